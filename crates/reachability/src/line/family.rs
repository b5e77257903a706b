//! A solver's arm with its freedoms, or a family of arms that differ only in their limits.

use super::config::{BoardPart, ExactConfig, Roll};
use crate::error::{ReachabilityError, Result};
use hwall_kinematics::{JointLimit, SrsArm};
use hwall_numeric::check::{finite, non_negative, positive, that};
use std::f64::consts::{FRAC_PI_2, PI};

/// Allowed accuracies relative to the arm's length: rounding of poses limits finer ones, and
/// coarser ones leave nothing to prove.
const FINEST: f64 = 1e-10;
const COARSEST: f64 = 0.1;

/// The finest accuracy if a height or a roll must be searched.
const FINEST_FREE: f64 = 5e-7;

/// Input of the exact search: the arms, and how the board may be held.
///
/// Usually there is one arm. A proof for a family of arms holds for each of them.
#[derive(Debug, Clone)]
pub(crate) struct ArmFamily {
    /// The arms with the narrowest and the widest limits of the family; equal if there is one arm.
    pub(crate) narrow: SrsArm,
    pub(crate) wide: SrsArm,
    /// True if the two differ.
    pub(crate) is_family: bool,
    /// Ways to hold the board with its touched point on the line.
    pub(crate) freedoms: Vec<Freedom>,
    pub(crate) accuracy_m: f64,
    /// Half of the board's touched width, m.
    pub(crate) half_width_m: f64,
}

/// Allowed rolls from `roll - half_roll` to `roll + half_roll`, rad, and heights of the tool point
/// up to `half_rise` above and below the line, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Freedom {
    pub(crate) roll: f64,
    pub(crate) half_roll: f64,
    pub(crate) half_rise: f64,
}

impl Freedom {
    /// True if there is more than one roll or height.
    pub(crate) fn is_free(&self) -> bool {
        self.half_roll > 0.0 || self.half_rise > 0.0
    }
}

impl ArmFamily {
    /// One arm; checks the configuration.
    pub(super) fn new(arm: &SrsArm, config: &ExactConfig) -> Result<Self> {
        let accuracy_m = positive("accuracy_m", config.accuracy_m)?;
        let size = size_m(arm);
        that(
            (FINEST * size..=COARSEST * size).contains(&accuracy_m),
            "accuracy_m",
            accuracy_m,
            "between 1e-10 and 0.1 lengths of the stretched arm",
        )?;
        let (half_width_m, half_height_m) = match config.board_part {
            BoardPart::Middle => (0.0, 0.0),
            BoardPart::Any {
                half_width_m,
                half_height_m,
            } => (
                non_negative("half_width_m", half_width_m)?,
                non_negative("half_height_m", half_height_m)?,
            ),
        };
        for (what, half_m) in [
            ("half_width_m", half_width_m),
            ("half_height_m", half_height_m),
        ] {
            // Larger values only risk overflow in the search.
            let wanted = "at most 100 lengths of the stretched arm";
            that(half_m <= 100.0 * size, what, half_m, wanted)?;
        }
        let mut arm = arm.clone();
        let at_roll = |roll: f64, half_roll: f64| Freedom {
            roll,
            half_roll,
            half_rise: half_height_m,
        };
        let freedoms: Vec<Freedom> = match &config.roll {
            Roll::Fixed(roll) => vec![at_roll(*roll, 0.0)],
            Roll::AnyOf(rolls) => rolls.iter().map(|roll| at_roll(*roll, 0.0)).collect(),
            Roll::Free if rolls_about_flange(&arm) => {
                // The last joint alone rotates the board: without its limit any roll is possible.
                let mut limits = *arm.limits();
                limits[6] = JointLimit::FREE;
                arm = arm.with_limits(limits)?;
                vec![at_roll(0.0, 0.0)]
            }
            Roll::Free => {
                let half = PI / FREE_ARCS as f64;
                let middle = |i: usize| (2 * i + 1) as f64 * half - PI;
                (0..FREE_ARCS).map(|i| at_roll(middle(i), half)).collect()
            }
        };
        if freedoms.is_empty() {
            return Err(ReachabilityError::Empty { what: "rolls" });
        }
        for freedom in &freedoms {
            finite("roll_rad", freedom.roll)?;
        }
        if half_height_m > 0.0 || half_width_m > 0.0 {
            // At other rolls the board's sides are neither horizontal nor vertical, and it does not
            // cover a rectangle of the wall's axes.
            let is_square = half_height_m == half_width_m;
            let turn = if is_square { FRAC_PI_2 } else { PI };
            for Freedom { roll, .. } in &freedoms {
                let turns = roll / turn;
                that(
                    (turns - turns.round()).abs() <= 1e-9,
                    "roll_rad where any part of the board counts",
                    *roll,
                    "a multiple of a quarter turn (of half a turn unless the board is square)",
                )?;
            }
        }
        that(
            accuracy_m >= FINEST_FREE * size || !freedoms.iter().any(Freedom::is_free),
            "accuracy_m",
            accuracy_m,
            "at least 5e-7 lengths of the stretched arm where a height or a roll is free",
        )?;
        Ok(Self {
            is_family: false,
            narrow: arm.clone(),
            wide: arm,
            freedoms,
            accuracy_m,
            half_width_m,
        })
    }

    /// These freedoms for a family of arms.
    pub(super) fn with_limits_of(&self, narrow: SrsArm, wide: SrsArm) -> Self {
        Self {
            is_family: narrow != wide,
            narrow,
            wide,
            ..self.clone()
        }
    }

    /// True if a height or a roll must be searched.
    pub(crate) fn is_free(&self) -> bool {
        self.freedoms.iter().any(Freedom::is_free)
    }
}

/// Initial number of arcs for a free roll that the last joint alone cannot produce.
const FREE_ARCS: usize = 24;

/// True if the tool's z axis is the axis of the last joint.
fn rolls_about_flange(arm: &SrsArm) -> bool {
    let tool = arm.flange_from_tool();
    let (z, p) = (tool.rotation().z_axis, tool.position_m());
    z.x.hypot(z.y) < 1e-15 && z.z > 0.0 && p.x.hypot(p.y) < 1e-15 * size_m(arm)
}

/// Length of the stretched arm with its tool, m.
pub(crate) fn size_m(arm: &SrsArm) -> f64 {
    let g = arm.geometry();
    g.d_bs_m.abs()
        + g.d_se_m
        + g.d_ew_m
        + g.d_wf_m.abs()
        + arm.flange_from_tool().position_m().length()
}
