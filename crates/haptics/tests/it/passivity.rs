//! Energy balance, controller, tank and port.

use hwall_haptics::passivity::{
    Causality, DissipationLimit, EnergyObserver, EnergyTank, PassivePort, PassivityController,
    PassivityMethod, PortConfig, PortInput, Sampling,
};
use hwall_testkit::{Sampler, refused};

const FAST: Sampling = Sampling {
    period_s: 1e-3,
    delay_s: 0.0,
};

/// A port at a place, whose controller wants a force or a velocity there.
fn at(position_m: f64, wanted: f64) -> PortInput {
    PortInput {
        position_m,
        hand_force_n: 0.0,
        wanted,
        stored_j: None,
    }
}

/// A closed path through a spring returns what it took; the mean of a linear force is exact.
#[test]
fn a_spring_conserves() {
    let mut observer = EnergyObserver::new();
    let place = |i: i32| 0.02 * (f64::from(i) * 0.01).sin();
    let turns = (std::f64::consts::TAU / 0.01).round() as i32 * 3;
    let mut last = place(0);
    for i in 1..=turns {
        let x = place(i);
        observer.book(0.5 * 900.0 * (x + last), x - last).unwrap();
        let stored = 0.5 * 900.0 * x * x;
        assert!((observer.net_j() - stored).abs() < 1e-12, "{i}");
        last = x;
    }
    assert!(observer.least_j() > -1e-12);
    let turned = observer.absorbed_j() - observer.released_j();
    assert!((turned - observer.net_j()).abs() < 1e-12);
}

/// A damper always absorbs b v², and returns nothing.
#[test]
fn a_damper_dissipates() {
    let mut observer = EnergyObserver::new();
    let mut taken = 0.0;
    for i in 0..1000 {
        let v = (f64::from(i) * 0.02).sin();
        let before = observer.net_j();
        observer.book(7.0 * v, v * 1e-3).unwrap();
        taken += 7.0 * v * v * 1e-3;
        assert!(observer.net_j() >= before);
    }
    assert_eq!(observer.released_j(), 0.0);
    assert!((observer.net_j() - taken).abs() < 1e-12);
}

#[test]
fn bad_numbers_are_named_and_change_nothing() {
    let mut observer = EnergyObserver::new();
    observer.book(1.0, 1.0).unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(observer.book(bad, 1.0).is_err());
        assert!(observer.book(1.0, bad).is_err());
    }
    assert!(observer.book(f64::MAX, f64::MAX).is_err());
    assert_eq!(observer.net_j(), 1.0);

    let mut tank = EnergyTank::new(1.0, 2.0).unwrap();
    assert!(tank.exchange(f64::NAN).is_err());
    assert!(tank.let_go(f64::NAN, 0.5).is_err());
    assert!(tank.let_go(0.0, 1.5).is_err());
    assert!(tank.affordable(-1.0, 0.0, 0.0, 0.0).is_err());
    assert!(tank.affordable(1.0, f64::NAN, 0.0, 0.0).is_err());
    assert_eq!(tank.energy_j(), 1.0);
    assert!(EnergyTank::new(2.0, 1.0).is_err());
    assert!(EnergyTank::new(-1.0, 1.0).is_err());

    let mut port = PassivePort::new(PortConfig::impedance(FAST, 1.0)).unwrap();
    let good = at(0.0, 0.0);
    let before = format!("{port:?}");
    refused!(good, |input| port.step(&input), {
        position_m = f64::NAN, f64::INFINITY;
        hand_force_n = f64::NAN, f64::INFINITY;
        wanted = f64::NAN, f64::INFINITY;
        stored_j = Some(f64::NAN), Some(f64::INFINITY);
    });
    assert_eq!(before, format!("{port:?}"));
    port.step(&good).unwrap();
}

#[test]
fn settings_out_of_range_are_named() {
    refused!(PortConfig::impedance(FAST, 1.0), PassivePort::new, {
        sampling.period_s = 0.0;
        sampling.delay_s = -1e-3;
        sampling.delay_s = 0.1 => "delay_s over period_s";
        mass_kg = f64::NAN;
        position_error_m = -1.0;
        most = f64::INFINITY;
        dissipation.gain = 0.0;
        initial_j = 6.0 => "capacity_j";
        spill_s = 0.0;
    });
}

/// One step of the controller dissipates exactly the shortage, unless a limit applies.
#[test]
fn a_shortage_is_dissipated_within_the_limits() {
    let limit = DissipationLimit {
        gain: 50.0,
        correction: 8.0,
    };
    let controller = PassivityController::new(limit).unwrap();
    let force = controller.correction(-1e-4, 0.2, 1e-3).unwrap();
    assert!((force + 1e-4 / (0.2 * 1e-3)).abs() < 1e-12);
    assert!((-force * 0.2 * 1e-3 - 1e-4).abs() < 1e-15);
    assert_eq!(controller.correction(1.0, 0.2, 1e-3).unwrap(), 0.0);
    assert_eq!(controller.correction(-1.0, 0.0, 1e-3).unwrap(), 0.0);
    assert!((controller.correction(-1.0, -0.1, 1e-3).unwrap() - 5.0).abs() < 1e-12);
    assert!((controller.correction(-1.0, 1.0, 1e-3).unwrap() + 8.0).abs() < 1e-12);
    assert!(controller.correction(f64::NAN, 1.0, 1e-3).is_err());
    assert!(controller.correction(-1.0, 1.0, 0.0).is_err());
}

