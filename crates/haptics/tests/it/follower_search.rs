//! An arm with a numeric search does not search much in one step.

use crate::support::{DT_S, home as start};
use glam::DVec3;
use hwall_haptics::{Board, BoardTarget, Follower, FollowerConfig};
use hwall_kinematics::{
    ArmKinematics, ArmScratch, ArmSolution, BranchPolicy, Chain, ChainArm, Jacobian, JointLimit,
    JointPositions, KinematicsError, MOST_JOINTS, NearestConfig, Pose,
};
use hwall_testkit::{Timing, format_ns};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

fn target(point_m: DVec3, normal: DVec3) -> BoardTarget {
    BoardTarget::new(point_m, normal, 0.0)
}

/// A chain that counts its calls, by whether they may search.
#[derive(Debug)]
struct Counted {
    chain: ChainArm,
    descents: AtomicUsize,
    searches: AtomicUsize,
}

impl ArmKinematics for Counted {
    fn joint_count(&self) -> usize {
        self.chain.joint_count()
    }
    fn limits(&self) -> &[JointLimit; MOST_JOINTS] {
        self.chain.limits()
    }
    fn max_velocity_rad_per_s(&self) -> &[f64; MOST_JOINTS] {
        self.chain.max_velocity_rad_per_s()
    }
    fn forward(&self, q: &JointPositions) -> Pose {
        self.chain.forward(q)
    }
    fn jacobian(&self, q: &JointPositions) -> Jacobian {
        self.chain.jacobian(q)
    }
    fn nearest(
        &self,
        base_from_tool: &Pose,
        reference: &JointPositions,
        config: &NearestConfig,
        scratch: &mut ArmScratch,
    ) -> Result<ArmSolution, KinematicsError> {
        let counter = match config.policy {
            BranchPolicy::Keep => &self.descents,
            _ => &self.searches,
        };
        counter.fetch_add(1, Ordering::Relaxed);
        self.chain
            .nearest(base_from_tool, reference, config, scratch)
    }
    fn searches(&self) -> bool {
        self.chain.searches()
    }
    fn carrying(&self, flange_from_tool: Pose) -> Arc<dyn ArmKinematics> {
        self.chain.carrying(flange_from_tool)
    }
    fn scratch(&self) -> ArmScratch {
        ArmKinematics::scratch(&self.chain)
    }
}

#[test]
fn a_step_searches_one_roll_at_most_while_an_unreachable_target_drifts() {
    let face = Board::default().flange_from_board_face().unwrap();
    let counted = Arc::new(Counted {
        chain: ChainArm::new(Chain::iiwa7()).unwrap().with_tool(face),
        descents: AtomicUsize::new(0),
        searches: AtomicUsize::new(0),
    });
    let mut f = Follower::new(counted.clone(), FollowerConfig::default(), &start()).unwrap();
    let ahead = target(DVec3::new(0.55, 0.1, 0.6), DVec3::X);
    assert_eq!(f.aim(&ahead).unwrap(), None);
    let goal = f.goal().unwrap();
    let mut times_ns = Vec::new();
    for step in 0..1000 {
        counted.descents.store(0, Ordering::Relaxed);
        counted.searches.store(0, Ordering::Relaxed);
        // Inside the base, a little further at each step.
        let inside = target(DVec3::new(1e-4 * f64::from(step), 0.0, 0.2), DVec3::X);
        let began = Instant::now();
        let reason = f.aim(&inside).unwrap();
        times_ns.push(began.elapsed().as_nanos() as f64);
        // The result takes one call for each roll, and stays while the target drifts.
        assert_eq!(reason.is_some(), step >= 3, "step {step}: {reason:?}");
        assert!(counted.descents.load(Ordering::Relaxed) <= 5);
        assert!(counted.searches.load(Ordering::Relaxed) <= 1);
        f.step(DT_S).unwrap();
    }
    assert_eq!(f.goal(), Some(goal));
    let Timing { p99_ns, max_ns, .. } = Timing::from_samples_ns(times_ns);
    println!("p99 {}, at most {}", format_ns(p99_ns), format_ns(max_ns));
    // Once the result is known, the same target costs nothing.
    let inside = target(DVec3::new(0.0999, 0.0, 0.2), DVec3::X);
    counted.descents.store(0, Ordering::Relaxed);
    assert!(f.aim(&inside).unwrap().is_some());
    assert_eq!(counted.descents.load(Ordering::Relaxed), 0);
    // A search continues for an equal target until a configuration is found.
    let behind = target(DVec3::new(-0.5, 0.0, 0.6), DVec3::NEG_X);
    for _ in 0..4 {
        assert_eq!(f.aim(&behind).unwrap(), None);
    }
    assert_ne!(f.goal(), Some(goal));
}
