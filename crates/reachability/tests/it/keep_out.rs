//! Keep-out boxes against hand computation, against independent proofs of overlap and separation, and with degenerate axes.

use crate::common::solids::{Solid, distance_m, proven_overlap};
use crate::common::{BOARD, carried};
use glam::{DMat3, DVec3};
use hwall_kinematics::Pose;
use hwall_reachability::{
    ArgumentError, Capsule, Carried, Interval, KeepOutBox, Plate, ReachabilityError, WallLine,
    WallPlane,
};
use hwall_testkit::Sampler;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

fn line(heading_rad: f64, distance_m: f64, height_m: f64) -> WallLine {
    let plane = WallPlane::new(heading_rad, distance_m).expect("finite");
    plane.line(height_m)
}

fn link(a: DVec3, b: DVec3, radius_m: f64) -> Carried {
    let ends_m = [a, b];
    Carried {
        plate: None,
        last_link: Some(Capsule { ends_m, radius_m }),
    }
}

fn cube(half_m: f64) -> KeepOutBox {
    KeepOutBox::from_corners("cube", DVec3::splat(-half_m), DVec3::splat(half_m)).expect("a box")
}

fn blocked(
    keep_out: &KeepOutBox,
    carried: &Carried,
    line: &WallLine,
    roll_rad: f64,
) -> Vec<Interval> {
    let spans = keep_out.blocked_on_line(carried, line, roll_rad);
    spans.expect("valid")
}

#[track_caller]
fn assert_span(spans: &[Interval], lo_m: f64, hi_m: f64, within_m: f64) {
    assert_eq!(spans.len(), 1, "{spans:?}");
    let off = (spans[0].lo_m - lo_m)
        .abs()
        .max((spans[0].hi_m - hi_m).abs());
    assert!(
        off <= within_m,
        "{spans:?} is off by {off:e}, wanted {lo_m} to {hi_m}"
    );
}

/// A random box, load and line that often meet.
struct Case {
    solid: Solid,
    carried: Carried,
    line: WallLine,
    roll_rad: f64,
    /// The blocked stretch of the line, if any.
    span: Option<Interval>,
}

impl Case {
    fn tool(&self, s: f64) -> Pose {
        let pose = self.line.board_pose(s, self.roll_rad);
        pose.expect("finite")
    }

    fn is_blocked(&self, s: f64) -> bool {
        self.span.is_some_and(|span| span.lo_m < s && s < span.hi_m)
    }
}

fn case(sampler: &mut Sampler, carried: impl Fn(&mut Sampler) -> Carried) -> Case {
    let half = DVec3::from_array(sampler.array_within([(0.02, 0.4); 3]));
    let rotation = if sampler.index(4) == 0 {
        DMat3::IDENTITY
    } else {
        sampler.rotation()
    };
    let near = sampler.point_in_box(DVec3::splat(-0.3), DVec3::splat(0.3));
    let pose = Pose::new(rotation, near).expect("a rotation");
    let quarter = FRAC_PI_2 * sampler.index(4) as f64;
    let (heading, roll) = if sampler.bool() {
        (sampler.uniform(-4.0, 4.0), sampler.uniform(-4.0, 4.0))
    } else {
        (quarter - FRAC_PI_2, FRAC_PI_2 * sampler.index(4) as f64)
    };
    let keep_out = KeepOutBox::new("box", pose, half).expect("positive");
    let carried = carried(sampler);
    let [distance_m, height_m] = sampler.array_within([(-0.5, 0.5); 2]);
    let line = line(heading, distance_m, height_m);
    let spans = blocked(&keep_out, &carried, &line, roll);
    assert!(spans.len() <= 1, "{spans:?}");
    Case {
        solid: Solid::of_box(&pose, half),
        carried,
        line,
        roll_rad: roll,
        span: spans.first().copied(),
    }
}

fn random_plate(sampler: &mut Sampler) -> Carried {
    carried(Plate {
        half_width_m: sampler.uniform(0.01, 0.3),
        half_height_m: sampler.uniform(0.01, 0.3),
        thickness_m: sampler.uniform(-0.02, 0.1).max(0.0),
    })
}

fn random_link(sampler: &mut Sampler) -> Carried {
    let a = sampler.point_in_box(DVec3::splat(-0.2), DVec3::splat(0.2));
    let b = match sampler.index(5) {
        0 => a,
        1 => a + DVec3::Z * 0.2,
        _ => sampler.point_in_box(DVec3::splat(-0.2), DVec3::splat(0.2)),
    };
    link(a, b, sampler.uniform(-0.05, 0.2).max(0.0))
}

