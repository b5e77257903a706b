//! Points of the person.

use crate::error::HapticsError;
use crate::render::ProximityConfig;
use crate::safety::state::Channel;
use glam::DVec3;
use hwall_numeric::check::{non_negative, positive};

/// A tracked part of the person.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PersonPart {
    /// The tip of the finger that touches.
    Fingertip,
    /// The palm.
    Palm,
    /// The head.
    Head,
}

impl PersonPart {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Fingertip, Self::Palm, Self::Head];

    /// Its channel.
    #[must_use]
    pub const fn channel(self) -> Channel {
        match self {
            Self::Fingertip => Channel::Fingertip,
            Self::Palm => Channel::Palm,
            Self::Head => Channel::Head,
        }
    }
}

/// Where a part of the person is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonPoint {
    /// The part.
    pub part: PersonPart,
    /// Robot base frame, m.
    pub position_m: DVec3,
    /// When it was measured, s, on the clock of the loop.
    pub stamp_s: f64,
}

/// How fast the board may move near the person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonLimits {
    /// Speed at which the face may come nearer to hand and head, by distance.
    pub separation: ProximityConfig,
    /// Speed of the face within `head_zone_m` of the head, in any direction, m/s; default 0.25, reduced speed of
    /// [ISO 10218-1].
    pub head_speed_m_per_s: f64,
    /// m; default 0.5, an assumption.
    pub head_zone_m: f64,
    /// Within this distance of a hand the speed at which the face comes nearer is capped by what a contact may do
    /// ([`ContactLimits::speed_cap_m_per_s`](crate::safety::ContactLimits::speed_cap_m_per_s)), m; default 0.3.
    pub contact_zone_m: f64,
}

impl Default for PersonLimits {
    fn default() -> Self {
        Self {
            separation: ProximityConfig::default(),
            head_speed_m_per_s: 0.25,
            head_zone_m: 0.5,
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
        positive("head_speed_m_per_s", self.head_speed_m_per_s)?;
        non_negative("head_zone_m", self.head_zone_m)?;
        non_negative("contact_zone_m", self.contact_zone_m)?;
        Ok(())
    }
}
