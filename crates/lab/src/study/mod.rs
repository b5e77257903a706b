//! The command line of `contact_study`, and the document that holds all of its protocols.

pub mod arguments;
pub mod document;
