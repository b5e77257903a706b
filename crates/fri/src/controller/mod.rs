//! A simulated controller of the arm: everything that a client sees of a real one.

mod answers;
mod config;
mod faults;
mod impedance;
mod in_process;
mod link;
mod machine;
mod message;
mod plant;
mod quality;
mod report;
#[cfg(feature = "sim")]
mod sim;
mod udp;
mod wanted;

pub use config::ControllerConfig;
pub use faults::FaultConfig;
pub use impedance::ImpedanceConfig;
pub use in_process::InProcess;
pub use link::{Link, LinkConfig};
pub use machine::Controller;
pub use plant::SimulatedPlant;
pub use quality::QualityConfig;
pub use report::{ControllerEvent, ControllerStatistics, EndReason, EventKind};
#[cfg(feature = "sim")]
pub use sim::{iiwa7_servo, iiwa7_torque};
pub use udp::{UdpController, UdpStatistics};
