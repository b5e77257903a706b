//! Settings of the simulated controller.

use super::faults::FaultConfig;
use super::impedance::ImpedanceConfig;
use super::quality::QualityConfig;
use crate::codec::{ClientCommandMode, FriVersion};
use crate::error::FriError;
use hwall_numeric::check::{non_negative, positive, that, within};

/// Largest torques of the iiwa 7's joints, N m.
const IIWA7_TORQUE_N_M: [f64; 7] = [176.0, 176.0, 110.0, 110.0, 110.0, 40.0, 40.0];
/// The limit of a public driver for this arm: 60 N m at the first joint, less towards the wrist.
const EXTERNAL_TORQUE_N_M: [f64; 7] = [60.0, 60.0, 60.0, 30.0, 12.0, 12.0, 6.0];

/// Settings of the controller and of the application on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerConfig {
    /// Version of the interface; default 1.15.
    pub version: FriVersion,
    /// Time between messages, ms, `1..=10`; default 1.
    pub send_period_ms: u32,
    /// Number of messages per expected answer, `1..=100`; default 1.
    pub receive_multiplier: u32,
    /// The client command mode: position, torque or wrench. On the real controller the application chooses it. Default position.
    pub mode: ClientCommandMode,
    /// Time in `IDLE` before the session begins, s; default 0: many clients leave at the first `IDLE`.
    pub idle_s: f64,
    /// Time in `MONITORING_READY` until the application requests commands, s; `None`: never. Default 0.5.
    pub ready_s: Option<f64>,
    /// Shortest time in `COMMANDING_WAIT`, s: earlier commands have no effect. Default 0.25, as in a public driver.
    pub wait_s: f64,
    /// Does the application request commands again after a loss of quality ended commanding? After any other end it does so only after
    /// [`Controller::acknowledge`](super::Controller::acknowledge). Default true.
    pub asks_again: bool,
    /// Age at which a command expires, s: the arm then holds. Default 0.05, as in a public driver.
    pub command_expiry_s: f64,
    /// Largest distance of the commanded positions from the interpolator's before commanding begins, rad; default 0.01.
    pub mirror_tolerance_rad: f64,
    /// External torques beyond which commanding ends, N m; default 60, 60, 60, 30, 12, 12, 6, as in a public driver.
    pub max_external_torque_n_m: [f64; 7],
    /// Largest overlay torques, N m; default those of the iiwa 7's joints.
    pub max_overlay_torque_n_m: [f64; 7],
    /// How the quality is computed.
    pub quality: QualityConfig,
    /// Stiffness and damping in the modes torque and wrench.
    pub impedance: ImpedanceConfig,
    /// Unix time at the start, s: the first time stamp. Default 0.
    pub start_unix_s: u32,
    /// Deliberate faults.
    pub faults: FaultConfig,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        Self {
            version: FriVersion::V1_15,
            send_period_ms: 1,
            receive_multiplier: 1,
            mode: ClientCommandMode::Position,
            idle_s: 0.0,
            ready_s: Some(0.5),
            wait_s: 0.25,
            asks_again: true,
            command_expiry_s: 0.05,
            mirror_tolerance_rad: 0.01,
            max_external_torque_n_m: EXTERNAL_TORQUE_N_M,
            max_overlay_torque_n_m: IIWA7_TORQUE_N_M,
            quality: QualityConfig::default(),
            impedance: ImpedanceConfig::default(),
            start_unix_s: 0,
            faults: FaultConfig::default(),
        }
    }
}

impl ControllerConfig {
    /// Time between messages, s.
    #[must_use]
    pub fn send_period_s(&self) -> f64 {
        f64::from(self.send_period_ms) * 1e-3
    }

    pub(super) fn validate(&self) -> Result<(), FriError> {
        let [period, multiplier] = [self.send_period_ms, self.receive_multiplier].map(f64::from);
        within("send_period_ms", period, 1.0..=10.0, "1 to 10")?;
        within("receive_multiplier", multiplier, 1.0..=100.0, "1 to 100")?;
        non_negative("idle_s", self.idle_s)?;
        non_negative("ready_s", self.ready_s.unwrap_or(0.0))?;
        non_negative("wait_s", self.wait_s)?;
        positive("command_expiry_s", self.command_expiry_s)?;
        positive("mirror_tolerance_rad", self.mirror_tolerance_rad)?;
        for limit in self.max_external_torque_n_m {
            that(limit > 0.0, "max_external_torque_n_m", limit, "positive")?;
        }
        for limit in self.max_overlay_torque_n_m {
            that(limit >= 0.0, "max_overlay_torque_n_m", limit, "at least 0")?;
        }
        self.impedance.validate()?;
        match self.mode {
            ClientCommandMode::Position | ClientCommandMode::Torque | ClientCommandMode::Wrench => {
                Ok(())
            }
            mode => Err(FriError::UnsupportedMode(mode)),
        }
    }
}
