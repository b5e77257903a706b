//! Mass, centre of mass and rotational inertia of one rigid body.

use crate::error::KinematicsError;
use crate::joints::MOST;
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;
use hwall_numeric::check::{all_finite, that};

/// Relative tolerance of the symmetry, sign and triangle checks: robot descriptions are rounded to a few digits.
const PHYSICAL_TOLERANCE: f64 = 1e-3;

/// Mass properties of one link, in the frame defined by the owner.
///
/// Plain data: robot descriptions with missing or invented inertias are common and usable for
/// kinematics, so nothing is checked before [`Inertial::validate`] or `ChainDynamics::new`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Inertial {
    /// Name of the link, for error messages.
    pub link: String,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass, m.
    pub com_m: DVec3,
    /// Inertia about the centre of mass in the axes of the frame, kg m².
    pub inertia_kg_m2: DMat3,
}

impl Inertial {
    /// From the six entries `[ixx, ixy, ixz, iyy, iyz, izz]` about the centre of mass, kg m².
    #[must_use]
    pub fn from_six(
        link: impl Into<String>,
        mass_kg: f64,
        com_m: DVec3,
        inertia_kg_m2: [f64; 6],
    ) -> Self {
        let [xx, xy, xz, yy, yz, zz] = inertia_kg_m2;
        let rows = [xx, xy, xz, xy, yy, yz, xz, yz, zz];
        Self {
            inertia_kg_m2: DMat3::from_cols_array(&rows),
            ..Self::point(link, mass_kg, com_m)
        }
    }

    /// A point mass, kg, at a position in the frame, m.
    #[must_use]
    pub fn point(link: impl Into<String>, mass_kg: f64, com_m: DVec3) -> Self {
        Self {
            link: link.into(),
            mass_kg,
            com_m,
            inertia_kg_m2: DMat3::ZERO,
        }
    }

    /// A solid box centred on `com_m` with edges `size_m` along the frame's axes: boards and handles.
    #[must_use]
    pub fn solid_box(link: impl Into<String>, mass_kg: f64, com_m: DVec3, size_m: DVec3) -> Self {
        let s = size_m * size_m;
        let diagonal = DVec3::new(s.y + s.z, s.z + s.x, s.x + s.y) * (mass_kg / 12.0);
        Self {
            inertia_kg_m2: DMat3::from_diagonal(diagonal),
            ..Self::point(link, mass_kg, com_m)
        }
    }

    /// The same body seen from an outer frame.
    #[must_use]
    pub fn transformed(&self, outer_from_frame: &Pose) -> Self {
        let r = outer_from_frame.rotation();
        Self {
            link: self.link.clone(),
            mass_kg: self.mass_kg,
            com_m: outer_from_frame.transform_point(self.com_m),
            inertia_kg_m2: r * self.inertia_kg_m2 * r.transpose(),
        }
    }

    /// Checks that this body is physical.
    ///
    /// Mass zero or more; inertia symmetric, positive semi-definite and within the triangle
    /// inequality of its principal moments, each to 0.1 % of the largest moment, since
    /// published values are rounded.
    ///
    /// # Errors
    /// [`KinematicsError::Argument`] or [`KinematicsError::Inertia`].
    pub fn validate(&self) -> Result<(), KinematicsError> {
        let (com_m, inertia) = (self.com_m.to_array(), self.inertia_kg_m2.to_cols_array());
        for (what, values) in [
            ("link mass", &[self.mass_kg][..]),
            ("centre of mass", &com_m),
            ("inertia", &inertia),
        ] {
            all_finite(what, values)?;
            // Products of values up to this bound stay finite.
            let most = largest(values);
            that(most <= MOST, what, most, "within 1e9 of zero")?;
        }
        let i = self.inertia_kg_m2;
        let scale = largest(&inertia);
        let slack = PHYSICAL_TOLERANCE * scale;
        let asymmetry = largest(&(i - i.transpose()).to_cols_array());
        // Σ = tr(I)/2 − I, the second moment of the mass, is positive semi-definite exactly when
        // the principal moments obey the triangle inequality; I = tr(Σ) − Σ then is, too.
        let trace = i.x_axis.x + i.y_axis.y + i.z_axis.z;
        let second_moment = DMat3::from_diagonal(DVec3::splat(0.5 * trace + slack)) - i;
        let massless_with_inertia = self.mass_kg == 0.0 && scale > 0.0;
        let physical = self.mass_kg >= 0.0
            && !massless_with_inertia
            && asymmetry <= slack
            && positive_semi_definite(second_moment, slack * scale);
        if physical {
            Ok(())
        } else {
            Err(KinematicsError::Inertia {
                link: self.link.clone(),
                mass_kg: self.mass_kg,
            })
        }
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

/// True if all principal minors of a symmetric matrix are at least zero, up to rounding.
fn positive_semi_definite(m: DMat3, minor_slack: f64) -> bool {
    let minor = |a: f64, b: f64, c: f64| a * b - c * c >= -minor_slack;
    m.x_axis.x >= 0.0
        && m.y_axis.y >= 0.0
        && m.z_axis.z >= 0.0
        && minor(m.x_axis.x, m.y_axis.y, m.x_axis.y)
        && minor(m.y_axis.y, m.z_axis.z, m.y_axis.z)
        && minor(m.x_axis.x, m.z_axis.z, m.x_axis.z)
        && m.determinant() >= -minor_slack * (m.x_axis.x + m.y_axis.y + m.z_axis.z)
}
