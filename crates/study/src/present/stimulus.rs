//! Wanted and rendered stimuli.

use super::patch::Patch;
use crate::error::StudyError;
use crate::protocol::{Procedure, Protocol};
use hwall::numeric::check::{finite, that};
use serde::{Deserialize, Serialize};

/// The virtual surface that the board represents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Surface {
    /// A fixed wall.
    #[default]
    Wall,
    /// A hinged door, which yields to the finger.
    Door,
    /// A panel that slides upwards with the finger, across its scan.
    Panel,
    /// A real, fixed board that is touched without the arm; no level of a factor, see [`Procedure::MoreReal`].
    Whiteboard,
}

/// The wanted stimulus of a condition.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stimulus {
    /// The virtual surface.
    pub surface: Surface,
    /// Angle between scan and long axis of the bumps, degrees, 0 to 90.
    pub angle_deg: f64,
    /// Speed of the board against the scan, mm/s.
    pub speed_mm_per_s: f64,
    /// The printed patch on the board; `None`: any.
    pub patch: Option<Patch>,
}

impl Surface {
    /// As one word, as in the levels of a factor.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Wall => "wall",
            Self::Door => "door",
            Self::Panel => "panel",
            Self::Whiteboard => "whiteboard",
        }
    }
}

impl Default for Stimulus {
    /// Across the bumps at 40 mm/s on a wall: values for factors that a study does not have.
    fn default() -> Self {
        Self {
            surface: Surface::Wall,
            angle_deg: 90.0,
            speed_mm_per_s: 40.0,
            patch: None,
        }
    }
}

impl Stimulus {
    /// The stimulus of a condition: factors named `angle`, `orientation`, `speed`, `velocity`, `surface`, `patch` or `question` (which
    /// changes nothing), with or without the unit of their numbers (`_deg`, `_mm_s`, `_mm_per_s`). For [`Protocol::reference`] it is the
    /// reference stimulus.
    ///
    /// # Errors
    /// An unknown factor; a level that is not a number in its range or not a surface; no such condition.
    pub fn of(protocol: &Protocol, condition: usize) -> Result<Self, StudyError> {
        let mut stimulus = Self::default();
        let compares = matches!(protocol.procedure, Procedure::MoreReal { .. });
        if compares && condition == protocol.reference() {
            stimulus.surface = Surface::Whiteboard;
            return Ok(stimulus);
        }
        let levels = protocol.levels(condition);
        let levels = levels.ok_or(StudyError::NoTrial {
            what: "a condition that the study does not have",
        })?;
        for (factor, level) in protocol.factors.iter().zip(levels) {
            let refused = |wanted| StudyError::BadLevel {
                factor: factor.name.clone(),
                level: level.to_owned(),
                wanted,
            };
            let within = |most: f64| {
                let number = level.parse().ok();
                number.filter(|v: &f64| (0.0..=most).contains(v))
            };
            match Quantity::of(&factor.name)? {
                Quantity::Angle => {
                    stimulus.angle_deg = within(90.0).ok_or_else(|| refused("0 to 90 degrees"))?;
                }
                Quantity::Speed => {
                    stimulus.speed_mm_per_s =
                        within(100.0).ok_or_else(|| refused("0 to 100 mm/s"))?;
                }
                Quantity::Patch => {
                    let named = Patch::ALL.into_iter().find(|patch| patch.word() == level);
                    let refused = || refused("study-1.5, study-2, study-2.5, study-3 or cones-3");
                    stimulus.patch = Some(named.ok_or_else(refused)?);
                }
                Quantity::Question => {}
                Quantity::Surface => {
                    let mut all = [Surface::Wall, Surface::Door, Surface::Panel].into_iter();
                    let named = all.find(|surface| surface.word() == level);
                    stimulus.surface = named.ok_or_else(|| refused("wall, door or panel"))?;
                }
            }
        }
        Ok(stimulus)
    }

    /// Checks that every condition of a protocol can be presented.
    ///
    /// # Errors
    /// As [`Stimulus::of`]; [`StudyError::SameQuantity`] for two factors that set the same quantity, such as `angle` and `orientation`.
    pub fn check_all(protocol: &Protocol) -> Result<(), StudyError> {
        let mut named: Vec<(Quantity, &str)> = Vec::new();
        for factor in &protocol.factors {
            let quantity = Quantity::of(&factor.name)?;
            if let Some((_, first)) = named.iter().find(|(other, _)| *other == quantity) {
                return Err(StudyError::SameQuantity {
                    first: (*first).to_owned(),
                    second: factor.name.clone(),
                    quantity: quantity.word(),
                });
            }
            named.push((quantity, &factor.name));
        }
        // Every level occurs in a condition that differs from the first one only in this factor.
        let mut step = protocol.conditions();
        for factor in &protocol.factors {
            step /= factor.levels.len().max(1);
            for place in 0..factor.levels.len() {
                Self::of(protocol, place * step)?;
            }
        }
        Ok(())
    }
}

/// The quantity that a factor sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Angle,
    Speed,
    Surface,
    Patch,
    Question,
}

