//! The enumerations of the protocol.

use std::fmt;

/// A number that is not in an enumeration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NoValue {
    pub(crate) what: &'static str,
    pub(crate) value: i32,
}

/// An enumeration of the protocol: values with their numbers and names.
macro_rules! wire_enum {
    ($(#[$meta:meta])* $name:ident, $what:literal { $($(#[$doc:meta])* $value:ident = $number:literal, $text:literal;)+ }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name {
            $($(#[$doc])* $value = $number,)+
        }

        impl $name {
            /// All values, in the order of their numbers.
            pub const ALL: &'static [Self] = &[$(Self::$value),+];

            /// The number on the wire.
            #[must_use]
            pub const fn number(self) -> u64 {
                self as u64
            }

            pub(crate) fn from_number(number: i32) -> Result<Self, NoValue> {
                match number {
                    $($number => Ok(Self::$value),)+
                    value => Err(NoValue { what: $what, value }),
                }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self {
                    $(Self::$value => $text,)+
                })
            }
        }
    };
}

wire_enum! {
    /// The session state, as reported by the controller.
    SessionState, "session state" {
        /// No session; messages are not answered.
        Idle = 0, "IDLE";
        /// States are sent and answered; the connection is not good enough for commands.
        MonitoringWait = 1, "MONITORING_WAIT";
        /// Good enough; commands are not requested yet.
        MonitoringReady = 2, "MONITORING_READY";
        /// Commanding is about to begin: the client repeats the positions of the interpolator.
        CommandingWait = 3, "COMMANDING_WAIT";
        /// The client commands.
        CommandingActive = 4, "COMMANDING_ACTIVE";
    }
}

wire_enum! {
    /// Connection quality, as judged by the controller.
    ConnectionQuality, "connection quality" {
        /// Commanding is not possible.
        Poor = 0, "POOR";
        /// Commanding is not possible.
        Fair = 1, "FAIR";
        /// Good enough to command.
        Good = 2, "GOOD";
        /// The best quality.
        Excellent = 3, "EXCELLENT";
    }
}

wire_enum! {
    /// The state of the safety controller.
    SafetyState, "safety state" {
        /// No stop.
        NormalOperation = 0, "NORMAL_OPERATION";
        /// Safety stop STOP 0, or a violation of a configured limit.
        StopLevel0 = 1, "SAFETY_STOP_LEVEL_0";
        /// Safety stop STOP 1.
        StopLevel1 = 2, "SAFETY_STOP_LEVEL_1";
        /// Safety stop STOP 2.
        StopLevel2 = 3, "SAFETY_STOP_LEVEL_2";
    }
}

wire_enum! {
    /// The operation mode.
    OperationMode, "operation mode" {
        /// T1: reduced speed.
        Test1 = 0, "TEST_MODE_1";
        /// T2.
        Test2 = 1, "TEST_MODE_2";
        /// AUT.
        Automatic = 2, "AUTOMATIC_MODE";
    }
}

wire_enum! {
    /// State of a joint's drive.
    DriveState, "drive state" {
        /// Without power.
        Off = 0, "OFF";
        /// Between off and active.
        Transitioning = 1, "TRANSITIONING";
        /// The drive is in control.
        Active = 2, "ACTIVE";
    }
}

wire_enum! {
    /// The control mode of the arm's own controller.
    ControlMode, "control mode" {
        /// Stiff position control.
        Position = 0, "POSITION_CONTROL_MODE";
        /// Cartesian impedance.
        CartesianImpedance = 1, "CART_IMP_CONTROL_MODE";
        /// Joint impedance.
        JointImpedance = 2, "JOINT_IMP_CONTROL_MODE";
        /// None: the drives are off.
        NoControl = 3, "NO_CONTROL";
    }
}

wire_enum! {
    /// The kind of command expected from the client; chosen by the application on the controller.
    ClientCommandMode, "client command mode" {
        /// Nothing.
        None = 0, "NO_COMMAND_MODE";
        /// Joint positions.
        Position = 1, "POSITION";
        /// A wrench in addition to joint positions; the arm is in Cartesian impedance control.
        Wrench = 2, "WRENCH";
        /// Joint torques in addition to joint positions; the arm is in joint impedance control.
        Torque = 3, "TORQUE";
        /// A Cartesian pose (2.x).
        CartesianPose = 4, "CARTESIAN_POSE";
    }
}

wire_enum! {
    /// How the client's commands overlay the motion of the application.
    OverlayType, "overlay type" {
        /// Not at all.
        None = 0, "NO_OVERLAY";
        /// Joint by joint.
        Joint = 1, "JOINT";
        /// In Cartesian space.
        Cartesian = 2, "CARTESIAN";
    }
}
