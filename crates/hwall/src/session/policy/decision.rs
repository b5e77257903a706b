//! When the board goes where: wait, be ready behind a surface, present it.

use super::available_time::{AvailableTime, TimeFrame};
use super::config::PolicyConfig;
use super::edge::Weighed;
use super::fixations::{FixationFrame, Fixations};
use super::hand_motion::{HandMotion, MeanVelocity};
use super::presenting::Presenting;
use super::sight::Sight;
use crate::error::SessionError;
use glam::{DMat3, DVec3};
use hwall_contact::{ContactPrediction, PredictionSource, SteadyPoint};
use hwall_geometry::Pose;
use hwall_hand::HandState;
use hwall_haptics::{Board, PlaceTolerance, surface_axes};
use hwall_scene::SurfaceId;

/// What the board does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::session) enum Decision {
    /// Nothing is about to be touched.
    Wait,
    /// Something may be touched: the arm waits closer to it.
    Preposition(ContactPrediction),
    /// The board goes behind the place that is fixated, or that will probably be touched again.
    Ready(ContactPrediction),
    /// The board goes to the place that is about to be touched.
    Present(ContactPrediction),
}

impl Decision {
    /// The same decision `dt_s` later.
    fn aged(self, dt_s: f64) -> Self {
        let older = |mut contact: ContactPrediction| {
            if let Some(time) = &mut contact.time_to_contact_s {
                time.mean_s = (time.mean_s - dt_s).max(0.0);
            }
            contact
        };
        match self {
            Self::Wait => Self::Wait,
            Self::Preposition(contact) => Self::Preposition(older(contact)),
            Self::Ready(contact) => Self::Ready(older(contact)),
            Self::Present(contact) => Self::Present(older(contact)),
        }
    }
}

/// The predicted place, and since when it has been predicted.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    surface: SurfaceId,
    point_m: DVec3,
    since_s: f64,
}

/// The motion of the hand relative to a predicted place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Motion {
    Rests,
    Reaches,
    Leaves,
}

/// Standard deviation of the predicted point, m; zero for one that comes without, NaN for a covariance that is none.
fn spread_m(contact: &ContactPrediction) -> f64 {
    let variance_m2 = |c: DMat3| c.x_axis.x + c.y_axis.y + c.z_axis.z;
    contact.covariance_m2.map_or(0.0, variance_m2).sqrt()
}

/// At the end of a minimum-jerk reach, the remaining time is this multiple of remaining distance over speed; earlier it is less.
const SLOWS_DOWN: f64 = 3.0;

/// Caps the time to contact at the end of a minimum-jerk reach: a time learnt from all people is too late for fast ones.
fn in_time(mut contact: ContactPrediction, hand: &HandState) -> ContactPrediction {
    let way = contact.point_m - hand.point_m;
    let closing_m_per_s = hand.velocity_m_per_s.dot(way.normalize_or_zero());
    if closing_m_per_s > SLOWEST_M_PER_S
        && let Some(time) = &mut contact.time_to_contact_s
    {
        let latest_s = SLOWS_DOWN * way.length() / closing_m_per_s;
        time.mean_s = time.mean_s.min(latest_s);
    }
    contact
}

/// Below this speed the direction of motion is dominated by noise, m/s.
const SLOWEST_M_PER_S: f64 = 0.1;

/// Distance from its centre that a board covers, m.
const COVERED_M: f64 = 0.075;

/// The ranked contacts, starting with the one that a board is most likely to cover. The more probable of a place touched before and
/// another prediction may be too vague for a board to cover it.
fn worth_a_board(ranked: &[ContactPrediction]) -> &[ContactPrediction] {
    let Some(repeat) = (ranked.iter()).position(|p| p.source == PredictionSource::TouchedBefore)
    else {
        return ranked;
    };
    let other = usize::from(repeat == 0);
    let covered = |p: &ContactPrediction| p.probability * covered_share(p);
    match ranked.get(other) {
        Some(other) if covered(other) > covered(&ranked[repeat]) => {
            if repeat == 0 {
                &ranked[1..]
            } else {
                ranked
            }
        }
        _ => &ranked[repeat..=repeat],
    }
}

