//! A complete study: its factors and values, read from a table, scaled to a common mean.

mod complete;
mod factor;
mod missing;
mod normalise;
mod table;
mod wide;

pub use complete::Study;
pub use factor::{Factor, Groups, MOST_FACTORS};
pub use missing::{LeftOut, Missing};
pub use normalise::Normalisation;
pub use table::Columns;

pub(crate) use complete::{LEAST_SIZE, MOST_SIZE};
