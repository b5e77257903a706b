//! Moving objects with all effects combined, against many tiny steps of a plain integrator.

use hwall_haptics::{Click, Detent, MovingObject, ObjectConfig};
use hwall_testkit::Sampler;

const STEP_S: f64 = 1e-6;

/// Semi-implicit Euler; written from the documented law, independently of the closed form.
struct Brute<'a> {
    config: &'a ObjectConfig,
    x: f64,
    v: f64,
    armed: bool,
}

impl Brute<'_> {
    fn step(&mut self, held: f64) {
        let c = self.config;
        let mut force = held - c.stiffness * (self.x - c.rest) - c.damping * self.v;
        for well in &c.detents {
            let offset = self.x - well.position;
            if offset.abs() < well.half_width {
                force -= well.force * offset / well.half_width;
            }
        }
        if let Some(click) = c.click {
            if self.armed && self.x > click.snap {
                self.armed = false;
            } else if !self.armed && self.x < click.release {
                self.armed = true;
            }
            if self.armed && self.x > click.start {
                force -= click.force * (self.x - click.start) / (click.snap - click.start);
            }
        }
        // Friction reduces the speed, at most to zero.
        let driven = self.v + force / c.inertia * STEP_S;
        let most = c.friction / c.inertia * STEP_S;
        self.v = if driven.abs() <= most {
            0.0
        } else {
            driven - most * driven.signum()
        };
        self.x += self.v * STEP_S;
        let [low, high] = c.range;
        if (self.x >= high && self.v > 0.0) || (self.x <= low && self.v < 0.0) {
            self.x = self.x.clamp(low, high);
            self.v *= -c.restitution;
        }
    }
}

#[test]
fn everything_at_once_agrees_with_a_million_tiny_steps() {
    let mut sampler = Sampler::new(9);
    let mut differences = Vec::new();
    for case in 0..60 {
        let some = |share: bool, value: f64| if share { value } else { 0.0 };
        let start = sampler.uniform(-0.1, 0.1);
        let snap = start + sampler.uniform(0.02, 0.1);
        let detents: Vec<_> = (0..case % 3)
            .map(|_| Detent {
                position: sampler.uniform(-0.3, 0.3),
                half_width: sampler.uniform(0.02, 0.2),
                force: sampler.uniform(1.0, 8.0),
            })
            .collect();
        let config = ObjectConfig {
            detents,
            inertia: sampler.uniform(0.2, 3.0),
            stiffness: some(sampler.bool(), sampler.uniform(1.0, 200.0)),
            rest: sampler.uniform(-0.2, 0.2),
            damping: some(sampler.bool(), sampler.uniform(0.1, 10.0)),
            friction: some(sampler.bool(), sampler.uniform(0.1, 3.0)),
            range: [sampler.uniform(-0.5, -0.1), sampler.uniform(0.1, 0.5)],
            restitution: some(sampler.bool(), sampler.uniform(0.1, 0.8)),
            click: (case % 2 == 0).then(|| Click {
                start,
                snap,
                release: sampler.uniform(start, snap),
                force: sampler.uniform(1.0, 8.0),
            }),
        };
        let mut moving = MovingObject::new(config.clone()).unwrap();
        let mut brute = Brute {
            config: &config,
            x: moving.position(),
            v: 0.0,
            armed: !moving.clicked(),
        };
        for _ in 0..5 {
            let force = sampler.uniform(-10.0, 10.0);
            moving.step(force, 0.2).unwrap();
            for _ in 0..200_000 {
                brute.step(force);
            }
            differences.push((moving.position() - brute.x).abs());
        }
    }
    differences.sort_by(f64::total_cmp);
    let at = |share: f64| differences[(share * (differences.len() - 1) as f64) as usize];
    let (median, q90) = (at(0.5), at(0.9));
    println!("median {median:.1e}, q90 {q90:.1e}, max {:.1e}", at(1.0));
    // Few runs come so close to a crest that the plain integrator falls off on the other side.
    assert!(median < 1e-6 && q90 < 1e-4, "{median:.1e} {q90:.1e}");
}
