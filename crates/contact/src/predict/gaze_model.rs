//! What a gaze says about the place that is going to be touched.

use super::gaussian::{Gaussian, log_density_2d};
use crate::error::ContactError;
use crate::outer_product::square;
use glam::DMat3;
use hwall_hand::{GazeRay, LabelledReach};
use hwall_numeric::check::{positive, that};

/// How people look while they reach: at the place they are going to touch, or elsewhere.
///
/// The angle between the line of sight and the contact point, seen from the head, has a density
/// that is a mixture of two: about the contact point with a small spread (the person's aim, the
/// eye tracker, its calibration), and with a wide one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GazeModel {
    /// Spread while the person looks at the place to be touched, in each of two directions, rad. Default
    /// 0.03 (1.7 degrees): an eye tracker of 1 degree and a person who is about as accurate.
    pub on_target_sd_rad: f64,
    /// Share of the time in which the person looks elsewhere, in [0, 1]. Default 0.15.
    pub elsewhere_share: f64,
    /// Spread of these looks elsewhere, in each of two directions, rad. Default 0.5: half the room.
    pub elsewhere_sd_rad: f64,
    /// Probability that the fixation before the present one was the look at the target, in [0, 1]. Default
    /// 0.25; it fades over `memory_s`.
    pub left_share: f64,
    /// How long a fixation that has ended still counts, s. Default 0.8: the eyes leave for the next
    /// target up to half a second before the hand arrives.
    pub memory_s: f64,
}

impl Default for GazeModel {
    fn default() -> Self {
        Self {
            on_target_sd_rad: 0.03,
            elsewhere_share: 0.15,
            elsewhere_sd_rad: 0.5,
            left_share: 0.25,
            memory_s: 0.8,
        }
    }
}

/// Larger angles are clipped to this, rad: the two spreads are those of a plane.
const WIDEST_RAD: f64 = 1.5;

impl GazeModel {
    /// Learns both spreads and the share from reaches, by expectation maximisation over the
    /// angles of all samples up to the contact; the rest stays as in `self`.
    ///
    /// Successive samples are nearly alike, so the number of reaches counts, not that of samples.
    ///
    /// # Errors
    /// Fewer than 20 samples with head and gaze.
    pub fn fit(self, reaches: &[LabelledReach]) -> Result<Self, ContactError> {
        let angles_rad: Vec<f64> = reaches
            .iter()
            .flat_map(|reach| reach.frames.iter().map(|f| (f, reach.contact_m)))
            .filter_map(|(frame, contact_m)| {
                let ray = frame.gaze_ray()?;
                let angle = ray.direction.angle_between(contact_m - ray.origin_m);
                angle.is_finite().then(|| angle.min(WIDEST_RAD))
            })
            .collect();
        if angles_rad.len() < 20 {
            return Err(ContactError::TooFewReaches {
                got: angles_rad.len(),
                needed: 20,
            });
        }
        let mut model = self;
        for _ in 0..100 {
            let (mut on, mut on_square, mut off_square) = (0.0, 0.0, 0.0);
            for angle in &angles_rad {
                let density =
                    |share: f64, sd: f64| share * (-0.5 * (angle / sd).powi(2)).exp() / (sd * sd);
                let near = density(1.0 - model.elsewhere_share, model.on_target_sd_rad);
                let far = density(model.elsewhere_share, model.elsewhere_sd_rad);
                let share = if near + far > 0.0 {
                    near / (near + far)
                } else {
                    0.0
                };
                on += share;
                on_square += share * angle * angle;
                off_square += (1.0 - share) * angle * angle;
            }
            let off = angles_rad.len() as f64 - on;
            // One pseudo-sample at the start value keeps a component without samples where it was.
            let pooled = |square: f64, n: f64, start: f64| {
                ((square + 2.0 * start * start) / (2.0 * n + 2.0)).sqrt()
            };
            model.on_target_sd_rad = pooled(on_square, on, self.on_target_sd_rad).max(1e-3);
            model.elsewhere_sd_rad =
                pooled(off_square, off, self.elsewhere_sd_rad).max(2.0 * model.on_target_sd_rad);
            model.elsewhere_share =
                ((off + 1.0) / (angles_rad.len() as f64 + 2.0)).clamp(1e-3, 1.0 - 1e-3);
        }
        Ok(model)
    }

    pub(super) fn validate(&self) -> Result<(), ContactError> {
        positive("on_target_sd_rad", self.on_target_sd_rad)?;
        positive("elsewhere_sd_rad", self.elsewhere_sd_rad)?;
        positive("memory_s", self.memory_s)?;
        for (what, value) in [
            ("elsewhere_share", self.elsewhere_share),
            ("left_share", self.left_share),
        ] {
            that((0.0..=1.0).contains(&value), what, value, "in [0, 1]")?;
        }
        Ok(())
    }

