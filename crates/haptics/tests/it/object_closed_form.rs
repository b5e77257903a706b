//! Moving objects against closed forms and against an independent high-order integration.

use hwall_haptics::{MovingObject, ObjectConfig};
use hwall_testkit::{Sampler, Tol, assert_close};

fn object(config: ObjectConfig) -> MovingObject {
    MovingObject::new(config).unwrap()
}

/// Dormand-Prince would do; a Taylor series of 30 terms is simpler and better for the linear equation, in steps short enough to converge at once.
fn integrated(
    [m, b, k]: [f64; 3],
    force: f64,
    [mut x, mut v]: [f64; 2],
    duration_s: f64,
) -> [f64; 2] {
    let rate = (b / m).max((k / m).sqrt()).max(1.0 / duration_s);
    let steps = (4.0 * rate * duration_s).ceil();
    let h = duration_s / steps;
    for _ in 0..steps as usize {
        // Derivatives from the equation: m y⁽ⁿ⁺²⁾ = −b y⁽ⁿ⁺¹⁾ − k y⁽ⁿ⁾.
        let (mut d0, mut d1) = (v, (force - b * v - k * x) / m);
        let (mut next_x, mut next_v, mut factor) = (x + v * h, v + d1 * h, h);
        for n in 1..30 {
            factor *= h / (f64::from(n) + 1.0);
            let d2 = (-b * d1 - k * d0) / m;
            next_x += d1 * factor;
            next_v += d2 * factor;
            (d0, d1) = (d1, d2);
        }
        (x, v) = (next_x, next_v);
    }
    [x, v]
}

#[test]
fn piecewise_constant_forces_in_all_regimes_agree_with_an_independent_integration() {
    let mut sampler = Sampler::new(1);
    let (mut worst_x, mut worst_v) = (0.0_f64, 0.0_f64);
    for case in 0..600 {
        let m = 10_f64.powf(sampler.uniform(-2.0, 1.5));
        let k = match case % 5 {
            0 => 0.0,
            _ => 10_f64.powf(sampler.uniform(-6.0, 4.0)),
        };
        let critical = 2.0 * (k * m).sqrt();
        let b = match case % 4 {
            0 => 0.0,
            // Around critical damping, where the two decay rates meet.
            1 => critical * (1.0 + sampler.normal() * 10_f64.powf(sampler.uniform(-16.0, -1.0))),
            2 => critical * sampler.uniform(0.0, 0.99),
            _ => critical * sampler.uniform(1.0, 20.0) + sampler.uniform(0.0, 5.0),
        };
        let mut moving = object(ObjectConfig {
            stiffness: k,
            damping: b.max(0.0),
            ..ObjectConfig::new(m)
        });
        let mut reference = [0.0, 0.0];
        for _ in 0..20 {
            let force = sampler.uniform(-50.0, 50.0);
            let dt_s = 10_f64.powf(sampler.uniform(-6.0, -0.5));
            moving.step(force, dt_s).unwrap();
            reference = integrated([m, b.max(0.0), k], force, reference, dt_s);
            let rate = (k / m).sqrt().max(1.0);
            let scale = 1.0_f64
                .max(reference[0].abs())
                .max(reference[1].abs() / rate);
            worst_x = worst_x.max((moving.position() - reference[0]).abs() / scale);
            worst_v = worst_v.max((moving.velocity() - reference[1]).abs() / (rate * scale));
        }
    }
    println!("largest differences, relative to the motion: {worst_x:.1e}, {worst_v:.1e}");
    assert!(worst_x < 2e-12 && worst_v < 2e-12, "{worst_x} {worst_v}");
}

