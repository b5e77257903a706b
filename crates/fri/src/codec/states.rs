//! The enumerations of the protocol.

use std::fmt;

/// A number that an enumeration does not have.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NoValue {
    pub(crate) what: &'static str,
    pub(crate) value: i32,
}

/// An enumeration as it stands on the wire: its values with their numbers and names.
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
    /// Where a session stands, as the controller says it.
    SessionState, "session state" {
        /// No session; nothing is answered.
        Idle = 0, "IDLE";
        /// States are sent and answered; the connection is not good enough to command.
        MonitoringWait = 1, "MONITORING_WAIT";
        /// Good enough; nobody has asked to command.
        MonitoringReady = 2, "MONITORING_READY";
        /// Commanding is about to begin: the client repeats the positions of the interpolator.
        CommandingWait = 3, "COMMANDING_WAIT";
        /// The client commands.
        CommandingActive = 4, "COMMANDING_ACTIVE";
    }
}

wire_enum! {
    /// How well answers come, as the controller judges it.
    ConnectionQuality, "connection quality" {
        /// Commanding is not possible.
        Poor = 0, "POOR";
        /// Commanding is not possible.
        Fair = 1, "FAIR";
        /// Good enough to command.
        Good = 2, "GOOD";
        /// As good as it gets.
        Excellent = 3, "EXCELLENT";
    }
}

wire_enum! {
    /// What the safety controller does.
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
    /// How the arm is operated.
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
        /// Between the two.
        Transitioning = 1, "TRANSITIONING";
        /// In control.
        Active = 2, "ACTIVE";
    }
}

wire_enum! {
    /// What the arm's own controller does.
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
    /// What the client commands; the application on the controller decides it.
    ClientCommandMode, "client command mode" {
        /// Nothing.
        None = 0, "NO_COMMAND_MODE";
        /// Joint positions.
        Position = 1, "POSITION";
        /// A wrench beside joint positions; the arm is in Cartesian impedance control.
        Wrench = 2, "WRENCH";
        /// Joint torques beside joint positions; the arm is in joint impedance control.
        Torque = 3, "TORQUE";
        /// A Cartesian pose (2.x).
        CartesianPose = 4, "CARTESIAN_POSE";
    }
}

wire_enum! {
    /// How the client's commands are laid over the motion of the application.
    OverlayType, "overlay type" {
        /// Not at all.
        None = 0, "NO_OVERLAY";
        /// Joint by joint.
        Joint = 1, "JOINT";
        /// In Cartesian space.
        Cartesian = 2, "CARTESIAN";
    }
}
