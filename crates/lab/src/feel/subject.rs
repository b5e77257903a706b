//! Pushed objects: those of the study, and doors of scenes.

use super::rig::Rig;
use anyhow::{Context, bail};
use glam::DVec3;
use hwall::object_of;
use hwall::scene::{Scene, SurfaceId, SurfaceKind};
use hwall_haptics::{
    MovingObject, ObjectConfig, ObjectPath, QUARTER_TURNS_RAD, RenderedObject, board_pose,
};
use hwall_kinematics::{BranchPolicy, JointPositions, NearestConfig, Pose};

/// An object with the board on it.
#[derive(Debug, Clone)]
pub struct Subject {
    /// For tables.
    pub name: String,
    /// The object, as asked for.
    pub object: RenderedObject,
    /// Joint positions that hold the board on it.
    pub start: JointPositions,
    /// Pose of the face there.
    pub face: Pose,
}

impl Subject {
    /// Displacement of the middle of the face per rad or m of the position, m.
    #[must_use]
    pub fn lever_m(&self) -> f64 {
        let path = &self.object.path;
        let per_unit = path.velocity_at(self.face.position_m(), 1.0);
        per_unit.linear_m_per_s.length()
    }
}

/// Path of a study's object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Turns about an upright hinge, 0.6 m beside the middle of the board.
    Door,
    /// Slides along the normal of the board, away from the hand.
    Panel,
    /// The same, shorter.
    Button,
}

/// Distance of the study's objects beyond the board's start position, m, to leave room for motion back.
const OUT_M: f64 = 0.1;
/// Distance from the hinge of a study's door to the middle of the board, m.
const LEVER_M: f64 = 0.6;

/// An object in front of the starting posture; positive positions lead away from the hand.
///
/// # Errors
/// Numbers that are not valid.
pub fn made(rig: &Rig, kind: Kind, name: String, config: ObjectConfig) -> anyhow::Result<Subject> {
    let face = rig.kinematics.forward(&rig.start);
    let face = face.at(face.position_m() + OUT_M * face.rotation().z_axis);
    let (arm, near) = (&rig.kinematics, NearestConfig::default());
    let start = arm.nearest(&face, &rig.start, &near, &mut arm.scratch())?.q;
    let inward = -face.rotation().z_axis;
    let path = match kind {
        Kind::Panel | Kind::Button => ObjectPath::sliding(inward)?,
        Kind::Door => {
            let beside = DVec3::Z.cross(inward).normalize();
            let hinge_m = face.position_m() - LEVER_M * beside;
            ObjectPath::turning(hinge_m, beside.cross(inward))?
        }
    };
    Ok(Subject {
        name,
        object: RenderedObject {
            object: MovingObject::new(config)?,
            path,
        },
        start,
        face,
    })
}

/// A moving surface of a scene, touched at the best of several places for the arm.
///
/// # Errors
/// An unknown name, a surface that does not move, one that the arm cannot hold the board on.
pub fn of_scene(rig: &Rig, scene: &Scene, name: Option<&str>) -> anyhow::Result<Subject> {
    let surfaces = scene.surfaces();
    let wanted = |kind: &SurfaceKind, of: &str| match name {
        Some(name) => name == of,
        None => matches!(kind, SurfaceKind::RevolvingDoor { .. }),
    };
    let mut tried = 0;
    for (index, surface) in surfaces.iter().enumerate() {
        if !wanted(&surface.kind, &surface.name) {
            continue;
        }
        tried += 1;
        let Some((config, path)) = object_of(scene, SurfaceId(index))? else {
            bail!("surface {:?} does not move", surface.name);
        };
        if let Some(subject) = held(rig, scene, SurfaceId(index), &config, path)? {
            return Ok(subject);
        }
    }
    match (tried, name) {
        (0, Some(name)) => bail!("no surface is called {name:?}"),
        (0, None) => bail!("the scene has no door"),
        _ => bail!(
            "the arm cannot hold the board on {}",
            name.unwrap_or("any door")
        ),
    }
}

