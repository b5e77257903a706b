//! The key frames of an animation.

use crate::frame::ViewFrame;

/// Frames at the rate of the animation, in order of time, with their times since the first.
#[derive(Debug)]
pub(super) struct Keys {
    pub(super) frames: Vec<ViewFrame>,
    pub(super) times_s: Vec<f32>,
}

impl Keys {
    /// Drops frames that come sooner than the rate requires, whose time does not increase, or whose angles are not finite.
    pub(super) fn of(frames: &[ViewFrame], rate_hz: f64) -> Self {
        let mut keys = Self {
            frames: Vec::new(),
            times_s: Vec::new(),
        };
        let mut start_s = None;
        for frame in frames {
            let sound = frame.t_s.is_finite() && frame.q.0.iter().all(|q| q.is_finite());
            let due_s = keys.frames.last().map(|last| last.t_s + 1.0 / rate_hz);
            if !sound || due_s.is_some_and(|due_s| frame.t_s < due_s - 1e-6) {
                continue;
            }
            let start_s = *start_s.get_or_insert(frame.t_s);
            keys.times_s.push((frame.t_s - start_s) as f32);
            let mut frame = *frame;
            for joint_m in &mut frame.hand.joints_m {
                *joint_m = joint_m.filter(|m| m.is_finite());
            }
            keys.frames.push(frame);
        }
        keys
    }
}

/// The opening of a moving surface at each key, rad or m.
pub(super) fn opening_keys(keys: &Keys, moving: usize) -> impl Iterator<Item = f64> + '_ {
    let frames = keys.frames.iter();
    let openings = frames.map(move |frame| frame.openings.get(moving).copied().unwrap_or(0.0));
    openings.map(|opening| if opening.is_finite() { opening } else { 0.0 })
}
