//! Which external torques can be explained by hands that push the face of the board?

use glam::DVec2;
use hwall_geometry::Wrench;
use hwall_kinematics::{ArmKinematics, JointPositions, JointTorques, MOST_JOINTS};

/// Corners of the face times edges of the friction pyramid.
const EDGES: usize = 16;
/// Largest friction of skin on the face; dry skin on plastic is between 0.3 and 1.
const FRICTION: f64 = 0.8;
/// Passes over all edges in a cycle. Each cycle starts from the previous result.
const PASSES: usize = 16;

/// Any set of pushes on the face, each within its friction cone, is a non-negative sum of pushes at the four corners along the edges of a friction
/// pyramid. The torques of such pushes thus form a convex cone with 16 edges. The residual between the measured torques and the nearest point of that
/// cone has another cause.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::safety) struct FacePushes {
    /// Force along each edge, N.
    force_n: [f64; EDGES],
}

impl FacePushes {
    /// Residual of `torque` (N m) after subtracting pushes on a face of this half width and height (m), least squares in units of `unit_n_m`. Stops
    /// early once the residual of each joint is below a unit.
    pub(in crate::safety) fn unexplained(
        &mut self,
        arm: &dyn ArmKinematics,
        half_m: DVec2,
        q: &JointPositions,
        torque: &JointTorques,
        unit_n_m: &[f64; MOST_JOINTS],
    ) -> JointTorques {
        // A joint that does not exist has no unit.
        let in_units = |torque: &JointTorques| {
            let of = |i: usize| {
                if unit_n_m[i] > 0.0 {
                    torque[i] / unit_n_m[i]
                } else {
                    0.0
                }
            };
            std::array::from_fn::<f64, MOST_JOINTS, _>(of)
        };
        let mut left = in_units(torque);
        let is_small = |left: &[f64]| left.iter().all(|left| left.abs() < 1.0);
        if is_small(&left) {
            self.force_n = [0.0; EDGES];
            return *torque;
        }
        let (face, jacobian) = arm.forward_and_jacobian(q);
        let rotation = face.rotation();
        let edges: [[f64; MOST_JOINTS]; EDGES] = std::array::from_fn(|edge| {
            let side = |bit: usize| if edge & bit == 0 { 1.0 } else { -1.0 };
            let corner_m =
                rotation.x_axis * (side(1) * half_m.x) + rotation.y_axis * (side(2) * half_m.y);
            let along = if edge & 8 == 0 {
                rotation.x_axis
            } else {
                rotation.y_axis
            };
            let force_n = FRICTION * side(4) * along - rotation.z_axis;
            in_units(&jacobian.torques(&Wrench {
                force_n,
                moment_n_m: corner_m.cross(force_n),
            }))
        });
        let dot = |a: &[f64; MOST_JOINTS], b: &[f64; MOST_JOINTS]| -> f64 {
            a.iter().zip(b).map(|(a, b)| a * b).sum()
        };
        let take = |left: &mut [f64; MOST_JOINTS], of_edge: &[f64; MOST_JOINTS], force_n: f64| {
            for (left, of_edge) in left.iter_mut().zip(of_edge) {
                *left -= force_n * of_edge;
            }
        };
        for (of_edge, force_n) in edges.iter().zip(&self.force_n) {
            take(&mut left, of_edge, *force_n);
        }
        // Non-negative least squares, one edge after the other.
        for _ in 0..PASSES {
            if is_small(&left) {
                break;
            }
            for (of_edge, force_n) in edges.iter().zip(&mut self.force_n) {
                let square = dot(of_edge, of_edge).max(f64::MIN_POSITIVE);
                let by_n = (*force_n + dot(of_edge, &left) / square).max(0.0) - *force_n;
                if by_n.is_finite() {
                    *force_n += by_n;
                    take(&mut left, of_edge, by_n);
                }
            }
        }
        JointTorques(std::array::from_fn(|i| left[i] * unit_n_m[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Board;
    use glam::DVec3;
    use hwall_kinematics::SrsArm;
    use hwall_testkit::Sampler;
    use std::sync::Arc;

    const UNIT_N_M: [f64; MOST_JOINTS] = [5.28, 5.28, 3.3, 3.3, 3.3, 1.2, 1.2];
    /// Longest time in which a push on a link may stay undetected, in cycles.
    const CYCLES: usize = 50;

    fn arm(board: &Board) -> Arc<dyn ArmKinematics> {
        SrsArm::iiwa7().carrying(board.flange_from_board_face().unwrap())
    }

    fn random_q(sampler: &mut Sampler, arm: &dyn ArmKinematics) -> JointPositions {
        let limits = arm.limits();
        JointPositions(std::array::from_fn(|i| {
            sampler.uniform(limits[i].min_rad, limits[i].max_rad)
        }))
    }

    /// Up to three pushes, each with up to 60 N.
    fn of_hands(
        sampler: &mut Sampler,
        arm: &dyn ArmKinematics,
        half_m: DVec2,
        q: &JointPositions,
    ) -> JointTorques {
        let (face, jacobian) = arm.forward_and_jacobian(q);
        let mut sum = Wrench::default();
        for _ in 0..=sampler.index(3) {
            let [x, y] = half_m
                .to_array()
                .map(|half_m| sampler.uniform(-half_m, half_m));
            let at_m = face.rotation() * DVec3::new(x, y, 0.0);
            let [fx, fy] = [0.0; 2].map(|_: f64| sampler.uniform(-0.4, 0.4));
            let force_n = face.rotation() * DVec3::new(fx, fy, -1.0) * sampler.uniform(0.0, 60.0);
            sum.force_n += force_n;
            sum.moment_n_m += at_m.cross(force_n);
        }
        jacobian.torques(&sum)
    }

    /// A push of 65 N at a point of the body, by virtual work.
    fn of_link(
        sampler: &mut Sampler,
        arm: &dyn ArmKinematics,
        point: usize,
        q: &JointPositions,
    ) -> JointTorques {
        let force_n = 65.0 * sampler.unit_vector();
        let at = |q: &JointPositions| arm.body_points(q).points_m()[point];
        JointTorques(std::array::from_fn(|joint| {
            let mut ahead = *q;
            ahead[joint] += 1e-6;
            force_n.dot(at(&ahead) - at(q)) / 1e-6
        }))
    }

    fn is_named(torque: &JointTorques) -> bool {
        (0..MOST_JOINTS).any(|i| torque[i].abs() > UNIT_N_M[i])
    }

    /// A push on a link looks like one on the face if both turn the same joints: along the forearm's axes, about half of them.
    #[test]
    fn hands_on_the_face_are_explained_and_pushes_on_links_are_not() {
        let board = Board::default();
        let half_m = DVec2::new(board.half_width_m, board.half_height_m);
        let arm = arm(&board);
        let mut sampler = Sampler::new(7);
        let (mut hands, mut felt, mut named) = (0, 0, 0);
        for case in 0..2000 {
            let q = random_q(&mut sampler, &*arm);
            let touch = of_hands(&mut sampler, &*arm, half_m, &q);
            let mut pushes = FacePushes::default();
            let mut left =
                |torque: &JointTorques| pushes.unexplained(&*arm, half_m, &q, torque, &UNIT_N_M);
            hands += usize::from((0..4).all(|_| is_named(&left(&touch))));
            let link = of_link(&mut sampler, &*arm, 2 + case % 2, &q);
            if !is_named(&link) {
                continue;
            }
            felt += 1;
            let both = JointTorques(std::array::from_fn(|i| touch[i] + link[i]));
            named += usize::from((0..CYCLES).all(|_| is_named(&left(&both))));
        }
        println!(
            "{hands} of 2000 touches are not explained; {named} of {felt} pushes on links are named"
        );
        assert!(hands == 0 && named as f64 > 0.45 * felt as f64);
    }
}