/// The probability that a board at the predicted point covers the touch.
fn covered_share(contact: &ContactPrediction) -> f64 {
    let Ok(axes) = surface_axes(contact.normal) else {
        return 0.0;
    };
    // A prediction without covariance counts as exact.
    let Some(c) = contact.covariance_m2 else {
        return 1.0;
    };
    let variances_m2 = axes.map(|axis| (c * axis).dot(axis));
    // NaN covers nothing.
    if !variances_m2.iter().all(|v| *v >= 0.0) {
        return 0.0;
    }
    let sds_m2 = (variances_m2[0] * variances_m2[1]).sqrt();
    1.0 - (-0.5 * COVERED_M * COVERED_M / sds_m2).exp()
}

/// Mean speed over 0.1 s above which the hand is treated as leaving, m/s.
const LEAVES_M_PER_S: f64 = 0.1;
/// A reaching hand may move away from the surface at up to this fraction of its closing speed, because reaches are curved.
const ALONG_SHARE: f64 = 0.2;
/// A place further than this many standard deviations from the predicted touch is ruled out.
const OUT_OF_QUESTION_SDS: f64 = 2.0;
/// How far from the eyes a place is that can be touched, m: an arm's length and some. The slack of a place that is looked at takes the
/// error of the line of sight on a wall that is faced from there, whatever the real distance and angle. What a grazing line of
/// sight would add is left to the hand to correct; counted in full it would leave a door seen from the side hardly any slack, and the board would follow every
/// wavering of the eyes.
const USUAL_LOOK_M: f64 = 1.0;

/// The policy with its state.
#[derive(Debug, Clone)]
pub(in crate::session) struct Policy {
    config: PolicyConfig,
    steady: SteadyPoint,
    candidate: Option<Candidate>,
    decision: Decision,
    /// When the hand was last seen to reach, s.
    reached_s: f64,
    /// When the hand was last seen not to rest, s.
    moved_s: f64,
    last_s: f64,
    fixations: Fixations,
    available_time: AvailableTime,
    course: HandMotion,
    /// The surface of the contact that is held, and how far its prediction is from the point that is held, m.
    off: Option<(SurfaceId, DVec3)>,
}

impl Policy {
    /// `usual_s`: available time assumed for an unknown person.
    pub(in crate::session) fn new(
        config: PolicyConfig,
        usual_s: f64,
    ) -> Result<Self, SessionError> {
        config.validate()?;
        Ok(Self {
            steady: SteadyPoint::new(config.steady_m)?,
            config,
            candidate: None,
            decision: Decision::Wait,
            reached_s: f64::NEG_INFINITY,
            moved_s: f64::NEG_INFINITY,
            last_s: f64::NEG_INFINITY,
            fixations: Fixations::default(),
            available_time: AvailableTime::usual(usual_s),
            course: HandMotion::default(),
            off: None,
        })
    }

    /// Forgets everything, for a world that leapt.
    pub(in crate::session) fn reset(&mut self) {
        self.steady.reset();
        self.candidate = None;
        self.decision = Decision::Wait;
        [self.reached_s, self.moved_s, self.last_s] = [f64::NEG_INFINITY; 3];
        self.fixations.forget_look();
        self.available_time.forget_reach();
        self.course = HandMotion::default();
    }

