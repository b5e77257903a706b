//! Who touches what, who was learnt from, and who foresees it.

pub mod hand;
pub mod kinds;
pub mod participants;
pub mod predictors;
pub mod responses;
pub mod sights;
pub mod touches;
pub mod training;
