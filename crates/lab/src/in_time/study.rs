//! The runs of the study.

use anyhow::Context;
use hwall::PolicyConfig;
use hwall::haptics::ProximityConfig;
use hwall_stage::built_in_room::BuiltInRoom;
use hwall_stage::numbers::count_within;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::predictors::{PREDICTORS, PredictorKind, Predictors, TrainingPeople};
use hwall_stage::person::responses;
use hwall_stage::report::summary::Summary;
use hwall_stage::run::people;
use hwall_stage::run::stage::Stage;

/// Settings of the study.
#[derive(Debug, Clone, clap::Args)]
pub struct Request {
    /// Kinds of people [default: all]
    #[arg(long, value_enum, num_args = 1..)]
    pub person: Vec<PersonKind>,
    /// Touches of each kind, a dozen for each person
    #[arg(long, default_value_t = 1200, value_parser = count_within::<1, 100_000>, allow_negative_numbers = true)]
    pub touches: usize,
    /// Seed of the people and the sensors' noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
    /// Who leads the board [default: fused]
    #[arg(long, value_enum)]
    pub predictor: Option<PredictorKind>,
    /// The board presents no roughness
    #[arg(long)]
    pub plain: bool,
    /// What is varied.
    #[arg(skip)]
    pub settings: Settings,
}

/// Settings of the product that the study may vary.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settings {
    /// When the board is sent.
    pub policy: PolicyConfig,
    /// How fast the board may move near the hand.
    pub proximity: ProximityConfig,
}

/// Results for one kind of people.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The kind.
    pub kind: PersonKind,
    /// Summary of their touches.
    pub summary: Summary,
    /// Leads of the predictors for each touch; `None` if wrong.
    pub leads_s: Vec<[Option<f64>; PREDICTORS]>,
}

/// The whole study.
#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// One for each kind.
    pub rows: Vec<Row>,
    /// Description of the training.
    pub learnt: String,
}

/// Control period, s.
const PERIOD_S: f64 = 1e-3;

/// Runs the built-in room with an iiwa 7 for every kind; `progress` receives the kind and the share of its touches done.
///
/// All kinds use the same seeds.
///
/// # Errors
/// As for the main job.
pub fn run(request: &Request, progress: impl FnMut(PersonKind, f64)) -> anyhow::Result<Results> {
    let mut results = run_each(request, &[request.settings], progress)?;
    results.pop().context("one setting gives one result")
}

/// The same people with each of several settings. Predictor and maps are created once.
///
/// # Errors
/// As for [`run`].
pub fn run_each(
    request: &Request,
    settings: &[Settings],
    mut progress: impl FnMut(PersonKind, f64),
) -> anyhow::Result<Vec<Results>> {
    let room = BuiltInRoom::new()?;
    let people_like = TrainingPeople::default();
    let (predictors, learnt) =
        Predictors::train(&room.scene, &room.arm, &people_like, request.predictor)?;
    let plain = room.people(PersonKind::Plain, 1, request.seed)?;
    let walls = room.walls(&plain, !request.plain)?;
    let scenery = room.scenery(&walls, &people_like, !request.plain);
    let (predictors, also) = responses::taught(predictors, &scenery)?;
    let learnt: Vec<String> = [learnt].into_iter().chain(also).collect();
    let mut row = |kind: &PersonKind, settings: &Settings| -> anyhow::Result<Row> {
        let stage = Stage {
            policy: settings.policy,
            proximity: settings.proximity,
            ..Stage::of(&scenery, &predictors, PERIOD_S)
        };
        let (touches, seed) = (request.touches, request.seed);
        let cast = room.people(*kind, touches, seed)?;
        let runs = people::run(&stage, &cast, |share| progress(*kind, share))?;
        let leads = runs.iter().flat_map(|run| &run.touches);
        let leads = leads.map(|touch| touch.leads_s);
        Ok(Row {
            kind: *kind,
            summary: Summary::new(&runs),
            leads_s: leads.collect(),
        })
    };
    let kinds = match &request.person[..] {
        [] => &PersonKind::ALL,
        chosen => chosen,
    };
    let learnt = learnt.join("; ");
    let results = settings.iter().map(|settings| {
        let rows = kinds.iter().map(|kind| row(kind, settings));
        Ok(Results {
            rows: rows.collect::<anyhow::Result<_>>()?,
            learnt: learnt.clone(),
        })
    });
    results.collect()
}
