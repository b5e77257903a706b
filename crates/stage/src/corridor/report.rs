//! The four walks as a table and as JSON.

use super::hall::Hall;
use super::run::Walked;
use super::touches::CorridorTouch;
use super::visits::Kind;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Was the board in place?
pub(super) const fn in_place(touch: &CorridorTouch) -> bool {
    touch.lead_s.is_some()
}

/// Share of the touches of a selection that have a property, %; empty without any.
pub(super) fn share(
    touches: &[CorridorTouch],
    of: impl Fn(&CorridorTouch) -> bool,
    has: impl Fn(&CorridorTouch) -> bool,
) -> String {
    let all = touches.iter().filter(|touch| of(touch));
    let (having, count) = all.fold((0, 0), |(having, count), touch| {
        (having + usize::from(has(touch)), count + 1)
    });
    match count {
        0 => String::new(),
        _ => format!("{:.1}", 100.0 * having as f64 / count as f64),
    }
}

/// A distance, m; empty if there was none.
pub(super) fn metres(m: f64) -> String {
    match m.is_finite() {
        true => format!("{m:.2}"),
        false => String::new(),
    }
}

/// Misses because the base stood elsewhere, and those of the arm.
pub(super) fn missed(walk: &Walked) -> [usize; 2] {
    let missed = walk.touches.iter().filter(|touch| touch.lead_s.is_none());
    let (by_arm, elsewhere): (Vec<_>, Vec<_>) = missed.partition(|touch| touch.served);
    [elsewhere.len(), by_arm.len()]
}

/// The longest inversion of a map, s.
fn inverted_s(hall: &Hall) -> f64 {
    let inverted = hall.rooms.iter().map(|room| room.inverted_s);
    inverted.fold(0.0, f64::max)
}

/// A Markdown table.
pub(super) fn table(walks: &[Walked]) -> String {
    let mut text = "| base | touches | in place, % | first of a visit, % | later ones, % | walls, % | shelves, % | doors, % | missed: base elsewhere | missed: arm | base's way, m | closest to the person while moving, m | asked for there, m | least margin, m | steps below the distance | steps in motion while touched | time, s | before doors, s | least margin to a hand, m |\n".to_owned();
    text += &"| --- ".repeat(19);
    text += "|\n";
    for walk in walks {
        let (touches, base) = (&walk.touches, &walk.base);
        let [elsewhere, by_arm] = missed(walk);
        let of_kind = |kind| share(touches, |touch| touch.kind == kind, in_place);
        let [walls, shelves, doors] = Kind::ALL.map(of_kind);
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {walls} | {shelves} | {doors} | {elsewhere} | {by_arm} | {:.1} | {} | {} | {} | {} | {} | {:.0} | {:.0} | {} |",
            walk.kind.name(),
            touches.len(),
            share(touches, |_| true, in_place),
            share(touches, |touch| touch.number == 0, in_place),
            share(touches, |touch| touch.number > 0, in_place),
            base.way_m,
            metres(base.closest_m),
            metres(base.asked_m),
            metres(base.margin_m),
            base.too_near,
            base.moved_touched,
            walk.duration_s,
            walk.waited_s,
            metres(base.hand_margin_m),
        );
    }
    text
}

/// Computing time of the inverse maps; not in the table, which must be the same for the same seed.
pub(super) fn inverted(hall: &Hall) -> String {
    let (cells, bases) = hall.rooms.first().map_or((0, 0), |room| {
        (room.inversion.cells(), room.inversion.bases().len())
    });
    let most_s = inverted_s(hall);
    format!(
        "inversion of the maps: {cells} cells and {bases} base poses a room, {most_s:.3} s at most"
    )
}

/// All results, for other programs; what is not finite is `null`.
pub(super) fn json(hall: &Hall, walks: &[Walked]) -> anyhow::Result<String> {
    let touch = |touch: &CorridorTouch| {
        json!({
            "kind": touch.kind.name(),
            "room": touch.room,
            "visit": touch.visit,
            "number": touch.number,
            "point_m": touch.point_m.to_array(),
            "contact_s": touch.contact_s,
            "in_place": touch.lead_s.is_some(),
            "lead_s": touch.lead_s,
            "served": touch.served,
            "cause": touch.cause.name(),
            "possible": touch.possible.map(|possible| possible.alone),
            "possible_beside_person": touch.possible.map(|possible| possible.beside_person),
        })
    };
    let walk = |walk: &Walked| {
        let base = &walk.base;
        let in_place = walk.touches.iter().filter(|touch| touch.lead_s.is_some());
        json!({
            "base": walk.kind.name(),
            "summary": {
                "touches": walk.touches.len(),
                "in_place": in_place.count(),
                "missed_base_elsewhere": missed(walk)[0],
                "base_way_m": base.way_m,
                "base_moves_s": base.moves_s,
                "closest_moving_m": base.closest_m,
                "asked_there_m": base.asked_m,
                "closest_m": base.closest_standing_m,
                "closest_hand_moving_m": base.hand_closest_m,
                "least_margin_m": base.margin_m,
                "least_hand_margin_m": base.hand_margin_m,
                "steps_below_distance": base.too_near,
                "steps_moved_touched": base.moved_touched,
                "touched_most_m_per_s": base.touched_m_per_s,
                "duration_s": walk.duration_s,
                "before_doors_s": walk.waited_s,
            },
            "touches": walk.touches.iter().map(touch).collect::<Vec<_>>(),
            "track": walk.samples.iter().map(|at| json!([
                at.t_s, at.person_m.x, at.person_m.y, at.base_m.x, at.base_m.y
            ])).collect::<Vec<_>>(),
        })
    };
    let file: Value = json!({
        "walks": walks.iter().map(walk).collect::<Vec<_>>(),
        "inversion_most_s": inverted_s(hall),
    });
    Ok(serde_json::to_string_pretty(&file)? + "\n")
}
