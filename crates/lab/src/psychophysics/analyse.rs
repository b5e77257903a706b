//! The analysis of a study's table, for the example `psychophysics`.

use crate::psychophysics::figures;
use anyhow::{Context, ensure};
use clap::ValueEnum;
use hwall_files::Table;
use hwall_psychophysics::{
    Adjustment, AnalysisConfig, Columns, ErrorModel, Normalisation, PsychophysicsError, Study,
    analyse,
};
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::note;
use hwall_stage::numbers::TableInput;
use std::fs;
use std::io::{self, Read, Write};
use std::path::PathBuf;

/// A column of this name marks valid rows; tables of the example `study` have it.
const VALID: &str = "valid";
/// Value of `--valid` for no validity column.
const NONE: &str = "none";

/// What to analyse and how.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    table: TableInput,
    /// Column of the subjects
    #[arg(long)]
    subject: String,
    /// Columns of the factors: a,b; the last one varies fastest in the tables
    #[arg(long, value_delimiter = ',', required = true)]
    factors: Vec<String>,
    /// Column of the answers; with --wide, their name in the output [default with --wide: answer]
    #[arg(long, required_unless_present = "wide")]
    value: Option<String>,
    /// The factors vary within subjects: the default, stated explicitly
    #[arg(long)]
    within: bool,
    /// Column of a factor that varies between subjects; it may also be in --factors
    #[arg(long)]
    between: Option<String>,
    /// Columns that number repeated trials, which are averaged: a,b
    #[arg(long, value_delimiter = ',')]
    round: Vec<String>,
    /// The table is wide, with one row per subject: the names of answer columns are levels joined by this text, such as 0_20; with one
    /// factor, the factor and a level, such as angle_0, or numbers. The program prints the columns that it uses
    #[arg(long, value_name = "JOINT", conflicts_with = "round")]
    wide: Option<String>,
    /// Column that says whether a row counts, true or false: rows with false are left out and counted; none: all rows count [default:
    /// valid, if there is such a column]
    #[arg(long, conflicts_with = "wide")]
    valid: Option<String>,
    /// Treatment of missing answers
    #[arg(long, value_enum, default_value = "refuse")]
    missing: Gaps,
    /// How the subjects' scales are normalised
    #[arg(long, value_enum, default_value = "none")]
    normalise: Scale,
    /// strata: each effect against its own error; pooled: all against one
    #[arg(long, value_enum, default_value = "strata")]
    errors: Errors,
    /// Aligned rank transform in addition to the plain analysis
    #[arg(long)]
    art: bool,
    /// Compare all pairs of levels, with p adjusted by this method
    #[arg(long, value_enum)]
    posthoc: Option<Adjust>,
    /// Confidence of all intervals
    #[arg(long, default_value_t = 0.95, allow_negative_numbers = true)]
    confidence: f64,
    /// Write every number here, as JSON
    #[arg(long)]
    json: Option<PathBuf>,
    /// Write the report here, as Markdown
    #[arg(long)]
    markdown: Option<PathBuf>,
    /// Folder for figures: means with intervals, and boxes of the subjects' values
    #[arg(long)]
    svg: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Gaps {
    /// The table is refused
    Refuse,
    /// Subjects with a missing answer are left out, and named
    Complete,
}

#[derive(Clone, Copy, ValueEnum)]
enum Scale {
    None,
    Arithmetic,
    Geometric,
}

#[derive(Clone, Copy, ValueEnum)]
enum Errors {
    Strata,
    Pooled,
    Both,
}

#[derive(Clone, Copy, ValueEnum)]
enum Adjust {
    Bonferroni,
    Holm,
}

impl Args {
    fn columns(&self, header: &[String]) -> Columns {
        let within = self.factors.iter().map(|f| f.trim());
        let within = within.filter(|f| self.between.as_deref() != Some(f));
        let value = self.value.as_deref().unwrap_or("answer");
        let mut columns = Columns::new(&self.subject, within, value);
        columns.valid = match self.valid.as_deref() {
            Some(NONE) => None,
            Some(column) => Some(column.to_owned()),
            None => self.own_valid(header),
        };
        columns.between.clone_from(&self.between);
        columns.rounds.clone_from(&self.round);
        match self.missing {
            Gaps::Refuse => columns,
            Gaps::Complete => columns.complete_cases(),
        }
    }

