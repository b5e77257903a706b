//! Links of the arm in front of a surface.

use crate::support::{DT_S, before_door, iiwa};
use glam::DVec3;
use hwall_haptics::body::{ArmBody, BodyConfig, PersonBody, Separation, SeparationConfig};
use hwall_haptics::safety::{PersonPart, PersonPoint};
use hwall_haptics::{ApproachConfig, Barrier, Board, Follower, FollowerConfig};
use std::sync::Arc;

/// For a link this far in front of a wall, m, and a head at this distance, m: is the link reported?
#[test]
fn a_link_is_told_once_it_is_in_front_within_reach_and_until_it_is_neither() {
    let (arm, board, q) = (Arc::new(iiwa()), Board::default(), before_door());
    let body = ArmBody::new(arm.clone(), board, BodyConfig::default()).unwrap();
    let capsules = body.at(&q);
    let (last, links) = capsules.links().split_last().unwrap();
    // The part of the last link within its radius of the face counts as the board.
    let length_m = last.from_m.distance(last.to_m);
    let ends_m = last.from_m.lerp(last.to_m, 1.0 - last.radius_m / length_m);
    let points_m = links.iter().flat_map(|link| [link.from_m, link.to_m]);
    let furthest_m = points_m
        .chain([ends_m])
        .fold(0.0, |most: f64, m| most.max(m.x))
        + last.radius_m;
    let config = SeparationConfig::default();
    let mut follower = Follower::new(arm, FollowerConfig::default(), &q)
        .unwrap()
        .with_board(ApproachConfig::default(), board);
    follower.keep_clear(Separation::new(body, config, [8.0; 7]).unwrap());
    let near = Some(0.5);
    for (row, (front_m, head_m, told)) in [
        (-0.1, near, false),
        (0.02, near, false),
        (0.04, near, true),
        // Hysteresis.
        (0.02, near, true),
        (0.01, near, false),
        (0.02, near, false),
        // Out of reach, and without a person.
        (0.04, Some(0.88), false),
        (0.04, Some(0.75), true),
        (0.04, Some(0.88), true),
        (0.04, Some(1.0), false),
        (0.04, None, false),
        (0.04, Some(f64::NAN), false),
        (0.04, near, true),
    ]
    .into_iter()
    .enumerate()
    {
        let wall_m = DVec3::new(furthest_m - front_m, 0.0, 0.5);
        follower.set_barriers(&[Barrier::new(wall_m, DVec3::X, [3.0, 3.0]).unwrap()]);
        let points = head_m.map(|beyond_m| PersonPoint {
            part: PersonPart::Head,
            position_m: ends_m
                + DVec3::X * (last.radius_m + config.person.head_radius_m + beyond_m),
            stamp_s: 0.0,
        });
        follower.set_person(PersonBody::of(points.as_slice(), &config.person));
        for _ in 0..3 {
            follower.step(DT_S).unwrap();
            follower.plan();
        }
        let found = follower.link_in_front();
        assert_eq!(found.is_some(), told, "row {row}: {found:?}");
        if let Some(found) = found {
            assert!((found.in_front_m - front_m).abs() < 1e-9, "{found:?}");
        }
    }
}
