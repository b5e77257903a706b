//! Recordings of hands: in memory, as CSV, resampled.

mod csv_text;
mod in_memory;
mod lost_rows;
mod resample;
mod units;

pub use csv_text::{read_recordings, write_recordings};
pub use in_memory::{Quantity, Recording, Sample};
pub use units::UnitHint;
