//! The runs of the study.
