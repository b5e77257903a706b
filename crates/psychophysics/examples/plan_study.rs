//! How many subjects does a study need, and in which order does each of them meet the conditions?
//!
//! `cargo run --release -p hwall-psychophysics --example plan_study`

use hwall_psychophysics::{
    Factor, PowerStudy, PowerTest, PsychophysicsError, Schedule, TrialOrder, power,
};

fn factor(name: &str, levels: &[&str]) -> Factor {
    Factor {
        name: name.to_owned(),
        levels: levels.iter().map(|&level| level.to_owned()).collect(),
    }
}

fn main() -> Result<(), PsychophysicsError> {
    let factors = vec![
        factor("angle", &["0", "45", "90"]),
        factor("speed", &["20", "60"]),
    ];
    println!("subjects  power of each effect");
    for subjects in [6, 10, 16] {
        let study = PowerStudy {
            within: factors.clone(),
            // Roughness grows with the angle, and a little with the speed; the last factor varies fastest.
            means: vec![0.0, 0.2, 0.4, 0.6, 0.8, 1.0],
            subjects,
            between_sd: 1.0,
            level_sd: 0.3,
            within_sd: 0.5,
            test: PowerTest::default(),
            alpha: 0.05,
            studies: 500,
            seed: 1,
        };
        print!("{subjects:8}");
        for effect in power(&study)? {
            print!(
                "  {} {:.2} ({:.2} to {:.2})",
                effect.name, effect.power, effect.ci_low, effect.ci_high
            );
        }
        println!();
    }

    let schedule = Schedule {
        factors,
        subjects: 10,
        rounds: 2,
        order: TrialOrder::BalancedLatinSquare,
        seed: 1,
    };
    let trials = schedule.trials()?;
    println!(
        "\nfirst round of the first three of {} trials' subjects:",
        trials.len()
    );
    for subject in 0..3 {
        let first = trials
            .iter()
            .filter(|t| t.subject == subject && t.round == 0);
        let conditions = first.filter_map(|t| schedule.levels(t.condition));
        let order: Vec<String> = conditions.map(|levels| levels.join("/")).collect();
        println!("{}: {}", subject + 1, order.join(" "));
    }
    Ok(())
}
