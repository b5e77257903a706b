//! Power of a study by simulation, for the example `psychophysics`.

use crate::psychophysics::design::factors;
use anyhow::{Context, bail, ensure};
use hwall_psychophysics::{EffectPower, ErrorModel, Factor, PowerStudy, PowerTest, power};
use hwall_stage::note;
use hwall_stage::numbers::count_within;
use hwall_testkit::MarkdownTable;
use serde::Serialize;
use std::io::{self, Write};
use std::path::PathBuf;

/// The population, and the studies drawn from it.
#[derive(clap::Args)]
pub struct Args {
    /// Numbers of levels, 5x5, or names and levels: orientation=0:45:90,velocity=20:40
    #[arg(long)]
    factors: String,
    /// Contribution of each level of a factor to the mean; may be repeated, one factor each: a=0:0.5:1:1.5:2
    #[arg(long, allow_hyphen_values = true)]
    effect: Vec<String>,
    /// Means of all cells, the last factor fastest: 1,2,... [default: those of --effect]
    #[arg(
        long,
        value_delimiter = ',',
        allow_hyphen_values = true,
        conflicts_with = "effect"
    )]
    means: Vec<f64>,
    /// Subjects, or several numbers of them: 10,15,20
    #[arg(long, value_delimiter = ',', required = true, value_parser = count_within::<2, 10_000>, allow_negative_numbers = true)]
    subjects: Vec<usize>,
    /// Standard deviation between the subjects' means
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    between_sd: f64,
    /// Standard deviation of the subjects' individual deviations at each level of each factor
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    level_sd: f64,
    /// Standard deviation of a value about the expectation for its subject
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    within_sd: f64,
    /// An effect counts as detected below this p
    #[arg(long, default_value_t = 0.05, allow_negative_numbers = true)]
    alpha: f64,
    /// Test against one pooled error instead of each effect's own error
    #[arg(long)]
    pooled: bool,
    /// Apply the Greenhouse-Geisser correction
    #[arg(long, conflicts_with = "pooled")]
    gg: bool,
    /// Analyse aligned ranks
    #[arg(long)]
    art: bool,
    /// Number of simulated studies
    #[arg(long, default_value_t = 10_000, value_parser = count_within::<1, 10_000_000>, allow_negative_numbers = true)]
    studies: usize,
    /// Seed of the studies
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Write the result here, as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

/// Power of all effects for one number of subjects.
#[derive(Serialize)]
struct Row {
    subjects: usize,
    studies: usize,
    effects: Vec<EffectPower>,
}

/// Simulates the studies, counts the detected effects, prints the table.
///
/// # Errors
/// A population that cannot be read, a file that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let within = factors(&args.factors)?;
    if args.effect.is_empty() && args.means.is_empty() {
        note("without --effect or --means all means are equal: these are rates of false alarms");
    }
    let means = match args.means.is_empty() {
        true => added(&within, &args.effect)?,
        false => args.means.clone(),
    };
    let mut rows = Vec::new();
    for &subjects in &args.subjects {
        let study = PowerStudy {
            within: within.clone(),
            means: means.clone(),
            subjects,
            between_sd: args.between_sd,
            level_sd: args.level_sd,
            within_sd: args.within_sd,
            test: PowerTest {
                errors: match args.pooled {
                    true => ErrorModel::Pooled,
                    false => ErrorModel::Strata,
                },
                ranks: args.art,
                greenhouse_geisser: args.gg,
            },
            alpha: args.alpha,
            studies: args.studies,
            seed: args.seed,
        };
        rows.push(Row {
            subjects,
            studies: args.studies,
            effects: power(&study)?,
        });
    }
    if let Some(path) = &args.json {
        let text = serde_json::to_string_pretty(&rows)? + "\n";
        hwall_files::write(path, text).with_context(|| path.display().to_string())?;
    }
    let mut table = MarkdownTable::new(["subjects", "effect", "power", "95% interval"]);
    for Row {
        subjects, effects, ..
    } in &rows
    {
        for effect in effects {
            table.row([
                subjects.to_string(),
                effect.name.clone(),
                format!("{:.4}", effect.power),
                format!("{:.4} to {:.4}", effect.ci_low, effect.ci_high),
            ]);
        }
    }
    write!(io::stdout(), "{table}").context("standard output")
}

/// Means of all cells without interactions.
fn added(within: &[Factor], effects: &[String]) -> anyhow::Result<Vec<f64>> {
    let mut additions: Vec<Vec<f64>> = within.iter().map(|f| vec![0.0; f.levels.len()]).collect();
    for effect in effects {
        let (name, values) = effect
            .split_once('=')
            .with_context(|| format!("--effect: {effect:?} is not factor=value:value"))?;
        let Some(place) = within.iter().position(|f| f.name == name.trim()) else {
            bail!("--effect: no factor {:?} in --factors", name.trim());
        };
        let values = values.split(':').map(|v| {
            let number = v.trim().parse().ok().filter(|v: &f64| v.is_finite());
            number.with_context(|| format!("--effect: {v:?} is not a finite number"))
        });
        let values: Vec<f64> = values.collect::<Result<_, _>>()?;
        let levels = additions[place].len();
        ensure!(
            values.len() == levels,
            "--effect: {} values for the {levels} levels of {:?}",
            values.len(),
            within[place].name
        );
        additions[place] = values;
    }
    let mut means = vec![0.0];
    for addition in &additions {
        let sums = means
            .iter()
            .flat_map(|mean| addition.iter().map(move |a| mean + a));
        means = sums.collect();
    }
    Ok(means)
}
