//! What does a study show? From a table, one row per trial, to tests of every effect.
//!
//! `cargo run -p hwall-psychophysics --example analyse_study`

use hwall_psychophysics::{
    Adjustment, AnalysisConfig, Columns, MagnitudeAnswer, Normalisation, PsychophysicsError, Study,
    analyse, stevens_fit,
};

fn main() -> Result<(), PsychophysicsError> {
    // Six people judge the roughness of three spacings at two speeds, each on an individual scale.
    let mut table = "person,spacing_mm,speed,rough\n".to_owned();
    for (person, scale) in [
        ("a", 1.0),
        ("b", 10.0),
        ("c", 4.0),
        ("d", 2.0),
        ("e", 7.0),
        ("f", 3.0),
    ] {
        for (i, spacing_mm) in [1.5_f64, 2.0, 3.0].into_iter().enumerate() {
            for (j, speed) in ["slow", "fast"].into_iter().enumerate() {
                let own = 1.0 + 0.1 * (scale * (3 * i + j) as f64).sin();
                let rough = scale * spacing_mm.powf(1.4) * own * (1.0 + 0.05 * j as f64);
                table += &format!("{person},{spacing_mm},{speed},{rough:.3}\n");
            }
        }
    }
    let columns = Columns::new("person", ["spacing_mm", "speed"], "rough");
    let study = Study::from_csv_str(&table, &columns)?;
    let config = AnalysisConfig {
        normalisation: Normalisation::Geometric,
        posthoc: Some(Adjustment::Holm),
        ..AnalysisConfig::default()
    };
    let analysis = analyse(&study, &config)?;
    println!("{}", analysis.to_text());

    // Growth of sensation: Stevens' law through the means of the spacings.
    let means = [1.5, 2.0, 3.0].map(|stimulus| {
        let rows = table
            .lines()
            .skip(1)
            .map(|row| row.split(',').collect::<Vec<_>>());
        let of_it = rows.filter(|row| row[1].parse() == Ok(stimulus));
        let logs: Vec<f64> = of_it
            .filter_map(|row| row[3].parse::<f64>().ok())
            .map(f64::ln)
            .collect();
        let magnitude = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
        MagnitudeAnswer {
            stimulus,
            magnitude,
        }
    });
    let law = stevens_fit(&means, 0.95)?;
    println!("exponent {:.2}, r² {:.3}", law.exponent, law.r2);
    Ok(())
}
