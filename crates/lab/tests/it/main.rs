//! Integration tests of the crate, one program.

mod hands_on_objects;
mod published_filter;
