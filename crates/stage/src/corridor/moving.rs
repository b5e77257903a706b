//! The base in the hall, and the world that is turned around the person.

use super::hall::{BEHIND_M, Room};
use super::visits::{BEFORE_M, Visit};
use super::walker::{Body, shorter};
use glam::{DVec2, DVec3, dvec2};
use hwall::arrival::base::{
    BaseChoiceConfig, BaseChooser, BaseDrive, BaseHypothesis, BaseLimits, BasePart, BasePose,
    BaseSafety, KeepOutArea, Surroundings,
};
use hwall_hand::Pose;
use hwall_haptics::Board;
use hwall_redirection::{AvatarTurn, PersonMotion, TurnConfig};
use std::f64::consts::FRAC_PI_2;

/// The base from above, m: a platform of half a metre.
const CHASSIS_M: f64 = 0.35;
/// Radius of the links, m.
const LINK_M: f64 = 0.1;
/// The axis of the base stays this far outside of a room, m: less than it stands behind the wall of a shelf.
const OUTSIDE_M: f64 = 0.45;
/// A base that leaves a room goes this much farther, m.
const CLEAR_M: f64 = 0.1;
/// Speeds below are rest, m/s.
const RESTS_M_PER_S: f64 = 1e-3;

/// What the base sees, in the frame of the corridor or of the base.
pub(super) struct Seen<'a> {
    pub(super) person_m: DVec2,
    /// Its measured velocity, m/s.
    pub(super) person_m_per_s: DVec2,
    pub(super) hands_m: &'a [DVec3],
    pub(super) skeleton_m: &'a [DVec3],
    pub(super) board: &'a Board,
    pub(super) base_from_board: Pose,
    pub(super) touched: bool,
}

/// What the base did.
#[derive(Debug, Clone, Copy)]
pub(super) struct BaseRecord {
    /// Length of its way, m, and time in motion, s.
    pub(super) way_m: f64,
    pub(super) moves_s: f64,
    /// While it moves: least distance between the surfaces of robot and person, m, and what the rule asked for then.
    pub(super) closest_m: f64,
    pub(super) asked_m: f64,
    /// The same distance also while it stands.
    pub(super) closest_standing_m: f64,
    /// Least margin beyond what the person can come until the base stands, m.
    pub(super) margin_m: f64,
    /// Steps in motion with a negative margin, and while the board was touched.
    pub(super) too_near: u64,
    pub(super) moved_touched: u64,
}

/// The base, and the pose of the corridor in the hall.
pub(super) struct MovingBase {
    drive: BaseDrive,
    safety: BaseSafety,
    /// The pose that it goes to, in the frame of the corridor.
    goal: Option<BasePose>,
    hall_from_corridor: Pose,
    turn: AvatarTurn,
    /// Where the world should turn, rad, and the person's last heading in the hall.
    wanted_rad: f64,
    last_yaw_rad: Option<f64>,
    pub(super) record: BaseRecord,
}

impl MovingBase {
    /// Behind the place that is visited first.
    pub(super) fn new(first: &Visit) -> anyhow::Result<Self> {
        let start = BasePose {
            at_m: first.stands_m + first.facing * (BEFORE_M + BEHIND_M),
            yaw_rad: (-first.facing).to_angle(),
        };
        Ok(Self {
            drive: BaseDrive::new(BaseLimits::default(), start)?,
            safety: BaseSafety::default(),
            goal: None,
            hall_from_corridor: Pose::IDENTITY,
            // The hall is as large as the corridor, so the total turn does not matter.
            turn: AvatarTurn::new(TurnConfig {
                most_rad: f64::MAX,
                ..TurnConfig::default()
            })?,
            wanted_rad: 0.0,
            last_yaw_rad: None,
            record: BaseRecord {
                way_m: 0.0,
                moves_s: 0.0,
                closest_m: f64::INFINITY,
                asked_m: f64::NAN,
                closest_standing_m: f64::INFINITY,
                margin_m: f64::INFINITY,
                too_near: 0,
                moved_touched: 0,
            },
        })
    }

    /// The place of the base in the frame of the corridor.
    fn place(&self) -> BasePose {
        let here = self.drive.state().pose();
        here.seen_from(&self.hall_from_corridor)
    }

    /// The world as the session is to see it.
    pub(super) fn base_from_corridor(&self) -> Pose {
        self.place().floor_from_base().inverse()
    }

    /// Is it outside an area, with room to spare?
    pub(super) fn is_out_of(&self, area: &KeepOutArea) -> bool {
        !area.grown(OUTSIDE_M).contains(self.place().at_m)
    }

    pub(super) fn forget_goal(&mut self) {
        self.goal = None;
    }

    /// Chooses where to go for what may be touched. `next`: the room behind a closed door that the person waits at.
    pub(super) fn choose(
        &mut self,
        room: &Room,
        next: Option<&Room>,
        hypotheses: &[BaseHypothesis],
    ) -> anyhow::Result<()> {
        let area = KeepOutArea {
            low_m: room.area.low_m,
            high_m: next.map_or(room.area.high_m, |next| next.area.high_m),
        }
        .grown(OUTSIDE_M);
        let here = self.drive.seen_from(&self.hall_from_corridor);
        let chosen = match next {
            // Out of the room behind the door, by the nearer side.
            Some(_) if area.contains(self.place().at_m) => {
                let at_m = self.place().at_m;
                let y = match at_m.y < 0.5 * (area.low_m.y + area.high_m.y) {
                    true => area.low_m.y - CLEAR_M,
                    false => area.high_m.y + CLEAR_M,
                };
                let to = BasePose {
                    at_m: dvec2(at_m.x, y),
                    yaw_rad: FRAC_PI_2.copysign(-y),
                };
                Some((to, vec![to.at_m]))
            }
            Some(_) => None,
            None => {
                let config = BaseChoiceConfig::default();
                let chooser = BaseChooser::new(config, &room.inversion, area)?;
                chooser.choose(&here, self.goal, hypotheses)
            }
        };
        let Some((goal, way)) = chosen else {
            return Ok(());
        };
        self.goal = Some(goal);
        let hall = &self.hall_from_corridor;
        let hall_m = |at_m: &DVec2| hall.transform_point(at_m.extend(0.0)).truncate();
        let way: Vec<DVec2> = way.iter().map(hall_m).collect();
        let yaw_rad = goal.placed(hall).yaw_rad;
        self.drive.set_route(&way, yaw_rad);
        Ok(())
    }

