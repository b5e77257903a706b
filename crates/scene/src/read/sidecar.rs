//! The TOML file next to an OBJ, which describes its surfaces.

use super::mesh::SurfaceMesh;
use crate::error::{Result, SceneError};
use crate::mechanics::{Mechanics, SurfaceClick, SurfaceDetent};
use crate::surface::{SlidingPart, SurfaceKind};
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
    Drawer,
    Button,
    Untouchable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    kind: Option<Kind>,
    roughness: Option<f64>,
    contact_stiffness_n_per_m: Option<f64>,
    // Moving surfaces.
    restitution: Option<f64>,
    detents: Option<Vec<DetentEntry>>,
    // Rotating surfaces.
    hinge_point_m: Option<[f64; 3]>,
    hinge_axis: Option<[f64; 3]>,
    range_deg: Option<[f64; 2]>,
    rest_deg: Option<f64>,
    inertia_kg_m2: Option<f64>,
    stiffness_n_m_per_rad: Option<f64>,
    damping_n_m_s_per_rad: Option<f64>,
    friction_n_m: Option<f64>,
    // Sliding surfaces.
    direction: Option<[f64; 3]>,
    range_m: Option<[f64; 2]>,
    rest_m: Option<f64>,
    mass_kg: Option<f64>,
    stiffness_n_per_m: Option<f64>,
    damping_n_s_per_m: Option<f64>,
    friction_n: Option<f64>,
    // Buttons.
    click: Option<ClickEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DetentEntry {
    position_deg: Option<f64>,
    half_width_deg: Option<f64>,
    torque_n_m: Option<f64>,
    position_m: Option<f64>,
    half_width_m: Option<f64>,
    force_n: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ClickEntry {
    start_m: f64,
    snap_m: f64,
    release_m: Option<f64>,
    force_n: f64,
}

/// Applies the properties in the sidecar to the surfaces.
pub(crate) fn apply(text: &str, meshes: &mut [SurfaceMesh]) -> Result<()> {
    let Sidecar {
        default_kind,
        mut surface,
    } = toml::from_str(text.trim_start_matches('\u{feff}')).map_err(|e| {
        SceneError::SidecarMalformed {
            message: in_line(text, &e),
        }
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

/// The parser's message and its position, in one line.
fn in_line(text: &str, error: &toml::de::Error) -> String {
    let message = error.message().trim();
    let before = error.span().and_then(|span| text.get(..span.start));
    match before {
        Some(before) => {
            let line = 1 + before.bytes().filter(|byte| *byte == b'\n').count();
            let words = text.lines().nth(line - 1).unwrap_or_default().trim();
            format!("line {line}, {words:?}: {message}")
        }
        None => message.to_owned(),
    }
}

/// A kind without required keys.
fn plain(kind: Kind) -> SurfaceKind {
    if kind == Kind::Untouchable {
        SurfaceKind::Untouchable
    } else {
        SurfaceKind::Static
    }
}

/// A key and whether the entry has it.
type Key = (&'static str, bool);

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::RevolvingDoor => "revolving_door",
            Self::SlidingPanel => "sliding_panel",
            Self::Drawer => "drawer",
            Self::Button => "button",
            Self::Untouchable => "untouchable",
        }
    }

    fn turns(self) -> bool {
        self == Self::RevolvingDoor
    }

    fn slides(self) -> bool {
        matches!(self, Self::SlidingPanel | Self::Drawer | Self::Button)
    }
}

impl Entry {
    /// The first key that a kind does not use.
    fn stray(&self, kind: Kind) -> Option<&'static str> {
        let moving: &[Key] = &[
            ("restitution", self.restitution.is_some()),
            ("detents", self.detents.is_some()),
        ];
        let turning: &[Key] = &[
            ("hinge_point_m", self.hinge_point_m.is_some()),
            ("hinge_axis", self.hinge_axis.is_some()),
            ("range_deg", self.range_deg.is_some()),
            ("rest_deg", self.rest_deg.is_some()),
            ("inertia_kg_m2", self.inertia_kg_m2.is_some()),
            (
                "stiffness_n_m_per_rad",
                self.stiffness_n_m_per_rad.is_some(),
            ),
            (
                "damping_n_m_s_per_rad",
                self.damping_n_m_s_per_rad.is_some(),
            ),
            ("friction_n_m", self.friction_n_m.is_some()),
        ];
        let sliding: &[Key] = &[
            ("direction", self.direction.is_some()),
            ("range_m", self.range_m.is_some()),
            ("rest_m", self.rest_m.is_some()),
            ("mass_kg", self.mass_kg.is_some()),
            ("stiffness_n_per_m", self.stiffness_n_per_m.is_some()),
            ("damping_n_s_per_m", self.damping_n_s_per_m.is_some()),
            ("friction_n", self.friction_n.is_some()),
        ];
        let pressed: &[Key] = &[("click", self.click.is_some())];
        let groups = [
            (moving, kind.turns() || kind.slides()),
            (turning, kind.turns()),
            (sliding, kind.slides()),
            (pressed, kind == Kind::Button),
        ];
        let unused = groups.iter().filter(|(_, used)| !used);
        let mut stray = unused.flat_map(|(keys, _)| keys.iter());
        stray.find(|(_, present)| *present).map(|(key, _)| *key)
    }
}

/// Errors about one entry.
struct Faults<'a> {
    surface: &'a str,
    kind: Kind,
}

