//! Arms other than the iiwa: from their URDF, solved numerically.

use crate::common::{Bench, Hand, session_of, wall};
use hwall::SessionState;
use hwall::glam::DVec3;
use hwall::haptics::{Board, PlaceTolerance, board_pose};
use hwall::kinematics::{
    ArmKinematics, BranchPolicy, Chain, ChainArm, JointPositions, NearestConfig,
};
use hwall::reachability::WallMaps;
use hwall_testkit::Timing;
use std::sync::Arc;
use std::time::Instant;

const WALL_M: f64 = 0.5;

fn arm(urdf: &str) -> Arc<dyn ArmKinematics> {
    let chain = Chain::from_urdf_str(urdf, Some("base"), Some("flange")).expect("a chain");
    let face = Board::default().flange_from_board_face().expect("a board");
    ChainArm::new(chain).expect("an arm").carrying(face)
}

/// A configuration that holds the board upright beside the place that will be touched.
fn start(arm: &dyn ArmKinematics) -> JointPositions {
    let middle = arm.limits().map(|l| l.middle_rad());
    let config = NearestConfig {
        policy: BranchPolicy::Any,
        ..NearestConfig::default()
    };
    let pose = board_pose(DVec3::new(WALL_M - 0.1, -0.2, 0.4), DVec3::X, 0.0).expect("a pose");
    arm.nearest(&pose, &JointPositions(middle), &config, &mut arm.scratch())
        .expect("a place before the arm")
        .q
}

/// The board is in place before a slow hand, and stands still while it is touched.
fn serves(name: &str, arm: &Arc<dyn ArmKinematics>) {
    let hand = Hand::reaching_in(2.0, DVec3::new(WALL_M, 0.1, 0.5));
    let mut session = session_of(&**arm, wall(WALL_M), WallMaps::default());
    let mut bench = Bench::with_arm(Arc::clone(arm), start(&**arm), hand);
    let mut times_ns = Vec::new();
    let (mut arrived, mut touched) = (false, Vec::new());
    while bench.now_s() < hand.end_s + 0.5 {
        bench.show_frames(&mut session);
        let (now_s, state) = (bench.now_s(), bench.state());
        let began = Instant::now();
        let command = session.step(now_s, &state);
        session.plan();
        times_ns.push(began.elapsed().as_nanos() as f64);
        bench.obey(command);
        match session.state() {
            SessionState::InPlace => arrived = true,
            SessionState::Touched => touched.push(bench.arm.q()),
            _ => {}
        }
        if (hand.press_s - 0.4..hand.press_s - 0.3).contains(&now_s) {
            let board = bench.arm.pose();
            let tolerance = PlaceTolerance::default();
            let placed = tolerance.holds(&Board::default(), &board, hand.target_m, DVec3::X);
            assert!(placed, "{name}: {board:?} at {now_s} s");
        }
    }
    assert!(arrived && touched.len() > 900, "{name}: {}", touched.len());
    // When the touch begins, the servo has not finished the last motion.
    let still = &touched[100..touched.len() - 100];
    assert!(still.iter().all(|q| *q == still[0]), "{name}");
    let median_ns = Timing::from_samples_ns(times_ns).median_ns;
    assert!(median_ns < 1e6, "{name}: a cycle is a millisecond");
}

#[test]
fn a_ur5_of_six_joints() {
    let urdf = include_str!("../../../kinematics/tests/data/ur5.urdf");
    serves("UR5", &arm(urdf));
}

#[test]
fn a_panda_of_seven_joints() {
    let urdf = include_str!("../../../kinematics/tests/data/panda.urdf");
    serves("Panda", &arm(urdf));
}
