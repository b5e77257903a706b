//! Time of one prediction with one observation of 18 of 25 degrees of freedom, 47 demonstrations.

use hwall_bip::{
    Basis, Demonstration, Filter, FilterConfig, Group, Model, Observation, TrainingConfig,
};
use hwall_testkit::{Machine, Sampler, format_ns, time_each};

const SEED: u64 = 47;
const DEMONSTRATIONS: usize = 47;
const OBSERVED: usize = 18;
const DOFS: usize = 25;

/// Smooth random motions of about 100 samples with noise of 1.5e-3.
fn demonstrations() -> Vec<Demonstration> {
    let mut sampler = Sampler::new(SEED);
    (0..DEMONSTRATIONS)
        .map(|_| {
            let samples = 60 + sampler.index(80);
            let shape: Vec<[f64; 4]> = (0..DOFS)
                .map(|_| [0; 4].map(|_| sampler.uniform(-0.5, 0.5)))
                .collect();
            let mut values = Vec::with_capacity(samples * DOFS);
            for k in 0..samples {
                let t = k as f64 / (samples - 1) as f64;
                for [a, b, c, d] in &shape {
                    let smooth = a + b * t + c * t * t + d * (5.0 * t).sin();
                    values.push(smooth + 1.5e-3 * sampler.normal());
                }
            }
            Demonstration::from_samples(1.0, DOFS, values).expect("finite")
        })
        .collect()
}

fn main() {
    println!("{}", Machine::detect(SEED));
    println!("| basis | state | fastest | median | p99 |\n| --- | --- | --- | --- | --- |");
    let demonstrations = demonstrations();
    let observed: Vec<usize> = (0..OBSERVED).collect();
    for count in [4, 6, 8, 12, 18] {
        let basis = Basis::Legendre { count };
        let groups = vec![
            Group::observed("hand", OBSERVED, basis),
            Group::controlled("arm", DOFS - OBSERVED, basis),
        ];
        let model = Model::train(&demonstrations, &TrainingConfig::new(groups)).expect("a model");
        let start = Filter::new(&model, &FilterConfig::default()).expect("a filter");
        let motion = &demonstrations[0];
        let mut filter = start.clone();
        let timing = time_each(50_000, |i| {
            let k = i % motion.len();
            if k == 0 {
                filter.clone_from(&start);
            }
            filter.predict(1.0).expect("a step");
            filter
                .observe(&Observation::new(&observed, &motion.sample(k)[..OBSERVED]))
                .expect("an update")
        });
        println!(
            "| Legendre, {count} functions | {} | {} | {} | {} |",
            2 + model.rank(),
            format_ns(timing.min_ns),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns)
        );
    }
}
