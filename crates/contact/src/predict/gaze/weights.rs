//! Hypotheses about the contact point, weighed by hand and eyes.

use super::super::gaussian::Gaussian;
use super::super::hand::phase::ReachPhase;
use super::super::hand::straight_way::StraightWay;
use super::idle::IdlePlaces;
use super::memory::{GazeMemory, Look};
use super::model::GazeModel;
use super::shares::LookShares;
use crate::matrices::{Plane, axes_across, square};
use glam::DMat3;
use hwall_hand::GazeRay;
use std::f64::consts::TAU;

/// What the hand alone says about the contact.
#[derive(Debug, Clone, Copy)]
pub(in crate::predict) struct ByHand {
    pub(in crate::predict) phase: ReachPhase,
    /// When the reach under way began, s.
    pub(in crate::predict) began_s: Option<f64>,
    /// Where its motion leads; `None` at rest.
    pub(in crate::predict) as_moves: Option<Gaussian>,
    /// The same where the motion is nearly straight, for surfaces before the place that it leads to.
    pub(in crate::predict) straight: Option<StraightWay>,
    /// The same by the motion alone, without where people usually touch: of a place that is looked at that says nothing more.
    pub(in crate::predict) by_motion: Option<Gaussian>,
    /// Where it may touch whatever the estimate says: what people touch from this resting place, or what lies ahead of a moving
    /// hand.
    pub(in crate::predict) anew: Gaussian,
}

/// One hypothesis about the contact point.
#[derive(Debug, Clone, Copy)]
pub(in crate::predict) struct Hypothesis {
    /// Its share times the density of the looks; those of all add up to 1.
    pub(in crate::predict) weight: f64,
    pub(in crate::predict) gaussian: Gaussian,
    /// The line of sight that it stems from.
    pub(in crate::predict) sight: Option<GazeRay>,
    /// Is it that of the present look?
    pub(in crate::predict) looked_at: bool,
    /// How probably the motion, which it follows, is astray.
    pub(in crate::predict) astray: f64,
    /// Does it follow the motion of the hand?
    pub(in crate::predict) as_moves: bool,
    /// Is it that of a look that began after the reach did: has the mind changed?
    pub(in crate::predict) changed: bool,
}

/// At most this many: three for each of two.
pub(in crate::predict) const HYPOTHESES: usize = 6;

/// Share of the estimates that are astray, and how many times their standard deviation they then are off. In the first half of
/// simulated reaches the squared distance of the contact from a regression, in its own variances, has a median of 1 and an upper tenth
/// from 8 on, where those of a normal distribution are 2.4 and 6.3. A mixture of 0.5 and, in 0.3 of the cases, 1.5 standard deviations fits best;
/// most keep the stated one here, which is safe.
pub(in crate::predict) const ASTRAY_SHARE: f64 = 0.2;
pub(in crate::predict) const ASTRAY_STRETCH: f64 = 2.0;
/// The same for the places about a resting hand.
pub(in crate::predict) const FAR_SHARE: f64 = 0.1;
pub(in crate::predict) const FAR_STRETCH: f64 = 2.0;

/// Share of the weight below which a hypothesis is dropped.
const NEGLIGIBLE: f64 = 0.005;

/// Looks at no place that the hand has told of yet spread over this, sr: half the room before the person.
pub(in crate::predict) const LOOKS_SR: f64 = 2.0;

/// Share of the looks elsewhere that have nothing to do with the target, as those at what is beside the person.
const ANYWHERE_SHARE: f64 = 0.02;

/// Nobody looks at a place nearer to the eyes than this in order to touch it, m.
const NEAREST_LOOK_M: f64 = 0.1;

/// Share of the changes of mind among the cases in which the hand moves and its motion says nothing; the rest are false starts.
const CHANGED_SHARE: f64 = 0.5;

/// How far away the place is that is looked at where the line of sight meets nothing, m, and how far before or behind what it meets
/// a person may mean, past an edge, standard deviation, m.
const USUAL_LOOK_M: f64 = 0.8;
const DEPTH_SD_M: f64 = 0.4;

/// A line of sight beside what the hand says.
#[derive(Debug, Clone, Copy)]
struct Seen {
    ray: GazeRay,
    gaussian: Gaussian,
    log_on_target: f64,
    log_elsewhere: f64,
    /// How probably the estimate is astray.
    astray: f64,
}

