//! Finds a printable texture and presentable levels for wanted roughnesses.

mod candidate;
mod given_up;
mod limits;
mod request;
mod response;
mod search;
mod solve;

pub use candidate::{DesignCandidate, DesignLevel, LevelPath};
pub use given_up::GivenUp;
pub use limits::{DeviceLimits, PrintProcess, ProcessLimits};
pub use request::{Compression, DesignRequest, MagnitudeScale, RoughnessSource, Wanted};
pub use search::design;
