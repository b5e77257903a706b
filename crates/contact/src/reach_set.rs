//! Common properties of a set of reaches, and its division into held-out groups.

use crate::error::ContactError;
use glam::DVec3;
use hwall_hand::{HandError, HandFrame, HandPoint, LabelledReach, NamedPoint};
use std::borrow::Borrow;

/// References to the reaches: training accepts owned reaches and references, so that a fold needs no copies of its frames.
pub(crate) fn references<R: Borrow<LabelledReach>>(reaches: &[R]) -> Vec<&LabelledReach> {
    reaches.iter().map(Borrow::borrow).collect()
}

/// The touching point of all reaches.
///
/// # Errors
/// No reach, an invalid one, or several touching points.
pub(crate) fn touching_point(reaches: &[&LabelledReach]) -> Result<HandPoint, ContactError> {
    reaches.iter().try_for_each(|r| r.validate())?;
    let first = reaches
        .first()
        .ok_or(ContactError::TooFewReaches { got: 0, needed: 1 })?;
    if let Some(other) = reaches.iter().find(|r| r.point != first.point) {
        return Err(HandError::Reach {
            reach: other.name(),
            what: "another touching point than the first reach",
        }
        .into());
    }
    Ok(first.point)
}

/// Mean offset of a point of the hand from every point, over all samples that show both, m.
pub(crate) fn mean_offsets_m(
    reaches: &[&LabelledReach],
    point: HandPoint,
) -> [Option<DVec3>; NamedPoint::COUNT] {
    let offset = |f: &HandFrame, other| Some(f.point(point)? - f.named(other)?);
    NamedPoint::ALL
        .map(|other| mean(reaches, |f| offset(f, other)))
        .map(|offset_m| offset_m.filter(|o| o.is_finite()))
}

/// Mean of a value over the samples that have it.
pub(crate) fn mean(
    reaches: &[&LabelledReach],
    value: impl Fn(&HandFrame) -> Option<DVec3>,
) -> Option<DVec3> {
    let values = reaches.iter().flat_map(|r| &r.frames).filter_map(value);
    let (sum, n) = values.fold((DVec3::ZERO, 0.0), |(s, n), v| (s + v, n + 1.0));
    (n > 0.0).then(|| sum / n)
}

/// With fewer people, reaches are held out instead of people.
const FEWEST_PEOPLE: usize = 3;

/// The held-out group of each reach, as an index. With three people or more a group holds all reaches of its people, in at most `by_person` groups;
/// otherwise every n-th reach, in `by_reach` groups. Reaches without a person count as reaches of one person.
pub(crate) fn held_out_groups(
    reaches: &[&LabelledReach],
    by_person: usize,
    by_reach: usize,
) -> Vec<usize> {
    let mut people: Vec<&Option<String>> = reaches.iter().map(|r| &r.person).collect();
    people.sort();
    people.dedup();
    let named = people.len() >= FEWEST_PEOPLE;
    let groups = if named { by_person } else { by_reach }.min(reaches.len());
    let group = |(i, r): (usize, &&LabelledReach)| match people.binary_search(&&r.person) {
        Ok(person) if named => person % groups,
        _ => i % groups,
    };
    reaches.iter().enumerate().map(group).collect()
}
