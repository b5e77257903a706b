//! Points of the person.

use crate::error::HapticsError;
use crate::render::ProximityConfig;
use crate::safety::state::Channel;
use glam::DVec3;
use hwall_numeric::check::non_negative;

/// A tracked part of the person, or of people who stand by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PersonPart {
    /// The tip of the finger that touches.
    Fingertip,
    /// The palm.
    Palm,
    /// The head.
    Head,
    /// The elbow of the arm whose hand touches.
    Elbow,
    /// The palm of the other hand.
    OtherHand,
    /// The head of somebody who stands by.
    Bystander1,
    /// The same of another one.
    Bystander2,
    /// The same of another one.
    Bystander3,
    /// The same of another one.
    Bystander4,
}

impl PersonPart {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Fingertip,
        Self::Palm,
        Self::Head,
        Self::Elbow,
        Self::OtherHand,
        Self::Bystander1,
        Self::Bystander2,
        Self::Bystander3,
        Self::Bystander4,
    ];

    /// Heads of the people who stand by.
    pub const BYSTANDERS: [Self; 4] = [
        Self::Bystander1,
        Self::Bystander2,
        Self::Bystander3,
        Self::Bystander4,
    ];

    /// Does the arm stop when this part is no longer tracked? Headsets lose elbow and other hand all the time. Without an elbow the person's arm
    /// counts as straight; without the other hand, the other arm is unknown. A [required](super::super::SupervisorConfig::required) part is always missed.
    pub(in crate::safety) const fn is_missed(self) -> bool {
        !matches!(self, Self::Elbow | Self::OtherHand)
    }

    /// Is it a hand? The face slows down near hands; head and elbow count only in the separation of the whole arm.
    pub(in crate::safety) const fn is_hand(self) -> bool {
        matches!(self, Self::Fingertip | Self::Palm | Self::OtherHand)
    }

    /// Is it the head of somebody who stands by?
    #[must_use]
    pub fn is_bystander(self) -> bool {
        Self::BYSTANDERS.contains(&self)
    }

    /// Its channel.
    #[must_use]
    pub const fn channel(self) -> Channel {
        match self {
            Self::Fingertip => Channel::Fingertip,
            Self::Palm => Channel::Palm,
            Self::Head => Channel::Head,
            Self::Elbow => Channel::Elbow,
            Self::OtherHand => Channel::OtherHand,
            Self::Bystander1 | Self::Bystander2 | Self::Bystander3 | Self::Bystander4 => {
                Channel::Bystander
            }
        }
    }
}

/// Position of a part of the person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonPoint {
    /// The part.
    pub part: PersonPart,
    /// Robot base frame, m.
    pub position_m: DVec3,
    /// When it was measured, s, on the clock of the loop.
    pub stamp_s: f64,
}

/// Speed limits of the board near the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonLimits {
    /// Approach speed of the face to the hand, by distance.
    pub separation: ProximityConfig,
    /// Within this distance of a hand the approach speed of the face is capped by the contact limits
    /// ([`ContactLimits::speed_cap_m_per_s`](crate::safety::ContactLimits::speed_cap_m_per_s)), m; default 0.3.
    pub contact_zone_m: f64,
}

impl Default for PersonLimits {
    fn default() -> Self {
        Self {
            separation: ProximityConfig::default(),
            contact_zone_m: 0.3,
        }
    }
}

impl PersonLimits {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        self.separation.validate()?;
        non_negative("contact_zone_m", self.contact_zone_m)?;
        Ok(())
    }
}