impl Faults<'_> {
    fn stray(&self, key: &'static str) -> SceneError {
        SceneError::SidecarStrayKey {
            surface: self.surface.to_owned(),
            kind: self.kind.name(),
            key,
        }
    }

    fn missing(&self, key: &'static str) -> SceneError {
        SceneError::SidecarMissingKey {
            surface: self.surface.to_owned(),
            kind: self.kind.name(),
            key,
        }
    }

    fn needed<T>(&self, key: &'static str, value: Option<T>) -> Result<T> {
        value.ok_or_else(|| self.missing(key))
    }
}

impl DetentEntry {
    fn read(&self, faults: &Faults) -> Result<SurfaceDetent> {
        let turning = [
            ("detents.position_deg", self.position_deg),
            ("detents.half_width_deg", self.half_width_deg),
            ("detents.torque_n_m", self.torque_n_m),
        ];
        let sliding = [
            ("detents.position_m", self.position_m),
            ("detents.half_width_m", self.half_width_m),
            ("detents.force_n", self.force_n),
        ];
        let turns = faults.kind.turns();
        let (own, others) = if turns {
            (turning, sliding)
        } else {
            (sliding, turning)
        };
        if let Some((key, _)) = others.iter().find(|(_, value)| value.is_some()) {
            return Err(faults.stray(key));
        }
        let [position, half_width, force] = own.map(|(key, value)| faults.needed(key, value));
        let scale = if turns { 1_f64.to_radians() } else { 1.0 };
        Ok(SurfaceDetent {
            position: scale * position?,
            half_width: scale * half_width?,
            force: force?,
        })
    }
}

impl Entry {
    /// For a kind already checked for stray keys: all present keys apply to it.
    fn mechanics(&self, faults: &Faults) -> Result<Mechanics> {
        let detents = self.detents.iter().flatten();
        Ok(Mechanics {
            inertia: self.inertia_kg_m2.or(self.mass_kg),
            stiffness: self.stiffness_n_m_per_rad.or(self.stiffness_n_per_m),
            rest: self.rest_deg.map(f64::to_radians).or(self.rest_m),
            damping: self.damping_n_m_s_per_rad.or(self.damping_n_s_per_m),
            friction: self.friction_n_m.or(self.friction_n),
            restitution: self.restitution,
            detents: detents.map(|d| d.read(faults)).collect::<Result<_, _>>()?,
            click: self.click.as_ref().map(|click| SurfaceClick {
                start: click.start_m,
                snap: click.snap_m,
                release: click.release_m.unwrap_or(click.start_m),
                force: click.force_n,
            }),
        })
    }
}

fn kind(surface: &str, entry: &Entry, kind: Kind) -> Result<SurfaceKind> {
    let faults = Faults { surface, kind };
    if let Some(key) = entry.stray(kind) {
        return Err(faults.stray(key));
    }
    if !kind.turns() && !kind.slides() {
        return Ok(plain(kind));
    }
    let vector = |value: Option<[f64; 3]>, key| faults.needed(key, value).map(DVec3::from);
    let mechanics = entry.mechanics(&faults)?;
    if kind.turns() {
        let [min_rad, max_rad] = faults
            .needed("range_deg", entry.range_deg)?
            .map(f64::to_radians);
        return Ok(SurfaceKind::RevolvingDoor {
            hinge_point_m: vector(entry.hinge_point_m, "hinge_point_m")?,
            hinge_axis: vector(entry.hinge_axis, "hinge_axis")?,
            min_rad,
            max_rad,
            mechanics,
        });
    }
    let [min_m, max_m] = faults.needed("range_m", entry.range_m)?;
    let direction = vector(entry.direction, "direction")?;
    Ok(SurfaceKind::Sliding {
        part: match kind {
            Kind::Drawer => SlidingPart::Drawer,
            Kind::Button => SlidingPart::Button,
            _ => SlidingPart::Panel,
        },
        direction,
        min_m,
        max_m,
        mechanics,
    })
}
