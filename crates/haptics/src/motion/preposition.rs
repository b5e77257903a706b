//! Where the arm waits while a person looks at something that may be touched.

use hwall_kinematics::JointPositions;

/// The waiting posture, shifted towards a place that may be touched.
#[derive(Debug, Clone, Default)]
pub(super) struct Preposition {
    last: Option<Leant>,
}

#[derive(Debug, Clone)]
struct Leant {
    /// From the waiting posture to the configuration that might be needed, rad.
    way: [JointPositions; 2],
    /// The posture found between them, rad.
    q: JointPositions,
}

/// Largest share of the joint path from the waiting posture to a configuration that may be needed.
///
/// At 0.5 the board would be in front of a wall for half of the places that people look at. These are the far ones, where a head start is worth most:
/// without smaller shares to fall back on, the board was late for one touch in twenty of people who look around.
pub const PREPOSITION_SHARE: f64 = 0.4;
/// The arm takes the first of these shares at which the board is behind the surfaces.
const SHARES: [f64; 4] = [PREPOSITION_SHARE, 0.3, 0.2, 0.1];
/// A pre-positioned board stays this far behind the surfaces, m.
const BEHIND_M: f64 = 0.01;

impl Preposition {
    /// The posture between the waiting posture and a configuration, rad; the waiting posture if at no share the board is behind the surfaces.
    pub(super) fn towards(
        &mut self,
        waiting: &JointPositions,
        to: &JointPositions,
        protrusion_m: impl Fn(&JointPositions) -> Option<f64>,
    ) -> JointPositions {
        let is_behind = |q: &JointPositions| protrusion_m(q).is_none_or(|m| m <= -BEHIND_M);
        let way = [*waiting, *to];
        // Keep the last posture while it is behind the surfaces (a door may have moved in front of it). If a door moves away the share does not grow
        // until another place is asked for: the board does not move back and forth with a swinging door.
        if let Some(last) = &self.last
            && last.way == way
            && is_behind(&last.q)
        {
            return last.q;
        }
        let at = |share: f64| {
            JointPositions(std::array::from_fn(|i| {
                waiting[i] + share * (to[i] - waiting[i])
            }))
        };
        let q = SHARES.into_iter().map(at).find(is_behind);
        let q = q.unwrap_or(*waiting);
        self.last = Some(Leant { way, q });
        q
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Board;
    use crate::motion::{Barrier, BarrierTree};
    use glam::DVec3;
    use hwall_kinematics::SrsArm;

    fn arm() -> SrsArm {
        let tool = Board::default().flange_from_board_face().expect("a board");
        SrsArm::iiwa7().with_tool(tool)
    }

    fn waiting() -> JointPositions {
        JointPositions::from_deg([0.0, 0.0, 0.0, -110.0, 0.0, -20.0, 90.0])
    }

    fn to() -> JointPositions {
        JointPositions::from_deg([0.0, 60.0, 0.0, -40.0, 0.0, -10.0, 90.0])
    }

    /// How far the board is in front of a wall at this distance.
    fn before_wall(x_m: f64) -> impl Fn(&JointPositions) -> Option<f64> {
        let wall = Barrier::new(DVec3::new(x_m, 0.0, 1.0), DVec3::X, [1.0, 1.0]);
        let tree = BarrierTree::from(&[wall.expect("a wall")]);
        move |q| tree.protrusion_m(&Board::default(), &arm().forward(q))
    }

    /// The share taken, and how far the board is then in front of the wall, m.
    fn leans(x_m: f64) -> (f64, f64) {
        let protrusion_m = before_wall(x_m);
        let q = Preposition::default().towards(&waiting(), &to(), &protrusion_m);
        let share = (q[1] - waiting()[1]) / (to()[1] - waiting()[1]);
        (share, protrusion_m(&q).expect("a wall"))
    }

    #[test]
    fn an_arm_leans_as_far_as_its_board_stays_behind_the_wall() {
        let face = |share: f64| {
            let q = std::array::from_fn(|i| waiting()[i] + share * (to()[i] - waiting()[i]));
            // The wall is 2 m away: the remaining distance shows how far the board reaches.
            2.0 + before_wall(2.0)(&JointPositions(q)).expect("a wall")
        };
        assert!((leans(2.0).0 - 0.4).abs() < 1e-12);
        let mut last = 0.4;
        // Walls that half the path would cross, up to one in front of the waiting posture.
        for share in [0.35, 0.25, 0.15] {
            let (leant, protrusion_m) = leans(face(share) + BEHIND_M);
            let near = leant <= share && leant >= share - 0.1;
            assert!(near && leant < last, "{leant}");
            assert!(protrusion_m <= -BEHIND_M);
            last = leant;
        }
        assert_eq!(leans(face(0.0)).0, 0.0);
    }

    #[test]
    fn a_wall_that_comes_nearer_is_noticed() {
        let mut preposition = Preposition::default();
        let mut towards = |x_m| preposition.towards(&waiting(), &to(), before_wall(x_m));
        let far = towards(2.0);
        assert_eq!(towards(2.0), far);
        let reach_m = arm().forward(&far).position_m().x;
        assert_ne!(towards(reach_m), far);
    }
}
