//! The TOML file beside an OBJ, which says what its surfaces are.

use super::mesh::SurfaceMesh;
use crate::error::SceneError;
use crate::surface::SurfaceKind;
use glam::DVec3;
use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sidecar {
    /// Kind of surfaces without an entry.
    #[serde(default)]
    default_kind: Kind,
    #[serde(default)]
    surface: BTreeMap<String, Entry>,
}

#[derive(Deserialize, Clone, Copy, PartialEq, Default)]
#[serde(rename_all = "snake_case")]
enum Kind {
    #[default]
    Static,
    RevolvingDoor,
    SlidingPanel,
    Untouchable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    kind: Option<Kind>,
    roughness: Option<f64>,
    contact_stiffness_n_per_m: Option<f64>,
    // Revolving door.
    hinge_point_m: Option<[f64; 3]>,
    hinge_axis: Option<[f64; 3]>,
    range_deg: Option<[f64; 2]>,
    stiffness_n_m_per_rad: Option<f64>,
    damping_n_m_s_per_rad: Option<f64>,
    // Sliding panel.
    direction: Option<[f64; 3]>,
    range_m: Option<[f64; 2]>,
    stiffness_n_per_m: Option<f64>,
    damping_n_s_per_m: Option<f64>,
}

/// Gives the surfaces the properties the sidecar names.
pub(crate) fn apply(text: &str, meshes: &mut [SurfaceMesh]) -> Result<(), SceneError> {
    let Sidecar {
        default_kind,
        mut surface,
    } = toml::from_str(text).map_err(|e| SceneError::SidecarMalformed {
        message: e.to_string().trim_end().to_owned(),
    })?;
    if !matches!(default_kind, Kind::Static | Kind::Untouchable) {
        let message = "default_kind must be \"static\" or \"untouchable\"".to_owned();
        return Err(SceneError::SidecarMalformed { message });
    }
    for mesh in meshes {
        let target = &mut mesh.surface;
        let Some(entry) = surface.remove(&target.name) else {
            target.kind = plain(default_kind);
            continue;
        };
        target.kind = kind(&target.name, &entry, entry.kind.unwrap_or(default_kind))?;
        target.roughness = entry.roughness;
        target.contact_stiffness_n_per_m = entry.contact_stiffness_n_per_m;
    }
    match surface.into_keys().next() {
        Some(name) => Err(SceneError::SidecarUnknownSurface { name }),
        None => Ok(()),
    }
}

/// A kind that needs no keys.
fn plain(kind: Kind) -> SurfaceKind {
    if kind == Kind::Untouchable {
        SurfaceKind::Untouchable
    } else {
        SurfaceKind::Static
    }
}

fn kind(surface: &str, entry: &Entry, kind: Kind) -> Result<SurfaceKind, SceneError> {
    let door_keys = [
        ("hinge_point_m", entry.hinge_point_m.is_some()),
        ("hinge_axis", entry.hinge_axis.is_some()),
        ("range_deg", entry.range_deg.is_some()),
        (
            "stiffness_n_m_per_rad",
            entry.stiffness_n_m_per_rad.is_some(),
        ),
        (
            "damping_n_m_s_per_rad",
            entry.damping_n_m_s_per_rad.is_some(),
        ),
    ];
    let panel_keys = [
        ("direction", entry.direction.is_some()),
        ("range_m", entry.range_m.is_some()),
        ("stiffness_n_per_m", entry.stiffness_n_per_m.is_some()),
        ("damping_n_s_per_m", entry.damping_n_s_per_m.is_some()),
    ];
    let (name, stray): (_, &[&[(&'static str, bool)]]) = match kind {
        Kind::Static => ("static", &[&door_keys, &panel_keys]),
        Kind::Untouchable => ("untouchable", &[&door_keys, &panel_keys]),
        Kind::RevolvingDoor => ("revolving_door", &[&panel_keys]),
        Kind::SlidingPanel => ("sliding_panel", &[&door_keys]),
    };
    if let Some(&(key, _)) = stray
        .iter()
        .copied()
        .flatten()
        .find(|(_, present)| *present)
    {
        return Err(SceneError::SidecarStrayKey {
            surface: surface.to_owned(),
            kind: name,
            key,
        });
    }
    let needs = |key| SceneError::SidecarMissingKey {
        surface: surface.to_owned(),
        kind: name,
        key,
    };
    let vector = |value: Option<[f64; 3]>, key| value.map(DVec3::from).ok_or_else(|| needs(key));
    Ok(match kind {
        Kind::Static | Kind::Untouchable => plain(kind),
        Kind::RevolvingDoor => {
            let [min_rad, max_rad] = entry
                .range_deg
                .ok_or_else(|| needs("range_deg"))?
                .map(f64::to_radians);
            SurfaceKind::RevolvingDoor {
                hinge_point_m: vector(entry.hinge_point_m, "hinge_point_m")?,
                hinge_axis: vector(entry.hinge_axis, "hinge_axis")?,
                min_rad,
                max_rad,
                stiffness_n_m_per_rad: entry.stiffness_n_m_per_rad,
                damping_n_m_s_per_rad: entry.damping_n_m_s_per_rad,
            }
        }
        Kind::SlidingPanel => {
            let [min_m, max_m] = entry.range_m.ok_or_else(|| needs("range_m"))?;
            SurfaceKind::SlidingPanel {
                direction: vector(entry.direction, "direction")?,
                min_m,
                max_m,
                stiffness_n_per_m: entry.stiffness_n_per_m,
                damping_n_s_per_m: entry.damping_n_s_per_m,
            }
        }
    })
}
