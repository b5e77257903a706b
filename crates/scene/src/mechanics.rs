//! Mechanics of a door, panel, drawer or button, as given in a sidecar.

use crate::error::{Result, SceneError};

/// Upper limit of masses, stiffnesses, forces etc. in their units: squares and products stay finite.
pub(crate) const MOST: f64 = 1e12;

/// Mechanics of a surface along its opening. `None` if the sidecar gives no value.
///
/// Openings are angles (rad) or distances (m), forces are moments (N m) or forces (N). This crate only stores them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mechanics {
    /// Inertia about the hinge, kg m², or mass, kg; positive.
    pub inertia: Option<f64>,
    /// Spring, N m/rad or N/m.
    pub stiffness: Option<f64>,
    /// Opening at which the spring is relaxed, rad or m.
    pub rest: Option<f64>,
    /// Viscous damping, N m s/rad or N s/m.
    pub damping: Option<f64>,
    /// Dry friction, N m or N.
    pub friction: Option<f64>,
    /// Coefficient of restitution at the ends of the range, 0 to 1.
    pub restitution: Option<f64>,
    /// Detents.
    pub detents: Vec<SurfaceDetent>,
    /// The click of a button.
    pub click: Option<SurfaceClick>,
}

/// A detent: it pulls towards its position with a force that grows with the distance, up to its edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceDetent {
    /// Opening at its middle, rad or m.
    pub position: f64,
    /// Distance from the middle to its edge, rad or m; positive.
    pub half_width: f64,
    /// Pull at its edge, N m or N.
    pub force: f64,
}

/// The click of a button: a resistance that grows from `start` to `snap`, vanishes there and returns at `release`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceClick {
    /// Opening at which the resistance begins, m.
    pub start: f64,
    /// Opening at which the resistance vanishes, m; above `start`.
    pub snap: f64,
    /// Opening at which the resistance is re-armed on return, m; from `start` to `snap`.
    pub release: f64,
    /// Resistance at `snap`, N.
    pub force: f64,
}

/// Keys of the values in a sidecar.
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

/// Keys of rotating surfaces.
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

/// Keys of sliding surfaces.
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
    /// Rejects invalid values, named by their sidecar keys.
    pub(crate) fn validate(&self, surface: &str, keys: &MechanicsKeys) -> Result<()> {
        let check = |what, value: Option<f64>, holds: fn(f64) -> bool, wanted| match value {
            Some(value) if !(value.abs() <= MOST && holds(value)) => {
                Err(SceneError::parameter(surface, what, value, wanted))
            }
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
        let fails = |what, value, wanted| Err(SceneError::parameter(surface, what, value, wanted));
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
