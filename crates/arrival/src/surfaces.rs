//! The surfaces that the board and the arm must stay behind.
//!
//! Every surface is a rectangle of a vertical plane. Its front is the side away from the base, where a person may be. A place in front of one
//! surface may be behind another one nearer to the person (the front of a shelf on a wall): that place is inside something, so no person is there.

use crate::error::ArrivalError;
use crate::length::longest_m;
use glam::DVec3;
use hwall_kinematics::ArmKinematics;
use hwall_numeric::check::{finite, non_negative};
use hwall_reachability::{WallFacet, WallMaps, WallPlane};

/// A nearer surface hides places up to this far behind it, m: the depth of a shelf or a cupboard.
const HIDES_M: f64 = 0.35;

/// Least cosine between the normals of a surface and of one in front of it.
const PARALLEL: f64 = 0.95;

/// Rounding tolerance for places on the surface, m.
const ROUNDING_M: f64 = 1e-6;

/// Surfaces near an arm, from its base frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surfaces {
    rectangles: Vec<Rectangle>,
    margin_m: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Rectangle {
    /// Points away from the base.
    normal: DVec3,
    along: DVec3,
    distance_m: f64,
    s_m: [f64; 2],
    z_m: [f64; 2],
}

impl Surfaces {
    /// From facets whose normals point to the touched side; `margin_m` extends each facet beyond its border.
    ///
    /// Facets whose normal points towards the base are ignored: the arm is on their touched side.
    ///
    /// # Errors
    /// NaN or infinity, a facet that is not vertical, a negative margin.
    pub fn from_facets(facets: &[WallFacet], margin_m: f64) -> Result<Self, ArrivalError> {
        non_negative("margin_m", margin_m)?;
        let mut rectangles = Vec::with_capacity(facets.len());
        for facet in facets {
            let given = WallPlane::through(facet.point_m, facet.normal)?;
            if given.distance_m() < 0.0 {
                continue;
            }
            let along = given.along();
            let mut s_m = [f64::INFINITY, f64::NEG_INFINITY];
            for corner in &facet.outline_m {
                let s = finite("corner of a facet", along.dot(*corner))?;
                s_m = [s_m[0].min(s), s_m[1].max(s)];
            }
            if facet.outline_m.is_empty() {
                return Err(ArrivalError::Empty {
                    what: "corners of a facet",
                });
            }
            let z_m = [
                finite("lower border", facet.heights.lo_m)?,
                finite("upper border", facet.heights.hi_m)?,
            ];
            rectangles.push(Rectangle {
                normal: given.normal(),
                along,
                distance_m: given.distance_m(),
                s_m,
                z_m,
            });
        }
        Ok(Self {
            rectangles,
            margin_m,
        })
    }

    /// From the facets of maps.
    ///
    /// # Errors
    /// As [`from_facets`](Self::from_facets).
    pub fn from_maps(maps: &WallMaps, margin_m: f64) -> Result<Self, ArrivalError> {
        Ok(match maps.map() {
            Some(map) => Self::from_facets(maps.facets(), margin_m)?.within_reach_of(map.arm()),
            None => Self::default(),
        })
    }

    /// Only the surfaces that the arm or its board can reach.
    #[must_use]
    pub fn within_reach_of(mut self, arm: &dyn ArmKinematics) -> Self {
        // The diagonal of a board is well below half a metre.
        let longest_m = longest_m(arm) + 0.5;
        self.rectangles.retain(|r| {
            let s_m = 0.0_f64.clamp(r.s_m[0], r.s_m[1].max(r.s_m[0]));
            r.distance_m.hypot(s_m) <= longest_m
        });
        self
    }

    /// Number of surfaces.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.rectangles.len()
    }

    /// Are there no surfaces?
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.rectangles.is_empty()
    }

    /// Distance of a place in front of the surfaces, on the person's side, m. Negative: behind them, by at least that much; minus infinity without
    /// a surface in front or behind.
    #[must_use]
    pub fn intrusion_m(&self, point_m: DVec3) -> f64 {
        // If behind some surface: the nearest one. Otherwise the nearest of those it is in front of; surfaces that contain the projection have
        // priority over those that contain it only with their margin.
        let mut behind = f64::NEG_INFINITY;
        let mut before = f64::INFINITY;
        let mut beside = f64::INFINITY;
        let mut far_behind = f64::NEG_INFINITY;
        for surface in &self.rectangles {
            if !surface.holds(point_m, self.margin_m) {
                continue;
            }
            let off = surface.off_m(point_m);
            if surface.holds(point_m, ROUNDING_M) {
                if off > ROUNDING_M {
                    before = before.min(off);
                } else if off >= -HIDES_M {
                    if off > behind && !self.is_inside_of_nearer(surface, off, point_m) {
                        behind = off;
                    }
                } else {
                    far_behind = far_behind.max(off);
                }
            } else if off > 0.0 {
                beside = beside.min(off);
            } else {
                far_behind = far_behind.max(off);
            }
        }
        if behind > f64::NEG_INFINITY {
            behind
        } else if before < f64::INFINITY {
            before
        } else if beside < f64::INFINITY {
            beside
        } else {
            far_behind
        }
    }
}

impl Surfaces {
    /// Is the place, behind a surface, also inside an object in front of that surface?
    fn is_inside_of_nearer(&self, surface: &Rectangle, off_m: f64, point_m: DVec3) -> bool {
        self.rectangles.iter().any(|other| {
            let off = other.off_m(point_m);
            surface.normal.dot(other.normal) > PARALLEL
                && (-HIDES_M..off_m - ROUNDING_M).contains(&off)
                && other.holds(point_m, ROUNDING_M)
        })
    }
}

impl Rectangle {
    fn off_m(&self, point_m: DVec3) -> f64 {
        self.normal.x * point_m.x + self.normal.y * point_m.y - self.distance_m
    }

    fn holds(&self, point_m: DVec3, margin_m: f64) -> bool {
        let s = self.along.x * point_m.x + self.along.y * point_m.y;
        self.s_m[0] - margin_m <= s
            && s <= self.s_m[1] + margin_m
            && self.z_m[0] - margin_m <= point_m.z
            && point_m.z <= self.z_m[1] + margin_m
    }
}
