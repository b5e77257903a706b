//! No step of a moving object generates energy, and the division of time into steps does not matter.

use hwall_haptics::{Click, Detent, MovingObject, ObjectConfig};
use hwall_testkit::{Sampler, Tol, assert_close};
use proptest::prelude::*;

fn object(config: ObjectConfig) -> MovingObject {
    MovingObject::new(config).unwrap()
}

/// Any valid configuration, from feathers to safes.
fn random_config(sampler: &mut Sampler) -> ObjectConfig {
    let power = |sampler: &mut Sampler, low, high| 10_f64.powf(sampler.uniform(low, high));
    let maybe = |sampler: &mut Sampler, low, high| match sampler.bool() {
        true => power(sampler, low, high),
        false => 0.0,
    };
    let start = sampler.uniform(-0.5, 0.5);
    let width = power(sampler, -3.0, -0.5);
    let count = sampler.index(4);
    let detents: Vec<_> = (0..count)
        .map(|_| Detent {
            position: sampler.uniform(-1.0, 1.0),
            half_width: power(sampler, -3.0, 0.0),
            force: power(sampler, -1.0, 2.0),
        })
        .collect();
    ObjectConfig {
        inertia: power(sampler, -2.0, 1.5),
        detents,
        stiffness: maybe(sampler, -2.0, 4.0),
        rest: sampler.uniform(-1.0, 1.0),
        damping: maybe(sampler, -2.0, 2.5),
        friction: maybe(sampler, -2.0, 1.5),
        range: match sampler.index(4) {
            0 => [f64::NEG_INFINITY, f64::INFINITY],
            1 => [0.0, f64::INFINITY],
            _ => [sampler.uniform(-1.0, 0.0), sampler.uniform(0.0, 1.0)],
        },
        restitution: match sampler.bool() {
            true => sampler.uniform(0.0, 0.95),
            false => 0.0,
        },
        click: sampler.bool().then(|| Click {
            start,
            snap: start + width,
            release: start + width * [0.0, 1.0, sampler.uniform(0.0, 1.0)][sampler.index(3)],
            force: power(sampler, -1.0, 1.5),
        }),
    }
}

/// Tolerance for rounding: some units in the last place of all summands.
fn slack_j(moving: &MovingObject, before_j: f64, force: f64, way: f64) -> f64 {
    let config = moving.config();
    let wells: f64 = config.detents.iter().map(|d| d.force).sum();
    let forces = force.abs() + config.friction + wells + config.click.map_or(0.0, |c| c.force);
    let extent = moving.position().abs() + way.abs() + config.rest.abs() + 1.0;
    1e-13 * (before_j + moving.energy_j() + forces * extent + config.stiffness * extent * extent)
}

#[test]
fn a_million_random_steps_make_no_energy() {
    let mut sampler = Sampler::new(2);
    let mut worst = f64::NEG_INFINITY;
    for _ in 0..25_000 {
        let config = random_config(&mut sampler);
        let mut moving = object(config.clone());
        for _ in 0..40 {
            let force = sampler.uniform(-60.0, 60.0) * f64::from(u8::from(sampler.bool()));
            let dt_s = 10_f64.powf(sampler.uniform(-6.0, 1.0));
            let (x, before_j) = (moving.position(), moving.energy_j());
            moving.step(force, dt_s).unwrap();
            let way = moving.position() - x;
            let gain_j = moving.energy_j() - before_j - force * way;
            let allowed_j = slack_j(&moving, before_j, force, way);
            assert!(
                gain_j <= allowed_j,
                "{gain_j} J in {dt_s} s under {force}: {config:?}"
            );
            worst = worst.max(gain_j / allowed_j);
            let [low, high] = config.range;
            assert!((low..=high).contains(&moving.position()), "{config:?}");
        }
    }
    println!("largest gain: {worst:.3} of what rounding explains");
}

#[test]
fn without_losses_the_energy_is_the_work() {
    let mut sampler = Sampler::new(3);
    for _ in 0..2000 {
        let mut config = random_config(&mut sampler);
        (config.damping, config.friction, config.restitution) = (0.0, 0.0, 1.0);
        if let Some(click) = &mut config.click {
            click.release = click.snap;
        }
        let mut moving = object(config.clone());
        for _ in 0..10 {
            let force = sampler.uniform(-60.0, 60.0);
            let (x, before_j) = (moving.position(), moving.energy_j());
            moving.step(force, sampler.uniform(1e-6, 0.05)).unwrap();
            let way = moving.position() - x;
            let gain_j = moving.energy_j() - before_j - force * way;
            // A rebound below 1e-12 is dropped.
            let allowed_j = 100.0 * slack_j(&moving, before_j, force, way) + 1e-10;
            assert!(gain_j.abs() <= allowed_j, "{gain_j} J: {config:?}");
        }
    }
}

