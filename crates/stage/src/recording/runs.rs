//! The sessions of a recording, each with its settings as options.

use super::words::{flag_of, numbers, numbers_of, wanted};
use crate::run::stage::SessionSettings;
use anyhow::Context;
use hwall_hand::HandFilterConfig;
use hwall_record::Run;

/// One session of a recording.
///
/// # Errors
/// A filter other than that for simulated hands or the default one (with any value step).
pub fn run_of(number: usize, settings: &SessionSettings<'_>) -> anyhow::Result<Run> {
    let value_step_m = (settings.filter.freeze).map_or(0.0, |freeze| freeze.value_step_m);
    let filter = FILTERS
        .iter()
        .find(|(_, config)| config().with_value_step(value_step_m) == settings.filter);
    let (filter, _) =
        filter.context("a hand filter with settings of its own cannot be recorded")?;
    let options = [
        ("hand_value_step_m", numbers(&[value_step_m])),
        ("hand_filter", (*filter).to_owned()),
        ("sees_head", settings.sees_head.to_string()),
        ("watches_head", settings.watches_head.to_string()),
        ("link_s", numbers(&[settings.link_s])),
        (
            "arm_minus_tracker_s",
            numbers(&[settings.arm_minus_tracker_s]),
        ),
    ];
    Ok(Run {
        number: u32::try_from(number)?,
        options: options.map(|(key, value)| (key.to_owned(), value)).into(),
    })
}

type Filter = (&'static str, fn() -> HandFilterConfig);

const FILTERS: [Filter; 2] = [
    ("simulated", HandFilterConfig::simulated),
    ("usual", HandFilterConfig::default),
];

/// Sets what a run records of a session's settings.
pub(super) fn set_from(run: &Run, settings: &mut SessionSettings<'_>) -> anyhow::Result<()> {
    let name = wanted(run.option("hand_filter"), "hand_filter")?;
    let filter = FILTERS.iter().find(|(known, _)| *known == name);
    let (_, filter) = filter.with_context(|| format!("hand_filter: {name:?} is not known"))?;
    // Older recordings lack this option: the step was unknown.
    let step = run.option("hand_value_step_m").unwrap_or("0");
    let [value_step_m] = numbers_of("hand_value_step_m", step)?;
    settings.filter = filter().with_value_step(value_step_m);
    let sees_head = wanted(run.option("sees_head"), "sees_head")?;
    settings.sees_head = flag_of("sees_head", sees_head)?;
    // Older recordings lack these options: no head was watched, and no link was allowed for.
    let watches_head = run.option("watches_head").unwrap_or("false");
    settings.watches_head = flag_of("watches_head", watches_head)?;
    let link = run.option("link_s").unwrap_or("0");
    [settings.link_s] = numbers_of("link_s", link)?;
    let offset = wanted(run.option("arm_minus_tracker_s"), "arm_minus_tracker_s")?;
    [settings.arm_minus_tracker_s] = numbers_of("arm_minus_tracker_s", offset)?;
    Ok(())
}
