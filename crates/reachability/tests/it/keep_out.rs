//! Keep-out boxes against hand computation, against independent proofs of overlap and of
//! separation, and in the cases where axes degenerate.

use glam::{DMat3, DVec3};
use hwall_kinematics::Pose;
use hwall_reachability::{
    ArgumentError, Capsule, Carried, Interval, KeepOutBox, Plate, ReachabilityError, WallLine,
    WallPlane,
};
use hwall_testkit::Sampler;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

const BOARD: Plate = Plate {
    half_width_m: 0.1,
    half_height_m: 0.1,
    thickness_m: 0.02,
};

fn line(heading_rad: f64, distance_m: f64, height_m: f64) -> WallLine {
    let plane = WallPlane::new(heading_rad, distance_m).expect("finite");
    plane.line(height_m)
}

fn plate(plate: Plate) -> Carried {
    Carried {
        plate: Some(plate),
        last_link: None,
    }
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
    keep_out: KeepOutBox,
    carried: Carried,
    line: WallLine,
    roll_rad: f64,
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
    Case {
        keep_out: KeepOutBox::new("box", pose, half).expect("positive"),
        carried: carried(sampler),
        line: line(
            heading,
            sampler.uniform(-0.5, 0.5),
            sampler.uniform(-0.5, 0.5),
        ),
        roll_rad: roll,
    }
}

