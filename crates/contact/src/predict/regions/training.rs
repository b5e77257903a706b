//! Learns region sizes from prediction errors over whole streams.

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

pub(super) const LEAST_TOUCHES: usize = 4;
/// A contact within this distance of a surface is on it, m.
const ON_IT_M: f64 = 0.05;
/// A hand at rest this far from its last contact belongs to the next one, m.
const AWAY_M: f64 = 0.08;
/// Smaller squared distances are raised to this value.
const LEAST_SQUARED: f64 = 1e-6;
/// Bound of the logarithms of squared distances: far outside realistic values.
pub(super) const MOST_LOGARITHM: f64 = 20.0;
/// Largest quantile level; a higher one cannot be estimated from few touches.
const MOST_SHARE: f64 = 0.98;

impl RegionModel {
    /// Learns from the errors of predictors over streams in a scene. `predictor` receives the index of the stream and returns a predictor not
    /// trained on it, best with a [`HeldOutEstimator`](crate::HeldOutEstimator): errors on training data are smaller than those on new data. Uses
    /// the samples of a reach up to the contact while the right surface is ranked first; all touches have equal weight. The touches of one stream
    /// are of one person and correlated.
    ///
    /// The model describes the prediction error without the registration error, so `predictor` must be configured with the registration error of
    /// the recordings: 0 for simulated ones ([`FusedConfig::registration_sd_m`](crate::FusedConfig::registration_sd_m)).
    ///
    /// # Errors
    /// Fewer than 4 touches with a prediction; a contact that is not finite; settings that a filter rejects; errors of `predictor`.
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
        // A new error lies below a quantile of few known errors less often than the known errors do, and there are fewer independent errors than
        // touches.
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
    /// Number of touches with a usable sample.
    touches: usize,
    /// That number after each person.
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
            // A place touched before states its own uncertainty; the model is for the estimator.
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
        // After the last contact there is no ground truth.
        if next.is_some() {
            self.misses.truncate(first);
        }
        Ok(())
    }

    /// The samples from `first` on belong to one touch.
    fn weigh(&mut self, first: usize) {
        let samples = &mut self.misses[first..];
        let count = samples.len();
        self.touches += usize::from(count > 0);
        for miss in samples {
            miss.weight = 1.0 / count as f64;
        }
    }
}
