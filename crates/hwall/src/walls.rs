//! Maps of where the arm can present its board on the walls of a scene.

use crate::error::SessionError;
#[cfg(feature = "texture")]
use crate::texture::TextureLevels;
use crate::upright_pieces::check_pieces;
use hwall_arrival::{
    ArrivalError, Atlas, AtlasConfig, BoardExtent, Surfaces, TouchRange, WaitingConfig,
    WaitingPosture, WeightedTarget, targets_of_facets, targets_of_maps, waiting_posture,
    waiting_posture_from,
};
use hwall_haptics::{Board, MotionConfig, MotionLimits};
use hwall_kinematics::{ArmKinematics, JointPositions, SrsArm};
use hwall_numeric::check::{all_finite, positive, that};
use hwall_numeric::parallel;
use hwall_reachability::{Interval, WallFacet, WallMaps, WallMapsConfig};
use hwall_scene::{Facet, Scene};
use std::sync::Arc;

/// The vertical surfaces of a scene that can be touched.
#[must_use]
pub fn facets_of(scene: &Scene) -> Vec<WallFacet> {
    let facet = |facet: Facet| WallFacet {
        point_m: facet.point_m,
        normal: facet.normal,
        heights: Interval::new(facet.lowest_m, facet.highest_m),
        outline_m: facet.outline_m,
    };
    scene.vertical_facets().into_iter().map(facet).collect()
}

/// Maps of the vertical surfaces of a scene in the arm's base frame: planes and heights only, and only of surfaces within the arm's length.
/// The tool of the arm is the face of the board; any quarter turn of the board counts.
///
/// # Errors
/// As for [`WallMaps::build`].
pub fn maps_of(scene: &Scene, arm: &SrsArm) -> Result<WallMaps, SessionError> {
    Ok(WallMaps::build(
        arm,
        &facets_of(scene),
        WallMapsConfig::default(),
    )?)
}

/// Places that people are likely to touch; the waiting posture is chosen for them.
#[derive(Debug, Clone, PartialEq)]
pub enum LikelyTouches {
    /// Any place on the walls within a range.
    InRange(TouchRange),
    /// Places like these, for instance previously touched ones. Unreachable ones do not count.
    Such(Vec<WeightedTarget>),
}

impl Default for LikelyTouches {
    fn default() -> Self {
        Self::InRange(TouchRange::default())
    }
}

/// Settings of [`Walls::of`].
#[derive(Debug, Clone)]
pub struct WallsConfig {
    /// Limits of the motion; the same as in the session.
    pub motion: MotionConfig,
    /// Which places people touch.
    pub touches: LikelyTouches,
    /// How the waiting posture is found, for people who leave the arm the default time.
    pub waiting: WaitingConfig,
    /// Other available times, s. For each, a posture and an atlas are built, which a session uses once it knows the person. Default
    /// [`WallsConfig::OTHER_BUDGETS_S`]; empty: one posture for everybody.
    pub other_budgets_s: Vec<f64>,
    /// How the atlas is built.
    pub atlas: AtlasConfig,
    /// Does the board present the roughness of surfaces, which requires a specific roll? As in the session; default yes.
    pub texture: bool,
}

impl Default for WallsConfig {
    fn default() -> Self {
        Self {
            motion: MotionConfig::default(),
            touches: LikelyTouches::default(),
            waiting: WaitingConfig::default(),
            other_budgets_s: Self::OTHER_BUDGETS_S.to_vec(),
            atlas: AtlasConfig::default(),
            texture: true,
        }
    }
}

impl WallsConfig {
    /// The default of [`Self::other_budgets_s`], s: for people in a hurry and for those in between. For slow people the default posture
    /// works well.
    pub const OTHER_BUDGETS_S: [f64; 2] = [0.5, 0.68];
}

/// How soon the arm reaches the walls from the waiting posture for people who leave it a certain time.
#[derive(Debug, Clone)]
pub struct BudgetAtlas {
    /// Available time, s.
    pub budget_s: f64,
    /// From [`Atlas::waiting`].
    pub atlas: Arc<Atlas>,
}

