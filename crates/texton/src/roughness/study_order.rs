//! Which model puts the conditions of a study in the order in which people put them?

use crate::{
    GrooveRidge, InvertedU, MonotoneSpacing, Pairs, RoughnessModel, ScanAngle, SpatialVariation,
    TemporalFrequency, TextonError, Texture, Vibration,
};

/// What a study found about the order of roughness.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyOrder {
    /// Orientations, degrees, from the least rough to the roughest.
    pub orientations_deg: Vec<f64>,
    /// For each orientation its rank; orientations of one rank did not differ.
    pub ranks: Vec<usize>,
    /// Speeds of the finger relative to the texture, mm/s, from the least rough to the roughest.
    pub speeds_mm_per_s: Vec<f64>,
}

impl StudyOrder {
    /// The dissertation's: 0 < 45 < 63.43 ~ 71.57 ~ 90 degrees, and rising with the speed of the board, 0
    /// to 80 mm/s, against a finger that moves at `finger_mm_per_s` itself (100 is an assumption).
    #[must_use]
    pub fn dissertation(finger_mm_per_s: f64) -> Self {
        Self {
            orientations_deg: vec![0.0, 45.0, 63.43, 71.57, 90.0],
            ranks: vec![0, 1, 2, 2, 2],
            speeds_mm_per_s: [0.0, 20.0, 40.0, 60.0, 80.0]
                .map(|board| finger_mm_per_s + board)
                .to_vec(),
        }
    }
}

/// How much of a study's order a model reproduces.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderScore {
    /// The model.
    pub model: &'static str,
    /// Pairs of orientations of different rank in the study's order, over all speeds: right, of all.
    pub orientation: [usize; 2],
    /// Largest difference between orientations of one rank, over the smallest between the means of neighbouring
    /// ranks; below 1 the ranks stand apart.
    pub plateau: f64,
    /// Pairs of speeds in the study's order, over all orientations: right, of all.
    pub speed: [usize; 2],
    /// Predictions within the model's range, of all.
    pub within: [usize; 2],
    /// Predictions over orientation at the middle speed.
    pub over_orientation: Vec<Option<f64>>,
}

impl OrderScore {
    /// Every pair of orientations in order, and those of one rank closer to each other than the ranks.
    #[must_use]
    pub fn reproduces_orientation(&self) -> bool {
        self.orientation[0] == self.orientation[1] && self.plateau < 1.0
    }

    /// Every pair of speeds in order.
    #[must_use]
    pub fn reproduces_speed(&self) -> bool {
        self.speed[0] == self.speed[1]
    }
}

/// Every model of this crate with its defaults.
#[must_use]
pub fn roughness_models() -> Vec<Box<dyn RoughnessModel>> {
    let variation = |pairs| SpatialVariation {
        pairs,
        ..SpatialVariation::default()
    };
    vec![
        Box::new(GrooveRidge),
        Box::new(InvertedU::default()),
        Box::new(MonotoneSpacing),
        Box::new(variation(Pairs::Around)),
        Box::new(variation(Pairs::Along)),
        Box::new(variation(Pairs::Across)),
        Box::new(TemporalFrequency),
        Box::new(Vibration::default()),
    ]
}

/// Scores a model on the order of a study. A pair of which the model says nothing is not right.
///
/// # Errors
/// Angles or speeds that are not finite, a negative speed, or ranks that are not one for each orientation.
pub fn score_order(
    model: &dyn RoughnessModel,
    texture: &Texture,
    study: &StudyOrder,
) -> Result<OrderScore, TextonError> {
    if study.ranks.len() != study.orientations_deg.len() {
        return Err(TextonError::Parameter {
            what: "number of ranks",
            value: study.ranks.len() as f64,
            wanted: "one for each orientation",
        });
    }
    let mut within = [0; 2];
    let mut table: Vec<Vec<Option<f64>>> = Vec::new();
    for &speed_mm_per_s in &study.speeds_mm_per_s {
        let mut row = Vec::new();
        for &deg in &study.orientations_deg {
            let prediction = model.predict(texture, ScanAngle::from_deg(deg)?, speed_mm_per_s)?;
            within[0] += usize::from(prediction.is_within());
            within[1] += 1;
            row.push(prediction.value());
        }
        table.push(row);
    }
    let (mut orientation, mut speed, mut plateau) = ([0; 2], [0; 2], 0.0_f64);
    for row in &table {
        plateau = plateau.max(plateau_of(row, &study.ranks));
        for_pairs(row, |i, j, a, b| {
            match study.ranks[i].cmp(&study.ranks[j]) {
                std::cmp::Ordering::Less => count(&mut orientation, a, b),
                std::cmp::Ordering::Greater => count(&mut orientation, b, a),
                std::cmp::Ordering::Equal => {}
            }
        });
    }
    for column in 0..study.orientations_deg.len() {
        let over_speed: Vec<Option<f64>> = table.iter().map(|row| row[column]).collect();
        for_pairs(&over_speed, |_, _, a, b| count(&mut speed, a, b));
    }
    Ok(OrderScore {
        model: model.info().name,
        orientation,
        plateau,
        speed,
        within,
        over_orientation: table.get(table.len() / 2).cloned().unwrap_or_default(),
    })
}

/// Largest spread within a rank over the smallest gap between the means of neighbouring ranks.
fn plateau_of(row: &[Option<f64>], ranks: &[usize]) -> f64 {
    let mut order = ranks.to_vec();
    order.sort_unstable();
    order.dedup();
    let (mut spread, mut gap, mut last) = (0.0_f64, f64::INFINITY, None);
    for rank in order {
        let (mut lo, mut hi, mut sum, mut n) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0);
        for (value, _) in row.iter().zip(ranks).filter(|(_, r)| **r == rank) {
            let Some(value) = *value else {
                return f64::INFINITY;
            };
            (lo, hi, sum, n) = (lo.min(value), hi.max(value), sum + value, n + 1.0);
        }
        spread = spread.max(hi - lo);
        let mean = sum / n;
        if let Some(last) = last.replace(mean) {
            gap = gap.min(f64::abs(mean - last));
        }
    }
    if spread == 0.0 { 0.0 } else { spread / gap }
}

fn for_pairs(values: &[Option<f64>], mut each: impl FnMut(usize, usize, Option<f64>, Option<f64>)) {
    for j in 1..values.len() {
        for i in 0..j {
            each(i, j, values[i], values[j]);
        }
    }
}

/// Counts a pair whose first must be below its second.
fn count(score: &mut [usize; 2], less: Option<f64>, more: Option<f64>) {
    score[0] += usize::from(less.zip(more).is_some_and(|(less, more)| less < more));
    score[1] += 1;
}
