//! How people look, learnt from reaches or from whole streams.

use super::super::gaussian::Gaussian;
use super::super::hand::phase::ReachPhase;
use super::super::hand::place::{HandPlace, by_motion_alone, gaussian_of};
use super::super::stream::StreamEstimator;
use super::idle::IdlePlaces;
use super::maximisation::{Angle, Collected, LABEL_SD_M, Row, WIDEST_RAD, log_ahead, log_tailed};
use super::memory::GazeMemory;
use super::model::GazeModel;
use super::shares::{LookShares, TargetShares};
use super::weights::{ASTRAY_SHARE, ASTRAY_STRETCH};
use crate::error::ContactError;
use crate::estimate::ContactEstimator;
use crate::matrices::isotropic;
use glam::DVec3;
use hwall_hand::{
    GazeFilter, GazeFilterConfig, HandFilter, HandFilterConfig, HandFrame, HandState,
    LabelledReach, WatchConfig,
};
use hwall_numeric::check::{all_finite, finite};

/// A person's samples, and where and when they touch: to learn from what people do between and before their reaches.
#[derive(Debug, Clone, Copy)]
pub struct LabelledStream<'a> {
    /// As the tracker saw them, in order of time, in the frame of the contacts.
    pub frames: &'a [HandFrame],
    /// All contacts in these samples, in order of time.
    pub contacts: &'a [StreamContact],
}

/// A contact in a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamContact {
    /// Where, m.
    pub point_m: DVec3,
    /// When the hand arrives, s.
    pub contact_s: f64,
}

/// The filters that a stream is seen through; the same as in use.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StreamFilters {
    /// How the hand is smoothed.
    pub hand: HandFilterConfig,
    /// What counts as a fixation.
    pub gaze: GazeFilterConfig,
    /// What begins and ends a reach.
    pub watch: WatchConfig,
}

/// Fewest samples of reaches, and fewest touches of streams, that can be learnt from.
const LEAST_SAMPLES: usize = 20;
const LEAST_TOUCHES: usize = 4;

/// Samples closer together than this say the same, s.
const STEP_S: f64 = 0.02;

/// A hand that is at rest this far from its last contact is on its way to the next, m.
const AWAY_M: f64 = 0.08;

/// Spread of an estimate without one, m.
const DEFAULT_SD_M: f64 = 0.1;

/// Rounds of expectation maximisation.
const ROUNDS: usize = 40;

