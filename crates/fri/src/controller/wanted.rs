//! Commands that have not taken effect yet.

use crate::codec::CommandMessage;
use hwall_kinematics::Wrench;

/// The part of a command that the mode needs, all values finite.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    /// The message that it answers.
    pub(super) answers: u32,
    pub(super) position_rad: [f64; 7],
    pub(super) torque_n_m: [f64; 7],
    pub(super) wrench: Wrench,
}

/// A deliberately delayed answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct LateAnswer {
    pub(super) message: CommandMessage,
    /// The cycle after which it arrives.
    pub(super) due: u64,
    pub(super) is_used: bool,
}

/// Number of messages from one to a later one, with wrapping sequence numbers. If several messages are available, a client may answer one before its
/// last command's message: that counts as 0, not as nearly a full wrap.
pub(super) const fn cycles_between(earlier: u32, later: u32) -> f64 {
    let ahead = later.wrapping_sub(earlier).cast_signed();
    if ahead > 0 { ahead as f64 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::cycles_between;

    #[test]
    fn numbers_of_messages_wrap() {
        assert_eq!(cycles_between(3, 8), 5.0);
        assert_eq!(cycles_between(u32::MAX - 1, 2), 4.0);
        assert_eq!(cycles_between(8, 8), 0.0);
        assert_eq!(cycles_between(8, 5), 0.0);
        assert_eq!(cycles_between(1, u32::MAX), 0.0);
    }
}
