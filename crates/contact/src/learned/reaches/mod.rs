//! Reaches as they are followed and learnt from: what is known of one so far, samples of many, copies at another pace.

pub(super) mod paces;
pub(super) mod reach_track;
pub(super) mod samples;
