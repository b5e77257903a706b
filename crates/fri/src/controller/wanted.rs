//! Commands on their way to take effect.

use crate::codec::CommandMessage;
use hwall_kinematics::Wrench;

/// A command as far as the mode needs it, all numbers finite.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    /// Message that it answers.
    pub(super) answers: u32,
    pub(super) position_rad: [f64; 7],
    pub(super) torque_n_m: [f64; 7],
    pub(super) wrench: Wrench,
}

/// An answer that was held back on purpose.
#[derive(Debug, Clone, Copy)]
pub(super) struct LateAnswer {
    pub(super) message: CommandMessage,
    /// Cycle after which it comes.
    pub(super) due: u64,
    pub(super) is_used: bool,
}

/// Messages from one to a later one, as numbers that wrap count them. A client may answer a message before the one that its last
/// command counts from, if it has several to choose from: that is no step back round the whole circle.
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