/// Spacing of the places tried, and least distance of the board's middle from the edge of a surface, m.
const STEP_M: f64 = 0.1;
/// Wanted displacement of a touched object, rad or m.
const CARRIED: f64 = 0.9;
/// Joints further apart than this belong to different postures, rad.
const NEXT_RAD: f64 = 0.3;
/// Steps of that displacement.
const PIECES: u32 = 18;
/// Least distance of a place from a hinge, m: nobody pushes a door close to it.
const LEAST_LEVER_M: f64 = 0.4;

/// The place from which the arm can move the object furthest; ties: with the least joint motion.
fn held(
    rig: &Rig,
    scene: &Scene,
    id: SurfaceId,
    config: &ObjectConfig,
    path: ObjectPath,
) -> anyhow::Result<Option<Subject>> {
    let surface = scene.surface(id);
    let triangles: Vec<_> = scene.triangles_m(id)?.collect();
    let normal_of = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]);
    let largest = triangles
        .iter()
        .max_by(|a, b| normal_of(a).length().total_cmp(&normal_of(b).length()))
        .context("a surface without triangles")?;
    let middle_m = (largest[0] + largest[1] + largest[2]) / 3.0;
    let normal = normal_of(largest).normalize();
    // The person and the arm are on opposite sides of it.
    let normal = match normal.dot(middle_m) < 0.0 {
        true => -normal,
        false => normal,
    };
    let [right, up] = hwall_haptics::surface_axes(normal)?;
    let corners = || triangles.iter().flatten().map(|&p| p - middle_m);
    let span = |axis: DVec3| {
        let along = corners().map(|p| p.dot(axis));
        along.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)))
    };
    let places = |axis: DVec3| {
        let (low, high) = span(axis);
        let count = ((high - low) / STEP_M).floor().max(1.0) as usize;
        (1..count).map(move |k| low + STEP_M * k as f64)
    };
    let mut best: Option<(u32, f64, JointPositions, Pose)> = None;
    for u in places(right) {
        for v in places(up) {
            let point_m = middle_m + right * u + up * v;
            let lever = path.velocity_at(point_m, 1.0).linear_m_per_s;
            if matches!(path, ObjectPath::Turning { .. }) && lever.length() < LEAST_LEVER_M {
                continue;
            }
            for roll_rad in QUARTER_TURNS_RAD {
                let face = board_pose(point_m, normal, roll_rad)?;
                let way = match lever.dot(normal) < 0.0 {
                    true => CARRIED,
                    false => -CARRIED,
                };
                let Some((start, pieces, turned)) = carried(rig, &face, &path, config, way) else {
                    continue;
                };
                let better = best.is_none_or(|(most, least, ..)| {
                    pieces > most || (pieces == most && turned < least)
                });
                if better {
                    best = Some((pieces, turned, start, face));
                }
            }
        }
    }
    let Some((.., start, face)) = best else {
        return Ok(None);
    };
    let object = MovingObject::new(config.clone())?;
    Ok(Some(Subject {
        name: surface.name.clone(),
        object: RenderedObject { object, path },
        start,
        face,
    }))
}

/// Joint positions at the start, number of steps of the displacement that they reach, and largest joint motion.
fn carried(
    rig: &Rig,
    face: &Pose,
    path: &ObjectPath,
    config: &ObjectConfig,
    way: f64,
) -> Option<(JointPositions, u32, f64)> {
    let arm = &rig.kinematics;
    let mut scratch = arm.scratch();
    let mut near = |pose: &Pose, from: &JointPositions, policy| {
        let config = NearestConfig {
            policy,
            ..NearestConfig::default()
        };
        arm.nearest(pose, from, &config, &mut scratch).ok()
    };
    let start = near(face, &rig.start, BranchPolicy::Any)?;
    let (mut q, mut turned) = (start.q, 0.0_f64);
    let mut pieces = 0;
    for k in 1..=PIECES {
        let by = (way * f64::from(k) / f64::from(PIECES)).clamp(config.range[0], config.range[1]);
        let Some(next) = near(&path.moved(face, by), &q, BranchPolicy::Keep) else {
            break;
        };
        if next.q.max_abs_difference(&q) > NEXT_RAD {
            break;
        }
        (q, pieces) = (next.q, k);
        turned = turned.max(q.max_abs_difference(&start.q));
    }
    Some((start.q, pieces, turned))
}