    /// The contact that counts after a frame and what is done about it: the ranked contacts, the hand and the place between the
    /// eyes, all in one frame. `None` without a contact in sight.
    pub(in crate::session) fn step(
        &mut self,
        t_s: f64,
        ranked: &[ContactPrediction],
        hand: Option<&HandState>,
        eye_m: Option<DVec3>,
        arm: &impl Presenting,
    ) -> Option<(ContactPrediction, Decision)> {
        if t_s < self.last_s {
            // The clock was set back.
            self.reset();
        }
        let dt_s = t_s - self.last_s;
        self.last_s = t_s;
        // The time to contact of a kept decision goes on.
        self.decision = self.decision.aged(dt_s);
        self.course.step(t_s, hand.map(|hand| hand.point_m));
        let sight = eye_m.map(|eye_m| self.sight(eye_m));
        let told = ranked;
        let ranked = worth_a_board(ranked);
        let weighed = Weighed::at_edge(ranked, |contact| arm.arrival_s(contact));
        let ranked = weighed.as_ref().map_or(ranked, Weighed::contacts);
        // Early predictions from hand motion are no better than a fixation, whatever variance they state.
        let held = self.steady.step_ranked_known(ranked, |prediction| {
            let own_m = spread_m(prediction);
            match (prediction.looked_at_since_s, sight) {
                (Some(_), Some(sight)) => own_m.min(sight.spread_m(prediction)),
                _ => own_m,
            }
        });
        self.off = held.and_then(|held| {
            let newest = ranked.iter().find(|p| p.surface == held.surface)?;
            let off = newest.point_m - held.point_m;
            Some((held.surface, off * self.told_share(newest, off)))
        });
        let Some(contact) = held else {
            self.steady.reset();
            self.available_time.forget_reach();
            self.candidate = None;
            self.decision = Decision::Wait;
            return None;
        };
        if !(contact.point_m.is_finite() && contact.normal.is_finite()) {
            // The control side holds, and reports why.
            self.steady.reset();
            self.candidate = None;
            self.decision = Decision::Present(contact);
            return Some((contact, self.decision));
        }
        let same =
            |p: &&ContactPrediction| (p.surface, p.source) == (contact.surface, contact.source);
        let contact = ContactPrediction {
            probability: told
                .iter()
                .find(same)
                .map_or(contact.probability, |p| p.probability),
            ..contact
        };
        let contact = hand.map_or(contact, |hand| in_time(contact, hand));
        // Hysteresis: once dispatched, tolerate a prediction that briefly leaves the reachable region.
        let is_sent = matches!(self.decision, Decision::Present(_) | Decision::Ready(_));
        let most_m = if is_sent { 2.0 * COVERED_M } else { COVERED_M };
        let is_covered = arm.beside_m(&contact) <= most_m;
        self.decision = self.decide(t_s, &contact, hand, is_covered);
        let sent_to = match &self.decision {
            Decision::Present(to) | Decision::Ready(to) => Some(to),
            Decision::Wait | Decision::Preposition(_) => None,
        };
        let frame = TimeFrame::new(t_s, sent_to, &contact, hand);
        self.available_time.step(&frame);
        Some((contact, self.decision))
    }

