//! The choice of least expected loss.

use super::config::PolicyConfig;
use super::explanation::{Explanation, WeighedChoice, WeighedPlace};
use super::way::{NOMINAL_S, Presenting, Stand, Way, arrival_s, part_way, travel_s};
use hwall_contact::ContactPrediction;
use hwall_haptics::{PREPOSITION_SHARE, surface_axes};
use hwall_kinematics::JointPositions;
use std::f64::consts::PI;

/// A place that may be touched next.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hypothesis {
    pub(super) contact: ContactPrediction,
    /// Standard deviations of the point along the axes of its surface, m.
    pub(super) sds_m: [f64; 2],
    /// Probability that the next touch is there and comes soon.
    pub(super) chance: f64,
    /// Time of that touch.
    pub(super) time: TouchTime,
    /// Does the hand move towards it?
    pub(super) reaches: bool,
    /// How the arm presents it; `None` if it cannot.
    pub(super) stand: Option<Stand>,
}

/// Time of a touch: a logistic distribution, given the time already waited.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TouchTime {
    pub(super) median_s: f64,
    pub(super) scale_s: f64,
    /// Time already waited, s.
    pub(super) passed_s: f64,
}

impl TouchTime {
    /// Probability that the touch has not come within a time, s.
    fn survives(&self, after_s: f64) -> f64 {
        logistic((self.median_s - after_s) / self.scale_s)
    }

    /// Probability that the touch is still to come after the time already waited.
    pub(super) fn still_awaited(&self) -> f64 {
        self.survives(self.passed_s)
    }

    /// Probability that the touch comes within a time from now, s.
    fn comes_within(&self, left_s: f64) -> f64 {
        let survives = self.survives(self.passed_s + left_s);
        1.0 - survives / self.still_awaited().max(f64::MIN_POSITIVE)
    }
}

/// What the arm can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Choice {
    Wait,
    /// Part of the way towards a place.
    Preposition(Goal),
    /// All the way.
    Present(Goal),
}

impl Choice {
    /// As an entry of an explanation.
    fn weighed(&self, arrival_s: f64, loss: f64) -> WeighedChoice {
        let (kind, goal) = match self {
            Self::Wait => ("wait", None),
            Self::Preposition(goal) => ("pre-position", Some(goal)),
            Self::Present(goal) => ("present", Some(goal)),
        };
        WeighedChoice {
            kind,
            place: goal.map(|goal| (goal.contact.surface, goal.stand.point_m)),
            arrival_s,
            loss,
        }
    }
}

/// A place that the arm goes to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Goal {
    pub(super) contact: ContactPrediction,
    pub(super) stand: Stand,
}

impl Goal {
    /// Is another goal the same dispatch: on the same surface, at most this far away, m?
    pub(super) fn is_near(&self, other: &Self, within_m: f64) -> bool {
        self.contact.surface == other.contact.surface
            && self.stand.point_m.distance(other.stand.point_m) <= within_m
    }
}

/// A face also covers a place on another surface if that place is this close to the plane of the face, m.
const IN_PLANE_M: f64 = 0.02;
/// The two normals must then agree to within 5 degrees; as a cosine.
const SAME_COSINE: f64 = 0.996;
/// Time to move a board that stands next to the touch: 0.3 s for 0.15 m, growing with the root of the distance.
const MOVES_S_PER_ROOT_M: f64 = 0.77;

/// Weighs the choices of one frame.
pub(super) struct Chooser<'a, A> {
    pub(super) config: &'a PolicyConfig,
    pub(super) arm: &'a A,
    /// How far the middle of the board may be from a touch on its face, m.
    pub(super) reach_m: f64,
    pub(super) hypotheses: &'a [Hypothesis],
    pub(super) t_s: f64,
    /// Where the board was sent and the hand has not come yet.
    pub(super) awaited: Option<Goal>,
    /// Time of a touch at a place that nothing predicts.
    pub(super) unknown: TouchTime,
    /// Time until the eyes show that the next touch is elsewhere, s.
    pub(super) glance_s: f64,
    /// Time from when the motion of the hand reveals a place until the touch.
    pub(super) revealed: TouchTime,
}

