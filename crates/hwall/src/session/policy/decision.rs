//! From the belief about the next touch to what the board does.

use super::available_time::{AvailableTime, TimeFrame};
use super::config::PolicyConfig;
use super::expected_loss::{Choice, Chooser, Goal, Hypothesis, TouchTime, scale_of};
use super::explanation::Explanations;
use super::fixations::{FixationFrame, Fixations};
use super::hand_motion::{HandMotion, MeanVelocity};
use super::way::{Presenting, Way};
use crate::error::SessionError;
use glam::{DMat3, DVec3};
use hwall_arrival::WaitingConfig;
use hwall_contact::{ContactPrediction, PredictionSource};
use hwall_hand::HandState;

/// What the board does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::session) enum Decision {
    /// No touch is expected.
    Wait,
    /// Something may be touched: the arm waits closer to it.
    Preposition(ContactPrediction),
    /// The board goes to the place that is about to be touched.
    Present(ContactPrediction),
}

/// The motion of the hand relative to a predicted place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Motion {
    Rests,
    Reaches,
    Leaves,
}

/// Most predictions that are weighed; the rest are less probable.
const MOST: usize = 8;
/// Mean speed over 0.1 s above which the hand is treated as leaving, m/s.
const LEAVES_M_PER_S: f64 = 0.1;
/// A reaching hand may move away from the surface at up to this fraction of its closing speed, because reaches are curved.
const ALONG_SHARE: f64 = 0.2;
/// At the end of a minimum-jerk reach, the remaining time is this multiple of remaining distance over speed; earlier it is less.
const SLOWS_DOWN: f64 = 3.0;
/// Below this speed the direction of motion is dominated by noise, m/s.
const SLOWEST_M_PER_S: f64 = 0.1;
/// Standard deviation assumed for a time to contact that states none, as a share of the mean.
const NOMINAL_SD_SHARE: f64 = 0.25;
/// The arm waits until all predictions have been finite for this time, s; the same as the supervisor's default recovery time.
const RECOVERY_S: f64 = 0.25;
/// Standard deviation of a person's time from reveal to touch, s.
const WITHIN_PERSON_S: f64 = 0.12;
/// Fixations that begin less than this after the hand came to rest belong to the last touch, s.
const RESTED_S: f64 = 0.1;

/// The policy with its state.
#[derive(Debug, Clone)]
pub(in crate::session) struct Policy {
    config: PolicyConfig,
    /// How far the middle of the board may be from a touch on its face, m.
    reach_m: f64,
    choice: Choice,
    /// Where the board was sent and the hand has not come yet.
    awaited: Option<Goal>,
    way: Option<Way>,
    /// The contact reported after the last frame.
    reported: Option<ContactPrediction>,
    /// When the hand was last reaching, s.
    reached_s: f64,
    /// While the hand reaches for the goal: the most probable place on its surface and the time until the touch there, m and s, in the last
    /// frame.
    left: Option<(DVec3, f64)>,
    /// When the hand was last not at rest, s.
    moved_s: f64,
    /// When a prediction was last not finite, s.
    bad_s: f64,
    last_s: f64,
    fixations: Fixations,
    available_time: AvailableTime,
    /// Time from when the motion of the hand reveals the place to the touch.
    revealed_time: AvailableTime,
    hand_motion: HandMotion,
    /// Reasons for the decisions, for whoever asks.
    pub(in crate::session) explanations: Explanations,
}

impl Policy {
    /// `nominal_s`: available time assumed for an unknown person; `reach_m`: how far the middle of the board may be from a touch on its
    /// face, m.
    pub(in crate::session) fn new(
        config: PolicyConfig,
        nominal_s: f64,
        reach_m: f64,
    ) -> Result<Self, SessionError> {
        config.validate()?;
        Ok(Self {
            config,
            reach_m,
            choice: Choice::Wait,
            awaited: None,
            way: None,
            reported: None,
            reached_s: f64::NEG_INFINITY,
            left: None,
            moved_s: f64::NEG_INFINITY,
            bad_s: f64::NEG_INFINITY,
            last_s: f64::NEG_INFINITY,
            fixations: Fixations::default(),
            available_time: AvailableTime::nominal(nominal_s),
            revealed_time: AvailableTime::nominal(config.onset_share * nominal_s),
            hand_motion: HandMotion::default(),
            explanations: Explanations::default(),
        })
    }