#[test]
fn a_step_is_the_sum_of_its_parts() {
    let mut sampler = Sampler::new(4);
    let mut differences = Vec::new();
    for _ in 0..20_000 {
        let config = random_config(&mut sampler);
        let mut whole = object(config.clone());
        let [low, high] = config.range;
        let at = sampler.uniform(-1.0, 1.0).clamp(low, high);
        whole.set_state(at, sampler.uniform(-2.0, 2.0)).unwrap();
        let mut parts = whole.clone();
        let force = sampler.uniform(-60.0, 60.0);
        let dt_s = 10_f64.powf(sampler.uniform(-6.0, 0.0));
        let share = sampler.uniform(0.0, 1.0);
        whole.step(force, dt_s).unwrap();
        parts.step(force, share * dt_s).unwrap();
        parts.step(force, dt_s - share * dt_s).unwrap();
        let extent = 1.0 + whole.position().abs();
        differences.push((whole.position() - parts.position()).abs() / extent);
    }
    differences.sort_by(f64::total_cmp);
    let at = |share: f64| differences[(share * (differences.len() - 1) as f64) as usize];
    let (q999, most) = (at(0.999), at(1.0));
    println!("q999 {q999:.1e}, at most {most:.1e}");
    assert!(q999 < 1e-12, "{q999:.1e}");
}

proptest! {
    /// Without edges to fall off on either side, every division agrees.
    #[test]
    fn smooth_objects_do_not_care_how_time_is_cut(
        inertia in 0.01..30.0_f64,
        stiffness in prop_oneof![Just(0.0), 0.01..1e4_f64],
        damping in prop_oneof![Just(0.0), 0.01..300.0_f64],
        friction in prop_oneof![Just(0.0), 0.01..30.0_f64],
        start in (-1.0..1.0_f64, -2.0..2.0_f64),
        force in -60.0..60.0_f64,
        (dt_s, share) in (1e-6..1.0_f64, 0.0..1.0_f64),
    ) {
        // If a swing just reaches a stop, rounding enters the time as its square root.
        for (range, rounding) in [([-1e5, 1e5], 1e-12), ([-1.0, 1.0], 1e-7)] {
            let mut whole = object(ObjectConfig {
                stiffness, damping, friction, range, ..ObjectConfig::new(inertia)
            });
            whole.set_state(start.0, start.1).unwrap();
            let mut parts = whole.clone();
            whole.step(force, dt_s).unwrap();
            parts.step(force, share * dt_s).unwrap();
            parts.step(force, dt_s - share * dt_s).unwrap();
            let speeds = 1.0 + (stiffness / inertia).sqrt();
            let off = (whole.position() - parts.position()).abs();
            let size = 1.0 + whole.position().abs();
            // The phase error of a fast oscillation grows with its size.
            prop_assert!(off < (rounding + 1e-14 * speeds) * size, "{off:e} {range:?}");
            let off = (whole.velocity() - parts.velocity()).abs();
            prop_assert!(off < 1e-7 * speeds * size.max(whole.velocity().abs()), "{off:e} {range:?}");
        }
    }
}

const LATCH: Detent = Detent {
    position: 0.0,
    half_width: 0.05,
    force: 8.0,
};

#[test]
fn a_latch_lets_go_when_its_energy_is_paid() {
    let config = ObjectConfig {
        detents: vec![LATCH],
        range: [0.0, 1.5],
        ..ObjectConfig::new(4.0)
    };
    // Slowly, with damping that dissipates all speed: half the force does not open it, slightly more than the full force does.
    let slow = ObjectConfig {
        damping: 500.0,
        ..config.clone()
    };
    let mut door = object(slow.clone());
    door.step(0.5 * LATCH.force, 200.0).unwrap();
    assert_close!(door.position(), 0.5 * LATCH.half_width, Tol::abs(1e-12));
    door.step(0.999 * LATCH.force, 200.0).unwrap();
    assert!(door.position() < LATCH.half_width);
    // Released: it returns.
    door.step(0.0, 200.0).unwrap();
    assert!(door.position().abs() < 1e-12);
    door.step(1.001 * LATCH.force, 200.0).unwrap();
    assert!(door.position() > LATCH.half_width);

    // By a swing: the potential is half of force times half width.
    let depth_j = 0.5 * LATCH.force * LATCH.half_width;
    let needed = (2.0 * depth_j / 4.0_f64).sqrt();
    for (share, opens) in [(0.999_999, false), (1.000_001, true)] {
        let mut door = object(config.clone());
        door.set_state(0.0, share * needed).unwrap();
        let energy_j = door.energy_j();
        door.step(0.0, 2.0).unwrap();
        assert_eq!(door.position() > LATCH.half_width, opens, "{share}");
        if opens {
            let left = needed * (share * share - 1.0_f64).sqrt();
            assert_close!(door.velocity(), left, Tol::rel(1e-9));
            assert_close!(door.energy_j(), energy_j, Tol::rel(1e-14));
        }
    }

    // A latch within friction holds the door wherever it is left.
    let mut stuck = object(ObjectConfig {
        friction: 9.0,
        ..config
    });
    stuck.set_state(0.03, 0.0).unwrap();
    stuck.step(0.0, 5.0).unwrap();
    assert_eq!(stuck.position(), 0.03);
}