/// Prior knowledge of the walls of a scene, for one arm.
#[derive(Debug, Clone)]
pub struct Walls {
    /// Where the arm can present the board.
    pub maps: WallMaps,
    /// In which configuration, and how soon; `None`: the solver decides alone.
    pub atlas: Option<Arc<Atlas>>,
    /// Waiting posture while nothing is about to be touched, rad; `None`: the arm stays where it is.
    pub waiting: Option<JointPositions>,
    /// Available time that this posture is chosen for, s.
    pub budget_s: f64,
    /// Postures for other available times: once a session knows a person, it uses the nearest.
    pub others: Vec<BudgetAtlas>,
}

impl Default for Walls {
    fn default() -> Self {
        Self {
            maps: WallMaps::default(),
            atlas: None,
            waiting: None,
            budget_s: WaitingConfig::NOMINAL_S,
            others: Vec::new(),
        }
    }
}

impl Walls {
    /// Maps, waiting posture and atlas of the vertical surfaces of a scene in the arm's base frame. The tool of the arm is the face of the
    /// board. Without a wall within reach there is neither posture nor atlas; for an arm without a closed form there are no maps. Takes
    /// about a second for a room, ten for an arm without a closed form.
    ///
    /// # Errors
    /// As for [`maps_of`]; a setting outside its range; [`SessionError::TooManyUprightPieces`], as for a session.
    pub fn of(
        scene: &Scene,
        arm: &dyn ArmKinematics,
        board: &Board,
        config: &WallsConfig,
    ) -> Result<Self, SessionError> {
        for &budget_s in &config.other_budgets_s {
            positive("budget_s", budget_s)?;
        }
        check_pieces(scene)?;
        // The arm presents the side of a facet that faces away from its base.
        let mut facets = facets_of(scene);
        facets.retain(|facet| facet.normal.dot(facet.point_m) >= 0.0);
        let margin_m = config.waiting.clearance.margin_m;
        let (maps, surfaces) = match arm.closed_form() {
            Some(arm) => {
                let maps = maps_of(scene, arm)?;
                let surfaces = Surfaces::from_maps(&maps, margin_m)?;
                (maps, surfaces)
            }
            None => {
                let surfaces = Surfaces::from_facets(&facets, margin_m)?;
                (WallMaps::default(), surfaces.within_reach_of(arm))
            }
        };
        let extent = BoardExtent {
            half_width_m: board.half_width_m,
            half_height_m: board.half_height_m,
        };
        let limits = MotionLimits::of_arm(arm, &config.motion)?;
        let places = |range: &TouchRange| match arm.closed_form() {
            Some(_) => targets_of_maps(&maps, range),
            None => targets_of_facets(&facets, range),
        };
        let targets = targets_of(scene, board, places, config)?;
        let nominal = waiting_posture(arm, &targets, &surfaces, extent, &limits, &config.waiting);
        let nominal = match nominal {
            Ok(posture) => posture,
            Err(
                ArrivalError::NoWalls
                | ArrivalError::OutOfReach { .. }
                | ArrivalError::Empty { .. },
            ) => return Ok(maps.into()),
            Err(error) => return Err(error.into()),
        };
        // The arm changes to this posture between two touches of a person in a hurry, so it must be close to the default posture.
        let posture_for = |budget_s: f64| {
            let waiting = WaitingConfig {
                budget_s,
                ..config.waiting.clone()
            };
            waiting_posture_from(
                &nominal.q, arm, &targets, &surfaces, extent, &limits, &waiting,
            )
        };
        let suits = |other: &WaitingPosture| {
            limits.travel_time_s(&nominal.q, &other.q) <= MOST_TURN_S
                && other.standoff_m >= nominal.standoff_m.min(config.waiting.standoff_m) - SPARE_M
        };
        let other_budgets_s = &config.other_budgets_s;
        let atlases = parallel::map(1 + other_budgets_s.len(), |i| {
            let q = match i.checked_sub(1) {
                None => nominal.q,
                Some(other) => {
                    let other = posture_for(other_budgets_s[other])?;
                    if !suits(&other) {
                        return Ok(None);
                    }
                    other.q
                }
            };
            let atlas = &config.atlas;
            match arm.closed_form() {
                Some(arm) => Atlas::build(arm, &maps, extent, &limits, &q, atlas).map(Some),
                // A search may miss reachable places: the session then has no atlas.
                None => match Atlas::search(arm, &facets, extent, &limits, &q, atlas) {
                    Err(ArrivalError::NoWalls | ArrivalError::OutOfReach { .. }) => Ok(None),
                    searched => searched.map(Some),
                },
            }
        });
        let atlases = atlases
            .into_iter()
            .collect::<Result<Vec<_>, ArrivalError>>()?;
        let mut atlases = atlases.into_iter().map(|atlas| atlas.map(Arc::new));
        let atlas = atlases.next().flatten();
        let others = other_budgets_s.iter().zip(atlases);
        let others = others.filter_map(|(&budget_s, atlas)| {
            Some(BudgetAtlas {
                budget_s,
                atlas: atlas?,
            })
        });
        Ok(Self {
            others: others.collect(),
            maps,
            atlas,
            waiting: Some(nominal.q),
            budget_s: config.waiting.budget_s,
        })
    }

