//! reach

pub mod figures;
pub mod maps;
pub mod placement;
pub mod published;
