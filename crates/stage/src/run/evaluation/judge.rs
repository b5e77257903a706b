//! Results of arm and predictors, touch by touch.

use crate::input::arms::BoardArm;
use crate::person::predictors::{PREDICTORS, PredictionRecord};
use crate::person::touches::Touch;
use crate::run::logs::tick::Tick;
use anyhow::Context;
use glam::DVec3;
use hwall_haptics::PlaceTolerance;
use hwall_kinematics::Unreachable;
use hwall_scene::Scene;

/// The arm's result at one touch.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The touch.
    pub touch: Touch,
    /// Why the board cannot be there, if it cannot.
    pub unreachable: Option<Unreachable>,
    /// Time before the hand's arrival from which the board stayed in place, s; `None` if it was not.
    pub lead_s: Option<f64>,
    /// Distance of the touched point from the middle of the face, along the face, m.
    pub offset_m: f64,
    /// Distance of the face from the touched point along the surface's normal, m.
    pub gap_m: f64,
    /// Angle between the face and the surface, rad.
    pub tilt_rad: f64,
    /// Time from the hand's arrival until the contact was felt, s.
    pub felt_after_s: Option<f64>,
    /// Velocity of the touched point of the face at the first contact, in the frame of the face (z: outward), m/s; `None` without contact.
    pub met_m_per_s: Option<DVec3>,
}

impl Outcome {
    /// Was the board there before the hand?
    #[must_use]
    pub const fn in_place(&self) -> bool {
        self.lead_s.is_some()
    }
}

/// A contact may be felt a little before the noise-free crossing, s.
const FELT_EARLY_S: f64 = 0.05;

/// Evaluates every touch from the log of the run.
///
/// # Errors
/// A touch outside the run.
pub fn judge(arm: &BoardArm, touches: &[Touch], ticks: &[Tick]) -> anyhow::Result<Vec<Outcome>> {
    let outcomes = touches.iter().map(|touch| judge_one(arm, touch, ticks));
    outcomes.collect()
}

/// Furthest motion of the board along the surface while the touch was felt, m; `None`: not felt.
#[must_use]
pub fn slid_m(touch: &Touch, ticks: &[Tick]) -> Option<f64> {
    let from = ticks.partition_point(|tick| tick.t_s < touch.contact_s);
    let felt = ticks[from..]
        .iter()
        .take_while(|tick| tick.t_s <= touch.end_s);
    let mut felt_m = felt
        .filter(|tick| tick.in_contact)
        .map(|tick| tick.base_from_board.position_m());
    let first_m = felt_m.next()?;
    let off_m = |at_m: DVec3| {
        (at_m - first_m)
            .reject_from_normalized(touch.normal)
            .length()
    };
    Some(felt_m.map(off_m).fold(0.0, f64::max))
}

fn judge_one(arm: &BoardArm, touch: &Touch, ticks: &[Tick]) -> anyhow::Result<Outcome> {
    let board = arm.board();
    let at = ticks.partition_point(|tick| tick.t_s <= touch.contact_s);
    let last = at.checked_sub(1).context("a touch before the run began")?;
    let place = PlaceTolerance::default();
    let in_place =
        |tick: &Tick| place.holds(board, &tick.base_from_board, touch.point_m, touch.normal);
    let steady = ticks[..=last]
        .iter()
        .rev()
        .take_while(|tick| in_place(tick))
        .last();
    let pose = &ticks[last].base_from_board;
    let p = pose.inverse_transform_point(touch.point_m);
    let tilt_rad = pose.rotation().z_axis.angle_between(touch.normal);
    // A press felt away from the touched point is not this touch.
    let board_holds = |tick: &Tick| {
        let p = tick.base_from_board.inverse_transform_point(touch.point_m);
        p.x.abs() <= board.half_width_m && p.y.abs() <= board.half_height_m
    };
    let from = ticks.partition_point(|tick| tick.t_s < touch.contact_s - FELT_EARLY_S);
    let mut ticks = ticks[from..]
        .iter()
        .take_while(|tick| tick.t_s <= touch.end_s);
    let met_m_per_s = ticks.clone().find_map(|tick| tick.pressed_m_per_s);
    let felt = ticks.find(|tick| tick.in_contact && board_holds(tick));
    Ok(Outcome {
        touch: touch.clone(),
        unreachable: arm.unreachable(touch.point_m, touch.normal)?,
        lead_s: steady.map(|tick| touch.contact_s - tick.t_s),
        offset_m: p.truncate().length(),
        gap_m: p.z.abs(),
        tilt_rad,
        felt_after_s: felt.map(|tick| tick.t_s - touch.contact_s),
        met_m_per_s,
    })
}

/// A prediction is right if it is on the touched surface and within this distance of the touched point, m: half
/// of the board's half width.
pub const RIGHT_M: f64 = 0.05;

/// Time before each touch from which each predictor was continuously right, s, in the order
/// of [`PredictorKind::ALL`](crate::person::predictors::PredictorKind::ALL); `None`: wrong in the last sample.
///
/// Ignores samples before the end of the previous touch.
#[must_use]
pub fn leads(
    scene: &Scene,
    touches: &[Touch],
    predictions: &[PredictionRecord],
) -> Vec<[Option<f64>; PREDICTORS]> {
    let mut since_s = f64::NEG_INFINITY;
    let of_touch = |touch: &Touch| {
        let from = predictions.partition_point(|p| p.t_s <= since_s);
        let until = predictions
            .partition_point(|p| p.t_s <= touch.contact_s)
            .max(from);
        since_s = touch.end_s;
        std::array::from_fn(|i| {
            let right = |p: &&PredictionRecord| {
                p.likeliest[i].is_some_and(|place| {
                    scene.surface(place.surface).name == touch.surface
                        && place.point_m.distance(touch.point_m) <= RIGHT_M
                })
            };
            let first = predictions[from..until]
                .iter()
                .rev()
                .take_while(right)
                .last();
            first.map(|p| touch.contact_s - p.t_s)
        })
    };
    touches.iter().map(of_touch).collect()
}