fn random_plate(sampler: &mut Sampler) -> Carried {
    plate(Plate {
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

/// Centre, axes as columns and half extents of a box in the base frame.
#[derive(Clone, Copy)]
struct Solid {
    centre: DVec3,
    axes: DMat3,
    half: DVec3,
}

impl Solid {
    fn of_box(b: &KeepOutBox) -> Self {
        Self {
            centre: b.base_from_box().position_m(),
            axes: b.base_from_box().rotation(),
            half: b.half_extents_m(),
        }
    }

    fn of_plate(p: Plate, tool: &Pose) -> Self {
        Self {
            centre: tool.transform_point(DVec3::new(0.0, 0.0, -p.thickness_m / 2.0)),
            axes: tool.rotation(),
            half: DVec3::new(p.half_width_m, p.half_height_m, p.thickness_m / 2.0),
        }
    }

    fn nearest(&self, p: DVec3) -> DVec3 {
        let local = self.axes.transpose() * (p - self.centre);
        self.axes * local.clamp(-self.half, self.half) + self.centre
    }

    fn support(&self, n: DVec3) -> f64 {
        n.dot(self.centre) + (self.axes.transpose() * n).abs().dot(self.half)
    }
}

/// Alternating projections: `Some(true)` with a common point in hand, `Some(false)` with a
/// separating plane in hand, `None` undecided. No axis of the separating-axis test is used.
fn proven_overlap(a: Solid, b: Solid) -> Option<bool> {
    let mut p = a.centre;
    for _ in 0..3000 {
        let q = b.nearest(p);
        p = a.nearest(q);
        let gap = p - q;
        if gap.length() < 1e-13 {
            return Some(true);
        }
        if -a.support(-gap) > b.support(gap) {
            return Some(false);
        }
    }
    None
}

/// Distance from a segment to a box: it is convex along the segment.
fn distance_m(solid: Solid, ends: [DVec3; 2]) -> f64 {
    let at = |u: f64| {
        let p = ends[0].lerp(ends[1], u);
        p.distance(solid.nearest(p))
    };
    let (mut lo, mut hi) = (0.0, 1.0);
    for _ in 0..100 {
        let (a, b) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
        if at(a) < at(b) { hi = b } else { lo = a }
    }
    at(lo).min(at(0.0)).min(at(1.0))
}

#[test]
fn boxes_by_hand() {
    // The line y = 0.5, heading 90 degrees: s runs towards -x, the board's back towards -y.
    let along = line(FRAC_PI_2, 0.5, 0.3);
    let wall = KeepOutBox::from_corners("w", DVec3::new(0.2, 0.4, 0.0), DVec3::new(0.5, 2.0, 0.35))
        .expect("a box");
    assert_span(
        &blocked(&wall, &Carried::default(), &along, 0.0),
        -0.5,
        -0.2,
        1e-12,
    );
    assert_span(
        &blocked(&wall, &plate(BOARD), &along, 0.0),
        -0.6,
        -0.1,
        1e-12,
    );
    // At 45 degrees the corner leads, but it passes above the box: z = 0.3 against 0.35.
    let reach = 0.1 * 2.0_f64.sqrt();
    assert_span(
        &blocked(&wall, &plate(BOARD), &along, FRAC_PI_4),
        -0.5 - reach,
        -0.2 + reach,
        1e-12,
    );
    let back = link(DVec3::ZERO, DVec3::new(0.0, 0.0, -0.126), 0.07);
    assert_span(&blocked(&wall, &back, &along, 0.0), -0.57, -0.13, 1e-12);
    // A ball 0.03 above the top edges, and one beside a corner: 3-4-5 triangles.
    let above = line(FRAC_PI_2, 0.5, 0.38);
    let ball = link(DVec3::ZERO, DVec3::ZERO, 0.05);
    assert_span(&blocked(&wall, &ball, &above, 0.0), -0.54, -0.16, 1e-12);
    let corner = line(FRAC_PI_2, 0.4 - 0.024, 0.35 + 0.018);
    assert_span(&blocked(&wall, &ball, &corner, 0.0), -0.54, -0.16, 1e-12);
    // Sharp corners of the moved faces would block here.
    let miss = line(FRAC_PI_2, 0.4 - 0.04, 0.35 + 0.04);
    assert!(blocked(&wall, &ball, &miss, 0.0).is_empty());

    let pedestal = KeepOutBox::pedestal(0.2, 0.3, 0.8).expect("a box");
    assert_eq!(pedestal.name(), "pedestal");
    let low = line(-FRAC_PI_2, 0.3, -0.1);
    assert_span(
        &blocked(&pedestal, &plate(BOARD), &low, 0.0),
        -0.3,
        0.3,
        1e-12,
    );
    assert!(blocked(&pedestal, &plate(BOARD), &line(-FRAC_PI_2, 0.3, 0.1), 0.0).is_empty());
    // Two carried bodies that do not meet leave the way between them free.
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
        let spans = blocked(&case.keep_out, &case.carried, &case.line, case.roll_rad);
        assert!(spans.len() <= 1);
        meet += spans.len();
        // Random places, and both sides of each end.
        let mut places = sampler.within(&[(-1.2, 1.2); 12]);
        for end in spans.iter().flat_map(|s| [s.lo_m, s.hi_m]) {
            places.extend([end - 1e-6, end + 1e-6, end - 1e-3, end + 1e-3]);
        }
        for s in places {
            let tool = case.line.board_pose(s, case.roll_rad).expect("finite");
            let inside = spans.iter().any(|span| span.lo_m < s && s < span.hi_m);
            let at_pose = case.keep_out.blocks_pose(&case.carried, &tool);
            assert_eq!(at_pose, Ok(inside));
            let body = Solid::of_plate(case.carried.plate.expect("a plate"), &tool);
            match proven_overlap(body, Solid::of_box(&case.keep_out)) {
                Some(overlap) => assert_eq!(overlap, inside, "s = {s}, {spans:?}"),
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
        let solid = Solid::of_box(&case.keep_out);
        let gap = |s: f64| {
            let tool = case.line.board_pose(s, case.roll_rad).expect("finite");
            let ends = capsule.ends_m.map(|e| tool.transform_point(e));
            let at_pose = case.keep_out.blocks_pose(&case.carried, &tool);
            (
                distance_m(solid, ends) - capsule.radius_m,
                at_pose.expect("valid"),
            )
        };
        let spans = blocked(&case.keep_out, &case.carried, &case.line, case.roll_rad);
        assert!(spans.len() <= 1);
        meet += spans.len();
        for span in &spans {
            for end in [span.lo_m, span.hi_m] {
                worst = worst.max(gap(end).0.abs());
            }
        }
        for s in sampler.within(&[(-1.5, 1.5); 10]) {
            let inside = spans.iter().any(|span| span.lo_m < s && s < span.hi_m);
            let (gap_m, at_pose) = gap(s);
            assert_eq!(inside, at_pose);
            // A segment inside the box has no depth by this measure, so zero radius is left open.
            if gap_m.abs() > 1e-12 {
                assert_eq!(inside, gap_m < 0.0, "s = {s}, {spans:?}, {gap_m:e}");
            }
        }
    }
    assert!(meet > 800, "only {meet} lines meet their box");
    assert!(worst < 1e-12, "an end is off by {worst:e} m");
}

#[test]
fn blocked_poses_sampled_densely_fill_the_interval() {
    let mut sampler = Sampler::new(73);
    for _ in 0..60 {
        let case = case(&mut sampler, |sampler| Carried {
            plate: random_plate(sampler).plate,
            last_link: random_link(sampler).last_link,
        });
        let spans = blocked(&case.keep_out, &case.carried, &case.line, case.roll_rad);
        let solid = Solid::of_box(&case.keep_out);
        let p = case.carried.plate.expect("a plate");
        for i in -400..400 {
            let s = f64::from(i) * 0.005 + 1e-4;
            let tool = case.line.board_pose(s, case.roll_rad).expect("finite");
            let inside = spans.iter().any(|span| span.lo_m < s && s < span.hi_m);
            assert_eq!(case.keep_out.blocks_pose(&case.carried, &tool), Ok(inside));
            // Points of the plate deep in the box block.
            let body = Solid::of_plate(p, &tool);
            let held = (0..20).any(|_| {
                let local = sampler.point_in_box(-body.half, body.half);
                let point = body.centre + body.axes * local;
                let depth = solid.half - (solid.axes.transpose() * (point - solid.centre)).abs();
                depth.min_element() > 1e-9
            });
            assert!(inside || !held, "s = {s} holds a common point");
        }
    }
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
            assert!(blocked(&touching, &plate(board), &along, 0.0).is_empty());
            // A hundred-millionth nearer, and it overlaps all along the face.
            let nearer = place(wall_axes, offset * (1.0 - 1e-8));
            let spans = blocked(&nearer, &plate(board), &along, 0.0);
            let reach = half.x + board.half_width_m;
            assert_span(&spans, 0.3 * size - reach, 0.3 * size + reach, 1e-11 * size);
        }
        // End to end: the pose at the end of the interval touches, a hair further in blocks.
        let ahead = place(wall_axes, DVec3::ZERO);
        let lo = 0.3 * size - half.x - board.half_width_m;
        let pose = |s: f64| along.board_pose(s, 0.0).expect("finite");
        assert_eq!(ahead.blocks_pose(&plate(board), &pose(lo)), Ok(false));
        let further = pose(lo + 1e-11 * size);
        assert_eq!(ahead.blocks_pose(&plate(board), &further), Ok(true));
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
        plate(BOARD),
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
fn intervals_scale_turn_and_grow_with_the_box() {
    let mut sampler = Sampler::new(75);
    for _ in 0..1000 {
        let Case {
            keep_out,
            line: along,
            roll_rad,
            carried,
        } = case(&mut sampler, |sampler| Carried {
            plate: random_plate(sampler).plate.filter(|_| sampler.bool()),
            last_link: random_link(sampler).last_link.filter(|_| sampler.bool()),
        });
        let spans = blocked(&keep_out, &carried, &along, roll_rad);
        let pose = keep_out.base_from_box();
        let half = keep_out.half_extents_m();
        for size in [1e-3, 1e3] {
            let placed = pose.at(pose.position_m() * size);
            let scaled = KeepOutBox::new("scaled", placed, half * size).expect("positive");
            let load = Carried {
                plate: carried.plate.map(|p| Plate {
                    half_width_m: p.half_width_m * size,
                    half_height_m: p.half_height_m * size,
                    thickness_m: p.thickness_m * size,
                }),
                last_link: carried.last_link.map(|h| Capsule {
                    ends_m: h.ends_m.map(|e| e * size),
                    radius_m: h.radius_m * size,
                }),
            };
            let plane = WallPlane::new(along.plane.heading_rad(), along.plane.distance_m() * size);
            let scaled_line = plane.expect("finite").line(along.height_m * size);
            let scaled_spans = blocked(&scaled, &load, &scaled_line, roll_rad);
            assert_eq!(scaled_spans.len(), spans.len());
            for (a, b) in scaled_spans.iter().zip(&spans) {
                assert_span(&[*a], b.lo_m * size, b.hi_m * size, 1e-8 * size);
            }
        }
        let bigger = KeepOutBox::new("bigger", pose, half * 1.01).expect("positive");
        for span in &spans {
            let wider = blocked(&bigger, &carried, &along, roll_rad);
            assert!(
                wider
                    .iter()
                    .any(|w| w.lo_m <= span.lo_m && span.hi_m <= w.hi_m)
            );
        }
        // The whole set-up turned about the base's axis.
        let angle = sampler.uniform(-3.0, 3.0);
        let turn = DMat3::from_rotation_z(angle);
        let turned =
            Pose::new(turn * pose.rotation(), turn * pose.position_m()).expect("a rotation");
        let turned = KeepOutBox::new("turned", turned, half).expect("positive");
        let heading = along.plane.heading_rad() + angle;
        let turned_line = line(heading, along.plane.distance_m(), along.height_m);
        let turned_spans = blocked(&turned, &carried, &turned_line, roll_rad);
        assert_eq!(turned_spans.len(), spans.len());
        for (a, b) in turned_spans.iter().zip(&spans) {
            assert_span(&[*a], b.lo_m, b.hi_m, 1e-8);
        }
    }
}

#[test]
fn a_box_far_from_the_base_keeps_its_touch() {
    // The positions round to 1e-13 there: the touch is relative to them, not to the gap.
    let along = line(0.7, 1e3, 0.2);
    let (n, t) = (along.plane.normal(), along.plane.along());
    let axes = DMat3::from_cols(t, DVec3::Z, n);
    let pose = Pose::new(axes, along.point_m(700.0) + n * 0.1).expect("a rotation");
    let touching = KeepOutBox::new("far", pose, DVec3::splat(0.1)).expect("positive");
    assert!(blocked(&touching, &plate(BOARD), &along, 0.0).is_empty());
    let tool = along.board_pose(700.0, 0.0).expect("finite");
    assert_eq!(touching.blocks_pose(&plate(BOARD), &tool), Ok(false));
}

#[test]
fn what_is_no_box_load_or_line_is_an_error() {
    let flat = [DVec3::new(0.1, 0.0, 0.1), DVec3::new(0.1, 0.1, -0.1)];
    for half in flat {
        let made = KeepOutBox::new("flat", Pose::IDENTITY, half);
        assert!(matches!(
            made,
            Err(ReachabilityError::Argument(
                ArgumentError::OutOfRange { .. }
            ))
        ));
    }
    for bad in [f64::NAN, f64::INFINITY] {
        let made = KeepOutBox::new("bad", Pose::IDENTITY, DVec3::new(0.1, bad, 0.1));
        assert!(matches!(
            made,
            Err(ReachabilityError::Argument(
                ArgumentError::OutOfRange { .. }
            ))
        ));
        assert!(KeepOutBox::from_corners("bad", DVec3::ZERO, DVec3::splat(bad)).is_err());
        assert!(KeepOutBox::from_corners("bad", DVec3::splat(bad), DVec3::ZERO).is_err());
        assert!(KeepOutBox::pedestal(0.1, 0.1, bad).is_err());
        let cube = cube(0.1);
        let along = line(0.0, 0.0, 0.0);
        let loads = [
            plate(Plate {
                half_width_m: bad,
                ..BOARD
            }),
            plate(Plate {
                half_height_m: bad,
                ..BOARD
            }),
            plate(Plate {
                thickness_m: bad,
                ..BOARD
            }),
            link(DVec3::new(0.0, bad, 0.0), DVec3::ZERO, 0.1),
            link(DVec3::ZERO, DVec3::new(0.0, 0.0, bad), 0.1),
            link(DVec3::ZERO, DVec3::ZERO, bad),
        ];
        for load in loads {
            assert!(cube.blocked_on_line(&load, &along, 0.0).is_err());
            assert!(cube.blocks_pose(&load, &Pose::IDENTITY).is_err());
        }
        let nothing = Carried::default();
        assert!(cube.blocked_on_line(&nothing, &along, bad).is_err());
        let nowhere = WallLine {
            height_m: bad,
            ..along
        };
        assert!(cube.blocked_on_line(&nothing, &nowhere, 0.0).is_err());
    }
    assert!(KeepOutBox::from_corners("inside out", DVec3::ONE, DVec3::ZERO).is_err());
    let negative = [
        plate(Plate {
            half_width_m: 0.0,
            ..BOARD
        }),
        plate(Plate {
            thickness_m: -0.01,
            ..BOARD
        }),
        link(DVec3::ZERO, DVec3::ZERO, -0.1),
    ];
    for load in negative {
        assert!(matches!(
            load.validate(),
            Err(ReachabilityError::Argument(
                ArgumentError::OutOfRange { .. }
            ))
        ));
    }
    // Distances whose sum overflows are refused, the largest below that are not.
    let huge = line(0.0, 1e308, 1e308);
    assert!(
        cube(0.1)
            .blocked_on_line(&plate(BOARD), &huge, 0.0)
            .is_err()
    );
    let load = link(DVec3::ZERO, DVec3::X * 1e300, 1e299);
    let spans = blocked(&cube(1e300), &load, &line(0.0, 0.0, 0.0), 0.0);
    assert_span(&spans, -2.1e300, 1.1e300, 1e288);
}