    /// A larger leap of the line of sight is a new fixation, rad.
    pub(super) fn saccade_rad(&self) -> f64 {
        let [least, most] = SACCADE_RAD;
        (SACCADE_SDS * self.on_target_sd_rad).clamp(least, most)
    }

    /// The hypotheses about the contact point once the gaze is known: at most three, the one without the
    /// gaze first; their weights add up to 1.
    pub(super) fn weigh(
        &self,
        by_motion: &Gaussian,
        memory: &GazeMemory,
        t_s: f64,
    ) -> [Option<Hypothesis>; 3] {
        let (now, before) = memory.fixations(t_s, self.memory_s);
        let astray = by_motion.stretched(ASTRAY_STRETCH);
        let look = |ray| self.look_anyhow([Some(by_motion), astray.as_ref()], ray);
        let now = now.and_then(look);
        let before = before.and_then(|(ray, age_s)| Some((look(ray)?, age_s)));
        let on_target = (1.0 - self.elsewhere_share).ln();
        let elsewhere = self.elsewhere_share.ln();
        // In every hypothesis each fixation is accounted for, on the target or elsewhere.
        let off = |look: Option<Look>| look.map_or(0.0, |l| l.log_elsewhere);
        let left = match (&now, before) {
            (_, None) => 0.0,
            (None, Some(_)) => 1.0,
            (Some(_), Some((_, age_s))) => {
                self.left_share * (1.0 - age_s / self.memory_s).clamp(0.0, 1.0)
            }
        };
        let previous = before.map(|(look, _)| look);
        let by_hand = if now.is_none() && previous.is_none() {
            0.0
        } else {
            elsewhere + off(now) + off(previous)
        };
        let by_look = |look: Look, share: f64, other: Option<Look>| {
            on_target + share.ln() + look.log_on_target + off(other)
        };
        let log_weights = [
            by_hand,
            now.map_or(f64::NEG_INFINITY, |look| {
                by_look(look, 1.0 - left, previous)
            }),
            previous.map_or(f64::NEG_INFINITY, |look| by_look(look, left, now)),
        ];
        let most = log_weights.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let weights = log_weights.map(|w| (w - most).exp());
        let total: f64 = weights.iter().sum();
        let hypothesis = |weight: f64, gaussian: &Gaussian, sight: Option<GazeRay>| {
            // A hypothesis that weighs next to nothing is not worth its rays.
            (weight > NEGLIGIBLE).then(|| Hypothesis {
                weight: weight / total,
                gaussian: *gaussian,
                sight,
            })
        };
        let by_sight = |weight: f64, look: Option<Look>| {
            look.and_then(|look| hypothesis(weight, &look.gaussian, Some(look.ray)))
        };
        let [unseen, on_now, on_previous] = weights;
        [
            hypothesis(unseen, by_motion, None),
            by_sight(on_now, now),
            by_sight(on_previous, previous),
        ]
    }

    /// A look, given an estimate that is sometimes astray: errors of estimates have longer tails than a
    /// Gaussian, and a look far away from one is more often the estimate's fault than the eye's.
    fn look_anyhow(&self, by_hand: [Option<&Gaussian>; 2], ray: &GazeRay) -> Option<Look> {
        let [usual, astray] = by_hand.map(|g| self.look(g?, ray));
        let (Some(usual), Some(astray)) = (usual, astray) else {
            return usual;
        };
        let mixed = |usual: f64, astray: f64| {
            let (a, b) = (
                (1.0 - ASTRAY_SHARE).ln() + usual,
                ASTRAY_SHARE.ln() + astray,
            );
            let most = a.max(b);
            most + ((a - most).exp() + (b - most).exp()).ln()
        };
        let log_on_target = mixed(usual.log_on_target, astray.log_on_target);
        let log_elsewhere = mixed(usual.log_elsewhere, astray.log_elsewhere);
        let is_usual = (1.0 - ASTRAY_SHARE).ln() + usual.log_on_target
            >= ASTRAY_SHARE.ln() + astray.log_on_target;
        let gaussian = if is_usual { usual } else { astray }.gaussian;
        Some(Look {
            gaussian,
            log_on_target,
            log_elsewhere,
            ..usual
        })
    }

