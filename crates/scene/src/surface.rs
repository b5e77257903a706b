//! Named surfaces and how they may move.

use crate::error::{Result, SceneError, finite};
use crate::mechanics::{MOST, Mechanics, SLIDING, TURNING};
use crate::part::triangle::{COORDINATE_LIMIT_M, is_usable};
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;

/// Index into [`Scene::surfaces`](crate::Scene::surfaces); valid for that scene and its placed copies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SurfaceId(pub usize);

/// How a surface may move, and whether it is touchable.
///
/// Points and directions are in the frame of the placed scene.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub enum SurfaceKind {
    /// Fixed and touchable.
    #[default]
    Static,
    /// Rotates about a hinge; the opening is an angle, zero as modelled in the file, right-handed.
    RevolvingDoor {
        /// A point of the hinge line, m.
        hinge_point_m: DVec3,
        /// Unit direction of the hinge line.
        hinge_axis: DVec3,
        /// Smallest opening, rad; not positive.
        min_rad: f64,
        /// Largest opening, rad; not negative.
        max_rad: f64,
        /// Mechanics of the door.
        mechanics: Mechanics,
    },
    /// Slides along a line; the opening is a distance, zero as modelled in the file.
    Sliding {
        /// Type of the sliding part.
        part: SlidingPart,
        /// Unit direction of a positive opening: out of the housing for a drawer, into it for a button.
        direction: DVec3,
        /// Smallest opening, m; not positive.
        min_m: f64,
        /// Largest opening, m; not negative.
        max_m: f64,
        /// Mechanics of the part, including the click of a button.
        mechanics: Mechanics,
    },
    /// Fixed; rays hit it, but it is not touchable (floor, pedestal).
    Untouchable,
}

/// Type of a sliding part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlidingPart {
    /// A panel.
    Panel,
    /// A drawer, pulled out of its housing.
    Drawer,
    /// A button, pressed into its housing.
    Button,
}

/// A named surface: one group (`o` or `g`) of the OBJ.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surface {
    /// Name of the group.
    pub name: String,
    /// How it moves.
    pub kind: SurfaceKind,
    /// Roughness level, not negative, on the scale of the sidecar.
    pub roughness: Option<f64>,
    /// Stiffness that a hand should feel when it presses the surface, N/m.
    pub contact_stiffness_n_per_m: Option<f64>,
    /// Name of its first material, whether or not a library defines it.
    pub material: Option<String>,
    /// Diffuse colour of the first of its materials that has one, red green blue in 0..1.
    pub color_rgb: Option<[f64; 3]>,
}

/// Range of the opening of a door (rad) or panel (m); contains zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpeningRange {
    /// Smallest opening, not positive.
    pub min: f64,
    /// Largest opening, not negative.
    pub max: f64,
}

impl Surface {
    /// True if the surface is touchable.
    #[must_use]
    pub fn touchable(&self) -> bool {
        self.kind != SurfaceKind::Untouchable
    }
}

