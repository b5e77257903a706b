//! Where the board is sent: certain, late, undecided.

use glam::{DMat3, DVec3};
use hwall_contact::{
    BoardChoice, BoardChooser, BoardConfig, ContactPrediction, PredictionSource, TimeToContact,
};
use hwall_scene::SurfaceId;
use hwall_testkit::{Sampler, Tol, assert_close};

fn at(
    surface: usize,
    point_m: DVec3,
    normal: DVec3,
    probability: f64,
    due_s: f64,
) -> ContactPrediction {
    let (u, v) = normal.any_orthonormal_pair();
    let flat = |x: DVec3| DMat3::from_cols(x * x.x, x * x.y, x * x.z) * 1e-4;
    ContactPrediction {
        surface: SurfaceId(surface),
        point_m,
        covariance_m2: Some(flat(u) + flat(v)),
        normal,
        roughness: None,
        distance_m: 0.1,
        time_to_contact_s: Some(TimeToContact {
            mean_s: due_s,
            sd_s: None,
        }),
        probability,
        source: PredictionSource::Motion,
    }
}

fn choose(predictions: &[ContactPrediction], board_m: DVec3) -> BoardChoice {
    let chooser = BoardChooser::new(slow()).unwrap();
    chooser.choose(predictions, board_m, 0.5).unwrap()
}

const FRONT: DVec3 = DVec3::new(0.7, 0.0, 1.2);
const SIDE: DVec3 = DVec3::new(0.4, 0.3, 1.2);

/// An arm that takes a while, and a hand that shows late where it goes.
fn slow() -> BoardConfig {
    BoardConfig {
        speed_m_per_s: 0.6,
        latency_s: 0.05,
        resolved_s: 0.2,
        ..BoardConfig::default()
    }
}

#[test]
fn a_certain_contact_is_where_the_board_goes() {
    let choice = choose(
        &[at(3, FRONT, DVec3::NEG_X, 1.0, 0.4)],
        FRONT + DVec3::Y * 0.1,
    );
    assert_eq!((choice.point_m, choice.surface), (FRONT, SurfaceId(3)));
    assert!(choice.on_board > 0.999 && choice.expected_miss_m < 1e-6);
}

#[test]
fn a_certain_contact_that_is_out_of_reach_in_time_says_so() {
    // 0.6 m/s for 0.15 s are 0.09 m of 0.5 m.
    let choice = choose(
        &[at(3, FRONT, DVec3::NEG_X, 1.0, 0.2)],
        FRONT + DVec3::Y * 0.5,
    );
    assert_eq!(choice.point_m, FRONT);
    assert!(choice.on_board < 1e-6);
    assert_close!(choice.expected_miss_m, 0.41 - 0.085, Tol::abs(2e-3));
}

#[test]
fn the_probability_on_board_is_that_of_drawn_contacts() {
    let mut sampler = Sampler::new(8);
    let c = DMat3::from_cols_array(&[0.0, 0.0, 0.0, 0.0, 0.006, 0.003, 0.0, 0.003, 0.004]);
    let wide = ContactPrediction {
        covariance_m2: Some(c),
        ..at(0, FRONT, DVec3::NEG_X, 1.0, 0.0)
    };
    let board_m = FRONT + DVec3::new(0.0, 0.05, -0.03);
    let choice = choose(&[wide], board_m);
    let (mut on, mut miss, n) = (0.0, 0.0, 20_000);
    for _ in 0..n {
        let (a, b) = (sampler.normal(), sampler.normal());
        let y = 0.006_f64.sqrt() * a;
        let z = 0.003 / 0.006 * y + (0.004 - 0.003 * 0.003 / 0.006_f64).sqrt() * b;
        let beside = |x: f64| (x.abs() - 0.085).max(0.0);
        let off = beside(y - 0.05).hypot(beside(z + 0.03));
        on += f64::from(off == 0.0) / f64::from(n);
        miss += off / f64::from(n);
    }
    assert_close!(choice.on_board, on, Tol::abs(0.02));
    assert_close!(choice.expected_miss_m, miss, Tol::abs(0.004));
}

