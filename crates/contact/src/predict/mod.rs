//! Which surface is about to be touched, where and when: by one ray, or by all evidence.
//!
//! # One belief
//!
//! `FusedPredictor` keeps a mixture of what each source says about the next contact: the motion of the hand, the present look and the one
//! before it, the places that this person has touched, and anywhere else (`EvidenceSource`). `EvidenceModel::fit_streams` learns from
//! whole streams and their contacts (`LabelledStream`) how often each is right: by what the hand does (`ReachPhase`: at rest, stirring,
//! setting off, under way, near the end), by the age of the look, and by whether the look agrees with the motion or, at rest, whether
//! the eyes of this person rest there in pauses, too. It also learns how far from its target a look lands, and where people touch, seen from
//! their resting hand. Each touch teaches how far each source can be taken for this person. `ContactPrediction::looked_at_since_s` says
//! since when the gaze has rested on what is predicted. The covariance is that in the plane of the surface, so it is wide along a
//! surface that is seen at a slant. While the eye is in flight, and for 0.3 s after the gaze is lost, the last look holds.
//!
//! A model learnt from fewer than `FusedConfig::least_reaches` is not trusted: `FusedPredictor::experience` says so, and
//! the gaze ray leads (`DeterministicConfig::ray_led`).
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
mod gaze;
mod hand;
mod prediction;
mod regions;
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
pub use regions::{REGION_SHARES, RegionModel, RegionSizes};
pub use stream::{ReachBeginning, StreamEstimator};
