//! The one error type of the crate.

use crate::unreachable::Unreachable;
use hwall_geometry::{ArgumentError, GeometryError};
use std::io::ErrorKind;

/// What can be wrong with a model, a pose or a request.
///
/// A result expected at run time, such as an unreachable pose, is not an error: see [`Verdict`](crate::Verdict).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum KinematicsError {
    /// An argument is NaN or infinite, or a setting is outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// Numbers that are not a pose.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A joint array has the wrong length.
    #[error("{what} has {got} values, the arm has {expected} joints")]
    WrongJointCount {
        /// The argument.
        what: &'static str,
        /// Joints of the arm.
        expected: usize,
        /// Length given.
        got: usize,
    },
    /// The lower limit of a joint lies above the upper one.
    #[error("joint {index}: limits reversed, {min_rad} > {max_rad} rad")]
    LimitsReversed {
        /// Joint, from 0.
        index: usize,
        /// Lower limit given, rad.
        min_rad: f64,
        /// Upper limit given, rad.
        max_rad: f64,
    },
    /// A limit of joint 2, 4 or 6 of an S-R-S arm reaches half a turn, where the arm folds onto itself.
    #[error(
        "joint {index}: limits [{min_rad}, {max_rad}] rad must stay strictly within half a turn"
    )]
    LimitTooWide {
        /// Joint, from 0.
        index: usize,
        /// Lower limit given, rad.
        min_rad: f64,
        /// Upper limit given, rad.
        max_rad: f64,
    },
    /// A configuration violates a joint limit.
    #[error("joint {index}: {value_rad} rad outside [{min_rad}, {max_rad}]")]
    JointLimit {
        /// Joint, from 0.
        index: usize,
        /// Angle given, rad (metres for a prismatic joint).
        value_rad: f64,
        /// Lower limit, rad.
        min_rad: f64,
        /// Upper limit, rad.
        max_rad: f64,
    },
    /// A link length is zero or negative where the arm needs it.
    #[error("link length {link} is {value_m} m, it must be positive")]
    LinkLength {
        /// Symbol of the length.
        link: &'static str,
        /// Length given, m.
        value_m: f64,
    },
    /// The numeric inverse found no solution within its budget.
    #[error("not converged after {iterations} steps: {residual_m} m, {residual_rad} rad left")]
    NotConverged {
        /// Steps spent over all restarts.
        iterations: usize,
        /// Position error of the best attempt, m.
        residual_m: f64,
        /// Orientation error of the best attempt, rad.
        residual_rad: f64,
    },
    /// No solution exists.
    #[error("unreachable: {0}")]
    Unreachable(#[from] Unreachable),
    /// A chain has no movable joint.
    #[error("the chain has no movable joint")]
    NoJoints,
    /// A chain is too long for an arm.
    #[error("the chain has {got} joints, an arm at most {most}")]
    TooManyJoints {
        /// Joints of the chain.
        got: usize,
        /// Most joints of an arm.
        most: usize,
    },
    /// A joint of an arm comes without a largest velocity.
    #[error("joint {joint:?} has no velocity limit")]
    NoVelocityLimit {
        /// Joint name.
        joint: String,
    },
    /// Two joints of a chain have the same name.
    #[error("two joints are called {joint:?}")]
    DuplicateJoint {
        /// Joint name.
        joint: String,
    },
    /// A revolute or prismatic joint comes without limits.
    #[error("URDF joint {joint:?} has no limits")]
    UrdfNoLimits {
        /// Joint name.
        joint: String,
    },
    /// A joint axis has no direction.
    #[error("joint {joint}: axis {axis:?} has no direction")]
    ZeroAxis {
        /// Joint name.
        joint: String,
        /// Axis given.
        axis: [f64; 3],
    },
    /// The URDF text cannot be read at all.
    #[error("malformed URDF: {message}")]
    UrdfMalformed {
        /// What the parser said.
        message: String,
    },
    /// A URDF names a link it does not define.
    #[error("URDF has no link {link:?}")]
    UrdfUnknownLink {
        /// The missing link.
        link: String,
    },
    /// A URDF link is defined twice or has two parents.
    #[error("URDF link {link:?} is defined twice or has two parents")]
    UrdfDuplicateLink {
        /// The link.
        link: String,
    },
    /// The joints of a URDF form a loop.
    #[error("URDF joints form a loop through link {link:?}")]
    UrdfLoop {
        /// A link on the loop.
        link: String,
    },
    /// There is no path from base to tip.
    #[error("URDF link {tip:?} does not hang on {base:?}")]
    UrdfDisconnected {
        /// First link.
        base: String,
        /// Last link.
        tip: String,
    },
    /// The robot has no links.
    #[error("the URDF describes a robot without links")]
    UrdfNoLinks,
    /// Several arms qualify, so the tip must be named.
    #[error("URDF has {} possible ends{}: name the base and tip link", links.len(), listed(links))]
    UrdfAmbiguous {
        /// Roots or leaves found.
        links: Vec<String>,
    },
    /// The text is a xacro macro, not expanded URDF.
    #[error("this is xacro, not URDF: run `xacro FILE` and read what it prints")]
    UrdfXacro,
    /// A chain is not an S-R-S arm in the posture that [`SrsGeometry`](crate::SrsGeometry) describes.
    #[error(
        "not an S-R-S arm: {what} of joint {joint} is {deviation} off, at most {most} is allowed"
    )]
    NotSrs {
        /// Joint, from 1.
        joint: usize,
        /// What does not fit.
        what: &'static str,
        /// Size of the deviation: sine of the angle for directions, metres for distances.
        deviation: f64,
        /// Largest allowed deviation.
        most: f64,
    },
    /// A joint kind that a serial chain does not support.
    #[error("URDF joint {joint:?} of kind {kind} is not supported")]
    UrdfJointKind {
        /// Joint name.
        joint: String,
        /// Kind given.
        kind: String,
    },
    /// Dynamics needs the inertia of a link that has none or an impossible one.
    #[error("link {link:?}: mass {mass_kg} kg or its inertia is not physical")]
    Inertia {
        /// Link name.
        link: String,
        /// Mass given, kg.
        mass_kg: f64,
    },
    /// The chain carries no inertials at all.
    #[error("the model holds no link inertials")]
    NoInertials,
    /// The mass matrix is singular: some motion up to this joint moves no mass.
    #[error("joint {joint} can move without moving any mass")]
    SingularMass {
        /// Joint, from 0.
        joint: usize,
    },
    /// A file cannot be read.
    #[error("{path}: {message}")]
    Io {
        /// The file.
        path: String,
        /// What kind of failure it was.
        kind: ErrorKind,
        /// What the system said.
        message: String,
    },
}

/// The first names of a list, for a message.
fn listed(links: &[String]) -> String {
    const MOST_NAMED: usize = 8;
    let mut text = String::new();
    for (k, link) in links.iter().take(MOST_NAMED).enumerate() {
        text += if k == 0 { " (" } else { ", " };
        text += &format!("{link:?}");
    }
    match links.len() {
        0 => {}
        count if count > MOST_NAMED => text += ", ...)",
        _ => text.push(')'),
    }
    text
}