    /// Drops the current choice and reach, for a world that jumped; what was learnt about the person stays.
    pub(in crate::session) fn reset(&mut self) {
        self.choice = Choice::Wait;
        (self.awaited, self.way, self.reported, self.left) = (None, None, None, None);
        [self.reached_s, self.moved_s, self.bad_s, self.last_s] = [f64::NEG_INFINITY; 4];
        self.fixations.forget_fixation();
        self.available_time.forget_reach();
        self.revealed_time.forget_reach();
        self.hand_motion = HandMotion::default();
    }

    /// Time available to the arm before this person touches, s.
    pub(in crate::session) const fn budget_s(&self) -> f64 {
        self.available_time.budget_s()
    }

    /// The contact to report after a frame, and the decision about it. Ranked contacts and hand are in one frame. `None` if no contact is
    /// predicted.
    pub(in crate::session) fn step(
        &mut self,
        t_s: f64,
        ranked: &[ContactPrediction],
        hand: Option<&HandState>,
        arm: &impl Presenting,
    ) -> Option<(ContactPrediction, Decision)> {
        if t_s < self.last_s {
            // The clock was set back.
            self.reset();
        }
        let since_s = t_s - self.last_s;
        self.last_s = t_s;
        self.hand_motion.step(t_s, hand.map(|hand| hand.point_m));
        let Some(first) = ranked.first() else {
            self.available_time.forget_reach();
            self.revealed_time.forget_reach();
            self.turn_to_waiting(t_s, arm);
            return None;
        };
        if !(first.point_m.is_finite() && first.normal.is_finite()) {
            // The control side holds, and reports why.
            self.turn_to_waiting(t_s, arm);
            self.bad_s = t_s;
            return Some((*first, Decision::Present(*first)));
        }
        if t_s - self.bad_s < RECOVERY_S {
            return Some((*first, Decision::Wait));
        }
        let ranked = &ranked[..ranked.len().min(MOST)];
        self.watch(t_s, ranked, hand);
        self.left = self
            .left
            .map(|(point_m, left_s)| (point_m, left_s + since_s));
        let hypothesis = |contact: &ContactPrediction| self.hypothesis(t_s, contact, hand, arm);
        let mut hypotheses = [hypothesis(first); MOST];
        for (into, contact) in hypotheses.iter_mut().zip(ranked).skip(1) {
            *into = hypothesis(contact);
        }
        let hypotheses = &hypotheses[..ranked.len()];
        let chooser = Chooser {
            config: &self.config,
            arm,
            reach_m: self.reach_m,
            hypotheses,
            t_s,
            awaited: self.awaited,
            unknown: self.nominal(),
            glance_s: self.fixations.glance_s(),
            revealed: TouchTime {
                median_s: self.revealed_time.budget_s(),
                scale_s: scale_of(WITHIN_PERSON_S),
                passed_s: 0.0,
            },
        };
        let waits_at = arm.waits_at();
        let way = match self.way.unwrap_or_else(|| Way::at(waits_at)) {
            // The waiting posture has changed.
            way if self.choice == Choice::Wait
                && waits_at.is_some()
                && way.leads_to() != waits_at =>
            {
                way.to(arm, waits_at, t_s)
            }
            way => way,
        };
        let stays = || {
            let contact = self.reported.filter(|_| arm.waits_at().is_none())?;
            let stand = arm.stand(&contact)?;
            Some(Choice::Present(Goal { contact, stand }))
        };
        // An arm without a waiting posture waits where it was last sent.
        let last = match self.choice {
            Choice::Wait => stays().unwrap_or(Choice::Wait),
            choice => choice,
        };
        if self.explanations.are_asked() {
            self.explanations.put(chooser.explain(last, &way));
        }
        let (choice, way) = chooser.best(last, &way);
        self.awaited = self.awaited_after(choice, hypotheses, hand);
        (self.choice, self.way) = (choice, Some(way));
        let reached = hypotheses
            .iter()
            .filter(|place| place.reaches && place.chance > 0.0 && self.is_goal(&place.contact));
        let reached = reached.max_by(|a, b| a.chance.total_cmp(&b.chance));
        self.left = reached.map(|place| (place.contact.point_m, place.time.median_s));
        let decision = match choice {
            Choice::Wait => Decision::Wait,
            Choice::Preposition(goal) => {
                Decision::Preposition(self.newest(&goal.contact, hypotheses))
            }
            Choice::Present(goal) => Decision::Present(self.newest(&goal.contact, hypotheses)),
        };
        let contact = match decision {
            Decision::Wait => {
                // An arm without a waiting posture follows this contact, and need not follow its noise.
                let near = |reported: &ContactPrediction| {
                    reported.surface == first.surface
                        && reported.point_m.distance(first.point_m) <= self.reach_m
                };
                let reported = self.reported.filter(near).unwrap_or(hypotheses[0].contact);
                self.newest(&reported, hypotheses)
            }
            Decision::Preposition(contact) | Decision::Present(contact) => contact,
        };
        self.reported = Some(contact);
        // The time counts from when hand, eyes or habit show the place, whether or not the board was sent.
        let shown = hypotheses
            .iter()
            .filter(|hypothesis| hypothesis.chance > 0.0);
        let shown = shown.max_by(|a, b| a.contact.probability.total_cmp(&b.contact.probability));
        let known = shown.map(|hypothesis| &hypothesis.contact);
        self.available_time
            .step(&TimeFrame::new(t_s, known, &contact, hand));
        let is_revealed = |shown: &Hypothesis| shown.reaches && shown.chance >= 0.5;
        let known = known.filter(|_| shown.is_some_and(is_revealed));
        self.revealed_time
            .step(&TimeFrame::new(t_s, known, &contact, hand));
        Some((contact, decision))
    }