    /// The column `valid`, if the table is long, has one, and it has no other role.
    fn own_valid(&self, header: &[String]) -> Option<String> {
        let named = self.factors.iter().chain(&self.round).chain(&self.between);
        let mut named = named.chain([&self.subject]).chain(&self.value);
        let is_taken = named.any(|name| name.trim().eq_ignore_ascii_case(VALID));
        let mut cells = header.iter();
        let has_one = cells.any(|cell| cell.eq_ignore_ascii_case(VALID));
        (self.wide.is_none() && has_one && !is_taken).then(|| VALID.to_owned())
    }

    /// The error of a table; if its column `valid` was used by default, also how to disable that.
    fn explained(&self, error: PsychophysicsError) -> anyhow::Error {
        let is_own =
            self.valid.is_none() && matches!(error, PsychophysicsError::NeitherValidNorNot { .. });
        let error = anyhow::Error::from(error);
        match is_own {
            true => error.context("the column valid says which rows count, unless --valid none"),
            false => error,
        }
    }

    fn config(&self) -> AnalysisConfig {
        AnalysisConfig {
            normalisation: match self.normalise {
                Scale::None => Normalisation::None,
                Scale::Arithmetic => Normalisation::Arithmetic,
                Scale::Geometric => Normalisation::Geometric,
            },
            errors: match self.errors {
                Errors::Strata => vec![ErrorModel::Strata],
                Errors::Pooled => vec![ErrorModel::Pooled],
                Errors::Both => vec![ErrorModel::Strata, ErrorModel::Pooled],
            },
            art: self.art,
            posthoc: self.posthoc.map(|p| match p {
                Adjust::Bonferroni => Adjustment::Bonferroni,
                Adjust::Holm => Adjustment::Holm,
            }),
            confidence: self.confidence,
        }
    }
}

/// Reads, analyses, prints, and writes the requested files.
///
/// # Errors
/// A table that is not a complete study, a file that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let between = args.between.as_deref();
    let has_within = args.factors.iter().any(|f| Some(f.trim()) != between);
    ensure!(
        has_within || args.svg.is_none(),
        "--svg needs a factor within subjects beside --between"
    );
    FilePlan::default()
        .read("--in", args.table.path())
        .write("--json", args.json.as_deref())
        .write("--markdown", args.markdown.as_deref())
        .write_into("--svg", args.svg.as_deref(), &["means.svg", "boxes.svg"])
        .check()?;
    let (name, mut source) = args.table.open()?;
    let name = || name.clone();
    let mut table = Vec::new();
    source.read_to_end(&mut table).with_context(name)?;
    let header = Table::new(table.as_slice()).map(|table| table.header().to_vec());
    // Errors of the table are reported below.
    let columns = args.columns(&header.unwrap_or_default());
    let study = match &args.wide {
        Some(joint) => {
            let taken = Study::wide_columns(&table, &columns, joint).with_context(name)?;
            note(format_args!("columns of answers: {}", taken.join(", ")));
            Study::from_wide_csv_str(&table, &columns, joint)
        }
        None => Study::read_csv(table.as_slice(), &columns),
    };
    let study = study.map_err(|error| args.explained(error));
    let study = study.with_context(name)?;
    let config = args.config();
    let analysis = analyse(&study, &config).with_context(name)?;
    if let Some(folder) = &args.svg {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let json = args.json.as_ref().zip(Some(analysis.to_json() + "\n"));
    let markdown = args.markdown.as_ref().zip(Some(analysis.to_markdown()));
    for (path, text) in json.into_iter().chain(markdown) {
        hwall_files::write(path, text).with_context(|| path.display().to_string())?;
    }
    if let Some(folder) = &args.svg {
        let scaled = study.normalise(config.normalisation)?;
        figures::means(&folder.join("means.svg"), &scaled, config.confidence)?;
        figures::boxes(&folder.join("boxes.svg"), &scaled)?;
    }
    let mut text = analysis.to_text();
    for size in analysis.effect_sizes(config.confidence)? {
        let [low, high] = size.ci;
        let errors = match size.errors == ErrorModel::Pooled {
            true => "pooled error",
            false => "own error",
        };
        text += &format!(
            "\n{}, {errors}: partial eta squared {:.4} in the sample; partial omega squared {:.4}, {}% interval {low:.4} to {high:.4}",
            size.name,
            size.partial_eta2,
            size.partial_omega2,
            100.0 * config.confidence
        );
    }
    writeln!(io::stdout(), "{text}").context("standard output")
}
