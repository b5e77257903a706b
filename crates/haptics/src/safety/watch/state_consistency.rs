//! The last known position of the arm, and whether the measured one is consistent with it.

use crate::arm::ArmState;
use hwall_kinematics::{JointPositions, JointVelocities, MOST_JOINTS};

/// A holding arm may deflect by this under a push, rad.
const GIVES_WAY_RAD: f64 = 0.05;
/// An arm commanded to hold continues for this long, s, and then brakes at least this hard, rad/s².
const REACTS_S: f64 = 0.05;
const BRAKES_RAD_PER_S2: f64 = 5.0;
/// While the angles were not observed, the arm gained speed at most at this rate, rad/s², for at most this long, s.
const GAINS_RAD_PER_S2: f64 = 10.0;
const LONGEST_UNSEEN_S: f64 = 0.2;

/// Angles and velocities.
#[derive(Debug, Clone, Copy)]
struct Sighting {
    q: JointPositions,
    qd: JointVelocities,
}

/// If velocities integrate to this while the angles stay the same, the angles are frozen, rad.
const MOVED_RAD: f64 = 0.01;
/// Longest time between two states that is integrated, s.
const LONGEST_TICK_S: f64 = 0.02;

/// How the angles became unusable.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Lost {
    /// They jumped, were not finite, or were too old: the arm was unobserved for this long, s.
    Suddenly { unseen_s: f64 },
    /// They stayed the same for this long, s, while the velocities show motion: until they change they carry no information.
    Frozen { for_s: f64 },
}

/// Why the measured position is not trusted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::safety) enum Doubt {
    /// The arm cannot have moved there: a joint is this far from its last known angle, rad.
    Elsewhere(f64),
    /// The angles are still the frozen ones, since this long, s.
    StillFrozen(f64),
}

/// Tracks the angles of the arm while they are sound. After a fault the arm holds, and angles are trusted again only where the held arm can be: an
/// angle that jumped and stays there is still wrong, however well its states agree with each other.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::safety) struct StateConsistency {
    /// The last sound state.
    sound: Option<Sighting>,
    /// The first state with these angles.
    changed: Option<Sighting>,
    lost: Option<Lost>,
    /// Integral of the velocities since the angles changed, rad.
    drift_rad: [f64; MOST_JOINTS],
    last_s: f64,
}

impl StateConsistency {
    /// The angles are not sound. `frozen_s`: how long they have been frozen, if that is the fault; `aged_s`: their age.
    pub(in crate::safety) fn lose(&mut self, state: &ArmState, frozen_s: Option<f64>, aged_s: f64) {
        self.add_up(state);
        let moved = self.drift_rad.iter().any(|drift| drift.abs() > MOVED_RAD);
        match frozen_s {
            Some(for_s) if moved => self.lost = Some(Lost::Frozen { for_s }),
            _ if self.lost.is_none() => {
                self.lost = Some(Lost::Suddenly {
                    unseen_s: at_most(LONGEST_UNSEEN_S, aged_s),
                });
            }
            _ => {}
        }
    }

    fn add_up(&mut self, state: &ArmState) {
        let dt_s = at_most(LONGEST_TICK_S, state.t_s - self.last_s);
        self.last_s = state.t_s;
        let same = self.changed.is_some_and(|changed| changed.q == state.q);
        for (drift, qd) in self.drift_rad.iter_mut().zip(state.qd.0) {
            let added = if same { *drift + qd * dt_s } else { 0.0 };
            *drift = if added.is_finite() { added } else { 0.0 };
        }
    }

    /// Trusts the measured position from now on: a person has checked it.
    pub(in crate::safety) fn believe(&mut self) {
        *self = Self::default();
    }

    /// Takes angles that passed their own checks.
    ///
    /// # Errors
    /// Why the arm cannot be there.
    pub(in crate::safety) fn find(&mut self, state: &ArmState) -> Result<(), Doubt> {
        self.add_up(state);
        let doubt = match (self.lost, self.sound, self.changed) {
            (Some(Lost::Suddenly { unseen_s }), Some(sound), _) => {
                elsewhere(&sound, state, unseen_s)
            }
            (Some(Lost::Frozen { for_s }), _, Some(changed)) => {
                if changed.q == state.q {
                    Some(Doubt::StillFrozen(for_s))
                } else {
                    elsewhere(&changed, state, at_most(LONGEST_UNSEEN_S, for_s))
                }
            }
            _ => None,
        };
        if let Some(doubt) = doubt {
            return Err(doubt);
        }
        let now = Sighting {
            q: state.q,
            qd: state.qd,
        };
        self.lost = None;
        self.sound = Some(now);
        if self.changed.is_none_or(|changed| changed.q != now.q) {
            self.changed = Some(now);
        }
        Ok(())
    }
}

/// A time clamped to between 0 and a bound; 0 for NaN, s.
fn at_most(bound_s: f64, s: f64) -> f64 {
    if s > 0.0 { s.min(bound_s) } else { 0.0 }
}

