//! Region verdicts against verdicts at sampled poses: no pose may contradict.

use crate::chain_support::geometry;
use glam::{DMat3, DVec3};
use hwall_kinematics::{
    Branch, BranchSet, JointLimit, JointPositions, Pose, PoseRegion, RegionVerdict, SrsArm,
    SrsParameters, Unreachable,
};
use hwall_testkit::Sampler;

const SEED: u64 = 31;

/// A pose of the region, preferably at corners and rim, where a too small bound would fail.
fn drawn(region: &PoseRegion, sampler: &mut Sampler) -> Pose {
    let [c, d] = sampler
        .array_within([(-1.5, 1.5); 2])
        .map(|c| c.clamp(-1.0, 1.0));
    let [a, b] = region.half_sides_m;
    let mut share = || match sampler.bool() {
        true => 1.0,
        false => sampler.uniform(0.0, 1.0),
    };
    let (radius_m, angle_rad) = (region.radius_m * share(), region.angle_rad * share());
    let middle_m = region.center.position_m() + a * c + b * d;
    let position_m = middle_m + sampler.unit_vector() * radius_m;
    let turn = DMat3::from_axis_angle(sampler.unit_vector(), angle_rad);
    Pose::new(turn * region.center.rotation(), position_m).expect("finite")
}

fn random_region(arm: &SrsArm, sampler: &mut Sampler) -> PoseRegion {
    let reach = arm.shoulder_wrist_range().longest_m;
    let center = if sampler.bool() {
        let ranges = arm
            .limits()
            .map(|l| (l.min_rad.max(-9.0), l.max_rad.min(9.0)));
        let q = sampler.array_within(ranges);
        arm.forward(&JointPositions(q))
    } else {
        let far = DVec3::splat(1.4 * reach);
        let shoulder = DVec3::Z * arm.geometry().d_bs_m;
        let (rotation, off) = (sampler.rotation(), sampler.point_in_box(-far, far));
        Pose::new(rotation, shoulder + off).expect("finite")
    };
    let size = reach * 10.0_f64.powf(sampler.uniform(-6.0, -0.5));
    let a = sampler.unit_vector();
    let b = a.any_orthonormal_vector();
    match sampler.index(4) {
        0 => PoseRegion::segment(center, a * size),
        1 => PoseRegion::rectangle(center, [a * size, b * (size * sampler.uniform(0.1, 2.0))]),
        2 => PoseRegion::ball(center, size, 0.0),
        _ => PoseRegion::ball(center, size, size / reach),
    }
}

/// Fractions proven reachable, proven unreachable, undecided.
fn attack(arm: &SrsArm, regions: usize, seed: u64) -> [usize; 3] {
    let mut sampler = Sampler::new(seed);
    let mut counts = [0; 3];
    for i in 0..regions {
        let region = random_region(arm, &mut sampler);
        match arm.region_verdict(&region) {
            RegionVerdict::Reachable(branches) => {
                counts[0] += 1;
                assert!(!branches.is_empty());
                let all = arm.branches_throughout(&region);
                assert_eq!(all.intersection(branches), branches);
                for _ in 0..12 {
                    let pose = drawn(&region, &mut sampler);
                    assert!(arm.is_reachable(&pose), "{i}: {region:?} {pose:?}");
                    let feasible = arm.feasible_arm_angles(&pose).expect("reachable");
                    for branch in all.iter() {
                        assert!(
                            feasible.arcs(branch).next().is_some(),
                            "{i}: {branch:?} {region:?} {pose:?}"
                        );
                    }
                }
            }
            RegionVerdict::Unreachable(reason) => {
                counts[1] += 1;
                for _ in 0..12 {
                    let pose = drawn(&region, &mut sampler);
                    assert!(
                        !arm.is_reachable(&pose),
                        "{i}: {reason} {region:?} {pose:?}"
                    );
                }
            }
            RegionVerdict::Undecided => counts[2] += 1,
        }
    }
    counts
}