    /// Turns the world around a walking person, as far as it goes unnoticed, so that the goal comes nearer to the base.
    pub(super) fn turn_avatar(&mut self, body: &Body, dt_s: f64) -> anyhow::Result<()> {
        let x = self.hall_from_corridor.rotation().x_axis;
        let yaw_rad = body.yaw_rad + x.y.atan2(x.x);
        let last_rad = self.last_yaw_rad.replace(yaw_rad).unwrap_or(yaw_rad);
        let turned_rad = shorter(yaw_rad - last_rad);
        if let Some(goal) = self.goal {
            let angle = |at_m: DVec2| (at_m - body.at_m).to_angle();
            // About the person, the world turns against the avatar.
            let towards = shorter(angle(self.place().at_m) - angle(goal.at_m));
            self.wanted_rad = self.turn.turned_rad() - towards;
        }
        let motion = PersonMotion {
            turn_rad_per_s: turned_rad / dt_s,
            speed_m_per_s: body.speed_m_per_s,
            ..PersonMotion::default()
        };
        let by = -self.turn.step(self.wanted_rad, &motion, dt_s)?.injected_rad;
        let about_m = body.at_m.extend(0.0);
        let turn = Pose::from_yaw(by, DVec3::ZERO)?;
        let fixed = Pose::from_yaw(by, about_m - turn.transform_point(about_m))?;
        let turned = self.hall_from_corridor.to_affine() * fixed.to_affine();
        self.hall_from_corridor = Pose::from_affine(&turned)?;
        self.last_yaw_rad = self.last_yaw_rad.map(|yaw| yaw + by);
        Ok(())
    }

    /// Moves the base by a time, s, if it may.
    pub(super) fn step(&mut self, dt_s: f64, seen: &Seen<'_>) {
        let parts = parts(seen);
        let hall = &self.hall_from_corridor;
        let hands_m = seen.hands_m.iter().map(|m| hall.transform_point(*m));
        let hands_m: Vec<DVec3> = hands_m.collect();
        let velocity = hall.transform_vector(seen.person_m_per_s.extend(0.0));
        let around = Surroundings {
            person_m: hall.transform_point(seen.person_m.extend(0.0)).truncate(),
            person_m_per_s: velocity.truncate(),
            hands_m: &hands_m,
            board_m: seen.base_from_board.position_m(),
            touched: seen.touched,
            parts: &parts,
        };
        let before_m = self.drive.state().pose().at_m;
        self.drive.step(dt_s, |drive, state| {
            self.safety.allows(drive, state, &around)
        });
        self.keep(dt_s, before_m, &around);
    }

    fn keep(&mut self, dt_s: f64, before_m: DVec2, around: &Surroundings<'_>) {
        let (state, record) = (*self.drive.state(), &mut self.record);
        let pose = state.pose();
        let gap_m =
            |part: &BasePart| part.distance_m(&pose, around.person_m) - self.safety.person_radius_m;
        let gap_m = around.parts.iter().map(gap_m).fold(f64::INFINITY, f64::min);
        record.closest_standing_m = record.closest_standing_m.min(gap_m);
        record.way_m += pose.at_m.distance(before_m);
        let speed = state.velocity_m_per_s().length();
        if speed < RESTS_M_PER_S && state.turning()[0].abs() < RESTS_M_PER_S {
            return;
        }
        // What the rule guarantees, without the reserve for the latency.
        let bare = BaseSafety {
            latency_s: 0.0,
            clearance_m: 0.0,
            velocity_error_m_per_s: 0.0,
            ..self.safety
        };
        let margin_m = bare.left_m(&self.drive, &state, around);
        record.moves_s += dt_s;
        record.margin_m = record.margin_m.min(margin_m);
        record.too_near += u64::from(margin_m < 0.0);
        record.moved_touched += u64::from(around.touched);
        if gap_m < record.closest_m {
            record.closest_m = gap_m;
            record.asked_m = self.safety.person_m_per_s * self.drive.stop_s(&state);
        }
    }
}

/// The robot from above: platform, links and the edges of the board.
fn parts(seen: &Seen<'_>) -> Vec<BasePart> {
    let part = |from_m: DVec2, to_m: DVec2, radius_m| BasePart {
        ends_m: [from_m, to_m],
        radius_m,
    };
    let platform = part(DVec2::ZERO, DVec2::ZERO, CHASSIS_M);
    let links = seen.skeleton_m.windows(2);
    let links = links.map(|link| part(link[0].truncate(), link[1].truncate(), LINK_M));
    let (x_m, y_m) = (seen.board.half_width_m, seen.board.half_height_m);
    let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(x, y)| {
        let corner_m = DVec3::new(x * x_m, y * y_m, 0.0);
        seen.base_from_board.transform_point(corner_m).truncate()
    });
    let edges = (0..4).map(|i| part(corners[i], corners[(i + 1) % 4], seen.board.thickness_m));
    std::iter::once(platform)
        .chain(links)
        .chain(edges)
        .collect()
}
