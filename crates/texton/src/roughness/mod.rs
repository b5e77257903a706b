//! Perceived roughness: published models, and the roughness of virtual surfaces.
//!
//! # How models compare
//!
//! Models are never blended: each states its source, range and misfit. On the dissertation's grids, temporal frequency and
//! vibration weighted by PC sensitivity reproduce the order of its study; on the released grid, an inverted U in spacing does
//! not.

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
