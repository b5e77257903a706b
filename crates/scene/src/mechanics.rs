//! How a door, panel, drawer or button moves when it is pushed, as far as a sidecar says so.

use crate::error::{Result, SceneError};

/// Masses, stiffnesses, forces and the like are at most this, in their units: squares and products stay finite.
pub(crate) const MOST: f64 = 1e12;

/// Mechanics of a surface that moves along its opening. `None` where the sidecar says nothing.
///
/// An opening is an angle (rad) or a distance (m), a force a moment (N m) or a force (N). This crate moves nothing by it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mechanics {
    /// Inertia about the hinge, kg m², or mass, kg; positive.
    pub inertia: Option<f64>,
    /// Spring, N m/rad or N/m.
    pub stiffness: Option<f64>,
    /// Opening at which the spring is relaxed, rad or m.
    pub rest: Option<f64>,
    /// Resistance that grows with the speed, N m s/rad or N s/m.
    pub damping: Option<f64>,
    /// Resistance at any speed, N m or N.
    pub friction: Option<f64>,
    /// Share of the speed with which the ends of the range throw back, 0 to 1.
    pub restitution: Option<f64>,
    /// Places where it latches.
    pub detents: Vec<SurfaceDetent>,
    /// The click of a button.
    pub click: Option<SurfaceClick>,
}

/// A latch: it pulls towards its place, the more the farther, until it lets go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceDetent {
    /// Opening in the middle of it, rad or m.
    pub position: f64,
    /// From there to where it lets go, rad or m; positive.
    pub half_width: f64,
    /// Pull where it lets go, N m or N.
    pub force: f64,
}

/// The click of a button: a resistance that grows from `start` to `snap`, vanishes there and comes back at `release`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceClick {
    /// Opening at which the resistance begins, m.
    pub start: f64,
    /// Opening at which it gives way, m; above `start`.
    pub snap: f64,
    /// Opening at which it is armed again on the way back, m; from `start` to `snap`.
    pub release: f64,
    /// Resistance at `snap`, N.
    pub force: f64,
}

/// What the numbers are called in a sidecar.
pub(crate) struct MechanicsKeys {
    pub(crate) inertia: &'static str,
    pub(crate) stiffness: &'static str,
    pub(crate) rest: &'static str,
    pub(crate) damping: &'static str,
    pub(crate) friction: &'static str,
    pub(crate) detent_position: &'static str,
    pub(crate) detent_half_width: &'static str,
    pub(crate) detent_force: &'static str,
}

/// Of what turns.
pub(crate) const TURNING: MechanicsKeys = MechanicsKeys {
    inertia: "inertia_kg_m2",
    stiffness: "stiffness_n_m_per_rad",
    rest: "rest_deg",
    damping: "damping_n_m_s_per_rad",
    friction: "friction_n_m",
    detent_position: "detents.position_deg",
    detent_half_width: "detents.half_width_deg",
    detent_force: "detents.torque_n_m",
};

/// Of what slides.
pub(crate) const SLIDING: MechanicsKeys = MechanicsKeys {
    inertia: "mass_kg",
    stiffness: "stiffness_n_per_m",
    rest: "rest_m",
    damping: "damping_n_s_per_m",
    friction: "friction_n",
    detent_position: "detents.position_m",
    detent_half_width: "detents.half_width_m",
    detent_force: "detents.force_n",
};

impl Mechanics {
    /// Rejects impossible numbers, named as in a sidecar.
    pub(crate) fn validate(&self, surface: &str, keys: &MechanicsKeys) -> Result<()> {
        let check = |what, value: Option<f64>, holds: fn(f64) -> bool, wanted| match value {
            Some(value) if !(value.abs() <= MOST && holds(value)) => Err(SceneError::Parameter {
                surface: surface.to_owned(),
                what,
                value,
                wanted,
            }),
            _ => Ok(()),
        };
        let positive = |what, value| {
            check(
                what,
                value,
                |v| v > 0.0,
                "finite, positive and at most 1e12",
            )
        };
        let not_negative = |what, value| {
            check(
                what,
                value,
                |v| v >= 0.0,
                "finite, not negative and at most 1e12",
            )
        };
        let finite = |what, value| check(what, Some(value), |_| true, "finite and at most 1e12");
        positive(keys.inertia, self.inertia)?;
        not_negative(keys.stiffness, self.stiffness)?;
        finite(keys.rest, self.rest.unwrap_or(0.0))?;
        not_negative(keys.damping, self.damping)?;
        not_negative(keys.friction, self.friction)?;
        let share = |v| (0.0..=1.0).contains(&v);
        check("restitution", self.restitution, share, "from 0 to 1")?;
        for detent in &self.detents {
            finite(keys.detent_position, detent.position)?;
            positive(keys.detent_half_width, Some(detent.half_width))?;
            not_negative(keys.detent_force, Some(detent.force))?;
        }
        let Some(click) = &self.click else {
            return Ok(());
        };
        finite("click.start_m", click.start)?;
        let fails = |what, value, wanted| {
            Err(SceneError::Parameter {
                surface: surface.to_owned(),
                what,
                value,
                wanted,
            })
        };
        if !(click.snap <= MOST && click.snap > click.start) {
            return fails("click.snap_m", click.snap, "finite and above click.start_m");
        }
        if !(click.start..=click.snap).contains(&click.release) {
            let wanted = "from click.start_m to click.snap_m";
            return fails("click.release_m", click.release, wanted);
        }
        not_negative("click.force_n", Some(click.force))
    }
}
