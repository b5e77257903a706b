//! Requested and sent commands.

use super::asked_path::{Answers, AskedPath};
use super::beginning::Beginning;
use super::braking::CommandedMotion;

/// The commands of a client in the current session.
#[derive(Debug)]
pub(super) struct Commanded {
    /// The last commanded positions, and the message that they answered.
    pub(super) motion: Option<CommandedMotion>,
    pub(super) motion_ns: u64,
    /// The answers sent, and which of them have arrived.
    pub(super) answers: Answers,
    /// The requested path.
    pub(super) path: AskedPath,
    /// The path time sent last; `None` off the path.
    pub(super) path_ns: Option<u64>,
    /// The delay of the arm on the path, ns.
    pub(super) behind_ns: u64,
    /// The last requested positions; the arm may still be moving there. `None` after other commands than positions.
    pub(super) asked_rad: Option<[f64; 7]>,
    /// Offset from the interpolator at the program's beginning; `None` before it began.
    pub(super) beginning: Option<Beginning>,
    /// After torques: are the sent positions still catching up with the requested ones?
    pub(super) leads: bool,
}

impl Commanded {
    pub(super) const fn new() -> Self {
        Self {
            motion: None,
            motion_ns: 0,
            answers: Answers::new(),
            path: AskedPath::new(),
            path_ns: None,
            behind_ns: 0,
            asked_rad: None,
            beginning: None,
            leads: false,
        }
    }

    /// Resets after commanding has ended.
    pub(super) const fn forget(&mut self) {
        self.motion = None;
        self.leave_path();
        self.beginning = None;
        self.leads = false;
    }

    /// The next request begins a new path.
    pub(super) const fn leave_path(&mut self) {
        self.asked_rad = None;
        self.path.clear();
        self.behind_ns = 0;
    }

    /// Stores the motion of the next answer.
    pub(super) const fn keep(&mut self, motion: CommandedMotion, path_ns: Option<u64>) {
        self.motion = Some(motion);
        self.path_ns = path_ns;
    }
}