/// Can the arm have moved here from its last seen state, if it was unobserved for `unseen_s` and then commanded to hold? If not, the deviation of the
/// worst joint.
fn elsewhere(seen: &Sighting, state: &ArmState, unseen_s: f64) -> Option<Doubt> {
    let mut worst = (0.0, 0.0);
    for i in 0..MOST_JOINTS {
        let by_rad = state.q[i] - seen.q[i];
        let gained = GAINS_RAD_PER_S2 * unseen_s;
        let speed = seen.qd[i].abs() + gained;
        let way_rad = speed * (REACTS_S + unseen_s + speed / (2.0 * BRAKES_RAD_PER_S2));
        // The arm stops ahead of where it was, not behind; unobserved, it may have turned back.
        let ahead_rad = by_rad * seen.qd[i].signum();
        let back_rad = if unseen_s > 0.0 { way_rad } else { 0.0 };
        let beyond_rad = (-ahead_rad - back_rad).max(ahead_rad - way_rad) - GIVES_WAY_RAD;
        // NaN does not prove that it can.
        if beyond_rad.is_nan() {
            return Some(Doubt::Elsewhere(by_rad.abs()));
        }
        if beyond_rad > worst.0 {
            worst = (beyond_rad, by_rad.abs());
        }
    }
    (worst.0 > 0.0).then_some(Doubt::Elsewhere(worst.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(rad: f64, rad_per_s: f64) -> ArmState {
        ArmState {
            q: JointPositions([rad; MOST_JOINTS]),
            qd: JointVelocities([rad_per_s; MOST_JOINTS]),
            t_s: 0.0,
            external_torque: None,
        }
    }

    /// After states at one angle and speed, for a number of cycles.
    fn after(rad_per_s: f64, cycles: u32) -> StateConsistency {
        let mut consistency = StateConsistency::default();
        for k in 0..cycles {
            let state = ArmState {
                t_s: 1e-3 * f64::from(k),
                ..at(1.0, rad_per_s)
            };
            assert_eq!(consistency.find(&state), Ok(()));
        }
        consistency
    }

    #[test]
    fn a_held_arm_is_where_it_was() {
        let mut consistency = after(0.0, 1);
        consistency.lose(&at(f64::NAN, 0.0), None, 0.0);
        let Err(Doubt::Elsewhere(by_rad)) = consistency.find(&at(1.1, 0.0)) else {
            panic!("believed");
        };
        assert!((by_rad - 0.1).abs() < 1e-12);
        // It stays lost, however often it reports the same angles.
        assert!(consistency.find(&at(1.1, 0.0)).is_err());
        assert_eq!(consistency.find(&at(1.02, 0.0)), Ok(()));
        assert_eq!(consistency.find(&at(1.1, 0.0)), Ok(()));
    }

    #[test]
    fn one_that_moved_comes_to_rest_further_on() {
        for speed in [1.0, -1.0] {
            let mut consistency = after(speed, 1);
            consistency.lose(&at(f64::NAN, 0.0), None, 0.0);
            assert!(consistency.find(&at(1.0 - 0.1 * speed, 0.0)).is_err());
            assert!(consistency.find(&at(1.0 + 0.25 * speed, 0.0)).is_err());
            assert_eq!(consistency.find(&at(1.0 + 0.15 * speed, 0.0)), Ok(()));
        }
    }

    #[test]
    fn somebody_may_say_so() {
        let mut consistency = after(0.0, 1);
        consistency.lose(&at(f64::NAN, 0.0), None, 0.0);
        assert!(consistency.find(&at(2.0, 0.0)).is_err());
        consistency.believe();
        assert_eq!(consistency.find(&at(2.0, 0.0)), Ok(()));
    }

    #[test]
    fn an_arm_that_stands_may_say_the_same_for_ever() {
        let mut consistency = after(0.0, 1000);
        consistency.lose(&at(1.0, 0.0), Some(0.1), 0.0);
        assert_eq!(consistency.find(&at(1.0, 0.0)), Ok(()));
    }

    #[test]
    fn nothing_is_known_at_first() {
        let mut consistency = StateConsistency::default();
        consistency.lose(&at(f64::NAN, 0.0), None, 0.0);
        assert_eq!(consistency.find(&at(1.0, 0.0)), Ok(()));
    }

    #[test]
    fn frozen_angles_say_nothing_until_they_change() {
        // The velocities continue, so the arm is known to move.
        let mut consistency = after(0.5, 100);
        consistency.lose(&at(1.0, 0.5), Some(0.1), 0.0);
        for _ in 0..1000 {
            let doubt = consistency.find(&at(1.0, 0.0));
            assert_eq!(doubt, Err(Doubt::StillFrozen(0.1)));
        }
        assert!(consistency.find(&at(2.0, 0.0)).is_err());
        assert_eq!(consistency.find(&at(1.1, 0.0)), Ok(()));
    }

    #[test]
    fn states_that_were_late_leave_the_arm_time_to_move() {
        let mut consistency = after(0.0, 1);
        consistency.lose(&at(1.0, 0.0), None, 0.12);
        assert_eq!(consistency.find(&at(1.13, 0.0)), Ok(()));
    }

    #[test]
    fn a_velocity_that_is_none_proves_nothing() {
        let mut consistency = after(f64::NAN, 1);
        consistency.lose(&at(1.0, 0.0), None, 0.0);
        assert!(consistency.find(&at(1.2, 0.0)).is_err());
    }
}
