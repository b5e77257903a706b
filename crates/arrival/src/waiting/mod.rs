//! Waiting postures, from which the places that a person may touch are reached in time.

mod config;
mod posture;
mod problem;
mod search;

pub use config::WaitingConfig;
pub use posture::{
    PostureArrivals, WaitingPosture, judge_posture, waiting_posture, waiting_posture_from,
    waiting_posture_of_maps,
};

pub(crate) use posture::{Quick, found, judged};
pub(crate) use problem::{Task, check_targets};