impl SurfaceKind {
    /// The word for the kind in a sidecar.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::RevolvingDoor { .. } => "revolving_door",
            Self::Sliding { part, .. } => match part {
                SlidingPart::Panel => "sliding_panel",
                SlidingPart::Drawer => "drawer",
                SlidingPart::Button => "button",
            },
            Self::Untouchable => "untouchable",
        }
    }

    /// Range of the opening; `None` for fixed surfaces.
    #[must_use]
    pub const fn range(&self) -> Option<OpeningRange> {
        match *self {
            Self::RevolvingDoor {
                min_rad, max_rad, ..
            } => Some(OpeningRange {
                min: min_rad,
                max: max_rad,
            }),
            Self::Sliding { min_m, max_m, .. } => Some(OpeningRange {
                min: min_m,
                max: max_m,
            }),
            Self::Static | Self::Untouchable => None,
        }
    }

    /// Mechanics of the surface; `None` for fixed surfaces.
    #[must_use]
    pub const fn mechanics(&self) -> Option<&Mechanics> {
        match self {
            Self::RevolvingDoor { mechanics, .. } | Self::Sliding { mechanics, .. } => {
                Some(mechanics)
            }
            Self::Static | Self::Untouchable => None,
        }
    }

    /// The rigid motion of the surface at an opening, in the frame of the kind.
    pub(crate) fn motion(&self, opening: f64) -> Pose {
        match *self {
            Self::RevolvingDoor {
                hinge_point_m,
                hinge_axis,
                ..
            } => {
                let rotation = DMat3::from_axis_angle(hinge_axis, opening);
                Pose::from_parts_unchecked(rotation, hinge_point_m - rotation * hinge_point_m)
            }
            Self::Sliding { direction, .. } => Pose::IDENTITY.at(direction * opening),
            Self::Static | Self::Untouchable => Pose::IDENTITY,
        }
    }

    /// The same kind in another frame.
    pub(crate) fn transformed(&self, outer_from_inner: &Pose) -> Self {
        let mut kind = self.clone();
        match &mut kind {
            Self::RevolvingDoor {
                hinge_point_m,
                hinge_axis,
                ..
            } => {
                *hinge_point_m = outer_from_inner.transform_point(*hinge_point_m);
                *hinge_axis = outer_from_inner.transform_vector(*hinge_axis);
            }
            Self::Sliding { direction, .. } => {
                *direction = outer_from_inner.transform_vector(*direction);
            }
            Self::Static | Self::Untouchable => {}
        }
        kind
    }
}

/// Rejects a surface with invalid values and normalises its axes.
pub(crate) fn validated(mut surface: Surface) -> Result<Surface> {
    let Surface {
        name,
        kind,
        roughness,
        contact_stiffness_n_per_m,
        ..
    } = &mut surface;
    let fail = |what, value, wanted| SceneError::parameter(name, what, value, wanted);
    let not_negative = |what, value: Option<f64>| match value {
        Some(v) if !(0.0..=MOST).contains(&v) => {
            Err(fail(what, v, "finite, not negative and at most 1e12"))
        }
        _ => Ok(()),
    };
    let unit = |what, axis: DVec3| {
        finite(what, axis)?;
        axis.try_normalize()
            .ok_or_else(|| fail(what, axis.length(), "a direction of non-zero length"))
    };
    let range = |min: f64, max: f64, limit: f64, wanted| {
        let what = "opening range";
        if !(-limit..=0.0).contains(&min) {
            return Err(fail(what, min, wanted));
        }
        if !(0.0..=limit).contains(&max) {
            return Err(fail(what, max, wanted));
        }
        Ok(())
    };
    not_negative("roughness", *roughness)?;
    not_negative("contact_stiffness_n_per_m", *contact_stiffness_n_per_m)?;
    match kind {
        SurfaceKind::RevolvingDoor {
            hinge_point_m,
            hinge_axis,
            min_rad,
            max_rad,
            mechanics,
        } => {
            finite("hinge_point_m", *hinge_point_m)?;
            let coordinates = hinge_point_m.to_array();
            if let Some(value) = coordinates.into_iter().find(|x| !is_usable(*x)) {
                let wanted = "at most 1e9 m from the origin";
                return Err(fail("hinge_point_m", value, wanted));
            }
            *hinge_axis = unit("hinge_axis", *hinge_axis)?;
            let wanted = "an interval around zero, within one turn";
            range(*min_rad, *max_rad, std::f64::consts::TAU, wanted)?;
            mechanics.validate(name, &TURNING)?;
        }
        SurfaceKind::Sliding {
            direction,
            min_m,
            max_m,
            mechanics,
            ..
        } => {
            *direction = unit("direction", *direction)?;
            let wanted = "a finite interval around zero";
            range(*min_m, *max_m, COORDINATE_LIMIT_M, wanted)?;
            mechanics.validate(name, &SLIDING)?;
        }
        SurfaceKind::Static | SurfaceKind::Untouchable => {}
    }
    Ok(surface)
}