#[test]
fn between_two_walls_the_board_waits_while_there_is_time_and_commits_when_there_is_none() {
    let corner = |due_s| {
        [
            at(0, FRONT, DVec3::NEG_X, 0.5, due_s),
            at(1, SIDE, DVec3::NEG_Y, 0.5, due_s),
        ]
    };
    // From one wall the other is 0.42 m away: too far for the 0.12 m after the decision shows, and
    // from the middle as well. So one is served, from as near to the other as that allows.
    let far = choose(&corner(1.0), FRONT);
    assert_close!(far.on_board, 0.5, Tol::abs(1e-2));
    let nearest_m = far.point_m.distance(FRONT).min(far.point_m.distance(SIDE));
    assert!(nearest_m < 0.15);
    // A faster arm reaches both from between them, but not one from the other.
    let chooser = BoardChooser::new(BoardConfig {
        speed_m_per_s: 1.2,
        ..slow()
    })
    .unwrap();
    let waits = chooser.choose(&corner(1.0), FRONT, 0.5).unwrap();
    assert!(waits.on_board > 0.99, "{waits:?}");
    assert!(waits.point_m.distance(FRONT) > 0.15 && waits.point_m.distance(SIDE) > 0.15);
    // 0.25 s before the contact, latency and the decision itself included, it is too late to wait.
    let commits = chooser.choose(&corner(0.25), waits.point_m, 0.5).unwrap();
    assert!(commits.point_m == FRONT || commits.point_m == SIDE);
    assert_close!(commits.on_board, 0.5, Tol::abs(1e-2));
}

#[test]
fn of_two_walls_the_one_that_can_be_reached_is_served() {
    let predictions = [
        at(0, FRONT, DVec3::NEG_X, 0.6, 0.2),
        at(1, SIDE, DVec3::NEG_Y, 0.4, 0.2),
    ];
    let near_side = SIDE + DVec3::new(-0.05, 0.0, 0.0);
    let choice = choose(&predictions, near_side);
    assert_eq!((choice.point_m, choice.surface), (SIDE, SurfaceId(1)));
    assert_close!(choice.on_board, 0.4, Tol::abs(1e-2));
}

#[test]
fn the_probable_wall_is_preferred() {
    let predictions = [
        at(0, FRONT, DVec3::NEG_X, 0.9, 0.5),
        at(1, SIDE, DVec3::NEG_Y, 0.1, 0.5),
    ];
    let choice = choose(&predictions, FRONT.midpoint(SIDE));
    assert_eq!(
        (choice.surface, choice.on_board > 0.89),
        (SurfaceId(0), true)
    );
    // It goes to where the other is still in reach if it can, and no further than it must.
    assert!(choice.point_m.distance(FRONT) < 0.15);
}

#[test]
fn a_door_and_the_wall_around_it_are_served_from_between_them() {
    // Two places of one plane 0.1 m apart: a board in the middle covers both, at once.
    let aside = FRONT + DVec3::Y * 0.1;
    let predictions = [
        at(0, FRONT, DVec3::NEG_X, 0.5, 0.1),
        at(1, aside, DVec3::NEG_X, 0.5, 0.1),
    ];
    let choice = choose(&predictions, FRONT.midpoint(aside) + DVec3::Z * 0.01);
    assert!(choice.on_board > 0.98, "{choice:?}");
}

#[test]
fn nothing_to_choose_and_bad_numbers() {
    let chooser = BoardChooser::new(slow()).unwrap();
    assert_eq!(chooser.choose(&[], FRONT, 0.5), None);
    let one = [at(0, FRONT, DVec3::NEG_X, 1.0, 0.3)];
    assert_eq!(chooser.choose(&one, DVec3::NAN, 0.5), None);
    let undated = [ContactPrediction {
        time_to_contact_s: None,
        covariance_m2: None,
        ..one[0]
    }];
    assert_eq!(chooser.choose(&undated, FRONT, 0.5).unwrap().on_board, 1.0);
    for bad in [f64::NAN, -1.0, 0.0] {
        let config = BoardConfig {
            speed_m_per_s: bad,
            ..slow()
        };
        assert!(BoardChooser::new(config).is_err());
    }
    let config = BoardConfig {
        inset_m: 0.1,
        ..slow()
    };
    assert!(BoardChooser::new(config).is_err());
}
