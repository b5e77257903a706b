//! Integration tests of the crate, one program.

mod end_to_end;
mod hands_as_recorded;
mod people;
mod recording;
