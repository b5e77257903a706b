//! Reaches with a known end, for training and evaluation of estimators.

use super::onset::ReachOnset;
use super::segment::{Knot, measured, speeds};
use crate::error::HandError;
use crate::frame::HandFrame;
use crate::hand_point::HandPoint;
use glam::DVec3;

/// One reach from the start of the movement to its contact, with position and time of the contact.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledReach {
    /// The person, if known.
    pub person: Option<String>,
    /// The trial, if known.
    pub trial: Option<String>,
    /// The point of the hand that touches.
    pub point: HandPoint,
    /// The samples from the start of the movement to the contact, in one frame; their times increase strictly.
    pub frames: Vec<HandFrame>,
    /// Touching point at contact, or the target if the study names it, m.
    pub contact_m: DVec3,
    /// Time of contact, s, on the clock of the frames.
    pub contact_s: f64,
    /// Unit normal of the touched surface, towards the hand, if known.
    pub normal: Option<DVec3>,
}

impl LabelledReach {
    /// A reach without a person that ends at `contact_m`, m, at `contact_s`, s, on the clock of the frames.
    #[must_use]
    pub const fn new(
        point: HandPoint,
        frames: Vec<HandFrame>,
        contact_m: DVec3,
        contact_s: f64,
    ) -> Self {
        Self {
            person: None,
            trial: None,
            point,
            frames,
            contact_m,
            contact_s,
            normal: None,
        }
    }

    /// The same reach, attributed to a person and a trial.
    #[must_use]
    pub fn by(self, person: impl Into<String>, trial: impl Into<String>) -> Self {
        Self {
            person: Some(person.into()),
            trial: Some(trial.into()),
            ..self
        }
    }

    /// The same reach, on a surface with this unit normal towards the hand.
    #[must_use]
    pub fn on_surface(self, normal: DVec3) -> Self {
        Self {
            normal: Some(normal),
            ..self
        }
    }

    /// Checks that the reach is usable for training.
    ///
    /// # Errors
    /// Fewer than two samples that show the touching point, times that do not increase or are later than the contact, a label that is not finite, a
    /// normal that is not a unit vector.
    pub fn validate(&self) -> Result<(), HandError> {
        let bad = |what| HandError::Reach {
            reach: self.name(),
            what,
        };
        let seen = self.frames.iter().filter(|f| f.point(self.point).is_some());
        if seen.count() < 2 {
            return Err(bad("fewer than two samples of the touching point"));
        }
        let increase = |w: &[HandFrame]| w[0].t_s < w[1].t_s;
        if !self.frames.windows(2).all(increase) {
            return Err(bad("times that do not increase strictly"));
        }
        if !self.contact_m.is_finite() || !self.contact_s.is_finite() {
            return Err(bad("a contact that is not finite"));
        }
        if self.frames.last().is_some_and(|f| f.t_s > self.contact_s) {
            return Err(bad("samples after the contact"));
        }
        if self.normal.is_some_and(|n| !n.is_normalized()) {
            return Err(bad("a normal that is not a unit vector"));
        }
        Ok(())
    }

    /// The samples at which the hand starts and first clearly moves, by the common definition ([`ReachOnset`]) and independently of the
    /// segmentation; `None` if it never clearly moves.
    #[must_use]
    pub fn onset(&self) -> Option<[usize; 2]> {
        let seen =
            |(index, f): (usize, &HandFrame)| Some(Knot::new(index, f.t_s, f.point(self.point)?));
        let knots = measured(self.frames.iter().enumerate().filter_map(seen).collect());
        let speeds = speeds(&knots);
        let peak = speeds.iter().fold(0.0, |m: f64, &v| m.max(v));
        let found = ReachOnset::of_peak(peak).find(&speeds)?;
        Some(found.map(|k| knots[k].index))
    }

    /// Person and trial, for messages.
    #[must_use]
    pub fn name(&self) -> String {
        let part = |p: &Option<String>| p.clone().unwrap_or_else(|| "?".to_owned());
        format!("{}/{}", part(&self.person), part(&self.trial))
    }

    /// Time from the first sample to the contact, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.frames
            .first()
            .map_or(0.0, |first| self.contact_s - first.t_s)
    }
}
