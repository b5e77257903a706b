//! What the example binaries share: command lines, tables of numbers, figures, the closed loop.
//!
//! Nothing here is published. The libraries under `crates/` do the work; this composes them.

pub mod arms;
pub mod bip_baselines;
pub mod bip_figures;
pub mod bip_held_out;
pub mod bip_recording_figures;
pub mod bip_recordings;
pub mod bip_regression;
pub mod bip_report;
pub mod bip_run;
pub mod bip_scores;
pub mod bip_setup;
pub mod bip_study;
pub mod bip_validation;
pub mod board_follow;
pub mod contact_arguments;
pub mod contact_candidates;
pub mod contact_dissertation;
pub mod contact_document;
pub mod contact_figures;
pub mod contact_moments;
pub mod contact_recordings;
pub mod contact_report;
pub mod contact_room;
pub mod contact_rooms;
pub mod contact_rooms_contenders;
pub mod contact_rooms_figures;
pub mod contact_rooms_scores;
pub mod contact_rooms_study;
pub mod contact_rooms_tables;
pub mod contact_rows;
pub mod contact_scores;
pub mod contact_tables;
pub mod demonstration_files;
pub mod demonstration_targets;
pub mod demonstrations;
pub mod figures;
pub mod foresight;
pub mod numbers;
pub mod perception_validation;
pub mod place;
pub mod placement;
pub mod psychophysics_analyse;
pub mod psychophysics_design;
pub mod psychophysics_figures;
pub mod psychophysics_power;
pub mod published;
pub mod reach_figures;
pub mod reach_maps;
pub mod reaches;
pub mod report;
pub mod run_figures;
pub mod session;
pub mod speed;
pub mod speed_bip;
pub mod speed_contact;
pub mod speed_contact_figures;
pub mod speed_contact_fusion;
pub mod speed_contact_knobs;
pub mod speed_reach;
pub mod speed_roughness;
pub mod speed_scene;
pub mod speed_texture;
pub mod stage;
pub mod texture_patch;
pub mod texture_patch_figures;
pub mod texture_touch;
pub mod texture_validation;
pub mod textured_board;
pub mod touches;
pub mod trajectories;
pub mod validation;
pub mod wall_maps;

use std::process::ExitCode;

/// Runs the code of the workspace's README as a test.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;

/// Ends a binary: one clear line on standard error and status 2 for an error.
#[must_use]
pub fn exit(result: anyhow::Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // A reader that closes the pipe early (`| head`) has all it wanted.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let io = cause.downcast_ref::<std::io::Error>();
        io.is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
    })
}
