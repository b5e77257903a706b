//! Settings of an arm at torque level.

use super::friction::{FrictionCompensation, JointFriction};
use super::motion::Integrator;
use super::sensor::TorqueSensor;
use crate::error::SimError;
use hwall_motion::IIWA7_ACCELERATION_RAD_PER_S2;
use hwall_numeric::check::{non_negative, positive, that, within};

/// Settings of a [`TorqueArm`](crate::TorqueArm). Entries beyond the arm's last joint are ignored.
///
/// Values that no manufacturer publishes are marked as assumptions; `TorqueConfig::ideal` has none of these effects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueConfig {
    /// Period of the arm's controller, s, `1e-4..=0.1`. Default 0.001. Commands and sensors are read and torques set once per period.
    pub control_period_s: f64,
    /// Longest step of the integration, s. Default 0.00025.
    pub max_step_s: f64,
    /// Default [`Integrator::SemiImplicit`].
    pub integrator: Integrator,
    /// Time from a command to its effect, s, `0..=1`. The command applies from the first control period that begins at or after this time.
    /// Default 0.005, an assumption for rendering over FRI.
    pub command_delay_s: f64,
    /// The inner torque loop, the gears, the rotors.
    pub drive: DriveConfig,
    /// Friction between motor and torque sensor that the inner loop leaves. Default 1 N m of dry friction on joints 1 to 4, 0.5 on 5, 0.3 on
    /// 6 and 7, a quarter more to break away, and viscous friction that equals the dry friction at 1 rad/s: an assumption.
    pub friction: [JointFriction; 7],
    /// Friction compensation of the controller.
    pub friction_compensation: FrictionCompensation,
    /// Errors of the torque sensors.
    pub sensor: TorqueSensor,
    /// Bandwidth (-3 dB) of the reported external torque, Hz. Default 25, a time constant of 6.4 ms: an assumption.
    pub observer_hz: f64,
    /// The joint servo, for positions and for holding.
    pub servo: PositionServo,
    /// Whether joints stop at their limits, without rebound. Default true; not needed if the controller never reaches them.
    pub joint_stops: bool,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

/// Transmission from a commanded torque to the link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveConfig {
    /// Largest torque of the motors, N m. `None`, the default: the effort limits of the chain, if it has any.
    pub max_torque_n_m: Option<[f64; 7]>,
    /// Maximum rate of a commanded overlay, N m/s; infinite for no limit. Default 1000, 1 N m per millisecond. Servo and
    /// gravity compensation are not limited.
    pub max_torque_rate_n_m_per_s: f64,
    /// Delay of the inner torque loop, s, `0..=0.1`. Default 0.001, an assumption.
    pub torque_delay_s: f64,
    /// Time constant of its first-order lag, s. Default 0.002 (80 Hz), an assumption.
    pub torque_lag_s: f64,
    /// Inertia of the rotors reflected to the joints, kg m². Default 3.4 on joints 1 to 4, 1.3 on 5, 1.2 on 6 and 7: the
    /// estimate for the iiwa 14 in [Drake models].
    pub rotor_inertia_kg_m2: [f64; 7],
    /// Fraction of that inertia that the torque loop hides, 0 to 1: torque feedback reduces the apparent rotor inertia
    /// ([Ott 2008]). Default 0.8, an assumption.
    pub hidden_share: f64,
}

/// The stiff joint servo: accelerations towards a reference motion, converted to torques by the model.
///
/// `τ = M (q̈_r + 2 ζ ω (q̇_r − q̇) + ω² (q_r − q)) + C q̇ + g`, with the rotors in `M`. The stiffness of a joint is its inertia times `ω²`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionServo {
    /// `ω / 2π`, Hz. Default 10: about the highest well-damped value with 3.5 ms of delay and lag in the torque loop.
    pub frequency_hz: f64,
    /// `ζ`. Default 1.
    pub damping_ratio: f64,
    /// Limits of the reference motion, as [`ServoConfig::max_velocity_rad_per_s`](crate::ServoConfig).
    pub max_velocity_rad_per_s: Option<[f64; 7]>,
    /// As [`ServoConfig::max_acceleration_rad_per_s2`](crate::ServoConfig).
    pub max_acceleration_rad_per_s2: [f64; 7],
    /// As [`ServoConfig::jerk_time_s`](crate::ServoConfig).
    pub jerk_time_s: f64,
}

