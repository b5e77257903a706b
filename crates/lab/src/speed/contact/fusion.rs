//! Fusion of an estimate with gaze and surfaces: time of a prediction and its error.

use crate::report::Gap;
use crate::rooms::people::{self, Condition, StudyPeople, StudySize};
use crate::rooms::room::Room;
use crate::rooms::scores::summary;
use crate::speed::contact::estimators::{AT, SHARES};
use crate::speed::section::{Section, median_and_p99, quoted};
use hwall_contact::score::Moment;
use hwall_contact::{Combination, FusedConfig, FusedPredictor, LearnedConfig, LearnedModel};
use hwall_stage::training;
use hwall_testkit::{Timing, titled};

/// Fusion with gaze and surfaces, in rooms with increasing numbers of surfaces.
///
/// # Errors
/// Errors of training and prediction.
pub fn fusion(seed: u64) -> anyhow::Result<Section> {
    let condition = Condition::nominal();
    let size = StudySize {
        participants: 16,
        seed,
        ..StudySize::default()
    };
    let mut table = titled(&format!(
        "touchable surfaces | median | p99 | right surface at 50 / 70 / 90 %, % | {AT}"
    ));
    let mut summary_rows = Vec::new();
    for count in [1, 6, 12] {
        let room = Room::new(count)?;
        let StudyPeople {
            training: train,
            participants,
        } = people::people(&room, &condition, &size)?;
        let config = LearnedConfig {
            combination: Combination::Both,
            ..LearnedConfig::default()
        };
        let estimator = LearnedModel::train(&training::reaches(&train)?, &config)?.estimator();
        let config = FusedConfig {
            evidence: training::evidence_model(&train, |_| estimator.clone())?,
            ..FusedConfig::default()
        };
        let mut predictor = FusedPredictor::new(estimator, config)?;
        let touches = people::predictions(&mut predictor, &room, &participants)?;
        let samples = touches.iter().flat_map(|t| &t.samples);
        let timing = Timing::from_samples_ns(samples.map(|s| 1e3 * s.took_us).collect());
        let at = SHARES.map(|share| summary(&touches, Moment::Share(share)));
        let right = at.map(|s| 100.0 * s.right);
        let median_mm = at.map(|s| 1e3 * s.median_m);
        let listed = |values: [f64; 3]| values.map(|v| format!("{v:.1}")).join(" / ");
        let [median, p99] = median_and_p99(&timing);
        table.row([
            count.to_string(),
            median,
            p99,
            listed(right),
            listed(median_mm),
        ]);
        if count == 6 {
            let error = format!(
                "{:.0} mm (median), {:.0} % the right surface at 70 % of a reach",
                median_mm[1], right[1]
            );
            let what = "ranked surfaces and points, 6 surfaces";
            summary_rows = vec![quoted("contact", what, &timing, error)];
        }
    }
    let gaps: [Gap<'_>; 3] = [
        ("touches", &size.touches),
        ("seed", &seed),
        ("table", &table),
    ];
    Section::of(include_str!("../text/fusion.md"), &gaps, summary_rows)
}
