//! Cost of a step of a moving object, and the difference between many short steps and one long one.
//!
//! `cargo bench -p hwall-haptics --bench object_step`

use hwall_haptics::{Click, Detent, MovingObject, ObjectConfig};
use hwall_testkit::{Sampler, time_batches};

const DT_S: f64 = 1e-3;

fn objects() -> [(&'static str, ObjectConfig, f64); 5] {
    let door = ObjectConfig {
        stiffness: 2.0,
        damping: 4.0,
        range: [0.0, 1.0],
        ..ObjectConfig::new(4.3)
    };
    let latch = Detent {
        position: 0.0,
        half_width: 0.035,
        force: 3.0,
    };
    let button = ObjectConfig {
        stiffness: 400.0,
        damping: 3.0,
        range: [0.0, 0.006],
        click: Some(Click {
            start: 0.001,
            snap: 0.003,
            release: 0.001,
            force: 3.0,
        }),
        ..ObjectConfig::new(0.05)
    };
    [
        ("free mass", ObjectConfig::new(5.0), 10.0),
        ("door with a closer", door.clone(), 10.0),
        (
            "the same, friction and latch",
            ObjectConfig {
                friction: 0.5,
                detents: vec![latch],
                ..door.clone()
            },
            10.0,
        ),
        ("button with a click", button, 6.0),
        (
            "bouncing door",
            ObjectConfig {
                restitution: 0.8,
                ..door
            },
            20.0,
        ),
    ]
}

fn main() {
    println!("{}", hwall_testkit::Machine::detect(1));
    println!("| object | median ns | p99 ns | 1 s in steps of 1 ms, against one step |");
    println!("| --- | --- | --- | --- |");
    for (name, config, force) in objects() {
        let Ok(mut object) = MovingObject::new(config.clone()) else {
            continue;
        };
        // A hand that changes its push or pull every 50 ms.
        let mut sampler = Sampler::new(1);
        let forces: Vec<f64> = (0..1000).map(|_| sampler.uniform(-force, force)).collect();
        let timing = time_batches(1000, 200, |i| {
            let pushed = object.step(forces[(i / 50) % forces.len()], DT_S);
            debug_assert!(pushed.is_ok());
            object.position()
        });
        let drift = drift(&config, force);
        let (median, p99) = (timing.median_ns, timing.p99_ns);
        println!("| {name} | {median:.0} | {p99:.0} | {drift:.1e} |");
    }
}

/// Largest difference of the position.
fn drift(config: &ObjectConfig, force: f64) -> f64 {
    let end = |steps: u32| {
        let mut object = MovingObject::new(config.clone()).ok()?;
        for _ in 0..steps {
            object.step(force, 1.0 / f64::from(steps)).ok()?;
        }
        Some(object.position())
    };
    match (end(1), end(1000)) {
        (Some(one), Some(many)) => (one - many).abs(),
        _ => f64::NAN,
    }
}
