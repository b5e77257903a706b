#![doc = include_str!("../README.md")]

mod error;
pub mod export;
pub mod log;
pub mod participant;
pub mod present;
pub mod protocol;
pub mod report;
pub mod run;

pub use error::StudyError;

// Protocol: the planned trials and their order.
pub use protocol::{
    ArmKind, Participants, Planned, PlannedTrial, Procedure, Protocol, ReadyProtocol, StudyFactor,
    TrialKind, TrialOrder,
};
// Record: an append-only log, and the study in it.
pub use log::{Durability, Event, EventLog, Recovered};
pub use run::{
    Adaptive, AdaptiveThreshold, Answer, Ask, NextStep, Respondent, Simulation, Study, StudyRecord,
    TrialRecord, conduct, simulate, simulate_and_tell,
};
// Presenters and participants.
pub use participant::{
    EXPERIMENT_2_MEANS, ParticipantConfig, Roughness, SimulatedParticipant, planted_for,
    promised_power,
};
pub use present::{
    ArmStage, ArmStop, ArmTrialConfig, Fault, Patch, Presentation, Presenter, Rendered,
    SimulatedStage, Stimulus, StudyRoom, Surface, check_surfaces, scene_of,
};
// Exports and reports.
pub use export::{write_attempts, write_trials};
pub use report::{
    LevelGroups, RatingPower, Ratings, StudyReport, level_groups, mean_power, ratings, sign_power,
};
