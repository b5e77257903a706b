//! Boxes that the carried load must not enter: a pedestal, a table, the person's safety zone.
//!
//! The load moves along a [`WallLine`] without rotation, so it overlaps a box exactly while the tool point
//! is inside their Minkowski difference. This is a zonotope, and for a capsule a zonotope extended by a
//! ball (`zonotope.rs`).

use super::zonotope::{Path, Zonotope, hull};
use crate::error::{ReachabilityError, Result};
use crate::line::Interval;
use crate::wall::WallLine;
use glam::{DMat3, DVec3};
use hwall_kinematics::Pose;
use hwall_numeric::check::{all_finite, finite, non_negative, positive};
use serde::{Deserialize, Serialize};

/// An overlap shallower than this, relative to the distances involved, counts as none. It is a few
/// hundred roundings, so that bodies placed face to face count as touching even if their positions
/// come from other formulas.
const ROUNDING: f64 = 1e-13;

/// A solid box, fixed in the base frame, that the load must not overlap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "(String, Pose, DVec3)", into = "(String, Pose, DVec3)")]
pub struct KeepOutBox {
    name: String,
    base_from_box: Pose,
    half_extents_m: DVec3,
}

impl TryFrom<(String, Pose, DVec3)> for KeepOutBox {
    type Error = ReachabilityError;
    fn try_from((name, pose, half_m): (String, Pose, DVec3)) -> Result<Self, Self::Error> {
        Self::new(name, pose, half_m)
    }
}

impl From<KeepOutBox> for (String, Pose, DVec3) {
    fn from(b: KeepOutBox) -> Self {
        (b.name, b.base_from_box, b.half_extents_m)
    }
}

impl KeepOutBox {
    /// The box with the given centre and axes, and half of its extent along each axis, m.
    ///
    /// # Errors
    /// A half extent that is NaN, infinite or not positive: a flat box has no interior.
    pub fn new(
        name: impl Into<String>,
        base_from_box: Pose,
        half_extents_m: DVec3,
    ) -> Result<Self> {
        for half in half_extents_m.to_array() {
            positive("half extent of a keep-out box", half)?;
        }
        Ok(Self {
            name: name.into(),
            base_from_box,
            half_extents_m,
        })
    }

    /// The box between two corners, along the axes of the base, m.
    ///
    /// # Errors
    /// NaN, infinity, or a maximum that is not above its minimum.
    pub fn from_corners(name: impl Into<String>, min_m: DVec3, max_m: DVec3) -> Result<Self> {
        let centre = Pose::from_translation(min_m * 0.5 + max_m * 0.5)?;
        Self::new(name, centre, max_m * 0.5 - min_m * 0.5)
    }

    /// The pedestal of the base: centred below it, top at z = 0; half extents along the base's x
    /// and y axes and full height, m.
    ///
    /// # Errors
    /// NaN, infinity or a size that is not positive.
    pub fn pedestal(half_depth_x_m: f64, half_width_y_m: f64, height_m: f64) -> Result<Self> {
        let (x, y) = (half_depth_x_m, half_width_y_m);
        Self::from_corners(
            "pedestal",
            DVec3::new(-x, -y, -height_m),
            DVec3::new(x, y, 0.0),
        )
    }

    /// Name of the box, for messages.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where the load would overlap the box on a line: sorted, disjoint **open** intervals of s, m,
    /// at most one per carried body. At their ends the load touches the box, which is allowed.
    ///
    /// Error: the ends are exact for a load displaced by at most 1e-13 of the sum of all distances
    /// involved (below 1e-12 m for a table-top arm). A shallower overlap counts as none.
    ///
    /// # Errors
    /// NaN or infinity, a negative size, a plate without width or height.
    pub fn blocked_on_line(
        &self,
        carried: &Carried,
        line: &WallLine,
        roll_rad: f64,
    ) -> Result<Vec<Interval>> {
        finite("height_m", line.height_m)?;
        finite("roll_rad", roll_rad)?;
        let rotation = line.plane.board_rotation(roll_rad);
        let path = Path {
            start: line.point_m(0.0),
            step: line.plane.along(),
        };
        let mut blocked: Vec<Interval> = Vec::new();
        for span in self
            .overlaps(carried, rotation, path)?
            .into_iter()
            .flatten()
        {
            match blocked.last_mut() {
                Some(last) if span.lo_m < last.hi_m && last.lo_m < span.hi_m => {
                    *last = hull(*last, span);
                }
                _ => blocked.push(span),
            }
        }
        blocked.sort_by(|a, b| a.lo_m.total_cmp(&b.lo_m));
        Ok(blocked)
    }

    /// For the plate, and for the last link or (if nothing is carried) the tool point.
    fn overlaps(
        &self,
        carried: &Carried,
        rotation: DMat3,
        tool: Path,
    ) -> Result<[Option<Interval>; 2]> {
        carried.validate()?;
        let centre = self.base_from_box.position_m();
        let norm = |v: DVec3| v.abs().element_sum();
        // Lengths are divided by this unit, so that no square overflows and tolerances are relative.
        let unit_m = norm(tool.start) + norm(centre) + norm(self.half_extents_m) + carried.size_m();
        finite("sum of the distances to a keep-out box", unit_m)?;
        let path_of = |middle: DVec3| Path {
            start: (tool.start + rotation * middle - centre) / unit_m,
            step: tool.step,
        };
        let metres = |s: Interval| Interval::new(s.lo_m * unit_m, s.hi_m * unit_m);
        let axes = self.base_from_box.rotation();
        let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis];
        let [a, b, c] = (self.half_extents_m / unit_m).to_array();

