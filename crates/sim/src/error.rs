//! The one error type of the crate.

use hwall_numeric::ArgumentError;

/// What can be wrong with a command, a configuration or a plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// An argument is NaN or infinite, or a setting is outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A start or commanded position violates a joint limit.
    #[error("joint {joint}: {value_rad} rad outside [{min_rad}, {max_rad}]")]
    JointLimit {
        /// Joint, from 0.
        joint: usize,
        /// Angle given, rad.
        value_rad: f64,
        /// Lower limit, rad.
        min_rad: f64,
        /// Upper limit, rad.
        max_rad: f64,
    },
    /// The arm does not support this kind of command.
    #[error("the simulated arm does not know this kind of command")]
    UnsupportedCommand,
    /// Joint bounds that the motion profile rejects.
    #[error(transparent)]
    Motion(#[from] hwall_motion::MotionError),
    /// An arm model is not valid, or its motion overflows.
    #[error(transparent)]
    Kinematics(#[from] hwall_kinematics::KinematicsError),
    /// Kinematics and dynamics belong to different arms.
    #[error("kinematics and dynamics differ in their {what} by {difference}")]
    OtherArm {
        /// What differs.
        what: &'static str,
        /// By how much.
        difference: f64,
    },
    /// Times of held torques must increase.
    #[error("torques at {t_s} s do not come after those at {before_s} s")]
    TimesNotRising {
        /// Time given, s.
        t_s: f64,
        /// Previous time, s.
        before_s: f64,
    },
    /// The motion diverged.
    #[error(
        "the motion diverged at t = {t_s} s: joint {joint} at {velocity} rad/s or m/s, in steps of {step_s} s"
    )]
    Diverged {
        /// End of the step, s.
        t_s: f64,
        /// Joint, from 0.
        joint: usize,
        /// Its velocity, rad/s or m/s; infinite on overflow.
        velocity: f64,
        /// Length of the step, s.
        step_s: f64,
    },
    /// More commands are pending within the reaction delay than the queue can hold.
    #[error("{capacity} commands are waiting already")]
    QueueFull {
        /// Maximum number of pending commands.
        capacity: usize,
    },
    /// The resting fingertip is too close to a planned surface, or behind it.
    #[error(
        "touch {touch}: the resting fingertip is {height_m} m in front of the surface, it needs {needed_m} m"
    )]
    BehindSurface {
        /// Index in the plan.
        touch: usize,
        /// Distance of the resting fingertip along the normal, m; negative behind.
        height_m: f64,
        /// Minimum distance, m.
        needed_m: f64,
    },
}
