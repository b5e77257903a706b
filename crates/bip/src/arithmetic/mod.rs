//! Square-root information arithmetic on padded vectors.

mod reflections;
mod rows;
mod square_root;
mod tile;

pub(crate) use rows::Rows;
pub(crate) use square_root::SquareRoot;
pub(crate) use tile::{
    AlignedTile, LANES, Tile, add_multiple, all_finite, lane_sum, tiles, vectorize,
};

/// `ln(2 π)`.
pub(crate) const LN_TAU: f64 = 1.837_877_066_409_345_5;
