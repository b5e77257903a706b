//! The surfaces that the board stays behind, where the world and its doors are now.

use super::sequence_lock::{Reader, Writer, sequence_lock};
use crate::error::SessionError;
use crate::objects::paths_of;
use crate::walls::barrier_of;
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;
use hwall_haptics::{Barrier, ObjectPath, Renderer};
use hwall_scene::{Facet, Scene, SurfaceId};

/// Doors that opened by more than this since, rad or m, are barriers elsewhere.
const OPENED: f64 = 1e-3;

/// A world that tilted by more than this since shows other surfaces upright, as a cosine; 1 degree, as for
/// [`Scene::vertical_facets`].
const TILTED: f64 = 0.99985;
/// No more pieces than this are told; more are an error.
const MOST: usize = 2048;

/// A vertical piece of a surface where it was when the scene was looked at, base frame.
struct Piece {
    facet: Facet,
    /// How its surface moves, and the opening at which it was looked at.
    moves: Option<(ObjectPath, f64)>,
}

/// Follows the surfaces of a scene, and tells the control half where they are. Pieces that are upright are carried along with
/// doors and world, and nothing is allocated; only a world that leapt or tilted is looked at again.
pub(in crate::session) struct WorldBarriers {
    paths: Vec<(SurfaceId, ObjectPath)>,
    pieces: Vec<Piece>,
    /// Where the world stood when it was looked at.
    base_from_seen: Pose,
    corners_m: Vec<DVec3>,
    /// What was told last: openings by surface, the place of the world, how often it had leapt.
    openings: Vec<f64>,
    base_from_world: Pose,
    leaps: u64,
    is_known: bool,
    barriers: Vec<Barrier>,
    most: usize,
    sender: Writer,
}

/// Of what does not move it is 0, rad or m.
fn opening(scene: &Scene, surface: SurfaceId) -> f64 {
    scene.opening(surface).unwrap_or(0.0)
}

/// Where the control half finds them.
pub(in crate::session) struct BarrierReceiver {
    reader: Reader,
    words: Box<[u64]>,
    barriers: Vec<Barrier>,
    base_from_world: Pose,
    leaps: u64,
}

fn within_limit(count: usize, most: usize) -> Result<(), SessionError> {
    match count > most {
        true => Err(SessionError::TooManyUprightPieces { count, most }),
        false => Ok(()),
    }
}

/// Names a scene of more upright pieces than a session follows, before minutes are spent on it.
pub(crate) fn check_pieces(scene: &Scene) -> Result<(), SessionError> {
    within_limit(scene.vertical_facets().len(), MOST)
}

/// Words before those of the barriers: how many, leaps, the place of the world.
const HEAD: usize = 2 + 12;
/// Words of a barrier: middle, normal, half extents.
const EACH: usize = 8;
/// So many barriers mean that none are known.
const UNKNOWN: u64 = u64::MAX;

impl WorldBarriers {
    /// Those of a scene in the base frame, and the other end.
    pub(in crate::session) fn new(scene: &Scene) -> Result<(Self, BarrierReceiver), SessionError> {
        let triangles = (0..scene.surfaces().len())
            .filter_map(|id| Some(scene.triangles_m(SurfaceId(id)).ok()?.len()));
        let most = triangles.sum::<usize>().min(MOST);
        let (sender, reader) = sequence_lock(HEAD + EACH * most);
        let receiver = BarrierReceiver {
            reader,
            words: vec![0; HEAD + EACH * most].into(),
            barriers: Vec::with_capacity(most),
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
            barriers: Vec::with_capacity(most),
            most,
            sender,
        };
        made.look(scene)?;
        made.make(scene)?;
        Ok((made, receiver))
    }

    /// Finds the upright pieces where the world stands now.
    fn look(&mut self, scene: &Scene) -> Result<(), SessionError> {
        self.pieces.clear();
        let facets = match self.base_from_world == Pose::IDENTITY {
            true => scene.vertical_facets(),
            false => scene.placed(&self.base_from_world).vertical_facets(),
        };
        within_limit(facets.len(), self.most)?;
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

    /// Has the world tilted since it was looked at?
    fn is_tilted(&self) -> bool {
        let moved = self.base_from_world * self.base_from_seen.inverse();
        let upright = moved.rotation().z_axis.z;
        upright.is_nan() || upright < TILTED
    }

    /// How many there may be.
    pub(in crate::session) fn most(&self) -> usize {
        self.most
    }

    /// Those of now.
    pub(in crate::session) fn all(&self) -> &[Barrier] {
        &self.barriers
    }

    /// Looks whether something has moved since, and tells the other half if so.
    ///
    /// # Errors
    /// The surfaces cannot be made out, since the last call; the other half knows none from then on.
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
            // Said once.
            Err(_) if !was_known => Ok(()),
            made => made,
        }
    }

    fn make(&mut self, scene: &Scene) -> Result<(), SessionError> {
        self.barriers.clear();
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
            self.barriers.extend(barrier);
        }
        Ok(())
    }

    fn send(&mut self) {
        let count = match self.is_known {
            true => self.barriers.len() as u64,
            false => UNKNOWN,
        };
        let rotation = self.base_from_world.rotation().to_cols_array();
        let place = self.base_from_world.position_m().to_array();
        let pose = rotation.into_iter().chain(place);
        let barriers = self.barriers.iter().flat_map(|barrier| {
            let [x, y, z] = barrier.middle_m().to_array();
            let [nx, ny, nz] = barrier.normal().to_array();
            let [width, height] = barrier.half_extent_m();
            [x, y, z, nx, ny, nz, width, height]
        });
        let numbers = pose.chain(barriers).map(f64::to_bits);
        self.sender
            .write([count, self.leaps].into_iter().chain(numbers));
    }
}

impl BarrierReceiver {
    /// Gives the newest barriers to the renderer, if there are newer ones. Nothing is allocated.
    pub(in crate::session) fn renew(&mut self, renderer: &mut Renderer) {
        let words = |count: u64| match usize::try_from(count) {
            Ok(count) if count <= MOST => HEAD + EACH * count,
            _ => HEAD,
        };
        if !self.reader.read(&mut self.words, words) {
            return;
        }
        if self.decode(renderer).is_none() {
            renderer.lose_barriers();
        }
    }

    /// `None`: none are known, or the words make no sense.
    fn decode(&mut self, renderer: &mut Renderer) -> Option<()> {
        let (head, rest) = self.words.split_at_checked(HEAD)?;
        let count = usize::try_from(head[0]).ok()?;
        let number = |words: &[u64], at: usize| f64::from_bits(words[at]);
        let vector =
            |w: &[u64], at: usize| DVec3::new(number(w, at), number(w, at + 1), number(w, at + 2));
        if head[0] == UNKNOWN {
            return None;
        }
        let rotation = DMat3::from_cols(vector(head, 2), vector(head, 5), vector(head, 8));
        let base_from_world = Pose::new(rotation, vector(head, 11)).ok()?;
        self.barriers.clear();
        for words in rest.chunks_exact(EACH).take(count) {
            let half_extent_m = [number(words, 6), number(words, 7)];
            let barrier = Barrier::new(vector(words, 0), vector(words, 3), half_extent_m);
            self.barriers.push(barrier.ok()?);
        }
        if head[1] == self.leaps {
            let moved = base_from_world * self.base_from_world.inverse();
            renderer.move_barriers(&self.barriers, &moved);
        } else {
            renderer.set_barriers(&self.barriers);
        }
        (self.base_from_world, self.leaps) = (base_from_world, head[1]);
        Some(())
    }
}