    /// The Gaussian along a line of sight, and how well it agrees with the hand.
    fn look(&self, by_hand: &Gaussian, ray: &GazeRay) -> Option<Look> {
        let (origin_m, sight) = (ray.origin_m, ray.direction);
        let across = DMat3::IDENTITY - square(sight);
        // The spread across grows with the distance, which the product itself improves.
        let mut gaussian = *by_hand;
        for _ in 0..2 {
            let distance_m = (gaussian.mean_m - origin_m).dot(sight);
            if distance_m < NEAREST_LOOK_M {
                return None;
            }
            let sd_m = self.on_target_sd_rad * distance_m;
            gaussian = by_hand.times(origin_m, across * (1.0 / (sd_m * sd_m)))?;
        }
        let distance_m = (gaussian.mean_m - origin_m).dot(sight).max(NEAREST_LOOK_M);
        let (u, v) = sight.any_orthonormal_pair();
        let off = (by_hand.mean_m - origin_m) / distance_m;
        let spread = by_hand
            .across_m2(u, v)
            .map(|c| c / (distance_m * distance_m));
        let log_density = |sd_rad: f64| {
            let [uu, uv, vv] = spread;
            let variance = sd_rad * sd_rad;
            log_density_2d([off.dot(u), off.dot(v)], [uu + variance, uv, vv + variance])
        };
        Some(Look {
            ray: *ray,
            gaussian,
            log_on_target: log_density(self.on_target_sd_rad),
            log_elsewhere: log_density(self.elsewhere_sd_rad),
        })
    }
}

/// Share of the estimates that are astray, and how many times their standard deviation they then are off.
const ASTRAY_SHARE: f64 = 0.1;
const ASTRAY_STRETCH: f64 = 3.0;

/// Share of the weight below which a hypothesis is dropped.
const NEGLIGIBLE: f64 = 0.005;

/// Nobody looks at a place nearer to the eyes than this in order to touch it, m.
const NEAREST_LOOK_M: f64 = 0.1;

/// One hypothesis about the contact point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hypothesis {
    pub(super) weight: f64,
    pub(super) gaussian: Gaussian,
    /// The line of sight that it stems from.
    pub(super) sight: Option<GazeRay>,
}

#[derive(Debug, Clone, Copy)]
struct Look {
    ray: GazeRay,
    gaussian: Gaussian,
    log_on_target: f64,
    log_elsewhere: f64,
}

/// The present fixation and the one before it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct GazeMemory {
    now: Option<Fixation>,
    before: Option<Fixation>,
}

#[derive(Debug, Clone, Copy)]
struct Fixation {
    ray: GazeRay,
    since_s: f64,
    until_s: f64,
}

/// A leap of the line of sight by more than this many times its spread about a target is a new fixation ...
const SACCADE_SDS: f64 = 2.5;
/// ... but one below the first limit is noise, and one above the second limit never is, rad.
const SACCADE_RAD: [f64; 2] = [0.07, 0.35];
/// Shorter fixations are ignored, s: the eye is on its way, or it is noise.
const SHORTEST_S: f64 = 0.08;

impl GazeMemory {
    /// Takes the next line of sight; a leap of more than `saccade_rad` is a new fixation.
    pub(super) fn step(&mut self, t_s: f64, ray: Option<&GazeRay>, saccade_rad: f64) {
        let usable = ray.filter(|r| {
            r.origin_m.is_finite() && r.direction.is_finite() && r.direction.is_normalized()
        });
        let last_s = |f: Option<Fixation>| f.is_some_and(|f| t_s < f.until_s);
        if last_s(self.now) || last_s(self.before) {
            // The clock was set back.
            *self = Self::default();
        }
        let Some(ray) = usable else {
            self.pass();
            return;
        };
        match &mut self.now {
            Some(f) if f.ray.direction.dot(ray.direction) >= saccade_rad.cos() => {
                f.ray = *ray;
                f.until_s = t_s;
            }
            _ => {
                self.pass();
                self.now = Some(Fixation {
                    ray: *ray,
                    since_s: t_s,
                    until_s: t_s,
                });
            }
        }
    }

    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// The present fixation ends.
    fn pass(&mut self) {
        if let Some(ended) = self.now.take()
            && ended.until_s - ended.since_s >= SHORTEST_S
        {
            self.before = Some(ended);
        }
    }

    fn fixations(&self, t_s: f64, memory_s: f64) -> (Option<&GazeRay>, Option<(&GazeRay, f64)>) {
        let before = self
            .before
            .as_ref()
            .map(|f| (&f.ray, t_s - f.until_s))
            .filter(|(_, age_s)| *age_s < memory_s);
        (self.now.as_ref().map(|f| &f.ray), before)
    }

    /// The present line of sight.
    pub(super) fn ray(&self) -> Option<&GazeRay> {
        self.now.as_ref().map(|f| &f.ray)
    }
}
