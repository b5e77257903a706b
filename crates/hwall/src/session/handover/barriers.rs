//! The surfaces that the board stays behind, at the current pose of the world and opening of its doors.

use crate::error::SessionError;
use crate::objects::paths_of;
use crate::upright_pieces::{barrier_of, within_limit};
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_haptics::{BarrierTree, ObjectPath, Planner};
use hwall_scene::{Facet, Scene, SurfaceId};
use std::sync::{Arc, Mutex, PoisonError};

/// A change of an opening above this moves barriers, rad or m.
const OPENED: f64 = 1e-3;

/// A world that tilts by more than this is scanned again for upright surfaces; cosine of 1 degree, as for [`Scene::vertical_facets`].
const TILTED: f64 = 0.99985;

/// A vertical surface piece where it was when the scene was scanned, base frame.
struct Piece {
    facet: Facet,
    /// How its surface moves, and its opening during the scan.
    moves: Option<(ObjectPath, f64)>,
}

/// Tracks the surfaces of a scene and sends them to the planner. Upright pieces move with doors and world; only a world that jumped or
/// tilted is scanned again.
pub(in crate::session) struct WorldBarriers {
    paths: Vec<(SurfaceId, ObjectPath)>,
    pieces: Vec<Piece>,
    /// Pose of the world during the scan.
    base_from_seen: Pose,
    corners_m: Vec<DVec3>,
    /// What was sent last: openings by surface, pose of the world, number of jumps.
    openings: Vec<f64>,
    base_from_world: Pose,
    leaps: u64,
    is_known: bool,
    barriers: BarrierTree,
    /// How many times barriers were sent.
    told: u64,
    newest: Newest,
}

/// Opening of a surface, rad or m; 0 if it does not move.
fn opening(scene: &Scene, surface: SurfaceId) -> f64 {
    scene.opening(surface).unwrap_or(0.0)
}

/// Surfaces that were sent and not yet taken.
struct Told {
    /// `None`: the barriers are unknown.
    barriers: Option<BarrierTree>,
    base_from_world: Pose,
    leaps: u64,
    number: u64,
}

type Newest = Arc<Mutex<Option<Told>>>;

/// The planner's end.
pub(in crate::session) struct BarrierReceiver {
    newest: Newest,
    base_from_world: Pose,
    leaps: u64,
}

impl WorldBarriers {
    /// Both ends of the hand-over, with the barriers of a scene in the base frame.
    pub(in crate::session) fn new(scene: &Scene) -> Result<(Self, BarrierReceiver), SessionError> {
        let newest = Newest::default();
        let receiver = BarrierReceiver {
            newest: Arc::clone(&newest),
            base_from_world: Pose::IDENTITY,
            leaps: 0,
        };
        let openings = (0..scene.surfaces().len()).map(|id| opening(scene, SurfaceId(id)));
        let mut made = Self {
            paths: paths_of(scene)?,
            pieces: Vec::new(),
            base_from_seen: Pose::IDENTITY,
            corners_m: Vec::new(),
            openings: openings.collect(),
            base_from_world: Pose::IDENTITY,
            leaps: 0,
            is_known: true,
            barriers: BarrierTree::default(),
            told: 0,
            newest,
        };
        made.look(scene)?;
        made.make(scene)?;
        Ok((made, receiver))
    }

    /// Finds the upright pieces at the current pose of the world.
    fn look(&mut self, scene: &Scene) -> Result<(), SessionError> {
        self.pieces.clear();
        let facets = match self.base_from_world == Pose::IDENTITY {
            true => scene.vertical_facets(),
            false => scene.placed(&self.base_from_world).vertical_facets(),
        };
        within_limit(facets.len())?;
        let paths = &self.paths;
        self.pieces.extend(facets.into_iter().map(|facet| {
            let path = paths.iter().find(|(surface, _)| *surface == facet.surface);
            let moves = path.map(|(_, path)| (*path, opening(scene, facet.surface)));
            Piece { facet, moves }
        }));
        let corners = self.pieces.iter().map(|p| p.facet.outline_m.len()).max();
        self.corners_m.clear();
        self.corners_m.reserve(corners.unwrap_or(0));
        self.base_from_seen = self.base_from_world;
        Ok(())
    }

