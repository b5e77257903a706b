//! The board on its way along a wall: behind it, and exactly on it at the end.

use glam::DVec3;
use hwall_haptics::{
    ApproachConfig, ArmCommand, ArmState, Board, BoardTarget, RenderStep, Renderer, RendererConfig,
};
use hwall_kinematics::{JointPositions, JointVelocities, SrsArm};

const DT_S: f64 = 1e-3;

/// A renderer and an arm that does at once what it is told.
struct Rig {
    renderer: Renderer,
    state: ArmState,
}

impl Rig {
    fn new(approach: ApproachConfig) -> Self {
        let config = RendererConfig {
            approach,
            ..Default::default()
        };
        let q = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        Self {
            renderer: Renderer::new(&SrsArm::iiwa7(), &Board::default(), config).unwrap(),
            state: ArmState {
                t_s: 0.0,
                q,
                qd: JointVelocities::default(),
                external_torque: None,
            },
        }
    }

    fn step(&mut self, point_m: DVec3) -> RenderStep {
        self.state.t_s += DT_S;
        let target = BoardTarget::new(point_m, DVec3::X, self.state.t_s);
        let step = self
            .renderer
            .step(self.state.t_s, &self.state, Some(&target));
        let ArmCommand::Position(q) = step.command else {
            panic!("{step:?}")
        };
        self.state.q = q;
        step
    }

    fn middle_m(&self) -> DVec3 {
        self.renderer.arm().forward(&self.state.q).position_m()
    }

    /// Brings the board to rest at a point; how far its middle came in front of the wall, m.
    fn settle(&mut self, point_m: DVec3) -> f64 {
        let mut front_m = f64::NEG_INFINITY;
        for _ in 0..3000 {
            assert_eq!(self.step(point_m).unreachable, None, "{point_m}");
            front_m = front_m.max(self.middle_m().x - point_m.x);
        }
        // The way behind the wall has shrunk to nothing.
        assert!(
            self.middle_m().distance(point_m) < 1e-11,
            "{}",
            self.middle_m()
        );
        front_m
    }
}

#[test]
fn a_move_along_the_wall_starts_behind_it_in_proportion_up_to_the_largest_distance() {
    for (along_m, behind_m) in [(0.3, 0.03), (0.2, 0.02), (0.5, 0.04)] {
        let mut rig = Rig::new(ApproachConfig::default());
        let from = DVec3::new(0.6, 0.25, 0.5);
        rig.settle(from);
        let to = from - DVec3::Y * along_m;
        let goal = rig.step(to).goal.unwrap();
        let goal_m = rig.renderer.arm().forward(&goal).position_m();
        assert!(goal_m.distance(to - DVec3::X * behind_m) < 1e-9, "{goal_m}");
        rig.settle(to);
    }
}

#[test]
fn a_move_straight_at_the_wall_goes_straight_to_the_target() {
    let mut rig = Rig::new(ApproachConfig::default());
    rig.settle(DVec3::new(0.55, 0.1, 0.5));
    let to = DVec3::new(0.65, 0.1, 0.5);
    let goal = rig.step(to).goal.unwrap();
    assert!(rig.renderer.arm().forward(&goal).position_m().distance(to) < 1e-9);
}

/// How far the middle of the board comes in front of the wall on moves between the two places,
/// to and fro, over a grid of walls and heights, m.
fn front_m(approach: ApproachConfig, y: [f64; 2]) -> Vec<f64> {
    let mut found = Vec::new();
    for x in [0.6, 0.65] {
        for z in [0.3, 0.5] {
            let mut rig = Rig::new(approach);
            rig.settle(DVec3::new(x, y[0], z));
            for y in [y[1], y[0], y[1], y[0]] {
                found.push(rig.settle(DVec3::new(x, y, z)));
            }
        }
    }
    found
}

const STRAIGHT: ApproachConfig = ApproachConfig {
    behind_m: 0.0,
    slope: 0.0,
};

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Joints move each for itself, so the way between two places on a wall bulges towards the hand:
/// 22 mm at most without the distance behind, 2.5 mm with it.
#[test]
fn across_the_arm_300_mm_along_the_wall_stay_behind_it_but_for_3_mm() {
    let across = front_m(ApproachConfig::default(), [-0.15, 0.15]);
    assert!(largest(&across) < 0.003, "{across:?}");
    let straight = front_m(STRAIGHT, [-0.15, 0.15]);
    assert!(largest(&straight) > 0.02, "{straight:?}");
}

/// Out to one side the joints part more, and the distance behind does not make up for it: 33 mm, 36 mm
/// without.
#[test]
fn to_one_side_300_mm_along_the_wall_come_at_most_35_mm_in_front_of_it() {
    for y in [0.3, -0.3] {
        let aside = front_m(ApproachConfig::default(), [0.0, y]);
        assert!(largest(&aside) < 0.035, "{aside:?}");
    }
}