    fn decide(
        &mut self,
        t_s: f64,
        contact: &ContactPrediction,
        hand: Option<&HandState>,
        is_covered: bool,
    ) -> Decision {
        let c = self.config;
        let stays = self.candidate.filter(|candidate| {
            candidate.surface == contact.surface
                && candidate.point_m.distance(contact.point_m) <= c.settle_m
        });
        let motion = hand.map_or(Motion::Rests, |hand| self.motion(contact, hand));
        // A fixation that began before the first frame does not count.
        let is_still = hand.is_none_or(|hand| hand.velocity_m_per_s.length() < c.still_m_per_s);
        if !is_still || self.moved_s == f64::NEG_INFINITY {
            self.moved_s = t_s;
        }
        let candidate = Candidate {
            surface: contact.surface,
            point_m: contact.point_m,
            since_s: stays.map_or(t_s, |candidate| candidate.since_s),
        };
        self.candidate = Some(candidate);
        let is_sent = matches!(self.decision, Decision::Present(_) | Decision::Ready(_));
        let reaches = motion == Motion::Reaches
            && (is_sent || hand.is_none_or(|hand| self.sets_off(contact, hand)));
        if reaches {
            self.reached_s = t_s;
        } else if is_still && stays.is_none() {
            // That was for another place.
            self.reached_s = f64::NEG_INFINITY;
        }
        let look = contact
            .looked_at_since_s
            .filter(|since_s| is_still && *since_s >= self.moved_s + c.still_s);
        self.fixations.step(&FixationFrame {
            t_s,
            since_s: look,
            reaches,
            is_still,
        });
        let reaching = t_s - self.reached_s <= c.pause_s && motion != Motion::Leaves;
        let settled = t_s - candidate.since_s >= c.settle_s;
        let enough_m = match self.decision {
            // Leaving a place that was fixated takes a more certain prediction.
            Decision::Present(last) | Decision::Ready(last) if last.looked_at_since_s.is_some() => {
                c.sure_m
            }
            _ => c.unsure_m,
        };
        // NaN is unsure.
        let spread_m = spread_m(contact);
        let leaves_place = match self.decision {
            Decision::Present(last) | Decision::Ready(last) => {
                last.point_m.distance(contact.point_m) > OUT_OF_QUESTION_SDS * spread_m
            }
            Decision::Wait | Decision::Preposition(_) => false,
        };
        let is_sure = spread_m <= enough_m || (leaves_place && spread_m <= c.unsure_m);
        let is_unsure = contact.looked_at_since_s.is_none() && !is_sure;
        // Ignore fixations while the hand is retracting. Do not send the board early to a place that it cannot cover: it would then be
        // late elsewhere.
        let is_look = look.is_some_and(|since_s| t_s - since_s <= c.look_s)
            && motion != Motion::Leaves
            && is_covered;
        // Without eye tracking, past touches are all that is known before the hand sets off.
        let is_again = contact.source == PredictionSource::TouchedBefore
            && contact.probability >= c.again_share
            && motion != Motion::Leaves
            && is_covered;
        match (self.decision, motion) {
            (Decision::Present(_) | Decision::Ready(_), Motion::Leaves) if settled => {
                Decision::Wait
            }
            (Decision::Wait, _) if is_unsure => Decision::Wait,
            (last, _) if is_unsure && reaching => last,
            _ if settled && reaching => Decision::Present(*contact),
            (Decision::Present(last), _) if reaching => {
                // The prediction changed too recently.
                Decision::Present(if stays.is_some() { *contact } else { last })
            }
            _ if settled && is_look && is_still => {
                match self.fixations.share() >= c.trusted_share {
                    true => Decision::Ready(*contact),
                    false => Decision::Preposition(*contact),
                }
            }
            _ if settled && is_again && is_still => Decision::Ready(*contact),
            _ if settled => Decision::Wait,
            (last, _) => last,
        }
    }

    /// Time available to the arm before this person touches, s.
    pub(in crate::session) const fn budget_s(&self) -> f64 {
        self.available_time.budget_s()
    }

    pub(in crate::session) const fn ready_m(&self) -> f64 {
        self.config.ready_m
    }

    fn motion(&self, contact: &ContactPrediction, hand: &HandState) -> Motion {
        let way = contact.point_m - hand.point_m;
        let course = self.course.velocity();
        // Without a history, only fast motion can be told from noise.
        let is_fast = hand.velocity_m_per_s.length() >= self.config.still_m_per_s;
        let found_m_per_s = hand.velocity_m_per_s * f64::from(u8::from(is_fast));
        let mean_m_per_s = course.map_or(found_m_per_s, |course| course.mean_m_per_s);
        let off_m_per_s = mean_m_per_s.dot(contact.normal);
        if contact.distance_m <= self.config.near_m {
            // Close to the surface, the direction to a point on it is unreliable.
            let most_m_per_s = match self.decision {
                Decision::Present(_) | Decision::Ready(_) => LEAVES_M_PER_S,
                // Hysteresis: a hand that has left returns only with a clear motion.
                Decision::Wait | Decision::Preposition(_) => self.config.reach_m_per_s,
            };
            return if off_m_per_s > most_m_per_s {
                Motion::Leaves
            } else {
                Motion::Reaches
            };
        }
        let closing_m_per_s = mean_m_per_s.dot(way.normalize_or_zero());
        // A hand that retracts upwards approaches a fixated point above it, but not its surface.
        let along_m_per_s = ALONG_SHARE * closing_m_per_s;
        if closing_m_per_s >= self.config.reach_m_per_s && off_m_per_s <= along_m_per_s {
            Motion::Reaches
        } else if closing_m_per_s <= -LEAVES_M_PER_S || off_m_per_s >= LEAVES_M_PER_S {
            Motion::Leaves
        } else {
            Motion::Rests
        }
    }

