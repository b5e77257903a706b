//! The poses that serve a wall, the ways there and the choice among them.

use super::{DT_S, standing};
use glam::{DVec2, DVec3, dvec2};
use hwall_arrival::base::{
    BaseChoiceConfig, BaseChooser, BaseDrive, BaseHypothesis, BaseInversion, BaseInversionConfig,
    BaseLimits, BasePose, KeepOutArea, route,
};
use hwall_arrival::reachability::{Interval, WallFacet, WallPlane};
use hwall_kinematics::SrsArm;
use hwall_testkit::Sampler;
use std::f64::consts::FRAC_PI_2;

/// A room of 6 x 6 m, its walls facing inwards, and a shelf of 0.12 m before one of them.
fn room() -> Vec<WallFacet> {
    let wall = |from: DVec2, to: DVec2, heights: [f64; 2]| {
        let way = to - from;
        WallFacet {
            point_m: from.midpoint(to).extend(0.0),
            normal: dvec2(way.y, -way.x).normalize().extend(0.0),
            heights: Interval::new(heights[0], heights[1]),
            outline_m: vec![from.extend(heights[0]), to.extend(heights[1])],
        }
    };
    let corners = [
        dvec2(6.0, 0.0),
        dvec2(0.0, 0.0),
        dvec2(0.0, 6.0),
        dvec2(6.0, 6.0),
    ];
    let mut walls: Vec<_> = (0..4)
        .map(|i| wall(corners[i], corners[(i + 1) % 4], [-0.95, 1.55]))
        .collect();
    walls.push(wall(dvec2(3.4, 0.12), dvec2(2.6, 0.12), [0.0, 0.45]));
    walls
}

/// The poses of an iiwa's base that serve the walls.
fn inversion(walls: &[WallFacet]) -> BaseInversion {
    let (arm, config) = (SrsArm::iiwa7(), BaseInversionConfig::default());
    let map = BaseInversion::map(&arm, &config).unwrap();
    BaseInversion::of_room(&map, walls, config).unwrap()
}

/// The floor of the room.
const AREA: KeepOutArea = KeepOutArea {
    low_m: DVec2::ZERO,
    high_m: DVec2::splat(6.0),
};

#[test]
fn the_inversion_agrees_with_the_arm() {
    let (arm, inversion) = (SrsArm::iiwa7(), inversion(&room()));
    let mut sampler = Sampler::new(3);
    let (mut served, mut refused) = (0, 0);
    for _ in 0..200_000 {
        let cell = sampler.index(inversion.cells());
        let (point_m, normal) = inversion.middle(cell).unwrap();
        if inversion.cell(point_m, normal) != Some(cell) {
            continue;
        }
        let index = sampler.index(inversion.bases().len());
        let base = inversion.bases()[index];
        if base.at_m.distance(point_m.truncate()) > 1.2 {
            continue;
        }
        let serves = inversion
            .serving(point_m, normal)
            .binary_search(&(index as u32))
            .is_ok();
        let holds = |aside_m: f64| {
            let beside_m = point_m + normal.cross(DVec3::Z) * aside_m;
            let base_from_floor = base.floor_from_base().unwrap().inverse();
            let there_m = base_from_floor.transform_point(beside_m);
            let plane =
                WallPlane::through(there_m, base_from_floor.transform_vector(normal)).unwrap();
            (0..4).any(|quarter| {
                let pose =
                    plane.board_pose(plane.project(there_m).at, f64::from(quarter) * FRAC_PI_2);
                arm.is_reachable(&pose.unwrap())
            })
        };
        if serves {
            served += 1;
            assert!(
                holds(0.0) && holds(0.019) && holds(-0.019),
                "{base:?} {point_m}"
            );
        } else if mapped(&base, point_m, normal) {
            refused += 1;
            assert!(
                !holds(0.0) || !holds(0.0201) || !holds(-0.0201),
                "{base:?} {point_m}"
            );
        }
    }
    assert!(served > 500 && refused > 500, "{served} {refused}");
}