impl GazeModel {
    /// The hypotheses about the contact point once the gaze is known; their weights add up to 1. `distance_m`: at which a line of sight
    /// meets something.
    pub(in crate::predict) fn weigh(
        &self,
        hand: &ByHand,
        (memory, idle): (&GazeMemory, &IdlePlaces),
        t_s: f64,
        distance_m: impl Fn(&GazeRay) -> Option<f64>,
    ) -> [Option<Hypothesis>; HYPOTHESES] {
        let (now, before) = memory.looks(t_s, self.memory_s);
        let age_s = now.map_or(0.0, |look| look.age_s(t_s));
        let fade = before.map_or(0.0, |(_, ago_s)| 1.0 - ago_s / self.memory_s);
        let idle = now.and_then(|look| idle.share(look, self.apart_rad()));
        let shares = self.looks.of_look(hand.phase, age_s, idle);
        let LookShares { as_moves, anew } = shares.among(now.is_some(), fade);
        let mut all = [None; HYPOTHESES];
        let (moves, resting) = all.split_at_mut(3);
        if let Some(motion) = &hand.as_moves {
            let by_motion = hand.by_motion.as_ref().unwrap_or(motion);
            let seen = |look: &Look| self.seen_anyhow(by_motion, look);
            let now = now.and_then(seen);
            let before = before.and_then(|(look, _)| seen(look));
            // In every hypothesis each look is accounted for, on the target or elsewhere.
            let off = |seen: Option<Seen>| seen.map_or(0.0, |seen| seen.log_elsewhere);
            let candidate = |log_weight: f64, seen: Option<Seen>, looked_at: bool| Hypothesis {
                weight: log_weight,
                gaussian: seen.map_or(*motion, |seen| seen.gaussian),
                sight: seen.map(|seen| seen.ray),
                astray: seen.map_or(0.0, |seen| seen.astray),
                looked_at,
                as_moves: true,
                changed: false,
            };
            let on = |share: f64, seen: Seen, other: Option<Seen>| {
                share.ln() + seen.log_on_target + off(other)
            };
            // The one that owes nothing to the looks comes first: what it weighs is the measure of the others.
            let unseen = as_moves.elsewhere.ln() + off(now) + off(before);
            moves[0] = Some(candidate(unseen, None, false));
            moves[1] = now.map(|seen| candidate(on(as_moves.now, seen, before), now, true));
            moves[2] = before.map(|seen| candidate(on(as_moves.before, seen, now), before, false));
        }
        // Before the hand has said anything, people look at any place as probably as at another, and touch it as probably.
        let looks = f64::from(u8::from(now.is_some()) + u8::from(before.is_some()));
        let log_looks = -looks * LOOKS_SR.ln();
        let cone = |look: &Look| {
            let distance_m = distance_m(&look.ray).unwrap_or(USUAL_LOOK_M);
            Some((self.cone(look, distance_m)?, look.ray))
        };
        let candidate = |share: f64, gaussian: Gaussian, sight: Option<GazeRay>| Hypothesis {
            weight: share.ln() + log_looks,
            gaussian,
            sight,
            astray: 0.0,
            looked_at: false,
            as_moves: false,
            changed: false,
        };
        // Who has changed their mind was looking before at what the motion still leads to.
        let meant_before = self.log_changed(hand.as_moves.as_ref(), hand.began_s, memory, t_s);
        resting[0] = now.and_then(cone).map(|(gaussian, ray)| {
            let hypothesis = candidate(anew.now, gaussian, Some(ray));
            Hypothesis {
                weight: hypothesis.weight + meant_before,
                looked_at: true,
                changed: meant_before != 0.0,
                ..hypothesis
            }
        });
        resting[1] = before
            .and_then(|(look, _)| cone(look))
            .map(|(gaussian, ray)| candidate(anew.before, gaussian, Some(ray)));
        resting[2] = Some(candidate(anew.elsewhere, hand.anew, None));
        normalized(all)
    }

    /// Logarithm of how much more probable the look before is when the mind may have changed since than when it had nothing to do
    /// with the motion. Only a look that began after the reach did tells of a change; the first one leads the hand.
    pub(in crate::predict) fn log_changed(
        &self,
        motion: Option<&Gaussian>,
        began_s: Option<f64>,
        memory: &GazeMemory,
        t_s: f64,
    ) -> f64 {
        let (Some(now), Some((before, _))) = memory.looks(t_s, self.memory_s) else {
            return 0.0;
        };
        let seen = motion
            .filter(|_| began_s.is_some_and(|began_s| now.since_s > began_s))
            .and_then(|motion| self.seen_anyhow(motion, before));
        seen.map_or(0.0, |seen| {
            log_sum([
                (1.0 - CHANGED_SHARE).ln(),
                CHANGED_SHARE.ln() + seen.log_on_target + LOOKS_SR.ln(),
            ])
        })
    }

    /// What a line of sight means by itself: the place that it meets, or one before or behind it.
    fn cone(&self, look: &Look, distance_m: f64) -> Option<Gaussian> {
        let GazeRay {
            origin_m,
            direction: sight,
        } = look.ray;
        let distance_m = distance_m.max(NEAREST_LOOK_M);
        let across_m = self.on_target_sd_rad.hypot(look.noise_rad) * distance_m;
        let along = square(sight);
        let covariance_m2 =
            along * (DEPTH_SD_M * DEPTH_SD_M) + (DMat3::IDENTITY - along) * (across_m * across_m);
        Gaussian::new(origin_m + sight * distance_m, covariance_m2)
    }

