//! Where to send the board, given where the hand may touch and how fast the arm is.

use crate::error::ContactError;
use crate::predict::ContactPrediction;
use glam::{DMat3, DVec3};
use hwall_numeric::check::{non_negative, positive};
use hwall_scene::SurfaceId;

/// The board and the arm that carries it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardConfig {
    /// Half the width (horizontal) and half the height of the board, m. Default 0.1 and 0.1.
    pub half_extents_m: [f64; 2],
    /// A touch nearer to the edge than this is none, m; less than either half. Default 0.015: a
    /// fingertip.
    pub inset_m: f64,
    /// Speed at which the board travels, m/s. Default 1.2: what an iiwa 7 does on ways of half a
    /// metre, latency apart.
    pub speed_m_per_s: f64,
    /// Time from a decision until the board is at speed, s. Default 0.1.
    pub latency_s: f64,
    /// How long before the contact the hand shows which of two places it goes to, s: until then a
    /// board may wait between them. Default 0: waiting pays only for a board that crosses what is
    /// left of the way in that time, and an arm of the iiwa's speed does not (in the closed loop of
    /// the workspace's main example 0.2 s cost more than half of the boards in place).
    pub resolved_s: f64,
}

impl Default for BoardConfig {
    fn default() -> Self {
        Self {
            half_extents_m: [0.1, 0.1],
            inset_m: 0.015,
            speed_m_per_s: 1.2,
            latency_s: 0.1,
            resolved_s: 0.0,
        }
    }
}

/// Where to send the board, and what may be expected of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardChoice {
    /// Where to send the middle of the board now, m: a predicted point, or a place between two.
    pub point_m: DVec3,
    /// Unit normal it should show to the hand.
    pub normal: DVec3,
    /// The surface it stands for: the most probable among those it can serve from there.
    pub surface: SurfaceId,
    /// Probability that the hand lands on the board.
    pub on_board: f64,
    /// Expected distance from the contact to the nearest usable point of the board, m; up to a tenth
    /// too small where the spread is wide.
    pub expected_miss_m: f64,
}

/// Finds the place for the board that minimises the expected cost when the hand arrives.
///
/// With T the time to contact, the board moves freely until the latency before it. Two stages: up
/// to `resolved_s` before the contact nobody knows more than now; after that the board goes on to
/// whatever place it turns out to be. From a waiting place p, within
/// `speed (T - latency - resolved)` of the board, hypothesis j finds the board at p carried
/// towards its point by at most `speed resolved`; once T is below `resolved_s` nothing is left to
/// wait for, and the board goes straight to the best place. Cost: the probability of a
/// touch beside the board, and among equals the expected distance by which it is missed.
///
/// Waiting places tried: every predicted point, the board's own, and eight on the line between
/// each two predicted points. The virtual surfaces do not bar the way of the real board, and
/// turning it to another normal is not counted as time.
///
/// Pure: the same predictions, the same choice. No allocation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BoardChooser {
    config: BoardConfig,
}

/// Answers after these are too improbable to count.
const HYPOTHESES: usize = 6;

/// Weight of an expected miss against the probability of one, per m: it breaks ties.
const MISS_PER_M: f64 = 0.1;

/// A board this far before or behind a surface serves it, m, ...
const OFF_PLANE_M: f64 = 0.02;
/// ... and a board tilted against it by an angle with at least this cosine (20 degrees).
const TILT_COS: f64 = 0.94;

