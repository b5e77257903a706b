//! The value of `--base`: a pose of the base, or its behaviour in a corridor of rooms.

use super::floor_pose::FloorPose;
use anyhow::Context;
use clap::ValueEnum;

named! {
    /// What the base does in the corridor, and whether the person is redirected.
    #[derive(ValueEnum)]
    pub enum BaseKind {
        /// The base stays where it is
        Fixed = "fixed",
        /// The base stays; the avatar is turned, unnoticed, so that walls come to the board
        Redirected = "redirected",
        /// The base drives
        Drives = "drives",
        /// The base drives and the avatar is turned
        Both = "both",
    }
}

impl BaseKind {
    /// Does the base move?
    #[must_use]
    pub const fn drives(self) -> bool {
        matches!(self, Self::Drives | Self::Both)
    }

    /// Is the avatar turned?
    #[must_use]
    pub const fn redirects(self) -> bool {
        matches!(self, Self::Redirected | Self::Both)
    }
}

/// The value of `--base`.
#[derive(Debug, Clone, Copy)]
pub enum BaseFlag {
    /// The base stands there, in the frame of the scene.
    At(FloorPose),
    /// Uses a corridor of rooms instead of the scene.
    Corridor(BaseKind),
}

impl BaseFlag {
    /// `x,y,z,yaw` or the name of a kind.
    ///
    /// # Errors
    /// Anything else.
    pub fn parse(text: &str) -> anyhow::Result<Self> {
        let named = BaseKind::ALL.into_iter().find(|kind| kind.name() == text);
        if let Some(kind) = named {
            return Ok(Self::Corridor(kind));
        }
        let at = FloorPose::parse(text);
        Ok(Self::At(at.context(
            "x,y,z,yaw, or fixed, redirected, drives or both",
        )?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_base_is_a_place_or_the_name_of_a_kind() {
        for kind in BaseKind::ALL {
            let parsed = BaseFlag::parse(kind.name()).unwrap();
            assert!(matches!(parsed, BaseFlag::Corridor(found) if found == kind));
        }
        let place = BaseFlag::parse("0.1,0,-0.2,90");
        assert!(matches!(place, Ok(BaseFlag::At(_))));
        for wrong in ["drive", "", "1,2,3", "0,0,NaN,0"] {
            let error = format!("{:#}", BaseFlag::parse(wrong).unwrap_err());
            assert!(error.contains("drives"), "{error}");
        }
    }
}
