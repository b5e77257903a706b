//! Sizes of regions from the errors of predictions over whole streams.

use super::super::belief::{FusedPredictor, LabelledStream, StreamFilters};
use super::super::prediction::{ContactPrediction, PredictionSource, Predictor, PredictorInput};
use super::alike::independent;
use super::model::{BetweenWays, KNOTS, RegionModel};
use super::quantiles::{Miss, quantiles};
use super::sizes::{REGION_SHARES, RegionSizes};
use crate::error::ContactError;
use crate::estimate::ContactEstimator;
use glam::DVec3;
use hwall_hand::{GazeFilter, HandFilter};
use hwall_numeric::check::{all_finite, finite};
use hwall_scene::{Scene, SurfaceId};

/// Fewest touches that can be learnt from.
pub(super) const LEAST_TOUCHES: usize = 4;
/// A contact is on a surface within this, m.
const ON_IT_M: f64 = 0.05;
/// A hand that is at rest this far from its last contact is on its way to the next, m.
const AWAY_M: f64 = 0.08;
/// Smaller squared distances are as good as this one.
const LEAST_SQUARED: f64 = 1e-6;
/// Squared distances lie between this and its inverse, as logarithms: what is learnt does by far.
pub(super) const MOST_LOGARITHM: f64 = 20.0;
/// Of few touches a new one lies beyond the largest error with this probability at least.
const MOST_SHARE: f64 = 0.98;

impl RegionModel {
    /// Learns from the errors of predictors over streams in a scene; `predictor` is given the number of the stream and makes one
    /// that has not learnt from it, best with a [`HeldOutEstimator`](crate::HeldOutEstimator): errors on what was learnt from are smaller than
    /// those to come. Samples of a reach up to the contact are used while the right surface comes first, and all touches count
    /// alike; those of one stream are of one person, whose errors are alike.
    ///
    /// What is learnt is how far off predictions are beside the error of registration, so the settings of `predictor` must state
    /// what that was when the streams were made: 0 for simulated ones ([`FusedConfig::registration_sd_m`](crate::FusedConfig::registration_sd_m)).
    ///
    /// # Errors
    /// Fewer than 4 touches with a prediction; a contact that is not finite; settings that a filter refuses; what `predictor` refuses.
    pub fn fit_streams<E: ContactEstimator>(
        scene: &Scene,
        streams: &[LabelledStream<'_>],
        mut predictor: impl FnMut(usize) -> Result<FusedPredictor<E>, ContactError>,
        filters: &StreamFilters,
    ) -> Result<Self, ContactError> {
        let mut collected = Collected::default();
        for (number, stream) in streams.iter().enumerate() {
            collected.collect(scene, stream, &mut predictor(number)?, filters)?;
            collected.people.push(collected.touches);
        }
        let touches = collected.touches;
        if touches < LEAST_TOUCHES {
            return Err(ContactError::TooFewReaches {
                got: touches,
                needed: LEAST_TOUCHES,
            });
        }
        // A new error lies below the quantile of few less often than they do, and there are fewer independent ones than touches.
        let n = independent(&collected.misses, &collected.people);
        let each: [[f64; KNOTS]; 3] = std::array::from_fn(|k| {
            let share = (REGION_SHARES[k] * (n + 1.0) / n).min(MOST_SHARE);
            let expected = RegionSizes::NORMAL.squared()[k].ln();
            quantiles(&collected.misses, k, share, expected)
        });
        Ok(Self {
            logarithms: std::array::from_fn(|knot| {
                std::array::from_fn(|k| each[k][knot].clamp(-MOST_LOGARITHM, MOST_LOGARITHM))
            }),
            touches,
        })
    }
}

/// A contact, and the surface that it is on.
#[derive(Debug, Clone, Copy)]
struct Contact {
    point_m: DVec3,
    contact_s: f64,
    surface: Option<SurfaceId>,
}

#[derive(Debug, Default)]
struct Collected {
    misses: Vec<Miss>,
    /// Those with a sample that counts.
    touches: usize,
    /// How many of them there were after each person.
    people: Vec<usize>,
}

impl Collected {
    fn collect<E: ContactEstimator>(
        &mut self,
        scene: &Scene,
        stream: &LabelledStream<'_>,
        predictor: &mut FusedPredictor<E>,
        filters: &StreamFilters,
    ) -> Result<(), ContactError> {
        let mut contacts = Vec::with_capacity(stream.contacts.len());
        for contact in stream.contacts {
            all_finite("point_m", &contact.point_m.to_array())?;
            finite("contact_s", contact.contact_s)?;
            let closest = scene.closest_touchable(contact.point_m, ON_IT_M);
            contacts.push(Contact {
                point_m: contact.point_m,
                contact_s: contact.contact_s,
                surface: closest.ok().flatten().map(|closest| closest.surface),
            });
        }
        let mut hand = HandFilter::new(filters.hand)?;
        let mut gaze = GazeFilter::new(filters.gaze)?;
        let mut due = contacts.iter();
        let (mut last, mut next) = (None::<&Contact>, due.next());
        let mut on_the_way = true;
        let mut first = self.misses.len();
        for frame in stream.frames {
            while let Some(over) = next.filter(|c| frame.t_s >= c.contact_s) {
                (last, next) = (Some(over), due.next());
                on_the_way = false;
                self.weigh(first);
                first = self.misses.len();
            }
            let Some(contact) = next else { break };
            let tracking = hand.step(frame);
            let input = PredictorInput {
                frame,
                hand: tracking.state(),
                gaze: gaze.step(frame.t_s, frame.gaze_ray().as_ref()),
            };
            let prediction = predictor.predict(scene, &input).first().copied();
            let Some(state) = tracking.state() else {
                continue;
            };
            let reaches = predictor.estimate().is_some();
            let away_m = last.map_or(f64::INFINITY, |c| c.point_m.distance(state.point_m));
            on_the_way |= !reaches && away_m > AWAY_M;
            let counts = reaches && on_the_way;
            // A place touched before says of itself how sure it is; what is learnt is of the estimator.
            let of_motion = |p: &ContactPrediction| p.source != PredictionSource::TouchedBefore;
            let Some(prediction) =
                prediction.filter(|p| counts && contact.surface == Some(p.surface) && of_motion(p))
            else {
                continue;
            };
            let squared = prediction.squared_deviations(contact.point_m);
            let Some((squared, error)) = squared
                .filter(|squared| squared.is_finite())
                .zip(predictor.in_plane_error(&prediction))
            else {
                continue;
            };
            self.misses.push(Miss {
                at: BetweenWays::of(state.point_m.distance(prediction.point_m)),
                touch: self.touches,
                logarithms: error
                    .own_squared(squared)
                    .map(|own| own.max(LEAST_SQUARED).ln()),
                weight: 1.0,
            });
        }
        // After the last contact nothing is known.
        if next.is_some() {
            self.misses.truncate(first);
        }
        Ok(())
    }

    /// The samples from the first on are those of one touch.
    fn weigh(&mut self, first: usize) {
        let samples = &mut self.misses[first..];
        let count = samples.len();
        self.touches += usize::from(count > 0);
        for miss in samples {
            miss.weight = 1.0 / count as f64;
        }
    }
}
