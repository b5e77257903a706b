//! Input of the command line.

pub mod address;
pub mod arms;
pub mod base_flag;
pub mod counted;
pub mod file_plan;
pub mod floor_pose;
pub mod numbers;
pub mod output;
pub mod place;
pub mod real_room;
pub mod recording_units;
pub mod scene_file;
pub mod trial;
