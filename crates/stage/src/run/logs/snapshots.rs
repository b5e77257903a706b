//! Drawable snapshots of the arm and its board.

use crate::input::arms::BoardArm;
use crate::run::evaluation::judge::Outcome;
use crate::run::logs::tick::Tick;
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_haptics::Board;

/// The face of a board at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardFace {
    /// Its middle, m.
    pub middle_m: DVec3,
    /// Its corners in turn, m.
    pub corners_m: [DVec3; 4],
    /// Outward unit normal.
    pub normal: DVec3,
}

impl BoardFace {
    /// Of a board in this pose.
    #[must_use]
    pub fn new(board: &Board, base_from_board: &Pose) -> Self {
        let (x, y) = (board.half_width_m, board.half_height_m);
        let corners = [(x, y), (-x, y), (-x, -y), (x, -y)];
        Self {
            middle_m: base_from_board.position_m(),
            corners_m: corners.map(|(x, y)| base_from_board.transform_point(DVec3::new(x, y, 0.0))),
            normal: base_from_board.rotation().z_axis,
        }
    }
}

/// The arm at an instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// Description for the legend.
    pub what: &'static str,
    /// Time, s.
    pub t_s: f64,
    /// Polyline from the base to the board, m.
    pub skeleton_m: Vec<DVec3>,
    /// Its board.
    pub board: BoardFace,
}

/// The board's motion to a touch in three snapshots: when the target could be known, half of the distance later, and at the
/// contact. Chooses the touch with the longest motion, preferably with the board in place; empty if nothing within reach
/// was touched.
#[must_use]
pub fn of_one_touch(
    arm: &BoardArm,
    ticks: &[Tick],
    outcomes: &[Outcome],
    known_s: &[f64],
) -> Vec<Snapshot> {
    let index = |t_s: f64| index(ticks, t_s);
    let middle_m = |i: usize| ticks[i].base_from_board.position_m();
    let within = outcomes.iter().zip(known_s);
    let furthest = within
        .filter(|(outcome, _)| outcome.unreachable.is_none() && !ticks.is_empty())
        .map(|(outcome, known_s)| {
            let (from, to) = (index(*known_s), index(outcome.touch.contact_s));
            (
                outcome.in_place(),
                middle_m(from).distance(middle_m(to)),
                from,
                to,
            )
        })
        .max_by(|a, b| (a.0.cmp(&b.0)).then(a.1.total_cmp(&b.1)));
    let Some((_, way_m, from, to)) = furthest else {
        return Vec::new();
    };
    let half = (from..=to)
        .find(|i| middle_m(*i).distance(middle_m(to)) <= 0.5 * way_m)
        .unwrap_or(to);
    let instants = [
        ("arm when it could know the next touch", from),
        ("on its way", half),
        ("at the contact", to),
    ];
    let snapshot = |(what, i): (&'static str, usize)| Snapshot {
        what,
        t_s: ticks[i].t_s,
        skeleton_m: arm.skeleton_m(&ticks[i].q),
        board: BoardFace::new(arm.board(), &ticks[i].base_from_board),
    };
    instants.map(snapshot).into()
}

/// The board at each contact within reach.
#[must_use]
pub fn at_contacts(arm: &BoardArm, ticks: &[Tick], outcomes: &[Outcome]) -> Vec<BoardFace> {
    let within = outcomes.iter().filter(|o| o.unreachable.is_none());
    within
        .filter_map(|outcome| ticks.get(index(ticks, outcome.touch.contact_s)))
        .map(|tick| BoardFace::new(arm.board(), &tick.base_from_board))
        .collect()
}

/// The last step not later than `t_s`, or the first one.
fn index(ticks: &[Tick], t_s: f64) -> usize {
    let after = ticks.partition_point(|tick| tick.t_s <= t_s);
    after.saturating_sub(1)
}