impl<A: Presenting> Chooser<'_, A> {
    /// The best choice and the path there: the last choice, unless another saves enough.
    pub(super) fn best(&self, last: Choice, way: &Way) -> (Choice, Way) {
        let mut best = (last, *way);
        let mut least = self.loss(&last, way) - self.config.least_gain;
        for (choice, way, loss) in self.others(last, way) {
            if loss < least {
                (best, least) = ((choice, way), loss);
            }
        }
        best
    }

    /// What the arm may do instead of the last choice, the path there and the loss.
    fn others<'b>(
        &'b self,
        last: Choice,
        way: &'b Way,
    ) -> impl Iterator<Item = (Choice, Way, f64)> + 'b {
        let goals = self.possible().filter_map(|hypothesis| {
            let (contact, stand) = (hypothesis.contact, hypothesis.stand?);
            Some(Goal { contact, stand })
        });
        let choices = goals.flat_map(|goal| [Choice::Preposition(goal), Choice::Present(goal)]);
        let may_wait = last != Choice::Wait && self.arm.waits_at().is_some();
        let wait = may_wait.then_some(Choice::Wait);
        wait.into_iter().chain(choices).map(move |choice| {
            let way = way.to(self.arm, self.leads_to(&choice), self.t_s);
            (choice, way, self.loss(&choice, &way))
        })
    }

    /// What was weighed for [`best`](Self::best).
    pub(super) fn explain(&self, last: Choice, way: &Way) -> Explanation {
        let weighed = |(choice, way, loss): (Choice, Way, f64)| {
            choice.weighed(self.arrives_s(&choice, &way, self.reach_m), loss)
        };
        let others: Vec<_> = self.others(last, way).map(weighed).collect();
        let last = weighed((last, *way, self.loss(&last, way)));
        let losses = others.iter().map(|other| other.loss).enumerate();
        let least = losses.min_by(|(_, a), (_, b)| a.total_cmp(b));
        let saves = |(_, loss): &(usize, f64)| *loss < last.loss - self.config.least_gain;
        let place = |hypothesis: &Hypothesis| WeighedPlace {
            surface: hypothesis.contact.surface,
            point_m: hypothesis.contact.point_m,
            probability: hypothesis.chance,
            touch_s: hypothesis.time.median_s,
            awaited_s: hypothesis.time.passed_s,
            is_held: hypothesis.stand.is_some(),
        };
        Explanation {
            t_s: self.t_s,
            places: self.possible().map(place).collect(),
            elsewhere: self.elsewhere(),
            last,
            taken: least.filter(saves).map(|(taken, _)| taken),
            others,
            least_gain: self.config.least_gain,
        }
    }

    /// Probability that the next touch fits no hypothesis.
    fn elsewhere(&self) -> f64 {
        let chances: f64 = self.possible().map(|hypothesis| hypothesis.chance).sum();
        (1.0 - chances).max(0.0)
    }

    fn possible(&self) -> impl Iterator<Item = &Hypothesis> {
        self.hypotheses
            .iter()
            .filter(|hypothesis| hypothesis.chance > 0.0)
    }

    /// Configuration that a choice leads to, rad.
    fn leads_to(&self, choice: &Choice) -> Option<JointPositions> {
        let waits_at = self.arm.waits_at();
        match choice {
            Choice::Wait => waits_at,
            Choice::Preposition(goal) => {
                Some(part_way(&waits_at?, &goal.stand.q?, PREPOSITION_SHARE))
            }
            Choice::Present(goal) => goal.stand.q,
        }
    }

    /// Time until the board stands within the slack (m) of the place of a choice, or else until the arm rests, s.
    fn arrives_s(&self, choice: &Choice, way: &Way, slack_m: f64) -> f64 {
        match choice {
            Choice::Present(goal) => way.left_within_s(self.arm, &goal.stand, slack_m, self.t_s),
            Choice::Wait | Choice::Preposition(_) => way.left_s(self.t_s),
        }
    }

    /// Expected loss of a choice: touches for which the board is late, and a new dispatch that is false.
    pub(super) fn loss(&self, choice: &Choice, way: &Way) -> f64 {
        let to = self.leads_to(choice);
        let goal = match choice {
            Choice::Present(goal) => Some(goal),
            Choice::Wait | Choice::Preposition(_) => None,
        };
        let (mut late, mut there) = (0.0, 0.0);
        // For a touch elsewhere, the arm continues from where the choice leads.
        let left_s = way.left_s(self.t_s);
        for hypothesis in self.possible() {
            let covered = goal.map_or(0.0, |goal| self.covered_share(goal, hypothesis));
            let [a_m, b_m] = hypothesis.sds_m;
            let onwards_s = match hypothesis.stand {
                Some(stand) => {
                    let beside_m = a_m.hypot(b_m).max(2.0 * self.reach_m);
                    // By the time of this motion, the place is known.
                    arrival_s(self.arm, to.as_ref(), &stand, self.reach_m)
                        .max(MOVES_S_PER_ROOT_M * beside_m.sqrt())
                }
                None => f64::INFINITY,
            };
            let elsewhere = match hypothesis.reaches {
                true => (hypothesis.time)
                    .comes_within((left_s + onwards_s).max(onwards_s / self.config.onset_share)),
                false => self.too_late(&hypothesis.time, left_s, onwards_s),
            };
            let arrives_s = self.arrives_s(choice, way, self.reach_m - a_m.max(b_m));
            let here = (1.0 - self.config.late_share) * hypothesis.time.comes_within(arrives_s);
            late += hypothesis.chance * (covered * here + (1.0 - covered) * elsewhere);
            there += hypothesis.chance * covered;
        }
        // The touch may come where none is predicted. The arm turns back when the eyes show that. Places lie all around the waiting posture, so the
        // times for the way back and the way on add like perpendicular distances.
        let by_then = way.now(self.t_s + self.glance_s);
        let back_s = travel_s(self.arm, by_then.as_ref(), self.arm.waits_at().as_ref());
        late += self.elsewhere() * self.too_late(&self.unknown, 0.0, NOMINAL_S.hypot(back_s));
        // To call a board back does not undo its dispatch, so only a new one costs.
        let is_sent = |goal: &Goal| {
            let awaited = self.awaited.as_ref();
            awaited.is_some_and(|awaited| awaited.is_near(goal, self.reach_m))
        };
        match goal {
            Some(goal) if !is_sent(goal) => late + self.config.false_dispatch * (1.0 - there),
            _ => late,
        }
    }

    /// Probability that the arm is too late: the touch comes within `left_s + onwards_s` (the rest of the current motion and the motion after it), or
    /// within `onwards_s` after the motion of the hand reveals the place. The two times are taken as independent, because the person's time from
    /// reveal to touch hardly depends on when the reach begins.
    fn too_late(&self, time: &TouchTime, left_s: f64, onwards_s: f64) -> f64 {
        let in_time = |time: &TouchTime, s: f64| 1.0 - time.comes_within(s);
        1.0 - in_time(time, left_s + onwards_s) * in_time(&self.revealed, onwards_s)
    }

    /// Probability that a touch of a hypothesis is on the face of a board at a goal.
    fn covered_share(&self, goal: &Goal, hypothesis: &Hypothesis) -> f64 {
        let (normal, place) = (goal.contact.normal, &hypothesis.contact);
        let off_m = place.point_m - goal.stand.point_m;
        let Ok(axes) = surface_axes(place.normal) else {
            return 0.0;
        };
        if off_m.dot(normal).abs() > IN_PLANE_M || place.normal.dot(normal) < SAME_COSINE {
            return 0.0;
        }
        let of_axis = |i: usize| {
            let (at_m, scale_m) = (off_m.dot(axes[i]), scale_of(hypothesis.sds_m[i]));
            let below = |edge_m: f64| logistic((edge_m - at_m) / scale_m);
            below(self.reach_m) - below(-self.reach_m)
        };
        let share: f64 = of_axis(0) * of_axis(1);
        // NaN covers nothing.
        if share > 0.0 { share } else { 0.0 }
    }
}

/// The scale of the logistic distribution with a standard deviation.
pub(super) fn scale_of(sd: f64) -> f64 {
    // NaN stays NaN.
    sd.clamp(1e-3, f64::INFINITY) * 3_f64.sqrt() / PI
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}