#[test]
fn random_regions_of_the_iiwas() {
    for arm in [SrsArm::iiwa7(), SrsArm::iiwa14()] {
        let [reachable, unreachable, undecided] = attack(&arm, 40_000, SEED);
        // Regions up to a quarter of the reach: most are small enough to be decided.
        assert!(reachable > 10_000, "{reachable}");
        assert!(unreachable > 10_000, "{unreachable}");
        assert!(undecided < 10_000, "{undecided}");
    }
}

#[test]
fn random_limits_links_and_tools() {
    let mut sampler = Sampler::new(SEED + 1);
    for i in 0..400 {
        let mut limits = SrsArm::iiwa7().limits().map(|l| {
            let lo = sampler.uniform(l.min_rad, l.max_rad);
            let hi = sampler.uniform(lo, l.max_rad);
            JointLimit::new(lo, hi)
        });
        match i % 4 {
            0 => limits[sampler.index(7)] = JointLimit::FREE,
            1 => {
                let joint = sampler.index(7);
                limits[joint].max_rad = limits[joint].min_rad;
            }
            _ => {}
        }
        for joint in [1, 3, 5] {
            limits[joint].min_rad = limits[joint].min_rad.max(-3.1);
            limits[joint].max_rad = limits[joint].max_rad.min(3.1);
        }
        let arm = SrsArm::new(SrsParameters {
            geometry: geometry(sampler.array_within([
                (-0.5, 0.5),
                (0.1, 1.0),
                (0.1, 1.0),
                (-0.3, 0.3),
            ])),
            limits,
            flange_from_tool: Pose::new(
                sampler.rotation(),
                sampler.unit_vector() * sampler.uniform(0.0, 0.5),
            )
            .expect("finite"),
            ..SrsParameters::iiwa7()
        })
        .expect("valid");
        attack(&arm, 300, SEED + i);
    }
}

#[test]
fn a_region_shrunk_to_a_pose_agrees_with_the_verdict() {
    let arm = SrsArm::iiwa7();
    let mut sampler = Sampler::new(SEED);
    let mut undecided = 0;
    for _ in 0..20_000 {
        let region = random_region(&arm, &mut sampler);
        let point = PoseRegion::ball(region.center, 0.0, 0.0);
        match arm.region_verdict(&point) {
            RegionVerdict::Reachable(_) => assert!(arm.is_reachable(&region.center)),
            RegionVerdict::Unreachable(_) => assert!(!arm.is_reachable(&region.center)),
            RegionVerdict::Undecided => undecided += 1,
        }
    }
    assert!(undecided <= 20, "{undecided}");
}

#[test]
fn full_stretch_and_beyond() {
    let arm = SrsArm::iiwa7();
    // The board looks upwards, the wrist is bent by 90 degrees.
    let at = |x: f64| Pose::new(DMat3::IDENTITY, DVec3::new(x, 0.0, 0.466)).expect("finite");
    // The stretched arm ends at 0.8 m; regions up to there and beyond are both proven.
    let half = 5e-4;
    let inside = PoseRegion::segment(at(0.8 - half), DVec3::X * half);
    let beyond = PoseRegion::segment(at(0.8 + half + 1e-12), DVec3::X * half);
    assert!(matches!(
        arm.region_verdict(&inside),
        RegionVerdict::Reachable(_)
    ));
    let RegionVerdict::Unreachable(Unreachable::TooFar { gap_m }) = arm.region_verdict(&beyond)
    else {
        panic!("{:?}", arm.region_verdict(&beyond));
    };
    assert!(gap_m.abs() < 2e-12, "{gap_m}");
    let across = PoseRegion::segment(at(0.8), DVec3::X * half);
    assert_eq!(arm.region_verdict(&across), RegionVerdict::Undecided);
    // So large that it contains the shoulder, or far away.
    let huge = PoseRegion::ball(at(0.5), 10.0, 0.0);
    assert_eq!(arm.region_verdict(&huge), RegionVerdict::Undecided);
    let far = PoseRegion::rectangle(at(50.0), [DVec3::Y * 40.0, DVec3::Z * 40.0]);
    assert!(matches!(
        arm.region_verdict(&far),
        RegionVerdict::Unreachable(Unreachable::TooFar { .. })
    ));
}

