//! Who touches what, who was learnt from, and who foresees it.

pub mod predictors;
pub mod touches;
pub mod training;
