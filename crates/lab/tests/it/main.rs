//! Integration tests of the crate, one program.

mod assign;
// Its reference files and its motions.
#[allow(dead_code)]
#[path = "../../../bip/tests/it/common/mod.rs"]
mod bip;
mod hands_on_objects;
mod in_space;
mod in_time;
mod leaning;
mod made_up;
mod panels;
mod published_filter;
mod thesis;
