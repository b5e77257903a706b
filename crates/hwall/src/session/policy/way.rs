//! Where the arm is on its path, and travel times to other places, as far as the tracker's side knows.

use glam::DVec3;
use hwall_contact::ContactPrediction;
use hwall_kinematics::JointPositions;

/// How the arm presents a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::session) struct Stand {
    /// The middle of the board, in the frame of the scene, m.
    pub(in crate::session) point_m: DVec3,
    /// The joints, rad; `None` if unknown.
    pub(in crate::session) q: Option<JointPositions>,
    /// Does the direct path from the waiting posture lead through a surface?
    pub(in crate::session) is_behind_edge: bool,
}

/// What the arm can do.
pub(in crate::session) trait Presenting {
    /// Waiting posture, rad; `None`: the arm stays where it is.
    fn waits_at(&self) -> Option<JointPositions>;

    /// How it presents a place in the frame of the scene; `None` if it cannot.
    fn stand(&self, contact: &ContactPrediction) -> Option<Stand>;

    /// Least time from rest at one configuration to rest at another, s; `None` if unknown.
    fn travel_s(&self, from: &JointPositions, to: &JointPositions) -> Option<f64>;

    /// Middle of the board at a configuration, in the frame of the scene, m; `None` if unknown.
    fn middle_m(&self, q: &JointPositions) -> Option<DVec3>;
}

/// Travel time assumed if it is unknown, s.
pub(super) const NOMINAL_S: f64 = 0.5;
/// Delay from a decision to the start of the motion, s: the delays of the arm and of the frame.
const REACTION_S: f64 = 0.03;

/// Extra time of a path that leads around an edge, s: 0.1 to 0.2 s at the shelf of the built-in room.
const DETOUR_S: f64 = 0.15;

/// Time between two configurations, s; the default if unknown.
pub(super) fn travel_s(
    arm: &impl Presenting,
    from: Option<&JointPositions>,
    to: Option<&JointPositions>,
) -> f64 {
    let known = || arm.travel_s(from?, to?);
    known().unwrap_or(NOMINAL_S)
}

/// Time from a configuration until the board stands within `slack_m` of a place, s, with the detour of a waiting arm.
pub(super) fn arrival_s(
    arm: &impl Presenting,
    from: Option<&JointPositions>,
    stand: &Stand,
    slack_m: f64,
) -> f64 {
    let detour_s = if stand.is_behind_edge { DETOUR_S } else { 0.0 };
    detour_s + travel_s(arm, from, stand.q.as_ref()) * shortened(arm, from, stand, slack_m)
}

/// Factor on the travel time if the motion may end `slack_m` early: time grows with the root of the distance. At most half of the distance is
/// saved, because a board within the slack may still face elsewhere.
fn shortened(
    arm: &impl Presenting,
    from: Option<&JointPositions>,
    stand: &Stand,
    slack_m: f64,
) -> f64 {
    let length_m = from.and_then(|from| Some(arm.middle_m(from)?.distance(stand.point_m)));
    // NaN saves nothing.
    let saved = length_m.map_or(0.0, |length_m| slack_m / length_m);
    if saved > 0.0 {
        (1.0 - saved.min(0.5)).sqrt()
    } else {
        1.0
    }
}

/// The configuration at a share of the path to another one.
pub(super) fn part_way(from: &JointPositions, to: &JointPositions, share: f64) -> JointPositions {
    JointPositions(std::array::from_fn(|i| from[i] + share * (to[i] - from[i])))
}

/// The last motion that was decided for the arm.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Way {
    from: Option<JointPositions>,
    to: Option<JointPositions>,
    since_s: f64,
    /// Time of the whole motion, s, and the same without reaction and braking.
    takes_s: f64,
    travels_s: f64,
}

impl Way {
    /// An arm that has always been at one configuration.
    pub(super) fn at(q: Option<JointPositions>) -> Self {
        Self {
            from: q,
            to: q,
            ..Self::default()
        }
    }

    /// Configuration that the motion leads to, rad.
    pub(super) const fn leads_to(&self) -> Option<JointPositions> {
        self.to
    }

    /// Time left until the board stands within `slack_m` of the place that the motion leads to, s.
    pub(super) fn left_within_s(
        &self,
        arm: &impl Presenting,
        stand: &Stand,
        slack_m: f64,
        t_s: f64,
    ) -> f64 {
        let saved = 1.0 - shortened(arm, self.from.as_ref(), stand, slack_m);
        (self.since_s + self.takes_s - saved * self.travels_s - t_s).max(0.0)
    }

    /// Time left until the arm arrives, s.
    pub(super) fn left_s(&self, t_s: f64) -> f64 {
        (self.since_s + self.takes_s - t_s).max(0.0)
    }

    /// Current configuration of the arm on a minimum-jerk motion.
    pub(super) fn now(&self, t_s: f64) -> Option<JointPositions> {
        let u = 1.0 - self.left_s(t_s) / self.takes_s.max(f64::MIN_POSITIVE);
        let share = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
        Some(part_way(&self.from?, &self.to?, share.clamp(0.0, 1.0)))
    }

    /// The motion to another place. The current motion must end first: braking takes as long as the motion has lasted or would still last,
    /// whichever is shorter, and less if the new direction is similar.
    pub(super) fn to(&self, arm: &impl Presenting, to: Option<JointPositions>, t_s: f64) -> Self {
        let from = self.now(t_s);
        let left_s = self.left_s(t_s);
        let brakes_s = left_s.min(self.takes_s - left_s) * self.turned(to.as_ref(), from.as_ref());
        let travels_s = travel_s(arm, from.as_ref(), to.as_ref());
        Self {
            from,
            to,
            since_s: t_s,
            takes_s: REACTION_S + brakes_s + travels_s,
            travels_s,
        }
    }

    /// How much a motion to another place turns: 0 continues the current motion, 1 reverses it.
    fn turned(&self, to: Option<&JointPositions>, now: Option<&JointPositions>) -> f64 {
        let cosine = || {
            let (to, now, goal) = (to?, now?, self.to?);
            let dot = |a: &JointPositions, b: &JointPositions| -> f64 {
                (0..a.0.len())
                    .map(|i| (a[i] - now[i]) * (b[i] - now[i]))
                    .sum()
            };
            let lengths = (dot(&goal, &goal) * dot(to, to)).sqrt();
            (lengths > 0.0).then(|| dot(&goal, to) / lengths)
        };
        0.5 * (1.0 - cosine().unwrap_or(0.0))
    }
}
