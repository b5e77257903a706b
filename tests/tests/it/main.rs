//! Scenarios of several crates, one program.

mod attacks;
mod bad_files;
mod bip_files;
mod command_lines;
mod common;
mod contact_study_files;
mod demonstrations;
mod dependencies;
mod documents;
mod door_over_fri;
mod fault_matrix;
mod feel;
mod figures;
mod house;
mod limits;
mod maps;
mod own_arm;
mod publishing;
mod real_input;
mod rooms;
mod stops;
mod tables;
mod texture;
mod touch;