    /// Where the board was sent and the hand has not come yet, if the policy now makes this choice.
    fn awaited_after(
        &self,
        choice: Choice,
        hypotheses: &[Hypothesis],
        hand: Option<&HandState>,
    ) -> Option<Goal> {
        let Choice::Present(goal) = choice else {
            return None;
        };
        let is_sent =
            matches!(self.choice, Choice::Present(last) if last.is_near(&goal, self.reach_m));
        if is_sent && self.awaited.is_none() {
            return None;
        }
        // A hand close to the place that does not come closer has come.
        let is_close = |place: &Hypothesis| {
            let contact = &place.contact;
            contact.surface == goal.contact.surface
                && contact.distance_m <= self.config.near_m
                && contact.point_m.distance(goal.stand.point_m) <= self.reach_m
        };
        let comes = (self.mean_velocity_m_per_s(hand))
            .is_some_and(|velocity| velocity.dot(goal.contact.normal) < -self.config.reach_m_per_s);
        let has_come = !comes && hypotheses.iter().any(is_close);
        (!has_come).then_some(goal)
    }

    /// Velocity of the hand, m/s. The mean suppresses the noise of the tracker.
    fn mean_velocity_m_per_s(&self, hand: Option<&HandState>) -> Option<DVec3> {
        let mean = self.hand_motion.velocity();
        mean.map(|velocity| velocity.mean_m_per_s)
            .or(hand.map(|hand| hand.velocity_m_per_s))
    }

    fn turn_to_waiting(&mut self, t_s: f64, arm: &impl Presenting) {
        (self.reported, self.left) = (None, None);
        if self.choice != Choice::Wait {
            (self.choice, self.awaited) = (Choice::Wait, None);
            self.way = self.way.map(|way| way.to(arm, arm.waits_at(), t_s));
        }
    }