/// Is the plane of a place one of those of the map, and ahead?
fn mapped(base: &BasePose, point_m: DVec3, normal: DVec3) -> bool {
    let distance_m = normal.truncate().dot(point_m.truncate() - base.at_m);
    let on_plane = (distance_m / 0.02 - (distance_m / 0.02).round()).abs() < 1e-6;
    let ahead = DVec2::from_angle(base.yaw_rad).dot(normal.truncate()) >= -0.866;
    on_plane && ahead && (0.3..=0.8).contains(&distance_m)
}

/// A wall of 6.03 m and a shelf of 0.8 m: the middle of every cell is its own, but those above and below the shelf are on no surface.
#[test]
fn the_middle_of_a_cell_is_in_it() {
    let mut walls = room();
    walls[0].outline_m[1].x = -0.03;
    let inversion = inversion(&walls);
    let own = |cell: &usize| {
        let (point_m, normal) = inversion.middle(*cell).unwrap();
        inversion.cell(point_m, normal) == Some(*cell)
    };
    let elsewhere = (0..inversion.cells()).filter(|cell| !own(cell)).count();
    let (columns, heights_off) = (8, 13 - 5);
    assert_eq!(inversion.cells(), (61 + 3 * 60 + columns) * 13);
    assert_eq!(elsewhere, columns * heights_off);
    assert!(inversion.middle(inversion.cells()).is_none());
    // A place is known up to half a step above the highest cells, and below the lowest.
    let known = |z: f64| inversion.cell(DVec3::new(1.0, 0.0, z), DVec3::Y).is_some();
    for (z, is_known) in [(1.04, true), (1.06, false), (-0.24, true), (-0.26, false)] {
        assert_eq!(known(z), is_known, "{z}");
    }
    assert!(!known(f64::NAN));
}

#[test]
fn ways_stay_out_of_the_room() {
    let mut sampler = Sampler::new(5);
    for _ in 0..2000 {
        let [from_m, to_m] =
            [(); 2].map(|()| dvec2(sampler.uniform(-2.0, 8.0), sampler.uniform(-2.0, 8.0)));
        let found = route(from_m, to_m, &AREA);
        assert_eq!(found.is_none(), AREA.contains(to_m), "{from_m} {to_m}");
        let Some(way) = found else { continue };
        assert_eq!(way.last(), Some(&to_m));
        let legs = std::iter::once(&from_m).chain(&way).zip(&way);
        // Only the leg that leaves the room is inside.
        let outside = legs.skip(usize::from(AREA.contains(from_m)));
        for (a, b) in outside {
            assert!(!AREA.is_crossed(*a, *b), "{from_m} {way:?}");
        }
        let legs_m = way.windows(2).map(|leg| leg[0].distance(leg[1]));
        assert!(legs_m.sum::<f64>() <= 32.0);
    }
}

/// Regression: a base that had cut a corner by millimetres was sent back to the corner at every choice, and crept around it.
#[test]
fn a_base_that_cut_a_corner_goes_on() {
    let corner_m = dvec2(AREA.high_m.x, AREA.low_m.y);
    let to_m = corner_m + dvec2(0.2, 1.0);
    let cut = standing(corner_m + dvec2(-0.014, 0.014), 0.0);
    let mut drive = BaseDrive::new(BaseLimits::default(), cut).unwrap();
    let mut steps = 0;
    while steps == 0 || !drive.has_arrived() {
        // A new choice every 0.1 s.
        if steps % 25 == 0 {
            let way = route(drive.stopping_m(), to_m, &AREA).unwrap();
            drive.set_route(&way, 0.0).unwrap();
        }
        drive.step(DT_S, |_, _| true).unwrap();
        steps += 1;
        assert!(steps < 1000, "{:?}", drive.state().pose());
    }
    let least_s = drive.leg_s(1.02, 0.8);
    assert!(f64::from(steps) * DT_S < least_s + 0.2, "{steps} steps");
    // From farther inside it leaves first.
    let way = route(corner_m + dvec2(-0.2, 0.3), to_m, &AREA).unwrap();
    assert!(way.len() > 1);
}

