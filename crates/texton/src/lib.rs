#![doc = include_str!("../README.md")]

mod afferent_models;
mod calibration;
mod calibration_csv;
mod discriminable;
mod encoding;
mod encounter;
mod error;
mod isotonic;
mod layout;
mod level;
mod presets;
mod roughness;
mod roughness_map;
mod scan;
mod spacing_models;
mod spectrum;
mod study_order;
mod texton;
mod texture;

pub use afferent_models::{Pairs, SpatialVariation, Vibration};
pub use calibration::{Calibration, CalibrationNode, Violation};
pub use discriminable::discriminable;
pub use encoding::Encoding;
pub use encounter::Encounter;
pub use error::TextonError;
pub use layout::Layout;
pub use level::{Level, LevelTable};
pub use roughness::{ModelInfo, Prediction, Quantity, RoughnessModel};
pub use roughness_map::{RoughnessMap, SurfaceRoughness};
pub use scan::ScanAngle;
pub use spacing_models::{GrooveRidge, InvertedU, MonotoneSpacing, TemporalFrequency};
pub use spectrum::Harmonic;
pub use study_order::{OrderScore, StudyOrder, roughness_models, score_order};
pub use texton::{Texton, TextonShape};
pub use texture::Texture;