    /// Does an approaching hand accelerate? A hand that comes to rest after a touch approaches something, too.
    fn sets_off(&self, contact: &ContactPrediction, hand: &HandState) -> bool {
        let is_fast = hand.velocity_m_per_s.length() >= self.config.still_m_per_s;
        let is_near = contact.distance_m <= self.config.near_m;
        let way = (contact.point_m - hand.point_m).normalize_or_zero();
        let gains = |course: MeanVelocity| course.gained_m_per_s.dot(way) >= 0.0;
        is_fast || is_near || self.course.velocity().is_none_or(gains)
    }

    /// The share of its way that a place that was looked at is moved by a newer prediction. One of another look counts in full; of one
    /// by the hand's motion as much as its variance says: two estimates of one place.
    fn told_share(&self, newest: &ContactPrediction, off: DVec3) -> f64 {
        if newest.looked_at_since_s.is_some() {
            return 1.0;
        }
        let along = off.normalize_or_zero();
        let Some(variance_m2) = newest.covariance_m2.map(|c| (c * along).dot(along)) else {
            return 1.0;
        };
        let looked_m2 = (self.config.looked_rad * USUAL_LOOK_M).powi(2);
        // NaN counts in full.
        if variance_m2 >= 0.0 {
            looked_m2 / (looked_m2 + variance_m2)
        } else {
            1.0
        }
    }

    const fn sight(&self, eye_m: DVec3) -> Sight {
        Sight {
            eye_m,
            error_rad: self.config.looked_rad,
        }
    }

    /// How far the middle of the board may be from a predicted point along the axes of the surface, the half axes of an
    /// ellipse, m. The contact is in the base frame; what was predicted was in
    /// that of the world.
    pub(in crate::session) fn slack_m(
        &self,
        contact: &ContactPrediction,
        base_from_world: &Pose,
        board: &Board,
        place: &PlaceTolerance,
    ) -> [f64; 2] {
        let Ok(axes) = surface_axes(contact.normal) else {
            return [0.0; 2];
        };
        // Of a face turned about its normal at least the disc about its middle is there.
        let half_m = board.half_width_m.min(board.half_height_m);
        let looked_sd_m = self.config.looked_rad * USUAL_LOOK_M;
        let off = self
            .off
            .map(|(surface, off)| (surface, base_from_world.transform_vector(off)));
        std::array::from_fn(|i| {
            let variance_m2 = contact
                .covariance_m2
                .map_or(self.config.default_sd_m.powi(2), |c| {
                    (c * axes[i]).dot(axes[i])
                });
            // A covariance that holds other places too says little about the one that is looked at. But a point that was held while
            // its prediction moved on is that much further from the touch.
            let (most_m, off_m) = match (contact.looked_at_since_s, off) {
                (Some(_), Some((surface, off))) if surface == contact.surface => {
                    (looked_sd_m, off.dot(axes[i]).abs())
                }
                (Some(_), _) => (looked_sd_m, 0.0),
                // A covariance is that about the point that is held; without one nothing tells how far the newest is off.
                (None, Some((surface, off)))
                    if surface == contact.surface && contact.covariance_m2.is_none() =>
                {
                    (f64::INFINITY, off.dot(axes[i]).abs())
                }
                (None, _) => (f64::INFINITY, 0.0),
            };
            let sd_m = if variance_m2 >= 0.0 {
                variance_m2.sqrt().min(most_m) + off_m
            } else {
                f64::NAN
            };
            let taken_m = place.inset_m + self.config.margin_m + self.config.deviations * sd_m;
            // NaN counts as no slack.
            (half_m - taken_m).max(0.0)
        })
    }
}

#[cfg(test)]
mod tests;