#[test]
fn on_the_crest_between_two_wells_a_step_ends() {
    let well = |position| Detent { position, ..LATCH };
    let mut moving = object(ObjectConfig {
        detents: vec![well(-0.05), well(0.05)],
        ..ObjectConfig::new(1.0)
    });
    moving.set_state(0.0, 0.0).unwrap();
    moving.step(0.0, 10.0).unwrap();
    // Down one side and up again, without loss.
    assert!(moving.position() <= 0.0);
    let crest_j = LATCH.force * LATCH.half_width;
    assert_close!(moving.energy_j(), crest_j, Tol::rel(1e-14));
}

fn button(release: f64) -> (ObjectConfig, Click) {
    let click = Click {
        start: 0.001,
        snap: 0.003,
        release,
        force: 4.0,
    };
    let config = ObjectConfig {
        stiffness: 500.0,
        damping: 2.0,
        range: [0.0, 0.006],
        click: Some(click),
        ..ObjectConfig::new(0.02)
    };
    (config, click)
}

#[test]
fn a_click_costs_what_it_says() {
    for release in [0.001, 0.002, 0.003] {
        let (config, click) = button(release);
        let lossless = ObjectConfig {
            damping: 0.0,
            range: [-1.0, 1.0],
            ..config
        };
        let mut moving = object(lossless);
        // Above the energy of spring and click at the snap.
        moving.set_state(0.0, 0.9).unwrap();
        let first_j = moving.energy_j();
        let (mut clicks, mut was) = (0, false);
        for _ in 0..200 {
            moving.step(0.0, 1e-4).unwrap();
            clicks += u32::from(moving.clicked() && !was);
            was = moving.clicked();
        }
        let pressed = |at: f64| (at - click.start).powi(2) / (2.0 * (click.snap - click.start));
        let lost_j = click.force * (pressed(click.snap) - pressed(release));
        // Whole swings: 20 ms are most of one swing.
        assert_eq!(clicks, 1);
        assert_close!(moving.energy_j(), first_j - lost_j, Tol::rel(1e-13));
    }
}

#[test]
fn a_click_is_felt_on_the_way_in_and_armed_again_on_the_way_out() {
    let (config, click) = button(0.001);
    // So slow that nothing overshoots.
    let mut moving = object(ObjectConfig {
        damping: 40.0,
        ..config
    });
    // The holding force: rises to the snap, drops there.
    let before = 500.0 * 0.0029 + click.force * 0.95;
    moving.step(before, 10.0).unwrap();
    assert_close!(moving.position(), 0.0029, Tol::abs(1e-12));
    assert!(!moving.clicked());
    let more = 500.0 * 0.003 + click.force * 1.001;
    moving.step(more, 10.0).unwrap();
    assert_eq!(moving.position(), 0.006);
    assert!(moving.clicked());
    // On the way back only the spring acts.
    moving.step(500.0 * 0.002, 10.0).unwrap();
    assert_close!(moving.position(), 0.002, Tol::abs(1e-12));
    assert!(moving.clicked());
    moving.step(0.0, 10.0).unwrap();
    assert!(moving.position().abs() < 1e-12 && !moving.clicked());
    // Placed below its snap it is armed; above, not.
    moving.set_state(0.002, 0.0).unwrap();
    assert!(!moving.clicked());
    moving.set_state(0.004, 0.0).unwrap();
    assert!(moving.clicked());
}

#[test]
fn a_step_does_not_allocate() {
    let mut sampler = Sampler::new(5);
    for _ in 0..200 {
        let mut moving = object(random_config(&mut sampler));
        let force = sampler.uniform(-60.0, 60.0);
        let info = allocation_counter::measure(|| {
            for _ in 0..50 {
                moving.step(force, 1e-3).unwrap();
            }
            moving.set_state(moving.position(), 0.0).unwrap();
            assert!(moving.energy_j() >= 0.0 && moving.acceleration(force).is_finite());
        });
        assert_eq!(info.count_total, 0);
    }
}
