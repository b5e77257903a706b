//! Yields to any push on the arm.

use hwall_kinematics::{ArmKinematics, JointPositions, JointTorques, JointVelocities, MOST_JOINTS};

/// A smaller torque may be no push, as a share of the joint's largest torque: the accuracy that an iiwa's maker states for its joint torque sensors.
const FELT_SHARE: f64 = 0.02;
/// The same for a joint whose largest torque is unknown, and at most, N m: that of an iiwa's first joint.
const FELT_N_M: f64 = 3.5;
/// At least, N m: noise of a joint torque sensor.
const NOISE_N_M: f64 = 0.5;
/// Acceleration and deceleration of the fastest part, m/s².
const ACCELERATION_M_PER_S2: f64 = 2.0;
/// Most distance by which the fastest part yields, m: twice what frees a hand of 1 kN/m that was pressed with 140 N. If a sensor fails during a
/// touch, the arm moves no further.
const MOST_M: f64 = 0.15;
/// Joint step for differentiating the position of the body, rad.
const SMALL_RAD: f64 = 1e-4;

/// Joints that move the way that they are pushed: whatever touches the arm, anywhere, moves with the force that it exerts, since
/// `τ · qd = F · v > 0`. So the force falls, although place and direction of the touch are unknown.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Yielding {
    speed_m_per_s: f64,
    way_m: f64,
    /// Joint direction, scaled so that the fastest part moves at 1 m/s.
    direction: JointVelocities,
}

impl Yielding {
    /// The joint velocities of the next step. Without a push the arm comes to rest.
    pub(super) fn step(
        &mut self,
        arm: &dyn ArmKinematics,
        q: &JointPositions,
        torque: Option<&JointTorques>,
        most_m_per_s: f64,
        dt_s: f64,
    ) -> JointVelocities {
        let change = ACCELERATION_M_PER_S2 * dt_s;
        let brakes_m = self.speed_m_per_s.powi(2) / (2.0 * ACCELERATION_M_PER_S2);
        let goes_on = self.way_m + brakes_m < MOST_M;
        let felt = torque.filter(|torque| goes_on && is_push(arm, torque));
        let direction = felt.and_then(|torque| direction(arm, q, torque));
        match direction {
            Some(direction) => {
                let turns = (0..MOST_JOINTS)
                    .map(|i| direction[i] * self.direction[i])
                    .sum::<f64>()
                    < 0.0;
                if turns {
                    self.speed_m_per_s = 0.0;
                }
                self.direction = direction;
                // A lower limit is reached by braking, too.
                let most_m_per_s = most_m_per_s.max(self.speed_m_per_s - change);
                self.speed_m_per_s = (self.speed_m_per_s + change).min(most_m_per_s);
            }
            None => self.speed_m_per_s = (self.speed_m_per_s - change).max(0.0),
        }
        self.way_m += self.speed_m_per_s * dt_s;
        JointVelocities(self.direction.0.map(|qd| qd * self.speed_m_per_s))
    }
}

/// Do the torques indicate a push?
pub(crate) fn is_push(arm: &dyn ArmKinematics, torque: &JointTorques) -> bool {
    let most = arm.max_torque_n_m();
    let felt_n_m = most.map(|most_n_m| {
        most_n_m.map_or(FELT_N_M, |most_n_m| {
            (FELT_SHARE * most_n_m).clamp(NOISE_N_M, FELT_N_M)
        })
    });
    (0..MOST_JOINTS).any(|joint| torque[joint].abs() > felt_n_m[joint])
}

/// Joint torques beyond the sensor bias, N m.
pub(crate) fn beyond(torque: &JointTorques, bias: &JointTorques) -> JointTorques {
    JointTorques(std::array::from_fn(|joint| torque[joint] - bias[joint]))
}

/// The direction in which the joints are pushed; `None` for torques that move no part.
fn direction(
    arm: &dyn ArmKinematics,
    q: &JointPositions,
    torque: &JointTorques,
) -> Option<JointVelocities> {
    let most_n_m = torque
        .0
        .iter()
        .fold(0.0, |most: f64, n_m| most.max(n_m.abs()));
    let unit = torque.0.map(|n_m| n_m / most_n_m);
    let ahead = JointPositions(std::array::from_fn(|i| q[i] + SMALL_RAD * unit[i]));
    let (here, there) = (arm.body_points(q), arm.body_points(&ahead));
    let fastest = here.points_m().iter().zip(there.points_m());
    let fastest = fastest.map(|(here, there)| here.distance(*there) / SMALL_RAD);
    let fastest = fastest.fold(0.0, f64::max);
    (fastest > 1e-3 && fastest.is_finite()).then(|| JointVelocities(unit.map(|qd| qd / fastest)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_kinematics::SrsArm;

    #[test]
    fn a_push_is_felt_by_each_joint_in_its_own_range() {
        let arm = SrsArm::iiwa7();
        let push = |joint: usize, n_m: f64| {
            let mut torque = JointTorques::default();
            torque[joint] = -n_m;
            is_push(&arm, &torque)
        };
        // 2 % of 176 N m at the shoulder, of 40 N m at the wrist.
        assert!(push(0, 3.6) && !push(0, 3.4) && push(6, 0.9) && !push(6, 0.7));
        assert!(!push(0, f64::NAN));
        // Whatever a description states.
        for (most_n_m, felt_n_m) in [(1e4, 3.5), (0.1, 0.5)] {
            let mut parameters = *arm.parameters();
            parameters.max_torque_n_m = [most_n_m; 7];
            let arm = SrsArm::new(parameters).expect("an arm");
            let mut torque = JointTorques::default();
            torque[6] = 1.01 * felt_n_m;
            assert!(is_push(&arm, &torque));
            torque[6] = 0.99 * felt_n_m;
            assert!(!is_push(&arm, &torque));
        }
    }
}
