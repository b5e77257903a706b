//! Where the arm was last known to be, and whether it can be where it says it is now.

use crate::arm::ArmState;
use hwall_kinematics::{JointPositions, JointVelocities, MOST_JOINTS};

/// An arm that holds gives way by this under a push, rad.
const GIVES_WAY_RAD: f64 = 0.05;
/// An arm that is told to hold goes on for this long, s, and then brakes at least so hard, rad/s².
const REACTS_S: f64 = 0.05;
const BRAKES_RAD_PER_S2: f64 = 5.0;
/// While its angles were not seen to change it gained speed at most so fast, rad/s², for at most so long, s.
const GAINS_RAD_PER_S2: f64 = 10.0;
const LONGEST_UNSEEN_S: f64 = 0.2;

/// Angles and velocities.
#[derive(Debug, Clone, Copy)]
struct Sighting {
    q: JointPositions,
    qd: JointVelocities,
}

/// Velocities that add up to this while the angles are the same show that those are frozen, rad.
const MOVED_RAD: f64 = 0.01;
/// Longest time between two states that is added up, s.
const LONGEST_TICK_S: f64 = 0.02;

/// How the angles were lost.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Lost {
    /// They leapt, were no numbers, or were too old: for so long nothing was seen of the arm, s.
    Suddenly { unseen_s: f64 },
    /// They were the same for so long, s, while the velocities say that the arm moved: until they change they say nothing.
    Frozen { for_s: f64 },
}

/// Why the arm is not where it says it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::safety) enum Doubt {
    /// It cannot have come there: a joint is this far from where it was known to be, rad.
    Elsewhere(f64),
    /// The angles are still those that were frozen for so long, s.
    StillFrozen(f64),
}

/// Follows the angles of the arm while they are sound. Once they were not, the arm holds, and they are believed again only where the
/// held arm can be: an angle that leapt and stays where it leapt to is still wrong, however well its states agree with each other.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::safety) struct StateConsistency {
    /// The last that were sound.
    sound: Option<Sighting>,
    /// The first with these angles.
    changed: Option<Sighting>,
    lost: Option<Lost>,
    /// What the velocities add up to since the angles changed, rad.
    drift_rad: [f64; MOST_JOINTS],
    last_s: f64,
}

impl StateConsistency {
    /// The angles are not sound. `frozen_s`: for how long they have been the same, if that is what is wrong; `aged_s`: how old they are.
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

    /// Wherever the arm says it is from now on, there it is: somebody has looked.
    pub(in crate::safety) fn believe(&mut self) {
        *self = Self::default();
    }

    /// Takes angles that are sound by themselves.
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

/// A time within 0 and a bound; 0 for NaN, s.
fn at_most(bound_s: f64, s: f64) -> f64 {
    if s > 0.0 { s.min(bound_s) } else { 0.0 }
}

/// Can the arm have come there from where it was seen, if it was not seen for so long and then told to hold? The joint that is
/// furthest beyond that, by how much it is away.
fn elsewhere(seen: &Sighting, state: &ArmState, unseen_s: f64) -> Option<Doubt> {
    let mut worst = (0.0, 0.0);
    for i in 0..MOST_JOINTS {
        let by_rad = state.q[i] - seen.q[i];
        let gained = GAINS_RAD_PER_S2 * unseen_s;
        let speed = seen.qd[i].abs() + gained;
        let way_rad = speed * (REACTS_S + unseen_s + speed / (2.0 * BRAKES_RAD_PER_S2));
        // It comes to rest ahead of where it was, not behind; one that was not seen may have turned back.
        let ahead_rad = by_rad * seen.qd[i].signum();
        let back_rad = if unseen_s > 0.0 { way_rad } else { 0.0 };
        let beyond_rad = (-ahead_rad - back_rad).max(ahead_rad - way_rad) - GIVES_WAY_RAD;
        // NaN is no proof that it can.
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

    #[test]
    fn a_held_arm_is_where_it_was() {
        let mut consistency = StateConsistency::default();
        assert_eq!(consistency.find(&at(1.0, 0.0)), Ok(()));
        consistency.lose(&at(f64::NAN, 0.0), None, 0.0);
        let Err(Doubt::Elsewhere(by_rad)) = consistency.find(&at(1.1, 0.0)) else {
            panic!("believed");
        };
        assert!((by_rad - 0.1).abs() < 1e-12);
        // It stays lost, however often it says the same.
        assert!(consistency.find(&at(1.1, 0.0)).is_err());
        assert_eq!(consistency.find(&at(1.02, 0.0)), Ok(()));
        assert_eq!(consistency.find(&at(1.1, 0.0)), Ok(()));
    }

    #[test]
    fn one_that_moved_comes_to_rest_further_on() {
        let mut consistency = StateConsistency::default();
        for speed in [1.0, -1.0] {
            consistency.believe();
            assert_eq!(consistency.find(&at(1.0, speed)), Ok(()));
            consistency.lose(&at(f64::NAN, 0.0), None, 0.0);
            assert!(consistency.find(&at(1.0 - 0.1 * speed, 0.0)).is_err());
            assert!(consistency.find(&at(1.0 + 0.25 * speed, 0.0)).is_err());
            assert_eq!(consistency.find(&at(1.0 + 0.15 * speed, 0.0)), Ok(()));
        }
    }

    #[test]
    fn somebody_may_say_so() {
        let mut consistency = StateConsistency::default();
        assert_eq!(consistency.find(&at(1.0, 0.0)), Ok(()));
        consistency.lose(&at(f64::NAN, 0.0), None, 0.0);
        assert!(consistency.find(&at(2.0, 0.0)).is_err());
        consistency.believe();
        assert_eq!(consistency.find(&at(2.0, 0.0)), Ok(()));
    }

    #[test]
    fn an_arm_that_stands_may_say_the_same_for_ever() {
        let mut consistency = StateConsistency::default();
        for k in 0..1000 {
            let t_s = 1e-3 * f64::from(k);
            let state = ArmState {
                t_s,
                ..at(1.0, 0.0)
            };
            assert_eq!(consistency.find(&state), Ok(()));
        }
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
        let mut consistency = StateConsistency::default();
        for k in 0..100 {
            // The velocities go on, so that the arm is known to move.
            let t_s = 1e-3 * f64::from(k);
            let state = ArmState {
                t_s,
                ..at(1.0, 0.5)
            };
            assert_eq!(consistency.find(&state), Ok(()));
        }
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
        let mut consistency = StateConsistency::default();
        assert_eq!(consistency.find(&at(1.0, 0.0)), Ok(()));
        consistency.lose(&at(1.0, 0.0), None, 0.12);
        assert_eq!(consistency.find(&at(1.13, 0.0)), Ok(()));
    }

    #[test]
    fn a_velocity_that_is_none_proves_nothing() {
        let mut consistency = StateConsistency::default();
        assert_eq!(consistency.find(&at(1.0, f64::NAN)), Ok(()));
        consistency.lose(&at(1.0, 0.0), None, 0.0);
        assert!(consistency.find(&at(1.2, 0.0)).is_err());
    }
}
