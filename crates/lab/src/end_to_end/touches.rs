//! Whole touches: the arm led by joints, and by a predicted point.

use hwall_haptics::{Board, PlaceTolerance};
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::participants;
use hwall_stage::person::predictors::{PredictionRecord, PredictorKind, Predictors};
use hwall_stage::person::responses::{self, Scenery};
use hwall_stage::run::people::{self, JudgedTouch};
use hwall_stage::run::stage::Stage;

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
    /// Computing time of the leader in frames with a new inference, us.
    pub predicted_us: Vec<f64>,
    /// Their share of all frames.
    pub inferring: f64,
}

impl Led {
    /// Number of touches with the face in place before the hand, within 5 mm and 2 degrees.
    pub(super) fn in_place(&self) -> usize {
        self.count(|touch| touch.outcome.in_place())
    }

    /// Number of touches with the face under the touched point within `gap_m`, m, at the hand's arrival.
    pub(super) fn within(&self, gap_m: f64) -> usize {
        let half_m = Board::default().half_width_m - PlaceTolerance::default().inset_m;
        self.count(|touch| touch.outcome.gap_m <= gap_m && touch.outcome.offset_m <= half_m)
    }

    /// Number of felt touches.
    pub(super) fn felt(&self) -> usize {
        self.count(|touch| touch.outcome.felt_after_s.is_some())
    }

    fn count(&self, what: impl Fn(&JudgedTouch) -> bool) -> usize {
        self.touches.iter().filter(|touch| what(touch)).count()
    }
}

/// Runs touches of each kind for both leaders; `progress` receives the share done, 0 to 1.
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
            let predicted_us: Vec<f64> = made
                .iter()
                .flat_map(|run| inferring_us(&run.run.predictions, leader))
                .collect();
            let frames: usize = made.iter().map(|run| run.run.predictions.len()).sum();
            let inferring = predicted_us.len() as f64 / frames.max(1) as f64;
            let touches = made.into_iter().flat_map(|run| run.touches);
            let within_reach = |touch: &JudgedTouch| touch.outcome.unreachable.is_none();
            all.push(Led {
                kind: *kind,
                leader,
                touches: touches.filter(within_reach).collect(),
                predicted_us,
                inferring,
            });
        }
    }
    Ok(all)
}

/// Time of predictions that differ from the previous one, us: for a hand at rest, as in most frames, a predictor of motions needs
/// almost no time.
fn inferring_us(
    records: &[PredictionRecord],
    leader: PredictorKind,
) -> impl Iterator<Item = f64> + '_ {
    let leader = leader as usize;
    records.windows(2).filter_map(move |pair| {
        let [before, now] = pair else { return None };
        let point_m = |of: &PredictionRecord| of.likeliest[leader].map(|place| place.point_m);
        let is_new = point_m(now).is_some() && point_m(now) != point_m(before);
        is_new.then(|| 1e-3 * now.took_ns[leader])
    })
}