#[test]
fn steps_of_a_spring_and_damper_are_those_of_the_textbook() {
    let (m, k, force) = (2.0, 50.0, 10.0);
    let omega: f64 = 5.0;
    for zeta in [0.0_f64, 0.1, 0.7, 0.999_999, 1.0, 1.000_001, 3.0, 100.0] {
        for t in [1e-6, 1e-3, 0.1, 0.7, 3.0, 10.0] {
            let mut moving = object(ObjectConfig {
                stiffness: k,
                damping: 2.0 * zeta * (k * m).sqrt(),
                ..ObjectConfig::new(m)
            });
            moving.step(force, t).unwrap();
            let x = if zeta < 0.9 {
                let wd = omega * (1.0 - zeta * zeta).sqrt();
                let decay = (-zeta * omega * t).exp();
                let sine = zeta / (1.0 - zeta * zeta).sqrt() * (wd * t).sin();
                force / k * (1.0 - decay * ((wd * t).cos() + sine))
            } else if zeta > 1.1 {
                let root = (zeta * zeta - 1.0).sqrt();
                let (s1, s2) = (omega * (zeta - root), omega * (zeta + root));
                force / k * (1.0 - (s2 * (-s1 * t).exp() - s1 * (-s2 * t).exp()) / (s2 - s1))
            } else {
                force / k * (1.0 - (1.0 + omega * t) * (-omega * t).exp())
            };
            let allowed = if (zeta - 1.0).abs() < 1e-3 && zeta != 1.0 {
                1e-6
            } else {
                1e-13
            };
            assert_close!(moving.position(), x, Tol::abs(allowed));
        }
    }
}

#[test]
fn a_free_door_with_friction_stops_where_its_energy_is_used_up() {
    let (inertia, friction, push, push_s): (f64, f64, f64, f64) = (4.0, 1.5, 9.0, 0.8);
    let mut door = object(ObjectConfig {
        friction,
        ..ObjectConfig::new(inertia)
    });
    door.step(push, push_s).unwrap();
    let rate = (push - friction) / inertia * push_s;
    assert_close!(door.velocity(), rate, Tol::abs(1e-14));
    let angle = 0.5 * rate * push_s;
    assert_close!(door.position(), angle, Tol::abs(1e-14));
    door.step(0.0, 10.0).unwrap();
    let end = angle + 0.5 * inertia * rate * rate / friction;
    assert_close!(door.position(), end, Tol::abs(1e-13));
    assert_eq!(door.velocity(), 0.0);
    // It stays exactly in place, up to and including the breakaway force.
    let rests = door.position();
    for force in [0.3, -1.4, friction, -friction] {
        door.step(force, 3.0).unwrap();
        assert_eq!((door.position(), door.velocity()), (rests, 0.0));
        assert_eq!(door.acceleration(force), 0.0);
    }
    let more = friction * (1.0 + f64::EPSILON);
    door.step(more, 10.0).unwrap();
    assert!(door.position() >= rests && door.velocity() > 0.0);
    assert!(door.acceleration(2.0 * friction) > 0.0);
}

#[test]
fn a_spring_with_friction_loses_the_same_way_in_every_half_swing() {
    // Undamped: each half swing ends 2 friction / stiffness closer to the centre.
    let (k, friction) = (100.0, 3.0);
    let mut moving = object(ObjectConfig {
        stiffness: k,
        friction,
        ..ObjectConfig::new(0.25)
    });
    moving.set_state(0.5, 0.0).unwrap();
    let half_s = std::f64::consts::PI / 20.0;
    for half_swing in 1..=8 {
        moving.step(0.0, half_s).unwrap();
        let sign = if half_swing % 2 == 0 { 1.0 } else { -1.0 };
        let expected = sign * (0.5 - 0.06 * f64::from(half_swing));
        assert_close!(moving.position(), expected, Tol::abs(1e-14));
    }
    // 0.02 is within friction / stiffness: it sticks there.
    moving.step(0.0, 10.0).unwrap();
    assert_close!(moving.position(), 0.02, Tol::abs(1e-14));
    assert_eq!(moving.velocity(), 0.0);
}

