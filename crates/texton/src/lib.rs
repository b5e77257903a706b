#![doc = include_str!("../README.md")]

mod afferent_models;
mod encounter;
mod error;
mod layout;
mod presets;
mod roughness;
mod scan;
mod spacing_models;
mod spectrum;
mod study_order;
mod texton;
mod texture;

pub use afferent_models::{Pairs, SpatialVariation, Vibration};
pub use encounter::Encounter;
pub use error::TextonError;
pub use layout::Layout;
pub use roughness::{ModelInfo, Prediction, Quantity, RoughnessModel};
pub use scan::ScanAngle;
pub use spacing_models::{GrooveRidge, InvertedU, MonotoneSpacing, TemporalFrequency};
pub use spectrum::Harmonic;
pub use study_order::{OrderScore, StudyOrder, roughness_models, score_order};
pub use texton::{Texton, TextonShape};
pub use texture::Texture;
