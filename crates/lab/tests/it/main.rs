//! Integration tests of the crate, one program.

mod assign;
mod hands_on_objects;
mod in_space;
mod in_time;
mod made_up;
mod panels;
mod published_filter;
mod thesis;
