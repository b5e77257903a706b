//! Chapter VI: demonstrations, choice of a basis, errors of the predicted contact.

use super::job::Job;
use crate::bip::run;
use crate::bip::scores::{Accuracy, dof_sets};
use crate::bip::setup::{BasisChoice, Mode, Noise, Setup};
use crate::bip::{figures as bip_figures, reaches};
use crate::contact::candidates;
use crate::contact::dissertation::{self, Overrides};
use crate::contact::figures;
use crate::contact::report::Choice;
use crate::report::template;
use hwall_bip::Criterion;
use hwall_contact::LearnedConfig;
use hwall_testkit::{MarkdownTable, cells};

/// The criteria, and who uses them.
const CRITERIA: [(Criterion, &str); 3] = [
    (Criterion::Aic, "AIC (the dissertation's)"),
    (Criterion::Bic, "BIC (the dissertation's)"),
    (Criterion::LeaveOneOut, "leave one out"),
];
/// Observed shares of a motion, per cent.
const SEEN: [usize; 3] = [50, 80, 100];

pub(super) fn section(job: &Job<'_>) -> anyhow::Result<String> {
    let overrides = Overrides {
        seed: job.seed,
        people: None,
        reaches: None,
    };
    let all = candidates::all(LearnedConfig::default());
    let found = dissertation::run(overrides, &all, &Choice::default(), None)?;
    let scores = &found.compared.scores;
    let (path, errors) = job.figure("contact.svg", "Error of the predicted contact over time")?;
    let (train, test) = (found.train.len(), found.test.len());
    let title = format!("Where {test} reaches end, learnt from {train} of other people");
    figures::error_over_time(&path, &title, scores)?;
    let (bases, ends) = bases(job, train, test)?;
    template(include_str!("prediction.md")).fill(&[
        ("train", &train),
        ("test", &test),
        ("errors", &errors),
        ("table", &dissertation::side_by_side(scores)),
        ("bases", &bases),
        ("ends", &ends),
    ])
}

/// The basis that each criterion chooses on synthetic motions, and the errors with it; a figure of the last.
fn bases(job: &Job<'_>, train: usize, test: usize) -> anyhow::Result<(MarkdownTable, String)> {
    let motions = reaches::sets(job.seed, train, test);
    let titles = SEEN.map(|percent| format!("hand, mean error at {percent} %, mm"));
    let first = ["criterion", "basis of the hand", "basis of the board"];
    let mut table = MarkdownTable::new(cells(first, titles));
    let (path, ends) = job.figure("motions.svg", "Error of the predicted end by share seen")?;
    for (criterion, name) in CRITERIA {
        let setup = Setup {
            basis: BasisChoice::Automatic(criterion),
            observed: reaches::OBSERVED.parse()?,
            mode: Mode::Exact,
            noise: Noise::HeldOut,
            phase_variance: 1e-4,
            process_variance: None,
            published: false,
        };
        let trained = setup.train(&motions.train)?;
        let runs = run::run(&setup, &trained, &motions.test)?;
        let sets = dof_sets(&setup, &trained);
        // Widths of the candidates follow from their number.
        let kind = |basis: String| basis.split(" of ").next().unwrap_or_default().to_owned();
        let groups = trained.model.groups().iter();
        let bases = groups.map(|g| kind(g.basis.to_string()));
        let errors = SEEN.map(|percent| {
            let at = Accuracy::at(&runs.tests, &sets[0], percent);
            format!("{:.1}", 1e3 * at.mean)
        });
        table.row(cells([name], bases.chain(errors)));
        bip_figures::errors(&path, &sets, &runs.tests)?;
    }
    Ok((table, ends))
}