    /// Has the world tilted since the scan?
    fn is_tilted(&self) -> bool {
        let moved = self.base_from_world * self.base_from_seen.inverse();
        let upright = moved.rotation().z_axis.z;
        upright.is_nan() || upright < TILTED
    }

    /// How many times barriers were sent to the planner.
    pub(in crate::session) const fn told(&self) -> u64 {
        self.told
    }

    /// The current barriers.
    pub(in crate::session) const fn all(&self) -> &BarrierTree {
        &self.barriers
    }

    /// Updates the barriers and sends them to the planner if something has moved.
    ///
    /// # Errors
    /// The surfaces cannot be computed; reported once. Until they can be again, the planner knows none.
    pub(in crate::session) fn keep(
        &mut self,
        scene: &Scene,
        base_from_world: &Pose,
        leaps: u64,
    ) -> Result<(), SessionError> {
        let world_moved = self.base_from_world != *base_from_world || self.leaps != leaps;
        let opened = (self.openings.iter().enumerate())
            .any(|(id, at)| (opening(scene, SurfaceId(id)) - at).abs() > OPENED);
        if !world_moved && !opened {
            return Ok(());
        }
        for (id, at) in self.openings.iter_mut().enumerate() {
            *at = opening(scene, SurfaceId(id));
        }
        let has_leapt = self.leaps != leaps;
        (self.base_from_world, self.leaps) = (*base_from_world, leaps);
        let looked = match has_leapt || !self.is_known || self.is_tilted() {
            true => self.look(scene),
            false => Ok(()),
        };
        let made = looked.and_then(|()| self.make(scene));
        let was_known = std::mem::replace(&mut self.is_known, made.is_ok());
        self.send();
        match made {
            // Reported once.
            Err(_) if !was_known => Ok(()),
            made => made,
        }
    }

    fn make(&mut self, scene: &Scene) -> Result<(), SessionError> {
        let mut barriers = Vec::with_capacity(self.pieces.len());
        let world_from_seen = self.base_from_seen.inverse();
        for piece in &self.pieces {
            let Facet {
                surface,
                point_m,
                normal,
                outline_m,
                ..
            } = &piece.facet;
            let moved = piece.moves.map_or(Pose::IDENTITY, |(path, from)| {
                let to = scene.opening(*surface).unwrap_or(from);
                path.moved(&Pose::IDENTITY, to - from)
            });
            let base_from_piece = self.base_from_world * moved * world_from_seen;
            let corners_m = outline_m.iter();
            self.corners_m.clear();
            self.corners_m
                .extend(corners_m.map(|m| base_from_piece.transform_point(*m)));
            let barrier = barrier_of(
                base_from_piece.transform_point(*point_m),
                base_from_piece.transform_vector(*normal),
                &self.corners_m,
            )?;
            barriers.extend(barrier);
        }
        self.barriers = barriers.into();
        Ok(())
    }

    fn send(&mut self) {
        self.told += 1;
        let told = Told {
            barriers: self.is_known.then(|| self.barriers.clone()),
            base_from_world: self.base_from_world,
            leaps: self.leaps,
            number: self.told,
        };
        let newest = self.newest.lock();
        *newest.unwrap_or_else(PoisonError::into_inner) = Some(told);
    }
}

impl BarrierReceiver {
    /// Gives the newest barriers to the planner, if there are newer ones.
    pub(in crate::session) fn renew(&mut self, planner: &mut Planner) {
        let newest = self.newest.lock();
        let Some(told) = newest.unwrap_or_else(PoisonError::into_inner).take() else {
            return;
        };
        planner.number_surfaces(told.number);
        let Some(barriers) = told.barriers else {
            return planner.lose_barriers();
        };
        if told.leaps == self.leaps {
            let moved = told.base_from_world * self.base_from_world.inverse();
            planner.move_barriers(barriers, &moved);
        } else {
            planner.set_barriers(barriers);
        }
        (self.base_from_world, self.leaps) = (told.base_from_world, told.leaps);
    }
}
