//! Pushes of the hand at moving objects: force, opening, energy.

use glam::DVec3;
use hwall::MovingSurface;
use hwall_scene::{Scene, SurfaceKind};

/// One push at a door, panel, drawer or button.
#[derive(Debug, Clone, PartialEq)]
pub struct Push {
    /// Name of the surface.
    pub surface: String,
    /// Does it turn (rad) or slide (m)?
    pub turns: bool,
    /// When the touch was felt, s.
    pub felt_s: f64,
    /// Duration, s.
    pub lasted_s: f64,
    /// Largest true force on the face, N.
    pub peak_n: f64,
    /// Opening at the beginning, rad or m.
    pub opening_before: f64,
    /// Largest opening, rad or m.
    pub opening_most: f64,
    /// Energy given by the hand to the board, and returned by it, J.
    pub given_j: f64,
    /// See `given_j`.
    pub returned_j: f64,
}

/// A moment of a run, for the figure over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceSample {
    /// Time, s.
    pub t_s: f64,
    /// True force of the hand on the face, N.
    pub force_n: f64,
    /// Opening of the object that was touched last, degrees or mm.
    pub opening: f64,
}

/// Collects pushes while a run lasts.
#[derive(Default)]
pub(in crate::run) struct PushLog {
    pub(super) pushes: Vec<Push>,
    is_open: bool,
    pub(super) samples: Vec<ForceSample>,
    next_sample_s: f64,
    last: Option<(usize, bool)>,
}

/// Samples for the figure are this far apart, s.
const SAMPLE_S: f64 = 0.01;

impl PushLog {
    /// A control period: the moving surfaces, the force of the hand on the face (base axes, N) and the velocity there.
    pub(in crate::run) fn step(
        &mut self,
        t_s: f64,
        dt_s: f64,
        scene: &Scene,
        moving: impl Iterator<Item = MovingSurface> + Clone,
        force_n: DVec3,
        velocity_m_per_s: DVec3,
    ) {
        let touched = moving.clone().find(|surface| surface.touched);
        if let Some(touched) = touched {
            let surface = scene.surface(touched.surface);
            let turns = matches!(surface.kind, SurfaceKind::RevolvingDoor { .. });
            self.last = Some((touched.surface.0, turns));
            if !self.is_open {
                self.is_open = true;
                self.pushes.push(Push {
                    surface: surface.name.clone(),
                    turns,
                    felt_s: t_s,
                    lasted_s: 0.0,
                    peak_n: 0.0,
                    opening_before: touched.position,
                    opening_most: touched.position,
                    given_j: 0.0,
                    returned_j: 0.0,
                });
            }
            if let Some(push) = self.pushes.last_mut() {
                push.lasted_s = t_s - push.felt_s;
                push.peak_n = push.peak_n.max(force_n.length());
                if touched.position.abs() > push.opening_most.abs() {
                    push.opening_most = touched.position;
                }
                let given_j = force_n.dot(velocity_m_per_s) * dt_s;
                push.given_j += given_j.max(0.0);
                push.returned_j -= given_j.min(0.0);
            }
        } else {
            self.is_open = false;
        }
        if t_s >= self.next_sample_s {
            self.next_sample_s = t_s + SAMPLE_S - 1e-9;
            let opening = self.last.and_then(|(index, turns)| {
                let position = moving.clone().find(|s| s.surface.0 == index)?.position;
                Some(if turns {
                    position.to_degrees()
                } else {
                    1e3 * position
                })
            });
            self.samples.push(ForceSample {
                t_s,
                force_n: force_n.length(),
                opening: opening.unwrap_or(0.0),
            });
        }
    }
}
