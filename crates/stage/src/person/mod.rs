//! Simulated and recorded people, their touches, training data, and predictors.

pub mod gestures;
pub mod hand;
pub mod kinds;
pub mod participants;
pub mod predictors;
pub mod responses;
pub mod sights;
pub mod standing_anywhere;
pub mod touches;
pub mod training;
