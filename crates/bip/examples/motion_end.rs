//! Where will a motion end, and how certain is that? Learned from demonstrations, predicted during the motion.
//!
//! `cargo run -p hwall-bip --example motion_end`

use hwall_bip::{
    Basis, BipError, Demonstration, Filter, FilterConfig, Group, Observation, TrainingConfig,
    Tuned, TuningConfig, tune,
};

/// A reach along an arc: distance and height of a hand at 50 Hz, m. `person` varies the style.
fn reach(depth_m: f64, duration_s: f64, person: f64) -> Result<Demonstration, BipError> {
    let samples = (50.0 * duration_s) as usize;
    let mut values = Vec::new();
    for k in 0..samples {
        let t = k as f64 / (samples - 1) as f64;
        let gone = t.powi(3) * (10.0 - 15.0 * t + 6.0 * t * t); // minimum jerk
        let sway_m = 0.004 * (3.0 * t + 5.0 * person).sin();
        let arch = 0.12 + 0.05 * (7.0 * person).sin();
        values.extend([depth_m * gone + sway_m, arch * gone * (1.6 - gone) + sway_m]);
    }
    Demonstration::from_samples(0.02, 2, values)
}

fn main() -> Result<(), BipError> {
    let known = (0..16)
        .map(|i| {
            let person = f64::from(i);
            reach(
                0.35 + 0.02 * person,
                0.9 + 0.05 * (3.0 * person).sin(),
                person,
            )
        })
        .collect::<Result<Vec<_>, _>>()?;
    let groups = vec![Group::observed("hand", 2, Basis::Legendre { count: 6 })];
    let training = TrainingConfig::new(groups);
    // The noise is chosen on held-out demonstrations, so that intervals have their stated coverage.
    let Tuned { model, trials } = tune(&known, &training, &TuningConfig::new(&training))?;
    println!(
        "{} demonstrations, {} settings tried",
        known.len(),
        trials.len()
    );

    let new = reach(0.53, 1.0, 2.5)?;
    let mut filter = Filter::new(&model, &FilterConfig::default())?;
    println!("seen   end (way, height), m     +- 90 %   left, s");
    for k in 0..new.len() {
        filter.predict(0.02)?;
        filter.observe(&Observation::new(&[0, 1], new.sample(k)))?;
        if k % 10 == 9 {
            let (mut mean_m, mut variance_m2) = ([0.0; 2], [0.0; 2]);
            filter.predict_at(1.0, &[0, 1], &mut mean_m, &mut variance_m2)?;
            println!(
                "{:3.0} %  {:.3} {:.3}   {:.3}   {:.2}",
                100.0 * (k + 1) as f64 / new.len() as f64,
                mean_m[0],
                mean_m[1],
                1.645 * variance_m2[0].sqrt(),
                filter.time_to_end().map_or(f64::NAN, |left| left.mean)
            );
        }
    }
    println!("truth  {:.3?}", new.sample(new.len() - 1));
    Ok(())
}
