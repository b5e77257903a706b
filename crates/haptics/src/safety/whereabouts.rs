//! Where the arm was last known to be, and whether it can be where it says it is now.

use crate::arm::ArmState;
use hwall_kinematics::{JointPositions, JointVelocities, MOST_JOINTS};

/// An arm that holds gives way by this under a push, rad.
const GIVES_WAY_RAD: f64 = 0.05;
/// An arm that is told to hold goes on for this long, s, and then brakes at least so hard, rad/s².
const REACTS_S: f64 = 0.05;
const BRAKES_RAD_PER_S2: f64 = 5.0;

/// Follows the angles of the arm while they are sound. Once they were not, the arm holds, and they are believed again only where the
/// held arm can be: an angle that leapt and stays where it leapt to is as wrong as on the first day, however well its
/// states agree with each other.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Whereabouts {
    sound: Option<(JointPositions, JointVelocities)>,
    lost: bool,
}

impl Whereabouts {
    /// The angles are not sound.
    pub(super) fn lose(&mut self) {
        self.lost = true;
    }

    /// Wherever the arm says it is from now on, there it is: somebody has looked.
    pub(super) fn believe(&mut self) {
        (self.sound, self.lost) = (None, false);
    }

    /// Takes angles that are sound by themselves.
    ///
    /// # Errors
    /// How far a joint is from where the arm was known to be, rad, if it cannot have come there.
    pub(super) fn find(&mut self, state: &ArmState) -> Result<(), f64> {
        if let (true, Some((q, qd))) = (self.lost, self.sound) {
            // The joint that is furthest beyond where it can be: by how much, and by how much it leapt.
            let mut worst = (0.0_f64, 0.0);
            for i in 0..MOST_JOINTS {
                let by_rad = state.q[i] - q[i];
                let speed = qd[i].abs();
                let way_rad = speed * (REACTS_S + speed / (2.0 * BRAKES_RAD_PER_S2));
                // It comes to rest ahead of where it was, not behind.
                let ahead_rad = by_rad * qd[i].signum();
                let beyond_rad = (-ahead_rad).max(ahead_rad - way_rad) - GIVES_WAY_RAD;
                if beyond_rad > worst.0 {
                    worst = (beyond_rad, by_rad.abs());
                }
            }
            if worst.0 > 0.0 {
                return Err(worst.1);
            }
        }
        *self = Self {
            sound: Some((state.q, state.qd)),
            lost: false,
        };
        Ok(())
    }
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
        let mut whereabouts = Whereabouts::default();
        assert_eq!(whereabouts.find(&at(1.0, 0.0)), Ok(()));
        whereabouts.lose();
        let by_rad = whereabouts.find(&at(1.1, 0.0)).unwrap_err();
        assert!((by_rad - 0.1).abs() < 1e-12);
        // It stays lost, however often it says the same.
        assert!(whereabouts.find(&at(1.1, 0.0)).is_err());
        assert_eq!(whereabouts.find(&at(1.02, 0.0)), Ok(()));
        assert_eq!(whereabouts.find(&at(1.1, 0.0)), Ok(()));
    }

    #[test]
    fn one_that_moved_comes_to_rest_further_on() {
        let mut whereabouts = Whereabouts::default();
        for speed in [1.0, -1.0] {
            whereabouts.believe();
            assert_eq!(whereabouts.find(&at(1.0, speed)), Ok(()));
            whereabouts.lose();
            assert!(whereabouts.find(&at(1.0 - 0.1 * speed, 0.0)).is_err());
            assert!(whereabouts.find(&at(1.0 + 0.25 * speed, 0.0)).is_err());
            assert_eq!(whereabouts.find(&at(1.0 + 0.15 * speed, 0.0)), Ok(()));
        }
    }

    #[test]
    fn somebody_may_say_so() {
        let mut whereabouts = Whereabouts::default();
        assert_eq!(whereabouts.find(&at(1.0, 0.0)), Ok(()));
        whereabouts.lose();
        assert!(whereabouts.find(&at(2.0, 0.0)).is_err());
        whereabouts.believe();
        assert_eq!(whereabouts.find(&at(2.0, 0.0)), Ok(()));
    }

    #[test]
    fn nothing_is_known_at_first() {
        let mut whereabouts = Whereabouts::default();
        whereabouts.lose();
        assert_eq!(whereabouts.find(&at(1.0, 0.0)), Ok(()));
    }
}