#[test]
fn boxes_by_hand() {
    // The line y = 0.5, heading 90 degrees: s runs towards -x, the board's back towards -y.
    let along = line(FRAC_PI_2, 0.5, 0.3);
    let wall = KeepOutBox::from_corners("w", DVec3::new(0.2, 0.4, 0.0), DVec3::new(0.5, 2.0, 0.35))
        .expect("a box");
    // At 45 degrees the corner leads, but it passes above the box: z = 0.3 against 0.35.
    let reach = 0.1 * 2.0_f64.sqrt();
    let back = link(DVec3::ZERO, DVec3::new(0.0, 0.0, -0.126), 0.07);
    // A ball 0.03 above the top edges, and one beside a corner: 3-4-5 triangles.
    let above = line(FRAC_PI_2, 0.5, 0.38);
    let ball = link(DVec3::ZERO, DVec3::ZERO, 0.05);
    let corner = line(FRAC_PI_2, 0.4 - 0.024, 0.35 + 0.018);
    for (load, line, roll_rad, more) in [
        (&Carried::default(), &along, 0.0, 0.0),
        (&carried(BOARD), &along, 0.0, 0.1),
        (&carried(BOARD), &along, FRAC_PI_4, reach),
        (&back, &along, 0.0, 0.07),
        (&ball, &above, 0.0, 0.04),
        (&ball, &corner, 0.0, 0.04),
    ] {
        let spans = blocked(&wall, load, line, roll_rad);
        assert_span(&spans, -0.5 - more, -0.2 + more, 1e-12);
    }
    // Sharp corners of the moved faces would block here.
    let miss = line(FRAC_PI_2, 0.4 - 0.04, 0.35 + 0.04);
    assert!(blocked(&wall, &ball, &miss, 0.0).is_empty());

    let pedestal = KeepOutBox::pedestal(0.2, 0.3, 0.8).expect("a box");
    assert_eq!(pedestal.name(), "pedestal");
    let low = line(-FRAC_PI_2, 0.3, -0.1);
    let spans = blocked(&pedestal, &carried(BOARD), &low, 0.0);
    assert_span(&spans, -0.3, 0.3, 1e-12);
    assert!(blocked(&pedestal, &carried(BOARD), &line(-FRAC_PI_2, 0.3, 0.1), 0.0).is_empty());
    // Two separate carried bodies leave the gap between them free.
    let apart = Carried {
        plate: Some(BOARD),
        last_link: Some(Capsule {
            ends_m: [DVec3::X; 2],
            radius_m: 0.1,
        }),
    };
    let spans = blocked(&cube(0.1), &apart, &line(0.0, 0.0, 0.0), 0.0);
    assert_eq!(spans.len(), 2);
    assert_span(&spans[..1], -1.2, -0.8, 1e-12);
    assert_span(&spans[1..], -0.2, 0.2, 1e-12);
}

#[test]
fn plates_against_proofs_of_overlap_and_separation() {
    let mut sampler = Sampler::new(71);
    let (mut meet, mut proven, mut open) = (0, 0, 0);
    for _ in 0..600 {
        let case = case(&mut sampler, random_plate);
        meet += usize::from(case.span.is_some());
        // Random positions, and both sides of each end.
        let mut places = sampler.within(&[(-1.2, 1.2); 12]);
        for end in case.span.iter().flat_map(|s| [s.lo_m, s.hi_m]) {
            places.extend([end - 1e-6, end + 1e-6, end - 1e-3, end + 1e-3]);
        }
        for s in places {
            let body = Solid::of_plate(case.carried.plate.expect("a plate"), &case.tool(s));
            match proven_overlap(body, case.solid) {
                Some(overlap) => assert_eq!(overlap, case.is_blocked(s), "{s}, {:?}", case.span),
                None => open += 1,
            }
            proven += 1;
        }
    }
    assert!(meet > 200, "only {meet} lines meet their box");
    assert!(open * 25 < proven, "{open} of {proven} undecided");
}

