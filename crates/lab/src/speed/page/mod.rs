//! What a section of the document is made of.

pub mod multiples;
pub mod section;