impl BoardChooser {
    /// A chooser for this board and arm.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(config: BoardConfig) -> Result<Self, ContactError> {
        non_negative("inset_m", config.inset_m)?;
        for half_m in config.half_extents_m {
            positive("half_extents_m - inset_m", half_m - config.inset_m)?;
        }
        positive("speed_m_per_s", config.speed_m_per_s)?;
        non_negative("latency_s", config.latency_s)?;
        non_negative("resolved_s", config.resolved_s)?;
        Ok(Self { config })
    }

    /// The best place for a board now at `board_m`; `None` without predictions, or for a board
    /// whose place is no number.
    ///
    /// Predictions without a time to contact are taken to be due in `unknown_s`, those without a
    /// covariance to be exact.
    #[must_use]
    pub fn choose(
        &self,
        predictions: &[ContactPrediction],
        board_m: DVec3,
        unknown_s: f64,
    ) -> Option<BoardChoice> {
        let likely = &predictions[..predictions.len().min(HYPOTHESES)];
        if likely.is_empty() || !board_m.is_finite() {
            return None;
        }
        let mut best: Option<(f64, BoardChoice)> = None;
        let mut consider = |point_m: DVec3| {
            let choice = self.judge(likely, board_m, point_m, unknown_s);
            let cost = 1.0 - choice.on_board + MISS_PER_M * choice.expected_miss_m;
            // A tie goes to the place tried first.
            if best.as_ref().is_none_or(|(least, _)| cost < least - 1e-9) {
                best = Some((cost, choice));
            }
        };
        for prediction in likely {
            consider(prediction.point_m);
        }
        for (i, a) in likely.iter().enumerate() {
            for b in &likely[..i] {
                for step in 1..=8 {
                    consider(a.point_m.lerp(b.point_m, f64::from(step) / 9.0));
                }
            }
        }
        consider(board_m);
        best.map(|(_, choice)| choice)
    }

    /// What may be expected of a board sent to a place.
    fn judge(
        &self,
        likely: &[ContactPrediction],
        board_m: DVec3,
        point_m: DVec3,
        unknown_s: f64,
    ) -> BoardChoice {
        let c = &self.config;
        let total: f64 = likely.iter().map(|p| p.probability).sum();
        let (mut on_board, mut expected_miss_m) = (0.0, 0.0);
        let mut served = (f64::NEG_INFINITY, &likely[0]);
        for prediction in likely {
            let due_s = prediction.time_to_contact_s.map_or(unknown_s, |t| t.mean_s);
            let free_s = (due_s - c.latency_s).max(0.0);
            let waiting_s = (free_s - c.resolved_s).max(0.0);
            // Too late for a second look: what is decided now stands.
            let (first_s, then_s) = if waiting_s > 0.0 {
                (waiting_s, c.resolved_s)
            } else {
                (free_s, 0.0)
            };
            let waits_m = towards(board_m, point_m, c.speed_m_per_s * first_s);
            let arrives_m = towards(waits_m, prediction.point_m, c.speed_m_per_s * then_s);
            // Whoever is not told apart later still turns the board to the likeliest.
            let normal = if then_s > 0.0 {
                prediction.normal
            } else {
                nearest_normal(likely, point_m)
            };
            let share = if total > 0.0 {
                prediction.probability / total
            } else {
                0.0
            };
            let (hit, miss_m) = self.landing(prediction, arrives_m, normal);
            on_board += share * hit;
            expected_miss_m += share * miss_m;
            if share * hit > served.0 {
                served = (share * hit, prediction);
            }
        }
        BoardChoice {
            point_m,
            normal: served.1.normal,
            surface: served.1.surface,
            on_board: on_board.clamp(0.0, 1.0),
            expected_miss_m,
        }
    }

    /// Probability that a contact lies on a board at `board_m`, and expected distance beside it.
    fn landing(&self, prediction: &ContactPrediction, board_m: DVec3, normal: DVec3) -> (f64, f64) {
        let (across, up) = board_axes(prediction.normal);
        let off_m = prediction.point_m - board_m;
        let beside = off_m.dot(prediction.normal).abs();
        let serves = beside <= OFF_PLANE_M && normal.dot(prediction.normal) >= TILT_COS;
        let c = prediction.covariance_m2.unwrap_or(DMat3::ZERO);
        let half_m = self.config.half_extents_m.map(|h| h - self.config.inset_m);
        let variance = [across.dot(c * across), up.dot(c * up)].map(|v: f64| v.max(0.0));
        let along = across.dot(c * up);
        let offset = [off_m.dot(across), off_m.dot(up)];
        let (mut on_board, mut miss_m) = (0.0, 0.0);
        // Strips of equal probability across the board; along each strip in closed form.
        let [sd_u, sd_v] = variance.map(f64::sqrt);
        let slope = if variance[0] > 0.0 {
            along / variance[0]
        } else {
            0.0
        };
        let rest = (sd_v * sd_v - slope * along).max(0.0).sqrt();
        for z in STRIPS {
            let u = offset[0] + sd_u * z;
            let v = offset[1] + slope * sd_u * z;
            let share = 1.0 / STRIPS.len() as f64;
            if u.abs() <= half_m[0] {
                on_board += share * (cdf((half_m[1] - v) / rest) - cdf((-half_m[1] - v) / rest));
            }
            let short = |x: f64, half: f64| (x.abs() - half).max(0.0);
            let aside_v = mean_beyond(v, rest, half_m[1]);
            miss_m += share
                * short(u, half_m[0])
                    .hypot(aside_v)
                    .hypot(short(beside, OFF_PLANE_M));
        }
        (if serves { on_board } else { 0.0 }, miss_m)
    }
}

/// At most `reach_m` of the way.
fn towards(from_m: DVec3, to_m: DVec3, reach_m: f64) -> DVec3 {
    let way = to_m - from_m;
    let length_m = way.length();
    if length_m <= reach_m {
        to_m
    } else {
        from_m + way * (reach_m / length_m)
    }
}

/// The normal of the prediction nearest to a place.
fn nearest_normal(likely: &[ContactPrediction], point_m: DVec3) -> DVec3 {
    likely
        .iter()
        .min_by(|a, b| {
            let distance = |p: &ContactPrediction| p.point_m.distance_squared(point_m);
            distance(a).total_cmp(&distance(b))
        })
        .map_or(DVec3::X, |p| p.normal)
}

/// Horizontal and upward axis of a board with this normal; some pair for a level one.
fn board_axes(normal: DVec3) -> (DVec3, DVec3) {
    match DVec3::Z.cross(normal).try_normalize() {
        Some(across) => (across, normal.cross(across)),
        None => normal.any_orthonormal_pair(),
    }
}

/// Middles of twelve intervals of equal probability of the standard normal distribution. Their
/// variance is 0.90, so that an expected miss comes out a little small.
const STRIPS: [f64; 12] = [
    -1.731664, -1.150349, -0.812218, -0.548522, -0.318639, -0.104633, 0.104633, 0.318639, 0.548522,
    0.812218, 1.150349, 1.731664,
];

/// Distribution function of the standard normal distribution; the sign's at infinity, 1/2 for 0/0.
fn cdf(x: f64) -> f64 {
    if x.is_nan() {
        0.5
    } else {
        0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
    }
}

/// Mean of how far a normal variable lies outside `[-half, half]`.
fn mean_beyond(mean: f64, sd: f64, half: f64) -> f64 {
    // E max(x - h, 0) = (m - h) Φ(z) + s φ(z) with z = (m - h) / s.
    let above = |m: f64| {
        if sd <= 0.0 {
            return (m - half).max(0.0);
        }
        let z = (m - half) / sd;
        (m - half) * cdf(z) + sd * (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt()
    };
    above(mean) + above(-mean)
}