    /// Updates what is known about hand and eyes.
    fn watch(&mut self, t_s: f64, ranked: &[ContactPrediction], hand: Option<&HandState>) {
        let still_m_per_s = self.config.still_m_per_s;
        let velocity = self.mean_velocity_m_per_s(hand);
        let is_still = velocity.is_none_or(|velocity| velocity.length() < still_m_per_s);
        // A fixation that began before the first frame does not count.
        if !is_still || self.moved_s == f64::NEG_INFINITY {
            self.moved_s = t_s;
        }
        let reaches = ranked
            .first()
            .is_some_and(|first| self.motion(first, hand) == Motion::Reaches);
        if reaches {
            self.reached_s = t_s;
        }
        self.fixations.step(&FixationFrame {
            t_s,
            since_s: ranked
                .iter()
                .find_map(|contact| self.chosen_since_s(contact)),
            reaches,
            is_still,
        });
    }

    /// Start of the fixation on a place, s, unless it only follows the last touch.
    fn chosen_since_s(&self, contact: &ContactPrediction) -> Option<f64> {
        let since_s = contact.looked_at_since_s?;
        (since_s >= self.moved_s + RESTED_S).then_some(since_s)
    }

    /// Time of the next touch if nothing is known about it.
    const fn nominal(&self) -> TouchTime {
        TouchTime {
            median_s: self.budget_s(),
            scale_s: WaitingConfig::NOMINAL_SOFTNESS_S,
            passed_s: 0.0,
        }
    }

    /// A predicted place, with the evidence of hand and eyes that it will be touched soon.
    fn hypothesis(
        &self,
        t_s: f64,
        contact: &ContactPrediction,
        hand: Option<&HandState>,
        arm: &impl Presenting,
    ) -> Hypothesis {
        let nominal = self.nominal();
        let contact = &expected_soon(*contact, hand);
        let stated =
            (contact.time_to_contact_s).filter(|time| (0.0..f64::INFINITY).contains(&time.mean_s));
        let expected = stated.map_or(nominal, |time| {
            let sd_s = time.sd_s.filter(|sd_s| *sd_s >= 0.0);
            TouchTime {
                median_s: time.mean_s,
                scale_s: scale_of(sd_s.unwrap_or(NOMINAL_SD_SHARE * time.mean_s)),
                passed_s: 0.0,
            }
        });
        // As the hand slows down before the touch, estimates jump up: within a reach, the time left grows no faster than time passes.
        let same_place = |(at_m, _): &(DVec3, f64)| at_m.distance(contact.point_m) <= self.reach_m;
        let expected = match self.left.filter(same_place) {
            Some((_, left_s)) if self.is_goal(contact) => TouchTime {
                median_s: expected.median_s.min(left_s),
                ..expected
            },
            _ => expected,
        };
        let meant = 1.0 - self.config.detour_share;
        let goes_on = t_s - self.reached_s <= self.config.pause_s && self.is_goal(contact);
        let (share, time) = match self.motion(contact, hand) {
            Motion::Leaves => (0.0, expected),
            Motion::Reaches => (meant, expected),
            Motion::Rests if goes_on => (meant, expected),
            Motion::Rests => match contact.looked_at_since_s {
                Some(_) => match self.chosen_since_s(contact) {
                    Some(since_s) => {
                        let passed_s = (t_s - since_s).max(0.0);
                        let time = TouchTime {
                            passed_s,
                            ..nominal
                        };
                        let awaited = time.still_awaited();
                        (self.fixations.leads(meant, passed_s, awaited), time)
                    }
                    None => (0.0, nominal),
                },
                // Without a fixation, only habit says that a place is next.
                None if contact.source == PredictionSource::TouchedBefore => (1.0, nominal),
                None => (0.0, nominal),
            },
        };
        let chance = share * contact.probability;
        Hypothesis {
            reaches: self.motion(contact, hand) == Motion::Reaches || goes_on,
            contact: *contact,
            sds_m: self.config.slack.sds_m(contact),
            chance,
            time,
            stand: if chance > 0.0 {
                arm.stand(contact)
            } else {
                None
            },
        }
    }

