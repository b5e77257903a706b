#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod design;
mod error;
pub mod geometry;
pub mod height;
pub mod levels;
pub mod material;
pub mod mesh;
pub mod motion;
#[cfg(feature = "exr")]
mod picture;
pub mod print;
pub mod roughness;

pub use error::TextonError;
pub use glam;
pub use hwall_numeric::ArgumentError;

// A bump, its grid, and the bumps a finger meets when it crosses them.
pub use geometry::{Encounter, Harmonic, Layout, Radii, ScanAngle, Texton, TextonShape, Texture};
// Plates to print, their meshes and files.
pub use height::HeightField;
#[cfg(feature = "exr")]
pub use height::HeightSource;
pub use mesh::{ChordSide, MeshCheck, StlFormat, Tessellation, TriangleMesh};
pub use print::{BumpCounts, Finding, MountingHole, Patch, PatchSpec, Printer, Tile};
// Predicted roughness.
pub use roughness::{
    AfferentPairs, GrooveRidge, InvertedU, ModelInfo, MonotoneSpacing, OrderScore, Prediction,
    Quantity, RoughnessMap, RoughnessModel, SpatialVariation, StudyOrder, SurfaceRoughness, Tally,
    TemporalFrequency, Vibration, roughness_models, score_order,
};
// Roughness of a material from its picture.
#[cfg(feature = "png")]
pub use material::PngSource;
pub use material::{
    Caveat, MaterialPicture, MaterialSample, MaterialScale, MaterialSeries, PictureKind, Relief,
    RoughnessProposal, ScaleError,
};
// Levels: orientation and speed that present a given roughness.
pub use levels::{Calibration, CalibrationNode, Encoding, Level, LevelTable, discriminable};
// Design: a texture and levels for wanted roughnesses.
pub use design::{
    Compression, DesignCandidate, DesignLevel, DesignRequest, DeviceLimits, GivenUp, LevelPath,
    MagnitudeScale, PrintProcess, ProcessLimits, RoughnessSource, Wanted, design,
};
// How the board moves under a finger.
pub use motion::{
    FingerState, Limit, MotionLimits, MotionStep, ScanConfig, ScanEstimator, Stroke, TextureMotion,
};