impl Quantity {
    /// The quantity for a factor's name, with or without the unit of its numbers.
    fn of(factor: &str) -> Result<Self, StudyError> {
        let name = factor.to_lowercase();
        let mut units = ["_deg", "_mm_per_s", "_mm_s"].into_iter();
        let bare = units.find_map(|unit| name.strip_suffix(unit));
        match bare.unwrap_or(&name) {
            "angle" | "orientation" => Ok(Self::Angle),
            "speed" | "velocity" => Ok(Self::Speed),
            "surface" => Ok(Self::Surface),
            "patch" => Ok(Self::Patch),
            "question" => Ok(Self::Question),
            _ => Err(StudyError::UnknownFactor {
                factor: factor.to_owned(),
            }),
        }
    }

    const fn word(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Speed => "speed",
            Self::Surface => "surface",
            Self::Patch => "patch",
            Self::Question => "question",
        }
    }
}

/// What was rendered in a trial: means over the touch after the motion has settled.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Rendered {
    /// Angle between the finger's motion over the board and the long axis of the bumps, degrees, 0 to 90.
    pub angle_deg: Option<f64>,
    /// Speed of the board against the scan, mm/s.
    pub speed_mm_per_s: Option<f64>,
    /// Speed of the finger over the board, mm/s.
    pub felt_mm_per_s: Option<f64>,
    /// Force of the finger along the normal, N.
    pub force_n: Option<f64>,
    /// Time in contact, s.
    pub contact_s: f64,
    /// Displacement of a door or a panel, rad or m.
    pub moved: Option<f64>,
    /// The printed patch that was on the board; `None`: unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patch: Option<Patch>,
    /// The fault that spoils the trial, if any.
    pub fault: Fault,
}

/// A board that moves slower than this share of the wanted speed presents another level: people tell tactile speeds apart that differ by 20 to 25 %
/// (Essick, Franzen and Whitsel 1988).
pub(crate) const LEAST_SPEED_SHARE: f64 = 0.75;

/// What spoils a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// Nothing.
    #[default]
    None,
    /// The board was not touched, or not long enough to be felt.
    NoTouch,
    /// The board arrived after the hand.
    Late,
    /// The texture did not move, or slower than 75 % of the wanted speed.
    NoTexture,
    /// The board made a safety stop.
    Stopped,
    /// The tracker lost the hand, or never saw it.
    HandLost,
    /// The hand did not let the board go.
    NotReleased,
    /// Another kind of surface was touched.
    OtherSurface,
    /// The arm disconnected, or refused a command.
    ArmGone,
    /// The experimenter ended it.
    Interrupted,
}

impl Fault {
    /// As one word; `None` for no fault.
    #[must_use]
    pub const fn word(self) -> Option<&'static str> {
        match self {
            Self::None => None,
            Self::NoTouch => Some("no touch"),
            Self::Late => Some("late"),
            Self::NoTexture => Some("no texture"),
            Self::Stopped => Some("stopped"),
            Self::HandLost => Some("hand lost"),
            Self::NotReleased => Some("not released"),
            Self::OtherSurface => Some("other surface"),
            Self::ArmGone => Some("arm gone"),
            Self::Interrupted => Some("interrupted"),
        }
    }
}

/// What was presented in a trial.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Presentation {
    /// The condition.
    pub rendered: Rendered,
    /// With two intervals: the reference.
    pub reference: Option<Rendered>,
}

impl Presentation {
    /// Rejects impossible numbers.
    ///
    /// # Errors
    /// The first number that is not finite, an angle outside 0 to 90 degrees, a negative time in contact.
    pub fn validate(&self) -> Result<(), StudyError> {
        self.rendered.validate()?;
        self.reference.as_ref().map_or(Ok(()), Rendered::validate)
    }

    pub(crate) fn rounded(self) -> Self {
        Self {
            rendered: self.rendered.rounded(),
            reference: self.reference.map(Rendered::rounded),
        }
    }

    /// Why the trial is invalid; `None` if it is valid.
    #[must_use]
    pub fn why_not(&self) -> Option<&'static str> {
        let reference = self.reference.and_then(|r| r.fault.word());
        self.rendered.fault.word().or(reference)
    }
}

impl Rendered {
    fn validate(&self) -> Result<(), StudyError> {
        for (what, value) in [
            ("rendered angle_deg", self.angle_deg),
            ("rendered speed_mm_per_s", self.speed_mm_per_s),
            ("rendered felt_mm_per_s", self.felt_mm_per_s),
            ("rendered force_n", self.force_n),
            ("rendered contact_s", Some(self.contact_s)),
            ("rendered moved", self.moved),
        ] {
            if let Some(value) = value {
                finite(what, value)?;
                that(value.abs() <= 1e6, what, value, "at most 1e6")?;
            }
        }
        if let Some(deg) = self.angle_deg {
            let holds = (0.0..=90.0).contains(&deg);
            that(holds, "rendered angle_deg", deg, "0 to 90")?;
        }
        let contact_s = self.contact_s;
        let what = "rendered contact_s";
        that(contact_s >= 0.0, what, contact_s, "zero or above")?;
        Ok(())
    }

    /// Rounded to six decimals: the values in use then equal the stored ones, also after reading the log.
    #[must_use]
    pub fn rounded(self) -> Self {
        Self {
            angle_deg: self.angle_deg.map(round),
            speed_mm_per_s: self.speed_mm_per_s.map(round),
            felt_mm_per_s: self.felt_mm_per_s.map(round),
            force_n: self.force_n.map(round),
            contact_s: round(self.contact_s),
            moved: self.moved.map(round),
            ..self
        }
    }
}

/// Rounds to six decimals.
pub(crate) fn round(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
