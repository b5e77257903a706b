//! Integration tests of the crate, one program.

mod hands_on_objects;
mod panels;
mod published_filter;