/// The tank never runs below zero, and debts come first.
#[test]
fn a_tank_is_never_below_zero() {
    let mut sampler = Sampler::new(4);
    for _ in 0..200 {
        let capacity = sampler.uniform(0.1, 2.0);
        let mut tank = EnergyTank::new(0.0, capacity).unwrap();
        let mut level: f64 = 0.0;
        for _ in 0..500 {
            let energy = sampler.uniform(-0.5, 0.5);
            tank.exchange(energy).unwrap();
            level = (level + energy).min(capacity);
            assert!(tank.energy_j() >= 0.0 && tank.energy_j() <= capacity);
            assert!((tank.energy_j() - tank.debt_j() - level).abs() < 1e-12);
            let (a, b) = (sampler.uniform(0.0, 2.0), sampler.uniform(-1.0, 2.0));
            let reserved = sampler.uniform(-0.2, 0.2);
            let size = tank.affordable(3.0, a, b, reserved).unwrap();
            let cost = a * size * size + b * size + reserved;
            // In debt only actions that are sure to gain energy are allowed.
            let within = cost <= level + 1e-12 || cost <= reserved + 1e-12;
            assert!(size == 0.0 || within, "{cost} of {level}");
        }
    }
}

/// A mass in front of an active spring, which pushes back with twice the force on the way out.
fn active_spring(method: PassivityMethod) -> (f64, f64) {
    let config = PortConfig {
        method,
        position_error_m: 0.0,
        ..PortConfig::impedance(FAST, 1.0)
    };
    let mut port = PassivePort::new(config).unwrap();
    let (mut x, mut v, mut out_j, mut most_j) = (0.0, 0.5, 0.0, f64::NEG_INFINITY);
    let mut last_m = 0.0;
    for _ in 0..4000 {
        let stiffness = if x > last_m { 500.0 } else { 1000.0 };
        last_m = x;
        let wanted = if x > 0.0 { -stiffness * x } else { 0.0 };
        let force = port.step(&at(x, wanted)).unwrap().command;
        // A hand throws it back every time it comes.
        if x < -0.05 && v < 0.0 {
            v = 0.5;
        }
        let moved = v * 1e-3 + 0.5 * force * 1e-6;
        out_j += force * moved;
        most_j = f64::max(most_j, out_j);
        x += moved;
        v += force * 1e-3;
    }
    (out_j, most_j)
}

#[test]
fn an_active_spring_gives_nothing_with_a_controller() {
    let (off, _) = active_spring(PassivityMethod::Off);
    assert!(off > 0.3, "{off}");
    let (end, most) = active_spring(PassivityMethod::Controller);
    assert!(end < 0.05 * off && most < 0.2, "{end} {most}");
    for method in [PassivityMethod::Tank, PassivityMethod::Both] {
        let (_, most) = active_spring(method);
        assert!(most <= 1e-12, "{method:?}: {most}");
    }
}

/// A wall held for long, with a quantised sensor, does not yield within the band.
#[test]
fn a_still_wall_keeps_its_account() {
    let config = PortConfig {
        position_error_m: 1e-5,
        still_band: 0.04,
        ..PortConfig::impedance(FAST, 2.0)
    };
    let mut port = PassivePort::new(config).unwrap();
    let mut noise = Sampler::new(1);
    let mut first = None;
    for i in 0..60_000 {
        let depth_m = 0.005 * (1.0 - (-f64::from(i) * 1e-3 / 0.05).exp());
        let position_m = depth_m + noise.uniform(-1e-5, 1e-5);
        let wanted = -2000.0 * position_m.max(0.0);
        let input = PortInput {
            stored_j: Some(0.5 * 2000.0 * position_m * position_m),
            ..at(position_m, wanted)
        };
        let force_n = port.step(&input).unwrap().command;
        if i >= 1000 {
            let first_n: f64 = *first.get_or_insert(force_n);
            assert!((force_n - first_n).abs() < 0.15, "{i}: {force_n}");
        }
    }
}

#[test]
fn a_hand_that_pushes_is_yielded_to_at_once() {
    let sampling = Sampling {
        period_s: 2e-3,
        delay_s: 5e-3,
    };
    let mut port = PassivePort::new(PortConfig::admittance(sampling, 1.0)).unwrap();
    assert_eq!(port.config().causality, Causality::Admittance);
    let mut pushed = |wanted: f64| {
        let input = PortInput {
            hand_force_n: 10.0,
            ..at(0.0, wanted)
        };
        port.step(&input).unwrap().command
    };
    assert_eq!(pushed(0.3), 0.3);
    // Nothing moves against the hand before energy has gone in.
    assert!(pushed(-0.3) > -0.01);
    assert_eq!(pushed(9.0), 1.0);
}

#[test]
fn no_step_allocates() {
    for causality in [Causality::Impedance, Causality::Admittance] {
        for method in PassivityMethod::ALL {
            let sampling = Sampling {
                period_s: 1e-3,
                delay_s: 7.3e-3,
            };
            let config = PortConfig {
                method,
                causality,
                ..PortConfig::impedance(sampling, 1.0)
            };
            let mut port = PassivePort::new(config).unwrap();
            let info = allocation_counter::measure(|| {
                for i in 0..300 {
                    let x = 0.01 * (f64::from(i) * 0.1).sin();
                    let input = PortInput {
                        hand_force_n: 5.0,
                        stored_j: Some(0.1),
                        ..at(x, -1000.0 * x)
                    };
                    assert!(port.step(&input).is_ok());
                }
            });
            assert_eq!(info.count_total, 0, "{causality:?} {method:?}");
        }
    }
}