    /// A look beside an estimate that is sometimes wrong: errors have longer tails, and a look far away from an estimate is more
    /// often the estimate's fault than the eye's.
    fn seen_anyhow(&self, estimate: &Gaussian, look: &Look) -> Option<Seen> {
        let usual = self.seen(estimate, look);
        let stretched = estimate.stretched(ASTRAY_STRETCH);
        let astray = stretched.and_then(|g| self.seen(&g, look));
        let (Some(usual), Some(astray)) = (usual, astray) else {
            return usual;
        };
        let (often, seldom) = ((1.0 - ASTRAY_SHARE).ln(), ASTRAY_SHARE.ln());
        let mixed = |usual: f64, astray: f64| log_sum([often + usual, seldom + astray]);
        let share =
            (1.0 + (seldom + astray.log_on_target - often - usual.log_on_target).exp()).recip();
        // The place is the mean of both, so that it does not leap where the likelier one changes; how sure it is, that one says. With the
        // distance of the two added, regions would hold 95 instead of 90 % where errors are as stated.
        let likelier = if share >= 0.5 { usual } else { astray };
        let mean_m = astray.gaussian.mean_m.lerp(usual.gaussian.mean_m, share);
        Some(Seen {
            gaussian: likelier.gaussian.about(mean_m),
            log_on_target: mixed(usual.log_on_target, astray.log_on_target),
            log_elsewhere: mixed(usual.log_elsewhere, astray.log_elsewhere),
            astray: 1.0 - share,
            ..usual
        })
    }

    /// The Gaussian along a line of sight, and how well it agrees with the hand.
    fn seen(&self, by_hand: &Gaussian, look: &Look) -> Option<Seen> {
        let (origin_m, sight) = (look.ray.origin_m, look.ray.direction);
        let on_target_rad = self.on_target_sd_rad.hypot(look.noise_rad);
        let across = DMat3::IDENTITY - square(sight);
        // The spread across grows with the distance, which the product itself improves.
        let mut gaussian = *by_hand;
        for _ in 0..2 {
            let distance_m = (gaussian.mean_m - origin_m).dot(sight);
            if distance_m < NEAREST_LOOK_M {
                return None;
            }
            let sd_m = on_target_rad * distance_m;
            gaussian = by_hand.times(origin_m, across * (1.0 / (sd_m * sd_m)))?;
        }
        let distance_m = (gaussian.mean_m - origin_m).dot(sight).max(NEAREST_LOOK_M);
        let axes = axes_across(sight);
        let off = (by_hand.mean_m - origin_m) / distance_m;
        let off = axes.map(|axis| off.dot(axis));
        let spread = Plane::of(&by_hand.covariance_m2, axes).map(|c| c / (distance_m * distance_m));
        let log_density = |sd_rad: f64| {
            let spread = spread.plus(sd_rad * sd_rad);
            -0.5 * spread.squared(off) - TAU.ln() - 0.5 * spread.determinant().ln()
        };
        Some(Seen {
            ray: look.ray,
            gaussian,
            log_on_target: log_density(on_target_rad),
            log_elsewhere: log_elsewhere(log_density(self.elsewhere_sd_rad.hypot(look.noise_rad))),
            astray: 0.0,
        })
    }
}

/// Logarithm of the density of a look elsewhere, per steradian, from that about the target: some of these looks are anywhere.
pub(in crate::predict) fn log_elsewhere(log_about: f64) -> f64 {
    log_sum([
        (1.0 - ANYWHERE_SHARE).ln() + log_about,
        ANYWHERE_SHARE.ln() - LOOKS_SR.ln(),
    ])
}

/// Logarithm of the sum of exponentials.
pub(in crate::predict) fn log_sum<const N: usize>(logs: [f64; N]) -> f64 {
    let most = logs.into_iter().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.iter().map(|l| (l - most).exp()).sum::<f64>().ln()
}

/// Turns logarithms into weights that add up to 1, without those that are not worth their rays.
fn normalized(mut all: [Option<Hypothesis>; HYPOTHESES]) -> [Option<Hypothesis>; HYPOTHESES] {
    let logs = all.map(|h| h.map_or(f64::NEG_INFINITY, |h| h.weight));
    let total = log_sum(logs);
    for hypothesis in &mut all {
        if let Some(h) = hypothesis {
            h.weight = (h.weight - total).exp();
            if h.weight.is_nan() || h.weight <= NEGLIGIBLE {
                *hypothesis = None;
            }
        }
    }
    all
}
