//! Predictions with a scene, in rooms with increasing numbers of surfaces and under degraded conditions.

use crate::report::template;
use crate::rooms::contenders::{SharedTraining, ray_cast};
use crate::rooms::people::{self, Condition, StudyPeople, StudySize};
use crate::rooms::room::{ROOMS, Room};
use crate::rooms::scores::{TouchPredictions, gained_s, summary};
use anyhow::Context;
use hwall_contact::Predictor;
use hwall_contact::score::Moment;
use hwall_testkit::{Column, quantiles, table_of, yes_or_no};
use rayon::prelude::*;

/// People and touches of the report; enough participants to distinguish shares near 100 %.
pub(super) const SIZE: StudySize = StudySize {
    training_people: 12,
    participants: 20,
    touches: 12,
    seed: 0,
};
/// The fusion was designed on people with smaller seeds, which are not used here.
pub(crate) const FIRST_SEED: u64 = 1000;
/// The room for comparing conditions and for the targets.
const MAIN_ROOM: usize = 6;
/// Targets of this project in the main room: the right surface in this share of the touches ...
const TARGET_RIGHT: f64 = 0.99;
/// ... after this share of the time.
const TARGET_SHARE: f64 = 0.7;

/// A room under a condition, and the predictions for each touch.
struct Setting {
    surfaces: usize,
    condition: Condition,
    fused: Vec<TouchPredictions>,
    ray_cast: Vec<TouchPredictions>,
}

impl Setting {
    fn new(surfaces: usize, condition: Condition, size: &StudySize) -> anyhow::Result<Self> {
        let name = || format!("{surfaces} surfaces, {}", condition.name);
        let room = Room::new(surfaces)?;
        let StudyPeople {
            training,
            participants,
        } = people::people(&room, &condition, size).with_context(name)?;
        let training = SharedTraining::new(&training).with_context(name)?;
        let predicted =
            |predictor: &mut dyn Predictor| people::predictions(predictor, &room, &participants);
        Ok(Self {
            fused: predicted(&mut training.fused(&training.config)?)?,
            ray_cast: predicted(&mut ray_cast()?)?,
            surfaces,
            condition,
        })
    }

    fn right(touches: &[TouchPredictions]) -> f64 {
        summary(touches, Moment::Share(TARGET_SHARE)).right
    }

    /// Median gain in lead of the fusion over the ray cast, ms.
    fn gained_ms(&self) -> f64 {
        let [gained_s] = quantiles(gained_s(&self.fused, &self.ray_cast), [0.5]);
        1e3 * gained_s
    }
}

/// The study as Markdown: the main contender compared with the ray cast of the dissertation.
///
/// # Errors
/// People who cannot be generated, an estimator that cannot be trained.
pub fn report(seed: u64) -> anyhow::Result<String> {
    let size = StudySize {
        seed: FIRST_SEED + seed,
        ..SIZE
    };
    let nominal = ROOMS.map(|surfaces| (surfaces, Condition::nominal()));
    let worse = Condition::all().into_iter().skip(1);
    let worse = worse.map(|condition| (MAIN_ROOM, condition));
    let places: Vec<(usize, Condition)> = nominal.into_iter().chain(worse).collect();
    let settings = places.into_par_iter();
    let settings = settings.map(|(surfaces, condition)| Setting::new(surfaces, condition, &size));
    let settings: Vec<Setting> = settings.collect::<anyhow::Result<_>>()?;
    let (nominal, worse) = settings.split_at(ROOMS.len());
    let is_main = |s: &Setting| s.surfaces == MAIN_ROOM;
    let target = format!(">= {:.0} %", 100.0 * TARGET_RIGHT);
    let right = |touches: &[TouchPredictions], decimals: usize| {
        format!("{:.decimals$} %", 100.0 * Setting::right(touches))
    };
    let touches: Column<'_, &Setting> = ("touches", &|s| s.fused.len().to_string());
    let gained: Column<'_, &Setting> = ("lead gained over the ray cast, ms, median", &|s| {
        format!("{:.0}", s.gained_ms())
    });
    let rooms: [Column<'_, &Setting>; 7] = [
        ("surfaces", &|s| s.surfaces.to_string()),
        touches,
        ("target", &|s| match is_main(s) {
            true => target.clone(),
            false => "none set".to_owned(),
        }),
        ("learned, fused", &|s| right(&s.fused, 1)),
        ("met", &|s| match is_main(s) {
            true => yes_or_no(Setting::right(&s.fused) >= TARGET_RIGHT).to_owned(),
            false => String::new(),
        }),
        ("ray cast", &|s| right(&s.ray_cast, 1)),
        gained,
    ];
    let conditions: [Column<'_, &Setting>; 5] = [
        ("condition", &|s| s.condition.name.clone()),
        touches,
        ("learned, fused", &|s| right(&s.fused, 0)),
        ("ray cast", &|s| right(&s.ray_cast, 0)),
        gained,
    ];
    let (learnt, judged) = (size.training_people, size.participants);
    template(include_str!("study.md")).fill(&[
        ("seed", &size.seed),
        ("learnt", &learnt),
        ("touches", &size.touches),
        ("first", &(learnt + 1)),
        ("last", &(learnt + judged)),
        ("first_seed", &FIRST_SEED),
        ("target", &(100.0 * TARGET_SHARE).round()),
        ("rooms", &table_of(nominal, &rooms)),
        ("main", &MAIN_ROOM),
        ("conditions", &table_of(worse, &conditions)),
    ])
}
