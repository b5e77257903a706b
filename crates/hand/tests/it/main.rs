//! Integration tests of the crate, one program.

mod as_recorded;
mod attacks;
mod frames;
mod gaze;
mod invariances;
mod labels;
mod real_recordings;
mod recording;
mod resample;
mod rigid_fit;
mod segment;
mod tracking;
mod watch;