impl GazeModel {
    /// Learns both spreads and the share of looks elsewhere from reaches, by expectation maximisation over the angles of
    /// all samples up to the contact. The share is set for every phase of a reach and every age of a look; the rest
    /// stays as in `self`. Streams say more: [`fit_streams`](Self::fit_streams).
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
        if angles_rad.len() < LEAST_SAMPLES {
            return Err(ContactError::TooFewReaches {
                got: angles_rad.len(),
                needed: LEAST_SAMPLES,
            });
        }
        let mut model = self;
        let start = self.looks.at(ReachPhase::UnderWay, 0.5);
        let mut share = start.as_moves.elsewhere + start.anew.elsewhere;
        for _ in 0..100 {
            let (mut on, mut on_square, mut off_square) = (0.0, 0.0, 0.0);
            for angle in &angles_rad {
                let density =
                    |share: f64, sd: f64| share * (-0.5 * (angle / sd).powi(2)).exp() / (sd * sd);
                let near = density(1.0 - share, model.on_target_sd_rad);
                let far = density(share, model.elsewhere_sd_rad);
                let is_on = if near + far > 0.0 {
                    near / (near + far)
                } else {
                    0.0
                };
                on += is_on;
                on_square += is_on * angle * angle;
                off_square += (1.0 - is_on) * angle * angle;
            }
            let off = angles_rad.len() as f64 - on;
            // One pseudo-sample at the start value keeps a component without samples where it was.
            let pooled = |square: f64, n: f64, start: f64| {
                ((square + 2.0 * start * start) / (2.0 * n + 2.0)).sqrt()
            };
            model.on_target_sd_rad = pooled(on_square, on, self.on_target_sd_rad).max(1e-3);
            model.elsewhere_sd_rad =
                pooled(off_square, off, self.elsewhere_sd_rad).max(2.0 * model.on_target_sd_rad);
            share = ((off + 1.0) / (angles_rad.len() as f64 + 2.0)).clamp(1e-3, 1.0 - 1e-3);
        }
        for phase in ReachPhase::ALL {
            model
                .looks
                .set(phase, with_elsewhere(self.looks.at(phase, 0.5), share));
        }
        model.touches = reaches.len();
        Ok(model)
    }

    /// Learns all of it from streams: spreads, where people touch seen from their resting hand, and how often the present look,
    /// the one before it, or neither is at the place of the next contact, by the age of the look and the phase of the reach. The
    /// estimator (given the number of the stream) is one as will be used, best not learnt from that stream: how far its word can
    /// be taken in each phase is learnt with it.
    ///
    /// Samples from the time at which the hand rests after a contact until the next contact are used; the touches count, not
    /// the samples. Streams without a gaze teach what they can.
    ///
    /// # Errors
    /// Fewer than 4 touches; a contact that is not finite; settings that a filter refuses.
    pub fn fit_streams<E: ContactEstimator>(
        self,
        streams: &[LabelledStream<'_>],
        mut estimator: impl FnMut(usize) -> E,
        filters: &StreamFilters,
    ) -> Result<Self, ContactError> {
        for contact in streams.iter().flat_map(|stream| stream.contacts) {
            all_finite("point_m", &contact.point_m.to_array())?;
            finite("contact_s", contact.contact_s)?;
        }
        let mut collected = Collected::default();
        for (number, stream) in streams.iter().enumerate() {
            let mut estimator = StreamEstimator::new(estimator(number), filters.watch)?;
            self.collect(stream, &mut estimator, filters, &mut collected)?;
        }
        if collected.touches < LEAST_TOUCHES {
            return Err(ContactError::TooFewReaches {
                got: collected.touches,
                needed: LEAST_TOUCHES,
            });
        }
        let mut model = self;
        model.touches = collected.touches;
        collected.weigh();
        for _ in 0..ROUNDS {
            model = collected.improved(&self, &model);
        }
        model.validate()?;
        Ok(model)
    }

    /// The rows of one stream.
    fn collect<E: ContactEstimator>(
        &self,
        stream: &LabelledStream<'_>,
        estimator: &mut StreamEstimator<E>,
        filters: &StreamFilters,
        collected: &mut Collected,
    ) -> Result<(), ContactError> {
        let mut hand = HandFilter::new(filters.hand)?;
        let mut gaze = GazeFilter::new(filters.gaze)?;
        let mut memory = GazeMemory::default();
        let mut idle = IdlePlaces::default();
        let mut contacts = stream.contacts.iter();
        let (mut last, mut next) = (None::<&StreamContact>, contacts.next());
        let mut on_the_way = true;
        let mut last_s = f64::NEG_INFINITY;
        for frame in stream.frames {
            while let Some(over) = next.filter(|c| frame.t_s >= c.contact_s) {
                (last, next) = (Some(over), contacts.next());
                on_the_way = false;
                collected.touches += 1;
            }
            let Some(contact) = next else { break };
            let tracking = hand.step(frame);
            estimator.step(frame, tracking.state());
            let seen = gaze.step(frame.t_s, frame.gaze_ray().as_ref());
            memory.step(frame.t_s, &seen, self.apart_rad());
            let hand_m = tracking.state().map(|hand| hand.point_m);
            idle.step(&memory, estimator.reaching(), hand_m, self.apart_rad());
            let Some(state) = tracking.state() else {
                continue;
            };
            let away_m = last.map_or(f64::INFINITY, |c| c.point_m.distance(state.point_m));
            on_the_way |= !estimator.reaching() && away_m > AWAY_M;
            if on_the_way && frame.t_s - last_s >= STEP_S {
                last_s = frame.t_s;
                let row = self.row(state, estimator, (&memory, &idle), contact, &filters.watch);
                let touch = collected.touches;
                collected.rows.extend(row.map(|row| Row { touch, ..row }));
            }
        }
        Ok(())
    }

    /// What one sample says about a contact.
    fn row<E: ContactEstimator>(
        &self,
        hand: &HandState,
        stream: &StreamEstimator<E>,
        (memory, idle): (&GazeMemory, &IdlePlaces),
        contact: &StreamContact,
        watch: &WatchConfig,
    ) -> Option<Row> {
        let (estimate, began) = (stream.estimate(), stream.began());
        let moves = estimate.and_then(|e| gaussian_of(e, DEFAULT_SD_M));
        let place = HandPlace::new(hand, began, stream.stirred_m(), estimate, watch);
        let by_motion = estimate
            .and_then(|e| by_motion_alone(e, began, DEFAULT_SD_M))
            .or(moves);
        let log_density = |g: Option<Gaussian>| {
            g.and_then(|g| g.widened(isotropic(LABEL_SD_M)))
                .map_or(f64::NEG_INFINITY, |g| {
                    log_tailed(&g, contact.point_m, ASTRAY_SHARE, ASTRAY_STRETCH)
                })
        };
        let (now, before) = memory.looks(hand.t_s, self.memory_s);
        let row = Row {
            touch: 0,
            phase: place.phase,
            age_s: now.map_or(0.0, |look| look.age_s(hand.t_s)),
            idle: now.and_then(|look| idle.share(look, self.apart_rad())),
            weight: 0.0,
            log_as_moves: log_density(moves),
            log_by_motion: log_density(by_motion),
            log_changed: self.log_changed(
                moves.as_ref(),
                began.map(|began| began.since_s),
                memory,
                hand.t_s,
            ),
            from_rest: contact.point_m - place.rest_m,
            log_ahead: hand
                .direction
                .filter(|_| place.moves)
                .map(|ahead| log_ahead(contact.point_m - hand.point_m, ahead)),
            now: now.map(|look| Angle::new(look, contact.point_m)),
            before: before.map(|(look, ago_s)| {
                let fade = 1.0 - ago_s / self.memory_s;
                (Angle::new(look, contact.point_m), fade)
            }),
        };
        row.from_rest.is_finite().then_some(row)
    }
}

/// The same shares with another one for looks elsewhere.
fn with_elsewhere(shares: LookShares, elsewhere: f64) -> LookShares {
    let on = |s: TargetShares| s.now + s.before;
    let all_on = on(shares.as_moves) + on(shares.anew);
    let all_off = shares.as_moves.elsewhere + shares.anew.elsewhere;
    let (a, b) = ((1.0 - elsewhere) / all_on, elsewhere / all_off);
    let scaled = |s: TargetShares| TargetShares {
        now: s.now * a,
        before: s.before * a,
        elsewhere: s.elsewhere * b,
    };
    LookShares {
        as_moves: scaled(shares.as_moves),
        anew: scaled(shares.anew),
    }
}
