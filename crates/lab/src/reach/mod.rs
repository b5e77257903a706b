//! Reachability maps and base placement from the command line, and the maps published with the 2018 paper.

pub mod disagreement;
pub mod figures;
pub mod maps;
pub mod placement;
pub mod published;
