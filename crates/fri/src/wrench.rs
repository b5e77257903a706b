//! Wrenches in the format of a command.

use glam::DVec3;
use hwall_geometry::Pose;
use hwall_kinematics::Wrench;

/// From the wire order: `Fx Fy Fz`, then moments about z, y and x, the manufacturer's angles A, B and C.
pub(crate) const fn wrench_from_wire(w: &[f64; 6]) -> Wrench {
    Wrench {
        force_n: DVec3::new(w[0], w[1], w[2]),
        moment_n_m: DVec3::new(w[5], w[4], w[3]),
    }
}

/// The reverse of [`wrench_from_wire`].
pub(crate) const fn wrench_to_wire(wrench: &Wrench) -> [f64; 6] {
    let (f, m) = (wrench.force_n, wrench.moment_n_m);
    [f.x, f.y, f.z, m.z, m.y, m.x]
}

/// Converts a wrench from the axes of the tool to those of the base.
pub(crate) fn wrench_in_base(base_from_tool: &Pose, wrench: &Wrench) -> Wrench {
    Wrench {
        force_n: base_from_tool.transform_vector(wrench.force_n),
        moment_n_m: base_from_tool.transform_vector(wrench.moment_n_m),
    }
}