#[test]
fn capsules_are_at_their_radius_at_both_ends() {
    let mut sampler = Sampler::new(72);
    let mut meet = 0;
    let mut worst: f64 = 0.0;
    for _ in 0..3000 {
        let case = case(&mut sampler, random_link);
        let capsule = case.carried.last_link.expect("a capsule");
        let gap = |s: f64| {
            let ends = capsule.ends_m.map(|e| case.tool(s).transform_point(e));
            distance_m(case.solid, ends) - capsule.radius_m
        };
        meet += usize::from(case.span.is_some());
        for end in case.span.iter().flat_map(|s| [s.lo_m, s.hi_m]) {
            worst = worst.max(gap(end).abs());
        }
        for s in sampler.within(&[(-1.5, 1.5); 10]) {
            let gap_m = gap(s);
            // A segment inside the box has zero depth by this measure, so zero radius is not tested.
            if gap_m.abs() > 1e-12 {
                let (span, is_in) = (case.span, case.is_blocked(s));
                assert_eq!(is_in, gap_m < 0.0, "s = {s}, {span:?}, {gap_m:e}");
            }
        }
    }
    assert!(meet > 800, "only {meet} lines meet their box");
    assert!(worst < 1e-12, "an end is off by {worst:e} m");
}

#[test]
fn face_to_face_is_a_touch_at_any_heading_place_and_size() {
    let mut sampler = Sampler::new(74);
    for _ in 0..2000 {
        let size = 10.0_f64.powf(sampler.uniform(-3.0, 3.0));
        let heading = sampler.uniform(-3.0, 3.0);
        let along = line(
            heading,
            size * sampler.uniform(-2.0, 2.0),
            size * sampler.uniform(-1.0, 1.0),
        );
        let board = Plate {
            half_width_m: 0.1 * size,
            half_height_m: 0.2 * size,
            thickness_m: 0.02 * size,
        };
        let half = DVec3::from_array(sampler.array_within([(0.01, 0.4); 3])) * size;
        let place = |axes: DMat3, offset: DVec3| {
            let middle = along.point_m(size * 0.3) + along.plane.normal() * (-0.01 * size);
            let pose = Pose::new(axes, middle + offset).expect("a rotation");
            KeepOutBox::new("neighbour", pose, half).expect("positive")
        };
        let (n, t) = (along.plane.normal(), along.plane.along());
        // In front of the face, behind the back, above and below: the line runs along a face.
        let wall_axes = DMat3::from_cols(t, DVec3::Z, n);
        let neighbours = [
            n * (half.z + 0.01 * size),
            n * -(half.z + 0.01 * size),
            DVec3::Z * (half.y + 0.2 * size),
            DVec3::Z * -(half.y + 0.2 * size),
        ];
        for offset in neighbours {
            let touching = place(wall_axes, offset);
            assert!(blocked(&touching, &carried(board), &along, 0.0).is_empty());
            // 1e-8 nearer, it overlaps along the whole face.
            let nearer = place(wall_axes, offset * (1.0 - 1e-8));
            let spans = blocked(&nearer, &carried(board), &along, 0.0);
            let reach = half.x + board.half_width_m;
            assert_span(&spans, 0.3 * size - reach, 0.3 * size + reach, 1e-11 * size);
        }
        // End to end.
        let ahead = place(wall_axes, DVec3::ZERO);
        let lo = 0.3 * size - half.x - board.half_width_m;
        let span = blocked(&ahead, &carried(board), &along, 0.0)[0];
        assert!((span.lo_m - lo).abs() < 1e-11 * size);
        // The same for a capsule that grazes a face and one that grazes an edge.
        let graze = link(DVec3::ZERO, DVec3::Z * -0.05 * size, 0.02 * size);
        let above = place(wall_axes, n * (half.z + 0.03 * size));
        assert!(blocked(&above, &graze, &along, 0.0).is_empty());
        let diagonal =
            n * (half.z + 0.01 * size + 0.012 * size) + DVec3::Z * (half.y + 0.016 * size);
        assert!(blocked(&place(wall_axes, diagonal), &graze, &along, 0.0).is_empty());
        let nearer = place(wall_axes, diagonal - DVec3::Z * 1e-6 * size);
        assert_eq!(blocked(&nearer, &graze, &along, 0.0).len(), 1);
    }
}

