//! Whole touches: the arm led by joints, and by a predicted point.

use hwall_haptics::{Board, PlaceTolerance};
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::participants;
use hwall_stage::person::predictors::{PredictorKind, Predictors};
use hwall_stage::person::responses::{self, Scenery};
use hwall_stage::run::people::{self, JudgedTouch, Stage};

/// Control period, s.
const PERIOD_S: f64 = 1e-3;

/// Touches of one kind of people, with one leader.
#[derive(Debug, Clone)]
pub struct Led {
    /// Who touched.
    pub kind: PersonKind,
    /// Who led the board.
    pub leader: PredictorKind,
    /// The touches within the arm's reach.
    pub touches: Vec<JudgedTouch>,
    /// Time of a prediction of the leader, us, in rising order.
    pub predicted_us: Vec<f64>,
}

impl Led {
    /// Was the face there before the hand, with 5 mm and 2 degrees?
    pub(super) fn in_place(&self) -> usize {
        self.count(|touch| touch.outcome.in_place())
    }

    /// Was it under the touched point and no further off than so much, m, when the hand came?
    pub(super) fn within(&self, gap_m: f64) -> usize {
        let half_m = Board::default().half_width_m - PlaceTolerance::default().inset_m;
        self.count(|touch| touch.outcome.gap_m <= gap_m && touch.outcome.offset_m <= half_m)
    }

    /// Was the touch felt?
    pub(super) fn felt(&self) -> usize {
        self.count(|touch| touch.outcome.felt_after_s.is_some())
    }

    fn count(&self, what: impl Fn(&JudgedTouch) -> bool) -> usize {
        self.touches.iter().filter(|touch| what(touch)).count()
    }
}

/// Runs so many touches of each kind for both leaders; `progress` is told what is done, 0 to 1.
pub(super) fn run(
    scenery: &Scenery<'_>,
    kinds: &[PersonKind],
    touches: usize,
    seed: u64,
    mut progress: impl FnMut(f64),
) -> anyhow::Result<Vec<Led>> {
    let Scenery { scene, arm, .. } = *scenery;
    let mut all = Vec::new();
    let runs = 2.0 * kinds.len() as f64;
    for leader in [PredictorKind::Fused, PredictorKind::EndToEnd] {
        let trained = Predictors::train(scene, arm, scenery.people, Some(leader))?;
        let (predictors, _) = responses::taught(trained.0, scenery)?;
        let stage = Stage::of(scenery, &predictors, PERIOD_S);
        for kind in kinds {
            let done = all.len() as f64;
            let cast = participants::simulated(scene, arm, *kind, touches, seed)?;
            let made = people::run(&stage, &cast, |share| progress((done + share) / runs))?;
            let records = made.iter().flat_map(|run| &run.run.predictions);
            let took_us = records.map(|record| 1e-3 * record.took_ns[leader as usize]);
            let mut predicted_us: Vec<f64> = took_us.collect();
            predicted_us.sort_by(f64::total_cmp);
            let touches = made.into_iter().flat_map(|run| run.touches);
            let within_reach = |touch: &JudgedTouch| touch.outcome.unreachable.is_none();
            all.push(Led {
                kind: *kind,
                leader,
                touches: touches.filter(within_reach).collect(),
                predicted_us,
            });
        }
    }
    Ok(all)
}
