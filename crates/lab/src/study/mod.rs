//! The command line of `contact_study`, and the document of all its protocols.

pub mod arguments;
