//! What was asked for and what was sent.

use super::asked_path::{Answers, AskedPath};
use super::beginning::Beginning;
use super::braking::CommandedMotion;

/// What a client has commanded in the present session.
#[derive(Debug)]
pub(super) struct Commanded {
    /// Positions commanded last, and the message that they answered.
    pub(super) motion: Option<CommandedMotion>,
    pub(super) motion_ns: u64,
    /// What was sent and what of it has arrived.
    pub(super) answers: Answers,
    /// Where the arm was asked to be.
    pub(super) path: AskedPath,
    /// Which time of it was sent last; `None` beside the path.
    pub(super) path_ns: Option<u64>,
    /// How far it is behind that, ns.
    pub(super) behind_ns: u64,
    /// Positions asked for last; the arm may still be on its way there. `None` after anything but positions.
    pub(super) asked_rad: Option<[f64; 7]>,
    /// How far from the interpolator the program began; `None` until it did.
    pub(super) beginning: Option<Beginning>,
    /// After torques: are the positions on their way to those that are commanded?
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

    /// Commanding has ended.
    pub(super) const fn forget(&mut self) {
        self.motion = None;
        self.leave_path();
        self.beginning = None;
        self.leads = false;
    }

    /// What is asked for next begins a path of its own.
    pub(super) const fn leave_path(&mut self) {
        self.asked_rad = None;
        self.path.clear();
        self.behind_ns = 0;
    }

    /// Remembers what goes out with the next answer.
    pub(super) const fn keep(&mut self, motion: CommandedMotion, path_ns: Option<u64>) {
        self.motion = Some(motion);
        self.path_ns = path_ns;
    }
}