#[test]
fn stops_hold_or_throw_back() {
    let config = ObjectConfig {
        range: [-0.1, 0.5],
        ..ObjectConfig::new(2.0)
    };
    // Inelastic: one step over the whole path, and only a force away from the stop leaves it.
    let mut panel = object(config.clone());
    panel.step(10.0, 5.0).unwrap();
    assert_eq!((panel.position(), panel.velocity()), (0.5, 0.0));
    assert_eq!(panel.acceleration(10.0), 0.0);
    panel.step(3.0, 1.0).unwrap();
    panel.step(0.0, 1.0).unwrap();
    assert_eq!((panel.position(), panel.velocity()), (0.5, 0.0));
    panel.step(-10.0, 0.2).unwrap();
    assert_close!(panel.position(), 0.4, Tol::abs(1e-15));
    assert_close!(panel.velocity(), -1.0, Tol::abs(1e-15));

    // Partly elastic: free flight between two stops, geometric.
    let mut puck = object(ObjectConfig {
        restitution: 0.5,
        ..config.clone()
    });
    puck.set_state(0.2, 3.0).unwrap();
    puck.step(0.0, 0.1 + 0.2 + 0.4).unwrap();
    assert_close!(puck.velocity(), 0.75, Tol::abs(1e-15));
    assert_close!(puck.position(), 0.05, Tol::abs(1e-15));

    // Pushed while it bounces: infinitely many bounces in finite time, then rest.
    let (height, pull, e) = (0.5, 20.0, 0.9_f64);
    let mut ball = object(ObjectConfig {
        restitution: e,
        range: [0.0, 1.0],
        ..ObjectConfig::new(2.0)
    });
    ball.set_state(height, 0.0).unwrap();
    let fall_s = (2.0 * height / (pull / 2.0_f64)).sqrt();
    let end_s = fall_s * (1.0 + e) / (1.0 - e);
    // Between the second and the third touch: at its highest point.
    let mut high = ball.clone();
    high.step(-pull, fall_s * (1.0 + 2.0 * e + e * e)).unwrap();
    assert_close!(high.position(), height * e.powi(4), Tol::abs(1e-14));
    assert_close!(high.velocity(), 0.0, Tol::abs(1e-13));
    ball.step(-pull, end_s * 1.000_001).unwrap();
    assert_eq!((ball.position(), ball.velocity()), (0.0, 0.0));
    ball.step(-pull, 10.0).unwrap();
    assert_eq!((ball.position(), ball.velocity()), (0.0, 0.0));

    // No motion is possible.
    let mut fixed = object(ObjectConfig {
        range: [0.0, 0.0],
        restitution: 1.0,
        stiffness: 100.0,
        ..config
    });
    for force in [5.0, -5.0, 0.0] {
        fixed.step(force, 1.0).unwrap();
        assert_eq!((fixed.position(), fixed.velocity()), (0.0, 0.0));
    }
    fixed.set_state(0.0, 3.0).unwrap();
    fixed.step(1.0, 1.0).unwrap();
    assert_eq!((fixed.position(), fixed.velocity()), (0.0, 0.0));
}

#[test]
fn extremes_stay_exact() {
    // No spring, no damper.
    let mut free = object(ObjectConfig::new(3.0));
    free.step(6.0, 10.0).unwrap();
    assert_eq!((free.position(), free.velocity()), (100.0, 20.0));
    // Hardly any spring: like none.
    let mut soft = object(ObjectConfig {
        stiffness: 1e-280,
        ..ObjectConfig::new(3.0)
    });
    soft.step(6.0, 10.0).unwrap();
    assert_eq!((soft.position(), soft.velocity()), (100.0, 20.0));
    // A stiff spring and a tiny mass: 5e7 swings in one step conserve their energy.
    let mut stiff = object(ObjectConfig {
        stiffness: 1e9,
        ..ObjectConfig::new(1e-6)
    });
    stiff.set_state(1e-3, 0.0).unwrap();
    let energy_j = stiff.energy_j();
    stiff.step(0.0, 10.0).unwrap();
    assert_close!(stiff.energy_j(), energy_j, Tol::rel(1e-14));
    // The same, damped: it rests at its equilibrium.
    let mut damped = object(ObjectConfig {
        stiffness: 1e9,
        damping: 1e-2,
        ..ObjectConfig::new(1e-6)
    });
    damped.step(1e3, 10.0).unwrap();
    assert_close!(damped.position(), 1e-6, Tol::rel(1e-15));
    assert_eq!(damped.velocity(), 0.0);
    // In a viscous medium, with a heavy and with a tiny mass.
    for inertia in [1e-6, 1.0, 1e6] {
        let mut slow = object(ObjectConfig {
            damping: 1e9,
            ..ObjectConfig::new(inertia)
        });
        slow.step(10.0, 10.0).unwrap();
        let tau_s = inertia / 1e9;
        let way = 1e-8 * (10.0 - tau_s);
        assert_close!(slow.position(), way, Tol::rel(1e-13));
        assert_close!(slow.velocity(), 1e-8, Tol::rel(1e-14));
    }
    // Friction with 1e8 half swings ahead: the step ends, at rest or not, without a gain of energy.
    let mut long = object(ObjectConfig {
        stiffness: 1e9,
        friction: 1e-6,
        ..ObjectConfig::new(1e-6)
    });
    long.set_state(1e-3, 0.0).unwrap();
    let energy_j = long.energy_j();
    long.step(0.0, 10.0).unwrap();
    assert!(long.energy_j() <= energy_j);
}
