//! Ranks the surfaces: from the weights of faces to predictions, the most probable first.

use super::{EvidenceSource, FusedPredictor};
use crate::estimate::{ContactEstimator, TimeToContact};
use crate::matrices::{isotropic, square};
use crate::predict::face_moments::Moments;
use crate::predict::hand::resting::SurfacePlace;
use crate::predict::prediction::{ContactPrediction, PredictionSource};
use crate::predict::surface_shares::Face;
use glam::DVec3;
use hwall_hand::HandState;
use hwall_scene::Scene;

/// Probability that a hand at rest on a surface is about to leave for another one; divided among the other surfaces as for a hand that rests
/// elsewhere.
const LEAVING_SHARE: f64 = 0.1;

/// The hand touches already.
const NOW: TimeToContact = TimeToContact {
    mean_s: 0.0,
    sd_s: None,
};

/// Longest time that is predicted from the speed of the hand, s.
const LONGEST_S: f64 = 2.0;

/// Least standard deviation of a prediction, m, so that no covariance is singular.
const LEAST_SD_M: f64 = 1e-3;

impl<E: ContactEstimator> FusedPredictor<E> {
    /// Adds up the faces of each surface; a surface under a resting hand is added separately.
    pub(super) fn rank(
        &mut self,
        scene: &Scene,
        hand: &HandState,
        behind: bool,
        touched: Option<SurfacePlace>,
    ) {
        let faces = self.shares.faces();
        let total: f64 = faces.iter().map(|f| f.mass).sum();
        let others = touched.map_or(1.0, |_| LEAVING_SHARE);
        let dwell = self.gaze.now();
        // A place touched before is listed separately from the rest of its surface.
        let key = |index: usize| {
            let face = &faces[index];
            let is_place = face.source == EvidenceSource::TouchedBefore;
            (face.surface, is_place.then_some(index))
        };
        let of = |index: usize| {
            let same = move |other: &usize| key(*other) == key(index);
            (0..faces.len()).filter(same).map(|other| &faces[other])
        };
        let weight_of = |index: usize| of(index).map(|f| f.mass).sum::<f64>();
        let is_touched = |f: &Face| touched.is_some_and(|t| t.surface == f.surface);
        let first = |index: usize| (0..index).all(|other| key(other) != key(index));
        let best_weight = (0..faces.len()).map(weight_of).fold(0.0, f64::max);
        let least = if touched.is_some() {
            self.config.min_probability * total / others
        } else {
            (self.config.min_probability * total).min(best_weight)
        };
        let mut probability = 0.0;
        for (index, face) in faces.iter().enumerate() {
            if is_touched(face) || !first(index) {
                continue;
            }
            let weight = weight_of(index);
            if weight < least {
                continue;
            }
            let Some(best) = of(index).max_by(|a, b| a.mass.total_cmp(&b.mass)) else {
                continue;
            };
            // Anywhere does not say where on a surface. During a reach, it still holds the tail of the estimator's errors, so it widens the
            // covariance.
            let is_vague = |f: &Face| f.source == EvidenceSource::Anywhere;
            let only_vague = is_vague(best);
            let says_where = |f: &Face| only_vague || !is_vague(f);
            let widens = |f: &&Face| self.in_reach || says_where(f);
            let moments = Moments::of(|| of(index).filter(widens), best, says_where);
            let met = SurfacePlace {
                surface: face.surface,
                point_m: best.met_m,
                normal: best.normal,
            };
            let SurfacePlace {
                point_m, normal, ..
            } = met.below(scene, moments.mean_m).unwrap_or(met);
            let off_plane_m = self.config.registration_sd_m.hypot(LEAST_SD_M);
            let covariance_m2 = moments.covariance_m2
                + square(point_m - moments.mean_m)
                + square(best.normal * off_plane_m);
            let distance_m = (hand.point_m - point_m).dot(normal);
            let p = others * weight / total;
            probability += p;
            self.ranked.push(ContactPrediction {
                surface: face.surface,
                point_m,
                covariance_m2: Some(covariance_m2),
                normal,
                roughness: scene.surface(face.surface).roughness,
                distance_m,
                time_to_contact_s: self.time_to(hand, point_m, behind && distance_m <= 0.0),
                probability: p,
                source: match best.source {
                    EvidenceSource::Fixation | EvidenceSource::PreviousFixation => {
                        PredictionSource::Gaze
                    }
                    EvidenceSource::TouchedBefore => PredictionSource::TouchedBefore,
                    EvidenceSource::Anywhere if self.estimate.is_none() => {
                        PredictionSource::Nearest
                    }
                    _ => PredictionSource::Motion,
                },
                looked_at_since_s: dwell
                    .filter(|dwell| self.is_looked_at(&dwell.ray, point_m))
                    .map(|dwell| dwell.since_s),
            });
        }
        if let Some(touched) = touched {
            let SurfacePlace {
                surface,
                point_m,
                normal,
            } = touched;
            self.ranked.push(ContactPrediction {
                covariance_m2: Some(isotropic(self.config.registration_sd_m.hypot(LEAST_SD_M))),
                roughness: scene.surface(surface).roughness,
                distance_m: (hand.point_m - point_m).dot(normal),
                time_to_contact_s: Some(NOW),
                probability: 1.0 - probability,
                source: PredictionSource::Nearest,
                ..ContactPrediction::of_place(surface, point_m, normal)
            });
            probability = 1.0;
        }
        self.ranked
            .iter_mut()
            .for_each(|a| a.probability /= probability);
        self.ranked
            .sort_unstable_by(|a, b| b.probability.total_cmp(&a.probability));
    }

    /// The estimator's time; otherwise distance over closing speed, if the hand clearly approaches.
    fn time_to(&self, hand: &HandState, point_m: DVec3, there: bool) -> Option<TimeToContact> {
        if there {
            return Some(NOW);
        }
        let usable = |t: &TimeToContact| t.mean_s.is_finite() && t.sd_s.is_none_or(f64::is_finite);
        let estimated = self
            .estimate
            .and_then(|e| e.time_to_contact_s)
            .filter(usable);
        estimated.or_else(|| {
            let way = point_m - hand.point_m;
            let closing = hand.velocity_m_per_s.dot(way.try_normalize()?);
            let mean_s = way.length() / closing;
            // Slower hands are resting, and no reach takes longer.
            let clearly = closing > self.config.watch.offset_m_per_s && mean_s <= LONGEST_S;
            clearly.then_some(TimeToContact { mean_s, sd_s: None })
        })
    }
}