#[test]
fn almost_parallel_edges_change_nothing() {
    let along = line(0.3, 0.5, 0.2);
    let board_axes = along.plane.board_rotation(0.0);
    let middle = along.point_m(0.1) + DVec3::new(0.05, -0.02, 0.1);
    let boxed = |tilt: f64| {
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -2.0) / 3.0, tilt);
        let pose = Pose::new(turn * board_axes, middle).expect("a rotation");
        KeepOutBox::new("tilted", pose, DVec3::new(0.1, 0.2, 0.3)).expect("positive")
    };
    let loads = [
        carried(BOARD),
        link(DVec3::ZERO, DVec3::Z * -0.126, 0.07),
        link(DVec3::ZERO, DVec3::new(0.1, 1e-9, 0.0), 0.07),
        link(DVec3::ZERO, DVec3::X * 1e-200, 0.07),
    ];
    for load in loads {
        let straight = blocked(&boxed(0.0), &load, &along, 0.0)[0];
        for exponent in 3..20 {
            let tilt = 10.0_f64.powi(-exponent);
            let spans = blocked(&boxed(tilt), &load, &along, 0.0);
            assert_span(&spans, straight.lo_m, straight.hi_m, tilt + 1e-12);
        }
    }
}

#[test]
fn a_box_far_from_the_base_keeps_its_touch() {
    // The positions round to 1e-13 there: the tolerance is relative to them, not to the gap.
    let along = line(0.7, 1e3, 0.2);
    let (n, t) = (along.plane.normal(), along.plane.along());
    let axes = DMat3::from_cols(t, DVec3::Z, n);
    let pose = Pose::new(axes, along.point_m(700.0) + n * 0.1).expect("a rotation");
    let touching = KeepOutBox::new("far", pose, DVec3::splat(0.1)).expect("positive");
    assert!(blocked(&touching, &carried(BOARD), &along, 0.0).is_empty());
}

#[track_caller]
fn assert_out_of_range<T: std::fmt::Debug>(result: Result<T, ReachabilityError>) {
    let error = result.expect_err("refused");
    let expected = matches!(
        error,
        ReachabilityError::Argument(ArgumentError::OutOfRange { .. })
    );
    assert!(expected, "{error}");
}

#[test]
fn what_is_no_box_load_or_line_is_an_error() {
    let made = |half| KeepOutBox::new("bad", Pose::IDENTITY, half);
    assert_out_of_range(made(DVec3::new(0.1, 0.0, 0.1)));
    assert_out_of_range(made(DVec3::new(0.1, 0.1, -0.1)));
    let spoil: [fn(&mut Plate, f64); 3] = [
        |plate, bad| plate.half_width_m = bad,
        |plate, bad| plate.half_height_m = bad,
        |plate, bad| plate.thickness_m = bad,
    ];
    let spoiled = |i: usize, bad: f64| {
        let mut board = BOARD;
        spoil[i](&mut board, bad);
        carried(board)
    };
    let (cube, along, nothing) = (cube(0.1), line(0.0, 0.0, 0.0), Carried::default());
    for bad in [f64::NAN, f64::INFINITY] {
        assert_out_of_range(made(DVec3::new(0.1, bad, 0.1)));
        assert!(KeepOutBox::from_corners("bad", DVec3::ZERO, DVec3::splat(bad)).is_err());
        assert!(KeepOutBox::from_corners("bad", DVec3::splat(bad), DVec3::ZERO).is_err());
        assert!(KeepOutBox::pedestal(0.1, 0.1, bad).is_err());
        for load in [
            spoiled(0, bad),
            spoiled(1, bad),
            spoiled(2, bad),
            link(DVec3::new(0.0, bad, 0.0), DVec3::ZERO, 0.1),
            link(DVec3::ZERO, DVec3::new(0.0, 0.0, bad), 0.1),
            link(DVec3::ZERO, DVec3::ZERO, bad),
        ] {
            assert!(cube.blocked_on_line(&load, &along, 0.0).is_err());
        }
        assert!(cube.blocked_on_line(&nothing, &along, bad).is_err());
        let nowhere = WallLine {
            height_m: bad,
            ..along
        };
        assert!(cube.blocked_on_line(&nothing, &nowhere, 0.0).is_err());
    }
    assert!(KeepOutBox::from_corners("inside out", DVec3::ONE, DVec3::ZERO).is_err());
    for load in [
        spoiled(0, 0.0),
        spoiled(2, -0.01),
        link(DVec3::ZERO, DVec3::ZERO, -0.1),
    ] {
        assert_out_of_range(load.validate());
    }
    // Distances whose sum overflows are rejected, the largest below that are not.
    let huge = line(0.0, 1e308, 1e308);
    assert!(cube.blocked_on_line(&carried(BOARD), &huge, 0.0).is_err());
    let load = link(DVec3::ZERO, DVec3::X * 1e300, 1e299);
    let spans = blocked(&self::cube(1e300), &load, &along, 0.0);
    assert_span(&spans, -2.1e300, 1.1e300, 1e288);
}