        let plate = carried.plate.and_then(|plate| {
            let [u, v, w] = (plate.half_extents_m() / unit_m).to_array();
            let [i, j, k] = [rotation.x_axis, rotation.y_axis, rotation.z_axis];
            Zonotope {
                directions: [x, y, z, i, j, k],
                halves: [a, b, c, u, v, w],
            }
            .cut(path_of(plate.middle_m()), -ROUNDING)
        });
        let rest = match carried.last_link {
            Some(link) => {
                let (direction, half) = link.direction_and_half_m();
                Zonotope {
                    directions: [x, y, z, rotation * direction],
                    halves: [a, b, c, half / unit_m],
                }
                .cut_rounded(path_of(link.middle_m()), link.radius_m / unit_m - ROUNDING)
            }
            None if carried.plate.is_none() => Zonotope {
                directions: [x, y, z],
                halves: [a, b, c],
            }
            .cut(path_of(DVec3::ZERO), -ROUNDING),
            None => None,
        };
        Ok([plate.map(metres), rest.map(metres)])
    }
}

/// Bodies fixed to the tool frame; by default none, so that only the tool point is tested.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Carried {
    /// The board, if it counts.
    pub plate: Option<Plate>,
    /// The last link of the arm, from the flange to the wrist, if it counts.
    pub last_link: Option<Capsule>,
}

impl Carried {
    /// Rejects sizes that are negative or not finite, and a plate without width or height.
    ///
    /// # Errors
    /// The first value outside its range.
    pub fn validate(&self) -> Result<()> {
        if let Some(plate) = self.plate {
            positive("half_width_m", plate.half_width_m)?;
            positive("half_height_m", plate.half_height_m)?;
            non_negative("thickness_m", plate.thickness_m)?;
        }
        if let Some(link) = self.last_link {
            for end in link.ends_m {
                all_finite("end of the last link", &end.to_array())?;
            }
            non_negative("radius_m", link.radius_m)?;
        }
        Ok(())
    }

    /// Bound on the distance of all parts from the tool point, m.
    fn size_m(&self) -> f64 {
        let plate = self
            .plate
            .map_or(0.0, |p| p.half_width_m + p.half_height_m + p.thickness_m);
        let link = self.last_link.map_or(0.0, |l| {
            let ends = l.ends_m.map(|e| e.abs().element_sum());
            ends[0] + ends[1] + l.radius_m
        });
        plate + link
    }
}

/// A flat board: its face in the plane z = 0 of the tool frame, centred, its body towards -z.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Plate {
    /// Half of the extent along the tool's x axis, m.
    pub half_width_m: f64,
    /// Half of the extent along the tool's y axis, m.
    pub half_height_m: f64,
    /// From the face to the back, m; may be 0.
    pub thickness_m: f64,
}

impl Plate {
    fn half_extents_m(&self) -> DVec3 {
        DVec3::new(
            self.half_width_m,
            self.half_height_m,
            self.thickness_m * 0.5,
        )
    }

    fn middle_m(&self) -> DVec3 {
        DVec3::Z * (self.thickness_m * -0.5)
    }
}

/// All points within a radius of a segment, in the tool frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Capsule {
    /// The ends of the segment, m; they may coincide.
    pub ends_m: [DVec3; 2],
    /// The radius, m; may be 0.
    pub radius_m: f64,
}

impl Capsule {
    fn middle_m(&self) -> DVec3 {
        self.ends_m[0] * 0.5 + self.ends_m[1] * 0.5
    }

    /// Unit vector along the segment (any, if its ends coincide) and half of its length.
    fn direction_and_half_m(&self) -> (DVec3, f64) {
        let half = self.ends_m[1] * 0.5 - self.ends_m[0] * 0.5;
        // Scale first, so that squares of tiny and huge segments keep their digits.
        let largest = half.abs().max_element();
        let scaled = half / largest;
        if !scaled.is_finite() {
            return (DVec3::X, 0.0);
        }
        (scaled.normalize(), scaled.length() * largest)
    }
}

/// A box, and the bodies that must not overlap it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeepOut {
    /// The box.
    pub solid: KeepOutBox,
    /// The bodies carried past it.
    pub carried: Carried,
}

/// Where the load overlaps some box on a line, at any of these rolls.
pub(super) fn blocked(
    keep_out: &[KeepOut],
    line: &WallLine,
    rolls_rad: impl Iterator<Item = f64>,
) -> Result<Vec<Interval>> {
    let mut blocked = Vec::new();
    for roll_rad in rolls_rad {
        for KeepOut { solid, carried } in keep_out {
            blocked.extend(solid.blocked_on_line(carried, line, roll_rad)?);
        }
    }
    Ok(blocked)
}
