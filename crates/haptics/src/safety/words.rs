//! The supervisor's states and reasons in words, for an observer.

use super::state::{Channel, SafeReason, SafeState};
use std::fmt::{self, Display};

impl Channel {
    /// The channel in words.
    const fn words(self) -> &'static str {
        match self {
            Self::Time => "the clock",
            Self::ArmTime => "the time of the arm's state",
            Self::Position => "an angle of the arm",
            Self::Velocity => "a velocity of the arm",
            Self::Torque => "a torque of the arm",
            Self::Fingertip => "the fingertip",
            Self::Palm => "the palm",
            Self::Head => "the head",
            Self::Elbow => "the elbow",
            Self::OtherHand => "the other hand",
            Self::Bystander => "the head of a bystander",
            Self::Target => "the target",
            Self::Force => "the force on the board",
            Self::Command => "the command",
        }
    }
}

impl Display for SafeReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonFinite(channel) => write!(f, "{} is no number", channel.words()),
            Self::Stale { channel, age_s } if *age_s < 0.0 => {
                write!(f, "{} is {:.2} s ahead", channel.words(), -age_s)
            }
            Self::Stale {
                channel: Channel::Bystander,
                age_s,
            } => write!(
                f,
                "the head of a bystander is {age_s:.2} s old: tell it again, or send \"bystanders\":[] if they have left"
            ),
            Self::Stale { channel, age_s } => write!(f, "{} is {age_s:.2} s old", channel.words()),
            Self::Jump { channel, by } => {
                let unit = match channel {
                    Channel::Time | Channel::ArmTime => "s",
                    Channel::Position | Channel::Command => "rad",
                    Channel::Velocity => "rad/s",
                    Channel::Torque => "N m",
                    Channel::Fingertip
                    | Channel::Palm
                    | Channel::Head
                    | Channel::Elbow
                    | Channel::OtherHand
                    | Channel::Bystander
                    | Channel::Target => "m",
                    Channel::Force => "N",
                };
                write!(f, "{} leapt by {by:.3} {unit}", channel.words())
            }
            Self::Frozen { channel, for_s } => {
                write!(f, "{} has not changed for {for_s:.2} s", channel.words())
            }
            Self::JointLimit {
                channel,
                joint,
                value,
            } => {
                let (what, unit) = match channel {
                    Channel::Velocity => ("velocity", "rad/s"),
                    Channel::Torque => ("torque", "N m"),
                    _ => ("angle", "rad"),
                };
                let joint = joint + 1;
                write!(
                    f,
                    "joint {joint} is beyond its limit: {what} {value:.3} {unit}"
                )
            }
            Self::CommandLimit { channel, joint } => {
                let what = match channel {
                    Channel::Velocity => "speed",
                    Channel::Torque => "torque",
                    _ => "angle",
                };
                write!(f, "a command of joint {} is cut in {what}", joint + 1)
            }
            Self::Workspace => f.write_str("the board leaves its box"),
            Self::SelfCollision { distance_m } => {
                write!(f, "parts of the arm are {:.0} mm apart", 1e3 * distance_m)
            }
            Self::Obstacle {
                obstacle,
                distance_m,
            } => write!(
                f,
                "the arm is {:.0} mm from entry {} of the room",
                1e3 * distance_m,
                obstacle + 1
            ),
            Self::Force { force_n, limit_n } => {
                write!(f, "{force_n:.0} N on the board, {limit_n:.0} N are allowed")
            }
            Self::ImplausibleForce { force_n } => {
                write!(
                    f,
                    "the sensors say {force_n:.3e} N, more than any hand pushes"
                )
            }
            Self::BoardEdge { moment_n_m } => {
                write!(f, "a push near the edge of the board, {moment_n_m:.1} N m")
            }
            Self::PersonNear { part, distance_m } => {
                write!(
                    f,
                    "{} is {:.0} mm from the arm",
                    part.words(),
                    1e3 * distance_m
                )
            }
            Self::NotObeyed => f.write_str("the arm is not where it was told to be"),
            Self::Refused => f.write_str("the arm does not take commands"),
            Self::Unproven => f.write_str("too few states of the arm agree to begin from"),
            Self::Unseen(part) => write!(f, "{} has not been tracked yet", part.words()),
            Self::TorqueBias { joint, bias_n_m } => write!(
                f,
                "the torque sensor of joint {} says {bias_n_m:.1} N m without a touch",
                joint + 1
            ),
            Self::UnexpectedContact { joint, torque_n_m } => write!(
                f,
                "something other than a touch of the board pushes the arm: {torque_n_m:.1} N m at joint {}",
                joint + 1
            ),
            Self::Requested => f.write_str("a stop was asked for"),
            Self::LostThread => {
                f.write_str("a thread of the program has ended by a fault: start the program again")
            }
        }
    }
}

/// The state with its reason after a colon.
impl Display for SafeState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = match self {
            Self::Normal => "free to move",
            Self::Slowed { .. } => "slower",
            Self::Holding { .. } => "holding",
            Self::Retreating { .. } => "withdrawing",
            Self::Compliant { .. } => "giving way",
            Self::Stopped { .. } => "stopped",
        };
        match self.reason() {
            Some(reason) => write!(f, "{state}: {reason}"),
            None => f.write_str(state),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_told_in_words() {
        let said = |reason| SafeState::Holding { reason }.to_string();
        let channel = Channel::Position;
        let stale = SafeReason::Stale {
            channel: Channel::Head,
            age_s: 0.25,
        };
        let leapt = SafeReason::Jump { channel, by: 1.0 };
        let beyond = SafeReason::JointLimit {
            channel,
            joint: 6,
            value: 3.1,
        };
        for (reason, words) in [
            (stale, "the head is 0.25 s old"),
            (leapt, "an angle of the arm leapt by 1.000 rad"),
            (beyond, "joint 7 is beyond its limit: angle 3.100 rad"),
        ] {
            assert_eq!(said(reason), format!("holding: {words}"));
        }
        assert_eq!(SafeState::Normal.to_string(), "free to move");
    }
}