#[test]
fn nan_infinite_and_negative_extents_are_undecided() {
    let arm = SrsArm::iiwa7();
    let center = arm.forward(&JointPositions([0.1, 0.5, 0.2, -1.2, 0.3, 0.8, 0.0]));
    let decided = arm.region_verdict(&PoseRegion::ball(center, 1e-3, 1e-3));
    assert!(
        matches!(decided, RegionVerdict::Reachable(_)),
        "{decided:?}"
    );
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        for region in [
            PoseRegion::ball(center, bad, 0.0),
            PoseRegion::ball(center, 0.0, bad),
        ] {
            let undecided = bad.is_infinite() && region.angle_rad == bad;
            let verdict = arm.region_verdict(&region);
            // All orientations are a valid region, but never reachable.
            assert!(
                verdict == RegionVerdict::Undecided || undecided,
                "{bad}: {verdict:?}"
            );
        }
    }
    let bad = PoseRegion::segment(center, DVec3::NAN);
    assert_eq!(arm.region_verdict(&bad), RegionVerdict::Undecided);
}

#[test]
fn one_answer_for_a_range_of_headings() {
    // Joint 1 narrowed and widened by 45 degrees: the proofs hold for every wall in between.
    let arm = SrsArm::iiwa7();
    let heading = 45.0_f64.to_radians();
    let mut limits = *arm.limits();
    limits[0] = limits[0].shrunk(heading);
    let narrow = arm.with_limits(limits).expect("valid");
    limits[0] = JointLimit::FREE;
    let wide = arm.with_limits(limits).expect("valid");
    let mut sampler = Sampler::new(SEED);
    let mut decided = 0;
    for _ in 0..5_000 {
        let region = random_region(&arm, &mut sampler);
        let verdict = narrow.region_verdict_between(&wide, &region);
        for _ in 0..8 {
            let turn = DMat3::from_rotation_z(sampler.uniform(-heading, heading));
            let pose = drawn(&region, &mut sampler);
            let turned =
                Pose::new(turn * pose.rotation(), turn * pose.position_m()).expect("finite");
            match verdict {
                RegionVerdict::Reachable(_) => assert!(arm.is_reachable(&turned)),
                RegionVerdict::Unreachable(_) => assert!(!arm.is_reachable(&turned)),
                RegionVerdict::Undecided => {}
            }
        }
        decided += usize::from(verdict != RegionVerdict::Undecided);
    }
    assert!(decided > 3_500, "{decided}");
}

#[test]
fn sets_of_branches() {
    let set: BranchSet = BranchSet::from_bits(0b1000_0101);
    assert_eq!(set.len(), 3);
    assert!(set.contains(Branch::ALL[0]) && !set.contains(Branch::ALL[1]));
    assert_eq!(set.iter().map(Branch::index).collect::<Vec<_>>(), [0, 2, 7]);
    assert_eq!(set.intersection(BranchSet::from_bits(0b1)).bits(), 1);
    assert_eq!(set.union(BranchSet::from_bits(0b10)).len(), 4);
    assert!(BranchSet::EMPTY.is_empty());
}

#[test]
fn a_joint_without_room_is_led_through_its_middle() {
    // No single arm angle serves a whole region then; the proof uses two.
    for joint in [0, 1, 2, 4, 5, 6] {
        for width in [0.0, 1e-9, 1e-3, 0.2] {
            let mut limits = *SrsArm::iiwa7().limits();
            limits[joint] = JointLimit::new(0.6 - 0.5 * width, 0.6 + 0.5 * width);
            let arm = SrsArm::iiwa7().with_limits(limits).expect("valid");
            let [reachable, unreachable, undecided] = attack(&arm, 3_000, SEED + joint as u64);
            println!("joint {joint}, width {width}: {reachable} {unreachable} {undecided}");
            // About half of the centres are reachable, and most regions are small.
            assert!(reachable > 700, "joint {joint}, width {width}: {reachable}");
        }
    }
}
