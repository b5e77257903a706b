//! Comparison of models: do they rank a study's conditions like its participants?

use super::afferent::{AfferentPairs, SpatialVariation, Vibration};
use super::model::RoughnessModel;
use super::spacing::{GrooveRidge, InvertedU, MonotoneSpacing, TemporalFrequency};
use crate::error::Result;
use crate::geometry::{ScanAngle, Texture};
use hwall_numeric::check::that;

/// The order of roughness that a study found.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyOrder {
    /// Orientations, degrees, from the least rough to the roughest.
    pub orientations_deg: Vec<f64>,
    /// Rank of each orientation; orientations of equal rank did not differ.
    pub ranks: Vec<usize>,
    /// Speeds of the finger relative to the texture, mm/s, from the least rough to the roughest.
    pub speeds_mm_per_s: Vec<f64>,
}

impl StudyOrder {
    /// The dissertation's order: 0 < 45 < 63.43 ~ 71.57 ~ 90 degrees. Roughness also rises with the speed of
    /// the board, 0 to 80 mm/s, against a finger moving at `finger_mm_per_s` (100 is an assumption).
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

/// Number of matching cases.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Matching cases.
    pub hits: usize,
    /// All cases.
    pub of: usize,
}

impl Tally {
    /// Do all cases match?
    #[must_use]
    pub const fn is_full(self) -> bool {
        self.hits == self.of
    }

    fn count(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.of += 1;
    }

    /// Counts a pair; it matches if the first is below the second.
    fn count_pair(&mut self, less: Option<f64>, more: Option<f64>) {
        self.count(less.zip(more).is_some_and(|(less, more)| less < more));
    }
}

/// Score of a model on a study's order.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderScore {
    /// The model.
    pub model: &'static str,
    /// Pairs of orientations of different rank that are in the study's order, over all speeds.
    pub orientation: Tally,
    /// Largest difference between orientations of equal rank, divided by the smallest difference between the means
    /// of neighbouring ranks; below 1 the ranks are distinct.
    pub plateau: f64,
    /// Pairs of speeds that are in the study's order, over all orientations.
    pub speed: Tally,
    /// Predictions within the model's range.
    pub within: Tally,
    /// Predictions over orientation at the middle speed.
    pub over_orientation: Vec<Option<f64>>,
}

impl OrderScore {
    /// Is every pair of orientations in order, with smaller differences within ranks than between them?
    #[must_use]
    pub fn reproduces_orientation(&self) -> bool {
        self.orientation.is_full() && self.plateau < 1.0
    }

    /// Is every pair of speeds in order?
    #[must_use]
    pub fn reproduces_speed(&self) -> bool {
        self.speed.is_full()
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
        Box::new(variation(AfferentPairs::Around)),
        Box::new(variation(AfferentPairs::Along)),
        Box::new(variation(AfferentPairs::Across)),
        Box::new(TemporalFrequency),
        Box::new(Vibration::default()),
    ]
}

/// Scores a model on the order of a study. A pair without a prediction counts as wrong.
///
/// # Errors
/// Angles or speeds that are not finite; a negative speed; a number of ranks other than that of orientations.
pub fn score_order(
    model: &dyn RoughnessModel,
    texture: &Texture,
    study: &StudyOrder,
) -> Result<OrderScore> {
    that(
        study.ranks.len() == study.orientations_deg.len(),
        "number of ranks",
        study.ranks.len() as f64,
        "one for each orientation",
    )?;
    let mut within = Tally::default();
    let mut table: Vec<Vec<Option<f64>>> = Vec::new();
    for &speed_mm_per_s in &study.speeds_mm_per_s {
        let mut row = Vec::new();
        for &deg in &study.orientations_deg {
            let prediction = model.predict(texture, ScanAngle::from_deg(deg)?, speed_mm_per_s)?;
            within.count(prediction.is_within());
            row.push(prediction.value());
        }
        table.push(row);
    }
    let (mut orientation, mut speed) = (Tally::default(), Tally::default());
    let mut plateau = 0.0_f64;
    for row in &table {
        plateau = plateau.max(plateau_of(row, &study.ranks));
        for_pairs(row, |i, j, a, b| {
            match study.ranks[i].cmp(&study.ranks[j]) {
                std::cmp::Ordering::Less => orientation.count_pair(a, b),
                std::cmp::Ordering::Greater => orientation.count_pair(b, a),
                std::cmp::Ordering::Equal => {}
            }
        });
    }
    for column in 0..study.orientations_deg.len() {
        let over_speed: Vec<Option<f64>> = table.iter().map(|row| row[column]).collect();
        for_pairs(&over_speed, |_, _, a, b| speed.count_pair(a, b));
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

/// Largest spread within a rank, divided by the smallest gap between the means of neighbouring ranks.
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