impl Default for TorqueConfig {
    fn default() -> Self {
        Self {
            control_period_s: 1e-3,
            max_step_s: 2.5e-4,
            integrator: Integrator::SemiImplicit,
            command_delay_s: 0.005,
            drive: DriveConfig::default(),
            friction: [1.0, 1.0, 1.0, 1.0, 0.5, 0.3, 0.3].map(|dry| JointFriction {
                coulomb_n_m: dry,
                breakaway_n_m: 1.25 * dry,
                stribeck_rad_per_s: 0.02,
                viscous_n_m_s_per_rad: dry,
            }),
            friction_compensation: FrictionCompensation::default(),
            sensor: TorqueSensor::default(),
            observer_hz: 25.0,
            servo: PositionServo::default(),
            joint_stops: true,
            seed: 0,
        }
    }
}

impl Default for DriveConfig {
    fn default() -> Self {
        Self {
            max_torque_n_m: None,
            max_torque_rate_n_m_per_s: 1000.0,
            torque_delay_s: 1e-3,
            torque_lag_s: 2e-3,
            rotor_inertia_kg_m2: [3.4, 3.4, 3.4, 3.4, 1.3, 1.2, 1.2],
            hidden_share: 0.8,
        }
    }
}

impl Default for PositionServo {
    fn default() -> Self {
        Self {
            frequency_hz: 10.0,
            damping_ratio: 1.0,
            max_velocity_rad_per_s: None,
            max_acceleration_rad_per_s2: IIWA7_ACCELERATION_RAD_PER_S2,
            jerk_time_s: 0.01,
        }
    }
}

impl TorqueConfig {
    /// Only rigid bodies: no friction, rotors, delays, lags, saturation or sensor errors. The observer bandwidth and the joint stops remain.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            command_delay_s: 0.0,
            drive: DriveConfig {
                max_torque_n_m: Some([f64::INFINITY; 7]),
                max_torque_rate_n_m_per_s: f64::INFINITY,
                torque_delay_s: 0.0,
                torque_lag_s: 0.0,
                rotor_inertia_kg_m2: [0.0; 7],
                hidden_share: 0.0,
            },
            friction: [JointFriction::NONE; 7],
            sensor: TorqueSensor::perfect(),
            ..Self::default()
        }
    }

    /// Rotor inertia felt at each joint, not hidden by the torque loop, kg m².
    #[must_use]
    pub fn felt_rotor_inertia_kg_m2(&self) -> [f64; 7] {
        let drive = &self.drive;
        drive
            .rotor_inertia_kg_m2
            .map(|inertia| (1.0 - drive.hidden_share) * inertia)
    }

    pub(super) fn validate(&self, joints: usize) -> Result<(), SimError> {
        let drive = &self.drive;
        let (period_s, step_s) = (self.control_period_s, self.max_step_s);
        within(
            "control_period_s",
            period_s,
            1e-4..=0.1,
            "between 1e-4 and 0.1",
        )?;
        within("max_step_s", step_s, 1e-6..=0.1, "between 1e-6 and 0.1")?;
        let (delay_s, torque_delay_s) = (self.command_delay_s, drive.torque_delay_s);
        within("command_delay_s", delay_s, 0.0..=1.0, "between 0 and 1")?;
        within(
            "torque_delay_s",
            torque_delay_s,
            0.0..=0.1,
            "between 0 and 0.1",
        )?;
        non_negative("torque_lag_s", drive.torque_lag_s)?;
        let rate = drive.max_torque_rate_n_m_per_s;
        that(rate > 0.0, "max_torque_rate_n_m_per_s", rate, "positive")?;
        within("hidden_share", drive.hidden_share, 0.0..=1.0, "0 to 1")?;
        for joint in 0..joints {
            non_negative("rotor_inertia_kg_m2", drive.rotor_inertia_kg_m2[joint])?;
            if let Some(most) = drive.max_torque_n_m {
                that(most[joint] > 0.0, "max_torque_n_m", most[joint], "positive")?;
            }
            self.friction[joint].validate()?;
        }
        self.friction_compensation.validate()?;
        self.sensor.validate()?;
        positive("observer_hz", self.observer_hz)?;
        positive("frequency_hz", self.servo.frequency_hz)?;
        non_negative("damping_ratio", self.servo.damping_ratio)?;
        Ok(())
    }
}
