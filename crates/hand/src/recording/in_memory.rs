//! Recordings of hands in memory.

use crate::body_point::{BodyPoint, NamedPoint};
use crate::error::HandError;
use crate::frame::HandFrame;
use crate::hand_point::HandPoint;
use glam::DVec3;
use std::sync::Arc;

/// A vector quantity of a recording: three columns `NAME_x, NAME_y, NAME_z`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// A point of the hand, m.
    Hand(HandPoint),
    /// A point of the arm or of a controller, m.
    Body(BodyPoint),
    /// Head (midway between the eyes), m.
    Head,
    /// Unit direction of gaze.
    Gaze,
    /// An additional tracked object, m.
    Object,
    /// The target of the reach, m.
    Target,
}

impl Quantity {
    /// All, in column order: points of the hand and of the arm, then the others.
    pub const ALL: [Self; NamedPoint::COUNT + 4] = {
        let mut all = [Self::Head; NamedPoint::COUNT + 4];
        let mut i = 0;
        while i < NamedPoint::COUNT {
            all[i] = match NamedPoint::ALL[i] {
                NamedPoint::Hand(point) => Self::Hand(point),
                NamedPoint::Body(point) => Self::Body(point),
            };
            i += 1;
        }
        all[i + 1] = Self::Gaze;
        all[i + 2] = Self::Object;
        all[i + 3] = Self::Target;
        all
    };

    /// Name in column headers.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hand(point) => point.name(),
            Self::Body(point) => point.name(),
            Self::Head => "head",
            Self::Gaze => "gaze",
            Self::Object => "object",
            Self::Target => "target",
        }
    }
}

/// One row of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sample {
    /// Time, hand, head and gaze.
    pub frame: HandFrame,
    /// An additional tracked object, m.
    pub object_m: Option<DVec3>,
    /// The target of the reach, m.
    pub target_m: Option<DVec3>,
    /// Whether the hand touches at this time, if known.
    pub contact: Option<bool>,
}

impl Sample {
    /// One quantity as stored, unchecked; `None` if missing.
    #[must_use]
    pub fn get(&self, quantity: Quantity) -> Option<DVec3> {
        match quantity {
            Quantity::Hand(HandPoint::Palm) => self.frame.palm_m,
            Quantity::Hand(tip) => self.frame.tips_m[tip as usize - 1],
            Quantity::Body(point) => self.frame.body_m[point as usize],
            Quantity::Head => self.frame.head_m,
            Quantity::Gaze => self.frame.gaze,
            Quantity::Object => self.object_m,
            Quantity::Target => self.target_m,
        }
    }

    /// Sets or clears one quantity.
    pub fn set(&mut self, quantity: Quantity, value: Option<DVec3>) {
        match quantity {
            Quantity::Hand(point) => self.frame.set_point(point, value),
            Quantity::Body(point) => self.frame.set_body(point, value),
            Quantity::Head => self.frame.head_m = value,
            Quantity::Gaze => self.frame.gaze = value,
            Quantity::Object => self.object_m = value,
            Quantity::Target => self.target_m = value,
        }
    }
}

/// One trial of one person, samples in order of time, all in the recorded frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// The person, if known.
    pub person: Option<String>,
    /// The trial, if known.
    pub trial: Option<String>,
    /// The samples; their times increase strictly.
    pub samples: Vec<Sample>,
    /// Unknown columns of the file, which were ignored; shared by all trials of a file.
    pub ignored_columns: Arc<[String]>,
    /// Number of rows in which zeros of the file were treated as missing.
    pub zero_rows: usize,
}

impl Recording {
    /// From samples of a hand only.
    ///
    /// # Errors
    /// See [`Recording::validate`].
    pub fn from_frames(frames: impl IntoIterator<Item = HandFrame>) -> Result<Self, HandError> {
        let samples = frames
            .into_iter()
            .map(|frame| Sample {
                frame,
                ..Sample::default()
            })
            .collect();
        let recording = Self {
            samples,
            ..Self::default()
        };
        recording.validate()?;
        Ok(recording)
    }

    /// The frames, in order of time.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = &HandFrame> {
        self.samples.iter().map(|s| &s.frame)
    }

    /// Time from the first to the last sample, s; 0 for fewer than two.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match (self.samples.first(), self.samples.last()) {
            (Some(first), Some(last)) => last.frame.t_s - first.frame.t_s,
            _ => 0.0,
        }
    }

    /// The point of the hand that is tracked in the most samples; among equals the palm, which finger motion does not move, then the first of
    /// [`HandPoint::BY_CONTACT`]. `None` if none is ever tracked.
    #[must_use]
    pub fn steadiest_point(&self) -> Option<HandPoint> {
        let seen = |p: HandPoint| self.frames().filter(|f| f.point(p).is_some()).count();
        // `max_by_key` keeps the last of equals.
        let order = HandPoint::BY_CONTACT
            .into_iter()
            .rev()
            .chain([HandPoint::Palm]);
        let best = order.max_by_key(|&p| seen(p))?;
        (seen(best) > 0).then_some(best)
    }

    /// Checks what the reader guarantees: at least one sample, strictly increasing times, no NaN and no infinity.
    ///
    /// # Errors
    /// The first invalid sample; `line` counts samples from 1.
    pub fn validate(&self) -> Result<(), HandError> {
        if self.samples.is_empty() {
            return Err(HandError::NoSamples);
        }
        let mut previous_s = f64::NEG_INFINITY;
        for (line, sample) in (1..).zip(&self.samples) {
            let t_s = sample.frame.t_s;
            if !t_s.is_finite() {
                return Err(HandError::NonFiniteCell {
                    line,
                    column: "t".into(),
                    value: t_s,
                });
            }
            if t_s <= previous_s {
                return Err(HandError::TimeNotIncreasing {
                    line,
                    t_s,
                    previous_s,
                });
            }
            previous_s = t_s;
            for quantity in Quantity::ALL {
                let cells = sample.get(quantity).map_or([0.0; 3], |v| v.to_array());
                if let Some(axis) = cells.iter().position(|c| !c.is_finite()) {
                    let column = format!("{}_{}", quantity.name(), ["x", "y", "z"][axis]);
                    return Err(HandError::NonFiniteCell {
                        line,
                        column,
                        value: cells[axis],
                    });
                }
            }
        }
        Ok(())
    }
}
