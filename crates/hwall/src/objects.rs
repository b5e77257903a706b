//! The moving surfaces of a scene, as objects that can be pushed.

use crate::error::SessionError;
use hwall_haptics::{Click, Detent, ObjectConfig, ObjectPath};
use hwall_scene::{Mechanics, Scene, SceneError, SlidingPart, SurfaceId, SurfaceKind};

/// A moving surface of a scene: which one, how it moves, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneObject {
    /// The surface.
    pub surface: SurfaceId,
    /// How it moves; the position of the object is the opening of the surface.
    pub config: ObjectConfig,
    /// Path of its positions in the frame of the scene, which is the base frame.
    pub path: ObjectPath,
}

/// Default mechanics, for an object whose sidecar states none.
struct Defaults {
    /// kg m² or kg.
    inertia: f64,
    /// N m/rad or N/m.
    stiffness: f64,
    /// N m s/rad or N s/m.
    damping: f64,
}

/// A door leaf of 20 kg and 0.8 m: 20 · 0.8² / 3. It comes to rest within a few seconds.
const DOOR: Defaults = Defaults {
    inertia: 4.3,
    stiffness: 0.0,
    damping: 2.0,
};
/// A light sliding door on rollers.
const PANEL: Defaults = Defaults {
    inertia: 10.0,
    stiffness: 0.0,
    damping: 10.0,
};
/// A half-full drawer.
const DRAWER: Defaults = Defaults {
    inertia: 3.0,
    stiffness: 0.0,
    damping: 10.0,
};
/// Springs back; damping ratio 0.35.
const BUTTON: Defaults = Defaults {
    inertia: 0.05,
    stiffness: 400.0,
    damping: 3.0,
};

/// The surface as an object that can be pushed; `None` if it does not move.
///
/// Values that the sidecar leaves out are zero, except for these:
///
/// | kind | inertia | stiffness | damping |
/// | --- | --- | --- | --- |
/// | `revolving_door` | 4.3 kg m² | 0 | 2 N m s/rad |
/// | `sliding_panel` | 10 kg | 0 | 10 N s/m |
/// | `drawer` | 3 kg | 0 | 10 N s/m |
/// | `button` | 0.05 kg | 400 N/m | 3 N s/m |
///
/// # Errors
/// A surface of another scene; values that are valid individually, but not in combination.
pub fn object_of(
    scene: &Scene,
    surface: SurfaceId,
) -> Result<Option<(ObjectConfig, ObjectPath)>, SessionError> {
    let surfaces = scene.surfaces();
    let unknown = SceneError::UnknownSurface {
        index: surface.0,
        count: surfaces.len(),
    };
    let kind = &surfaces.get(surface.0).ok_or(unknown)?.kind;
    let (path, defaults) = match *kind {
        SurfaceKind::RevolvingDoor {
            hinge_point_m,
            hinge_axis,
            ..
        } => (ObjectPath::turning(hinge_point_m, hinge_axis)?, DOOR),
        SurfaceKind::Sliding {
            part, direction, ..
        } => {
            let defaults = match part {
                SlidingPart::Panel => PANEL,
                SlidingPart::Drawer => DRAWER,
                SlidingPart::Button => BUTTON,
            };
            (ObjectPath::sliding(direction)?, defaults)
        }
        _ => return Ok(None),
    };
    let (Some(mechanics), Some(range)) = (kind.mechanics(), kind.range()) else {
        return Ok(None);
    };
    let config = config_of(mechanics, &defaults, [range.min, range.max]);
    config.validate()?;
    Ok(Some((config, path)))
}

/// All moving surfaces of a scene, in the order of its surfaces.
///
/// # Errors
/// As for [`object_of`].
pub fn objects_of(scene: &Scene) -> Result<Vec<SceneObject>, SessionError> {
    let mut objects = Vec::new();
    for surface in (0..scene.surfaces().len()).map(SurfaceId) {
        if let Some((config, path)) = object_of(scene, surface)? {
            objects.push(SceneObject {
                surface,
                config,
                path,
            });
        }
    }
    Ok(objects)
}

/// Paths of the moving surfaces of a scene.
pub(crate) fn paths_of(scene: &Scene) -> Result<Vec<(SurfaceId, ObjectPath)>, SessionError> {
    let objects = objects_of(scene)?.into_iter();
    Ok(objects.map(|found| (found.surface, found.path)).collect())
}

fn config_of(mechanics: &Mechanics, defaults: &Defaults, range: [f64; 2]) -> ObjectConfig {
    let detents = mechanics.detents.iter().map(|d| Detent {
        position: d.position,
        half_width: d.half_width,
        force: d.force,
    });
    ObjectConfig {
        inertia: mechanics.inertia.unwrap_or(defaults.inertia),
        stiffness: mechanics.stiffness.unwrap_or(defaults.stiffness),
        rest: mechanics.rest.unwrap_or(0.0),
        damping: mechanics.damping.unwrap_or(defaults.damping),
        friction: mechanics.friction.unwrap_or(0.0),
        range,
        restitution: mechanics.restitution.unwrap_or(0.0),
        detents: detents.collect(),
        click: mechanics.click.map(|c| Click {
            start: c.start,
            snap: c.snap,
            release: c.release,
            force: c.force,
        }),
    }
}
