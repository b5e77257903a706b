//! Reachability maps, arrival maps and base placement from the command line, and the maps published with the 2018 paper.

pub mod arrival;
pub mod arrival_figure;
pub mod figures;
pub mod in_space;
pub mod maps;
pub mod orientation_rows;
pub mod placement;
pub mod placement_job;
pub mod published;
