//! Reaches in training and in use: the track of a running reach, training samples, time-scaled copies.

pub(super) mod reach_track;
pub(super) mod samples;
pub(super) mod speeds;
