//! One wrong number in what a session is given.

use glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::ArmState;
use hwall_testkit::Sampler;

/// Where the number stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Angle(usize),
    Velocity(usize),
    Torque(usize),
    StateTime,
    FrameTime,
    Palm(usize),
    Tip(usize, usize),
    Head(usize),
    Gaze(usize),
}

/// A number that is replaced, or that another is added to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WrongNumber {
    place: Place,
    by: f64,
    replaces: bool,
}

/// From what no sensor says to what hardly differs: rad, rad/s, N m, m or s.
const SIZES: [f64; 14] = [
    f64::NAN,
    f64::INFINITY,
    1e300,
    1e9,
    1000.0,
    130.0,
    20.0,
    1.0,
    0.3,
    0.1,
    0.05,
    0.01,
    1e-3,
    0.0,
];

impl WrongNumber {
    pub(super) fn draw(sampler: &mut Sampler) -> Self {
        let joint = sampler.index(7);
        let axis = sampler.index(3);
        let place = match sampler.index(9) {
            0 => Place::Angle(joint),
            1 => Place::Velocity(joint),
            2 => Place::Torque(joint),
            3 => Place::StateTime,
            4 => Place::FrameTime,
            5 => Place::Palm(axis),
            6 => Place::Tip(sampler.index(5), axis),
            7 => Place::Head(axis),
            _ => Place::Gaze(axis),
        };
        let sign = if sampler.index(2) == 0 { 1.0 } else { -1.0 };
        Self {
            place,
            by: sign * SIZES[sampler.index(SIZES.len())],
            replaces: sampler.index(4) == 0,
        }
    }

    fn spoil(&self, number: &mut f64) {
        *number = if self.replaces {
            self.by
        } else {
            *number + self.by
        };
    }

    fn spoil_point(&self, point: &mut Option<DVec3>, axis: usize) {
        if let Some(point) = point {
            self.spoil(&mut point[axis]);
        }
    }

    pub(super) fn spoil_state(&self, state: &mut ArmState) {
        match self.place {
            Place::Angle(joint) => self.spoil(&mut state.q.0[joint]),
            Place::Velocity(joint) => self.spoil(&mut state.qd.0[joint]),
            Place::Torque(joint) => {
                if let Some(torque) = &mut state.external_torque {
                    self.spoil(&mut torque.0[joint]);
                }
            }
            Place::StateTime => self.spoil(&mut state.t_s),
            _ => {}
        }
    }

    pub(super) fn spoil_frame(&self, frame: &mut HandFrame) {
        match self.place {
            Place::FrameTime => self.spoil(&mut frame.t_s),
            Place::Palm(axis) => self.spoil_point(&mut frame.palm_m, axis),
            Place::Tip(finger, axis) => self.spoil_point(&mut frame.tips_m[finger], axis),
            Place::Head(axis) => self.spoil_point(&mut frame.head_m, axis),
            Place::Gaze(axis) => self.spoil_point(&mut frame.gaze, axis),
            _ => {}
        }
    }
}
