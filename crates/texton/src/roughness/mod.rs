//! How rough a texture feels: published models, and the roughness of virtual surfaces.

mod afferent;
mod map;
mod model;
mod skin;
mod spacing;
mod study_order;

pub use afferent::{AfferentPairs, SpatialVariation, Vibration};
pub use map::{RoughnessMap, SurfaceRoughness};
pub use model::{ModelInfo, Prediction, Quantity, RoughnessModel};
pub use spacing::{GrooveRidge, InvertedU, MonotoneSpacing, TemporalFrequency};
pub use study_order::{OrderScore, StudyOrder, Tally, roughness_models, score_order};