    /// Is the board there, or on its way there?
    fn is_goal(&self, contact: &ContactPrediction) -> bool {
        matches!(self.choice, Choice::Present(goal) if goal.contact.surface == contact.surface)
    }

    /// A place that is kept, updated: the newest prediction on its surface, at the point that is kept.
    fn newest(&self, held: &ContactPrediction, hypotheses: &[Hypothesis]) -> ContactPrediction {
        let near = hypotheses.iter().map(|hypothesis| &hypothesis.contact);
        let near = near.filter(|contact| contact.surface == held.surface);
        let off_m = |contact: &ContactPrediction| contact.point_m.distance(held.point_m);
        let Some(newest) = near.min_by(|a, b| off_m(a).total_cmp(&off_m(b))) else {
            return *held;
        };
        let off = newest.point_m - held.point_m;
        let known_m2 = newest.covariance_m2.unwrap_or_else(|| {
            DMat3::from_diagonal(DVec3::splat(self.config.slack.default_sd_m.powi(2)))
        });
        let about_m2 = DMat3::from_cols(off * off.x, off * off.y, off * off.z);
        ContactPrediction {
            point_m: held.point_m,
            normal: held.normal,
            covariance_m2: (off != DVec3::ZERO)
                .then_some(known_m2 + about_m2)
                .or(newest.covariance_m2),
            ..*newest
        }
    }

    fn motion(&self, contact: &ContactPrediction, hand: Option<&HandState>) -> Motion {
        let Some(hand) = hand else {
            return Motion::Rests;
        };
        let is_goal = self.is_goal(contact);
        let is_fast = hand.velocity_m_per_s.length() >= self.config.still_m_per_s;
        let velocity = self.hand_motion.velocity();
        // Without a history, only fast motion can be distinguished from noise.
        let found_m_per_s = hand.velocity_m_per_s * f64::from(u8::from(is_fast));
        let mean_m_per_s = velocity.map_or(found_m_per_s, |velocity| velocity.mean_m_per_s);
        let off_m_per_s = mean_m_per_s.dot(contact.normal);
        if contact.distance_m <= self.config.near_m {
            // Close to the surface, the direction to a point on it is unreliable, and people who search for the place move back and forth at up to
            // 0.25 m/s. A hand that has left returns with a clear motion.
            return match !is_goal && off_m_per_s > self.config.reach_m_per_s {
                true => Motion::Leaves,
                false => Motion::Reaches,
            };
        }
        let way = (contact.point_m - hand.point_m).normalize_or_zero();
        let closing_m_per_s = mean_m_per_s.dot(way);
        // A hand that comes to rest after a touch also approaches some place, but it loses speed.
        let gains = |velocity: MeanVelocity| velocity.gained_m_per_s.dot(way) >= 0.0;
        let sets_off = is_goal || is_fast || velocity.is_none_or(gains);
        // A hand that retracts upwards approaches a point above it, but not its surface.
        let is_towards = off_m_per_s <= ALONG_SHARE * closing_m_per_s;
        if closing_m_per_s >= self.config.reach_m_per_s && is_towards && sets_off {
            Motion::Reaches
        } else if closing_m_per_s <= -LEAVES_M_PER_S || off_m_per_s >= LEAVES_M_PER_S {
            Motion::Leaves
        } else {
            Motion::Rests
        }
    }
}

/// Caps the time to contact at its value for the end of a minimum-jerk reach: a time learnt from all people is too late for fast people.
fn expected_soon(mut contact: ContactPrediction, hand: Option<&HandState>) -> ContactPrediction {
    if let (Some(hand), Some(time)) = (hand, &mut contact.time_to_contact_s) {
        let way = contact.point_m - hand.point_m;
        let closing_m_per_s = hand.velocity_m_per_s.dot(way.normalize_or_zero());
        if closing_m_per_s > SLOWEST_M_PER_S {
            time.mean_s = time.mean_s.min(SLOWS_DOWN * way.length() / closing_m_per_s);
        }
    }
    contact
}

#[cfg(test)]
mod tests;