    pub(crate) fn validate(&self, arm: &dyn ArmKinematics) -> Result<(), SessionError> {
        positive("budget_s", self.budget_s)?;
        for other in &self.others {
            positive("budget_s", other.budget_s)?;
        }
        let others = self.others.iter().map(|other| other.atlas.waiting());
        for q in self.waiting.iter().chain(others) {
            all_finite("waiting", &q.0)?;
            for (q, limit) in q.0.iter().zip(arm.limits()) {
                let inside = limit.contains(*q);
                that(inside, "waiting", *q, "within the joint limits")?;
            }
        }
        Ok(())
    }
}

/// Longest time to change between waiting postures, between two touches, s.
const MOST_TURN_S: f64 = 0.6;
/// Another posture may be this much closer to the surfaces than the default one, m.
const SPARE_M: f64 = 0.005;

/// Places that people touch, with the rolls that their textures need.
fn targets_of(
    scene: &Scene,
    board: &Board,
    places: impl Fn(&TouchRange) -> Result<Vec<WeightedTarget>, ArrivalError>,
    config: &WallsConfig,
) -> Result<Vec<WeightedTarget>, SessionError> {
    let targets = match &config.touches {
        LikelyTouches::InRange(range) => match places(range) {
            Err(ArrivalError::NoWalls | ArrivalError::OutOfReach { .. }) => Vec::new(),
            found => found?,
        },
        LikelyTouches::Such(touches) => touches.clone(),
    };
    #[cfg(feature = "texture")]
    if let Some(levels) = TextureLevels::for_scene(scene, board)?.filter(|_| config.texture) {
        let roll_rad = |target: &WeightedTarget| {
            let place = scene
                .closest_touchable(target.target.point_m, BESIDE_M)
                .ok()??;
            levels.roll_of_rad(scene.surface(place.surface).roughness?)
        };
        let rolled = |target: WeightedTarget| WeightedTarget {
            roll_rad: target.roll_rad.or_else(|| roll_rad(&target)),
            ..target
        };
        return Ok(targets.into_iter().map(rolled).collect());
    }
    #[cfg(not(feature = "texture"))]
    let _ = (scene, board);
    Ok(targets)
}

/// A place within this distance of a surface is on it, m.
#[cfg(feature = "texture")]
const BESIDE_M: f64 = 0.05;

impl From<WallMaps> for Walls {
    fn from(maps: WallMaps) -> Self {
        Self {
            maps,
            ..Self::default()
        }
    }
}