/// From at most 5 cm inside the middle of a side it goes straight along or away, and never deeper; from farther inside it leaves first.
#[test]
fn a_base_slightly_inside_a_side_goes_on() {
    let first = |inside_m: f64, to_m| route(dvec2(3.0, inside_m), to_m, &AREA).unwrap();
    let corner_m = dvec2(AREA.high_m.x, AREA.low_m.y);
    for (to_m, corners) in [
        (dvec2(3.5, -1.0), vec![]),
        (dvec2(7.0, 0.0), vec![]),
        (dvec2(7.0, 2.0), vec![corner_m]),
    ] {
        let way = first(0.04, to_m);
        assert_eq!(way, [corners, vec![to_m]].concat());
        let from_m = dvec2(3.0, 0.04);
        let legs = std::iter::once(&from_m).chain(&way).zip(&way);
        for (a, b) in legs {
            assert!(!AREA.grown(-0.04).is_crossed(*a, *b), "{way:?}");
        }
        assert_eq!(first(0.06, to_m)[0], dvec2(3.0, 0.0));
    }
}

#[test]
fn the_base_goes_where_it_serves_what_is_probable() {
    let inversion = inversion(&room());
    let nowhere = KeepOutArea {
        high_m: DVec2::NAN,
        ..AREA
    };
    let new = |area| BaseChooser::new(BaseChoiceConfig::default(), &inversion, area);
    assert!(new(nowhere).is_err());
    let chooser = new(AREA).unwrap();
    let at = standing(dvec2(3.0, -0.62), FRAC_PI_2);
    let drive = BaseDrive::new(BaseLimits::default(), at).unwrap();
    let place = |point_m: DVec3, normal: DVec3, probability: f64| BaseHypothesis {
        point_m,
        normal,
        probability,
        touch_s: 6.0,
    };
    let here = place(DVec3::new(3.0, 0.0, 0.7), DVec3::Y, 0.8);
    let aside = place(DVec3::new(0.0, 1.5, 0.5), DVec3::X, 0.8);
    let (stays, _) = chooser.choose(&drive, Some(at), &[here]).unwrap();
    assert_eq!(stays, at);
    let (goes, way) = chooser.choose(&drive, Some(at), &[aside]).unwrap();
    assert!(goes.at_m.x < -0.5 && goes.yaw_rad.abs() < 1e-9, "{goes:?}");
    assert_eq!(way.last(), Some(&goes.at_m));
    // A little more probable is not worth the way.
    let doubtful = [here, aside].map(|place| BaseHypothesis {
        probability: 0.5,
        ..place
    });
    assert_eq!(chooser.choose(&drive, Some(at), &doubtful).unwrap().0, at);
    assert!(chooser.choose(&drive, None, &[]).is_none());
    // Regression: with a number that is none in it every loss was NaN, and the first candidate won.
    let sound = chooser.choose(&drive, None, &[aside]);
    assert!(sound.is_some());
    let spoils: [fn(&mut BaseHypothesis); 3] = [
        |place| place.touch_s = f64::NAN,
        |place| place.probability = f64::NAN,
        |place| place.normal = DVec3::NAN,
    ];
    for spoil in spoils {
        let mut bad = here;
        spoil(&mut bad);
        assert_eq!(chooser.choose(&drive, None, &[bad, aside]), sound);
        assert!(chooser.choose(&drive, None, &[bad]).is_none());
    }
    let nowhere = standing(DVec2::NAN, 0.0);
    assert_eq!(chooser.choose(&drive, Some(nowhere), &[aside]), sound);
    // A place that no wall has is served from nowhere.
    let nowhere = place(DVec3::new(3.0, 3.0, 0.5), DVec3::Y, 0.8);
    assert!(chooser.choose(&drive, None, &[nowhere]).is_none());
    // The way is the same now and later, so nobody waits for a place that is known, however late the base will be there.
    for touch_s in [0.5, 2.0, 20.0] {
        let behind = BaseHypothesis { touch_s, ..aside };
        let (goes, _) = chooser.choose(&drive, Some(at), &[behind]).unwrap();
        assert!(goes.at_m.x < -0.5, "{touch_s} {goes:?}");
    }
}
