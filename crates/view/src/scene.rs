//! The static part of the view.

use crate::arm::ViewArm;
use crate::error::ViewError;
use hwall::contact::Predictor;
use hwall::geometry::Pose;
use hwall::haptics::{Board, ObjectPath};
use hwall::kinematics::ArmKinematics;
use hwall::scene::{Scene, SurfaceId};
use hwall::{Session, objects_of};

/// Most moving surfaces whose openings a frame carries; further ones are shown as modelled in their file.
pub const MOST_MOVING: usize = 32;

/// A surface of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewSurface {
    /// Its name in the scene.
    pub name: String,
    /// Its kind, as named in a sidecar: `static`, `revolving_door`, `sliding_panel`, `drawer`, `button`, `untouchable`.
    pub kind: &'static str,
    /// Corners at opening zero, counter-clockwise from outside, base frame, m.
    pub triangles_m: Vec<[[f32; 3]; 3]>,
    /// Path of a moving surface. The openings of a frame belong to the moving surfaces, in the order of the scene.
    pub path: Option<ObjectPath>,
    /// Diffuse colour of its material, red green blue in 0..1.
    pub color_rgb: Option<[f64; 3]>,
}

/// The static part of the view: the room, the arm, the board. In the arm's base frame: z up, m.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewScene {
    /// Title above the picture.
    pub title: String,
    /// The room.
    pub surfaces: Vec<ViewSurface>,
    /// The arm; its tool is the face of the board.
    pub arm: ViewArm,
    /// The board: its face is the tool of the arm.
    pub board: Board,
    /// Pose of the space of a headset, once its axes are z up. Identity unless set.
    pub base_from_headset: Pose,
}

impl ViewScene {
    /// From a scene in the arm's base frame, an arm whose tool is the face of the board, and the board.
    ///
    /// # Errors
    /// A board without extent; invalid moving surfaces.
    pub fn new(
        title: impl Into<String>,
        scene: &Scene,
        arm: &dyn ArmKinematics,
        board: &Board,
    ) -> Result<Self, ViewError> {
        board.validate()?;
        // Surfaces as modelled: frames carry the openings of doors.
        let mut shut = scene.clone();
        let objects = objects_of(scene)?;
        for object in &objects {
            shut.set_opening(object.surface, 0.0)?;
        }
        let mut moving = 0;
        let mut surfaces = Vec::with_capacity(scene.surfaces().len());
        for (index, surface) in scene.surfaces().iter().enumerate() {
            let id = SurfaceId(index);
            let path = objects.iter().find(|object| object.surface == id);
            let triangles = shut.triangles_m(id)?;
            moving += usize::from(path.is_some());
            surfaces.push(ViewSurface {
                name: surface.name.clone(),
                kind: surface.kind.name(),
                triangles_m: triangles
                    .map(|corners| corners.map(|m| m.as_vec3().to_array()))
                    .collect(),
                path: path
                    .map(|object| object.path)
                    .filter(|_| moving <= MOST_MOVING),
                color_rgb: surface.color_rgb,
            });
        }
        Ok(Self {
            title: title.into(),
            surfaces,
            arm: ViewArm::of(arm),
            board: *board,
            base_from_headset: Pose::IDENTITY,
        })
    }

    /// From a session: its scene, its arm and its board.
    ///
    /// # Errors
    /// As for [`ViewScene::new`].
    pub fn of<P: Predictor>(
        title: impl Into<String>,
        session: &Session<P>,
    ) -> Result<Self, ViewError> {
        let control = session.control();
        Self::new(
            title,
            session.perception().scene(),
            &**control.arm(),
            control.board(),
        )
    }
}
