//! The order of the trials of a study, for the example `psychophysics`.

use anyhow::{Context, ensure};
use clap::ValueEnum;
use hwall_psychophysics::{Factor, Schedule, TrialOrder};
use hwall_stage::{note, numbers};
use std::io::Write;
use std::path::PathBuf;

/// The largest number of conditions of a study.
const MOST_CONDITIONS: usize = 10_000;

/// The study to be run.
#[derive(clap::Args)]
pub struct Args {
    /// Numbers of levels, 5x5, or names and levels: orientation=0:45:90,velocity=20:40
    #[arg(long)]
    factors: String,
    /// Subjects
    #[arg(long, value_parser = numbers::count_within::<1, 100_000>, allow_negative_numbers = true)]
    subjects: usize,
    /// Repetitions of every condition for each subject
    #[arg(long, default_value_t = 1, value_parser = numbers::count_within::<1, 10_000>, allow_negative_numbers = true)]
    rounds: usize,
    /// random: a new random order in every round; latin: rows of a balanced Latin square
    #[arg(long, value_enum, default_value = "random")]
    order: Order,
    /// Seed of the random orders
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Write the CSV here instead of to standard output
    #[arg(long)]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Order {
    Random,
    Latin,
}

/// Writes the session script.
///
/// # Errors
/// Factors that cannot be read, counts of zero, a file that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let schedule = Schedule {
        factors: factors(&args.factors)?,
        subjects: args.subjects,
        rounds: args.rounds,
        order: match args.order {
            Order::Random => TrialOrder::RandomisedBlocks,
            Order::Latin => TrialOrder::BalancedLatinSquare,
        },
        seed: args.seed,
    };
    let conditions = schedule.conditions();
    let cycle = conditions * (1 + conditions % 2);
    let orders = args.subjects.saturating_mul(args.rounds);
    if matches!(args.order, Order::Latin) && !orders.is_multiple_of(cycle) {
        note(format_args!(
            "{orders} orders of {conditions} conditions: successions are balanced only for a multiple of {cycle}"
        ));
    }
    // Before the file is created: a refused schedule leaves no file behind.
    let mut script = Vec::new();
    schedule.write_csv(&mut script)?;
    let mut out = numbers::output(args.out.as_deref())?;
    out.write_all(&script)
        .context("writing the session script")?;
    out.finish()?;
    note(format_args!(
        "{}, {}, {}",
        numbers::counted(schedule.subjects, "subject", "subjects"),
        numbers::counted(schedule.conditions(), "condition", "conditions"),
        numbers::counted(schedule.rounds, "round", "rounds")
    ));
    Ok(())
}

/// `5x5`, or `name=level:level,name=level:level`.
///
/// # Errors
/// Text that is neither; a factor of one level.
pub fn factors(text: &str) -> anyhow::Result<Vec<Factor>> {
    let factors: Vec<Factor> = if text.contains('=') {
        let one = |part: &str| -> anyhow::Result<Factor> {
            let (name, levels) = part
                .split_once('=')
                .with_context(|| format!("--factors: {part:?} is not name=level:level"))?;
            Ok(Factor::new(name.trim(), levels.split(':').map(str::trim)))
        };
        text.split(',').map(one).collect::<Result<_, _>>()?
    } else {
        let one = |(count, name): (&str, char)| -> anyhow::Result<Factor> {
            let levels: u16 = count.trim().parse().with_context(|| {
                format!("--factors {text}: {count:?} is not a number of levels")
            })?;
            ensure!(
                levels >= 2,
                "--factors {text}: a factor of {count} levels, it needs two or more"
            );
            Ok(Factor::new(name, (1..=levels).map(|l| l.to_string())))
        };
        let counts = text.split(['x', 'X', '×']).zip('a'..='z');
        counts.map(one).collect::<Result<_, _>>()?
    };
    for (place, factor) in factors.iter().enumerate() {
        let several = factor.levels.len() > 1 && factor.levels.iter().all(|l| !l.is_empty());
        ensure!(
            several,
            "--factors: {:?} needs two levels or more",
            factor.name
        );
        let twice = factors[..place].iter().any(|f| f.name == factor.name);
        ensure!(!twice, "--factors: {:?} stands twice", factor.name);
        let mut levels = factor.levels.clone();
        levels.sort();
        levels.dedup();
        ensure!(
            levels.len() == factor.levels.len(),
            "--factors: a level of {:?} stands twice",
            factor.name
        );
    }
    let conditions = factors.iter().map(|f| f.levels.len());
    let conditions = conditions.fold(1, usize::saturating_mul);
    ensure!(
        conditions <= MOST_CONDITIONS,
        "--factors: {conditions} conditions, wanted: at most {MOST_CONDITIONS}"
    );
    Ok(factors)
}

#[cfg(test)]
mod tests {
    use super::factors;

    #[test]
    fn factors_are_read_in_both_forms() {
        let plain = factors("5x3").expect("two factors");
        assert_eq!((plain[0].levels.len(), plain[1].name.as_str()), (5, "b"));
        let named = factors("speed=20:40, angle=0:45:90").expect("two factors");
        let angle = (named[1].name.as_str(), named[1].levels.len());
        assert_eq!(angle, ("angle", 3));
        // The first of them is empty.
        for wrong in " 5x 1x2 a=1 a=1:1 a=1:2,a=3:4 five a=1:".split(' ') {
            assert!(factors(wrong).is_err(), "{wrong}");
        }
    }
}
