//! Which surface is about to be touched, where and when: by one ray, or by all evidence.
//!
//! # The fused predictor
//!
//! `FusedPredictor` keeps a mixture over the sources of the next contact: the motion of the hand, the present and the previous fixation, the places
//! this person has touched, and anywhere else (`EvidenceSource`). `EvidenceModel::fit_streams` learns from whole streams and their contacts
//! (`LabelledStream`) how often each source is right, depending on the phase of the hand (`ReachPhase`: at rest, starting to move, onset, under
//! way, near the end), the age of the fixation, and, while the hand moves, the agreement of fixation and motion. It also learns how far a fixation is from its target, and where people touch relative to their
//! resting hand. Each touch updates the reliability of each source for this person. `ContactPrediction::looked_at_since_s` is the start of the
//! fixation on the predicted place. The covariance lies in the plane of the surface, so it is wide along a surface seen at a slant. During
//! saccades, and for 0.3 s after the gaze is lost, the last fixation is used.
//!
//! A model with fewer training reaches than `FusedConfig::least_reaches` is not used: `FusedPredictor::experience` reports this, and the gaze ray
//! is used instead (`DeterministicConfig::ray_led`).
//!
//! # The dissertation's predictor
//!
//! ```rust
//! use glam::DVec3;
//! use hwall_contact::{DeterministicPredictor, PredictionSource, Predictor, PredictorInput};
//! use hwall_hand::{Gaze, HandFilter, HandFilterConfig, HandFrame};
//! use hwall_scene::Scene;
//!
//! // A wall at x = 1 m, and a hand that approaches it at 1 m/s; there is no gaze.
//! let wall = "o wall\nv 1 -1 0\nv 1 1 0\nv 1 1 2\nv 1 -1 2\nf 1 4 3 2\n";
//! let (scene, _) = Scene::from_obj_str(wall, None)?;
//! let mut filter = HandFilter::new(HandFilterConfig::simulated())?;
//! let mut predictor = DeterministicPredictor::default();
//! let mut last = None;
//! for i in 0..40 {
//!     let t_s = 0.014 * i as f64;
//!     let mut frame = HandFrame::empty(t_s);
//!     frame.palm_m = Some(DVec3::new(0.2 + t_s, 0.1, 1.2));
//!     let tracking = filter.step(&frame);
//!     let input = PredictorInput { frame: &frame, hand: tracking.state(), gaze: Gaze::Lost };
//!     last = predictor.predict(&scene, &input).first().copied();
//! }
//! let contact = last.expect("the hand moves towards the wall");
//! assert_eq!(contact.source, PredictionSource::HandDirection);
//! assert!(contact.point_m.distance(DVec3::new(1.0, 0.1, 1.2)) < 1e-9);
//! assert!((contact.time_to_contact_s.unwrap().mean_s - (1.0 - 0.2 - 0.014 * 39.0)).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod belief;
mod deterministic;
mod face_moments;
mod fused_config;
mod gaussian;
mod gaze_memory;
mod hand;
mod prediction;
mod stream;
mod surface_shares;

pub use belief::{
    EvidenceModel, EvidenceSource, Experience, FusedPredictor, LabelledStream, RestingHand,
    SourceShares, StreamContact, StreamFilters,
};
pub use deterministic::{DeterministicConfig, DeterministicPredictor};
pub use fused_config::FusedConfig;
pub use hand::phase::ReachPhase;
pub use prediction::{ContactPrediction, PredictionSource, Predictor, PredictorInput};
pub use stream::{ReachBeginning, StreamEstimator};
