//! Results do not depend on the heading of the base, the handedness of the world or the unit of length.

use glam::{DMat3, DVec3};
use hwall_kinematics::{
    ArmKinematics, BranchPolicy, Chain, ChainArm, ChainJoint, JointLimit, JointPositions,
    NearestConfig, Pose, SrsArm, SrsGeometry, SrsParameters, Verdict,
};
use hwall_testkit::Sampler;

/// Tool poses that an arm of this length can just hold or just not hold.
fn pose(sampler: &mut Sampler, length_m: f64) -> Pose {
    let place = DVec3::Z * 0.4 + sampler.unit_vector() * sampler.uniform(0.3, 1.1);
    Pose::new(sampler.rotation(), place * length_m).expect("finite")
}

fn reference(sampler: &mut Sampler) -> JointPositions {
    JointPositions(sampler.array_within([(-1.8, 1.8); 7]))
}

/// The arm with an unlimited first joint.
fn endless() -> SrsArm {
    let mut limits = *SrsArm::iiwa7().limits();
    limits[0] = JointLimit::FREE;
    SrsArm::iiwa7().with_limits(limits).expect("valid")
}

fn nearest(arm: &dyn ArmKinematics, pose: &Pose, from: &JointPositions) -> Option<JointPositions> {
    let config = NearestConfig {
        policy: BranchPolicy::Keep,
        ..NearestConfig::default()
    };
    let found = arm.nearest(pose, from, &config, &mut arm.scratch());
    found.ok().map(|found| found.q)
}

/// Compares results of two arms for queries that are images of each other.
fn compare(
    name: &str,
    arms: [&dyn ArmKinematics; 2],
    image: impl Fn(&Pose) -> Pose,
    of_joints: impl Fn(JointPositions) -> JointPositions,
) {
    let mut sampler = Sampler::new(4);
    let (mut held, mut differ) = (0, 0);
    for _ in 0..1500 {
        let (pose, from) = (pose(&mut sampler, 1.0), reference(&mut sampler));
        let off = arms[1]
            .forward(&of_joints(from))
            .distance(&image(&arms[0].forward(&from)));
        assert!(
            off.position_m < 1e-10 && off.angle_rad < 1e-12,
            "{name}: {off:?}"
        );
        let found = nearest(arms[0], &pose, &from);
        let other = nearest(arms[1], &image(&pose), &of_joints(from));
        held += usize::from(found.is_some());
        let off = found.zip(other);
        let off = off.map(|(a, b)| of_joints(a).max_abs_difference(&b));
        // A descent, and a choice between two equally near solutions, depend on rounding.
        differ +=
            usize::from(found.is_some() != other.is_some() || off.is_some_and(|off| off > 1e-6));
    }
    println!("{name}: {held} held, {differ} differ");
    assert!(held > 200 && differ <= 3, "{name}: {differ} of {held}");
}

#[test]
fn a_turn_about_the_first_axis_is_a_turn_of_the_first_joint() {
    let arm = endless();
    let turn = Pose::new(DMat3::from_rotation_z(1.3), DVec3::ZERO).expect("finite");
    let turned = |q: JointPositions| {
        JointPositions(std::array::from_fn(|i| {
            q[i] + if i == 0 { 1.3 } else { 0.0 }
        }))
    };
    compare("turn", [&arm, &arm], |pose| turn * *pose, turned);
}

#[test]
fn the_mirror_image_is_reached_by_mirrored_joints() {
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    let image = |pose: &Pose| {
        let rotation = mirror * pose.rotation() * mirror;
        Pose::new(rotation, mirror * pose.position_m()).expect("finite")
    };
    // Joints with vertical axes at zero are negated; those about y are unchanged.
    let joints = |q: JointPositions| {
        JointPositions(std::array::from_fn(
            |i| if i % 2 == 0 { -q[i] } else { q[i] },
        ))
    };
    let (exact, chain) = (
        SrsArm::iiwa7(),
        ChainArm::new(Chain::iiwa7()).expect("an arm"),
    );
    compare("mirror", [&exact, &exact], image, joints);
    compare("mirrored chain", [&chain, &chain], image, joints);
    let mut sampler = Sampler::new(5);
    for _ in 0..3000 {
        let pose = pose(&mut sampler, 1.0);
        let reachable = |pose: &Pose| matches!(exact.verdict(pose), Verdict::Reachable(_));
        assert_eq!(reachable(&pose), reachable(&image(&pose)), "{pose:?}");
    }
}

#[test]
fn lengths_may_be_in_any_unit() {
    let iiwa = *SrsArm::iiwa7().parameters();
    for unit in [1e-2, 25.4, 1e3] {
        let g = iiwa.geometry;
        let geometry = SrsGeometry {
            d_bs_m: unit * g.d_bs_m,
            d_se_m: unit * g.d_se_m,
            d_ew_m: unit * g.d_ew_m,
            d_wf_m: unit * g.d_wf_m,
        };
        let large = SrsArm::new(SrsParameters { geometry, ..iiwa }).expect("valid");
        let mut sampler = Sampler::new(6);
        for _ in 0..2000 {
            let (small_pose, from) = (pose(&mut sampler, 1.0), reference(&mut sampler));
            let scaled = small_pose.at(unit * small_pose.position_m());
            let [a, b] = [
                nearest(&SrsArm::iiwa7(), &small_pose, &from),
                nearest(&large, &scaled, &from),
            ];
            let alike = match (a, b) {
                (Some(a), Some(b)) => a.max_abs_difference(&b) < 1e-6,
                (a, b) => a == b,
            };
            assert!(alike, "{unit}: {a:?} {b:?}");
        }
    }
}

#[test]
fn a_base_that_stands_elsewhere_changes_nothing_else() {
    let mut sampler = Sampler::new(7);
    let stand = Pose::new(sampler.rotation(), DVec3::new(3.0, -2.0, 0.7)).expect("finite");
    let chain = Chain::iiwa7();
    let mut joints = chain.joints().to_vec();
    joints[0] = ChainJoint {
        previous_from_link: stand * joints[0].previous_from_link,
        ..joints[0].clone()
    };
    let moved = Chain::new(joints, chain.link_from_tip()).expect("a chain");
    let arms = [chain, moved].map(|chain| ChainArm::new(chain).expect("an arm"));
    compare("stand", [&arms[0], &arms[1]], |pose| stand * *pose, |q| q);
}
