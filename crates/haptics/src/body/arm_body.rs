//! The arm with its board as capsules.

use super::capsule::Capsule;
use super::room::{MOST_OBSTACLES, Room};
use crate::board::Board;
use crate::error::HapticsError;
use glam::DVec3;
use hwall_kinematics::{
    ArmKinematics, JointPositions, JointVelocities, MOST_BODY_POINTS, MOST_JOINTS,
};
use hwall_numeric::check::{non_negative, positive, that};
use std::fmt::{self, Display};
use std::sync::Arc;

/// Dimensions of the arm's capsules.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyConfig {
    /// Radius of the links, m; default 0.09, roughly that of an iiwa.
    pub radius_m: f64,
    /// Distance that parts of the arm keep from each other and from the room, m; default 0.01.
    pub clearance_m: f64,
}

impl Default for BodyConfig {
    fn default() -> Self {
        Self {
            radius_m: 0.09,
            clearance_m: 0.01,
        }
    }
}

impl BodyConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("radius_m", self.radius_m)?;
        non_negative("clearance_m", self.clearance_m)?;
        Ok(())
    }
}

/// Capsules that cover the board: parallel strips along its height.
const STRIPS: usize = 3;
/// Most capsules of an arm: one between two neighbouring points of its body, and the board.
pub(super) const MOST: usize = MOST_BODY_POINTS - 1 + STRIPS;
/// Number of intervals of the stopping time.
const BRAKING_PIECES: usize = 4;
/// Sampled configurations that show which parts touch by construction.
const SAMPLES: u32 = 512;

/// An arm as capsules: its links between the [points of its body](ArmKinematics::body_points), and its board.
#[derive(Debug, Clone)]
pub struct ArmBody {
    arm: Arc<dyn ArmKinematics>,
    board: Board,
    config: BodyConfig,
    room: Room,
    /// Can these two parts be clear of each other?
    can_part: [[bool; MOST]; MOST],
    /// Could they, but for the posture that the arm was fitted to?
    left_out: [[bool; MOST]; MOST],
    /// Can this part be clear of this obstacle?
    can_clear: [[bool; MOST]; MOST_OBSTACLES],
    reach_m: f64,
}

/// Which parts of an arm are checked against each other, and which against each obstacle of the room.
#[derive(Debug, Clone, Copy, Default)]
struct Near {
    parts: [[bool; MOST]; MOST],
    room: [[bool; MOST]; MOST_OBSTACLES],
}

impl Near {
    fn is_empty(&self) -> bool {
        let mut all = self.parts.iter().chain(&self.room).flatten();
        all.all(|near| !near)
    }
}

/// A part of an arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArmPart {
    /// An index of [`ArmCapsules::links`].
    Link(usize),
    /// A strip of the board.
    Board {
        /// From 0.
        strip: usize,
    },
}

impl Display for ArmPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link(index) => write!(f, "link {index}"),
            Self::Board { strip } => write!(f, "strip {strip} of the board"),
        }
    }
}

/// Two parts of an arm that are not checked against each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeftOut(pub [ArmPart; 2]);

impl Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [one, other] = self.0;
        write!(f, "{one} and {other}")
    }
}

/// The nearest thing that the arm must not meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Distance between the surfaces, m; negative where they overlap, infinite without any. NaN for NaN joints.
    pub distance_m: f64,
    /// The obstacle of the room, from 0; `None`: another part of the arm.
    pub obstacle: Option<usize>,
}

impl ArmBody {
    /// For an arm whose tool frame is the face of the board.
    ///
    /// The arm stands in free space, see [`in_room`](Self::in_room). Neighbours always touch, and so do parts that overlap in all of 512
    /// configurations, such as the short links of a wrist; they are not checked. The board is not checked against the forearm (the last link that is
    /// longer than thick) and the parts after it: that depends on the true thickness of the wrist.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(
        arm: Arc<dyn ArmKinematics>,
        board: Board,
        config: BodyConfig,
    ) -> Result<Self, HapticsError> {
        config.validate()?;
        let mut body = Self {
            arm,
            board,
            config,
            room: Room::new(&[])?,
            can_part: [[false; MOST]; MOST],
            left_out: [[false; MOST]; MOST],
            can_clear: [[false; MOST]; MOST_OBSTACLES],
            reach_m: 1.0,
        };
        let capsules = body.at(&JointPositions::default());
        let links = capsules.links().iter();
        let length_m: f64 = links.map(|link| link.from_m.distance(link.to_m)).sum();
        let board_m = board.half_width_m.hypot(board.half_height_m);
        body.reach_m = (length_m + board_m).max(1.0);
        for sample in 0..SAMPLES {
            let capsules = body.at(&JointPositions::spread(body.arm.limits(), sample));
            for (i, j) in capsules.strangers() {
                let apart_m = capsules.all[i].distance_m(&capsules.all[j]);
                body.can_part[i][j] |= apart_m > config.clearance_m;
            }
        }
        Ok(body)
    }

    /// The same in a room. Parts that always touch an obstacle, such as the base on its floor, are not checked against it.
    ///
    /// # Errors
    /// An obstacle that every part touches in all of 512 configurations.
    pub fn in_room(mut self, room: Room) -> Result<Self, HapticsError> {
        self.can_clear = [[false; MOST]; MOST_OBSTACLES];
        for sample in 0..SAMPLES {
            let capsules = self.at(&JointPositions::spread(self.arm.limits(), sample));
            for (obstacle, can_clear) in room.obstacles().iter().zip(&mut self.can_clear) {
                for (part, can_clear) in capsules.all().iter().zip(can_clear) {
                    *can_clear = *can_clear || obstacle.distance_m(part) > self.config.clearance_m;
                }
            }
        }
        let can_clear = self.can_clear.iter().take(room.obstacles().len());
        for (number, parts) in (1..).zip(can_clear) {
            let number = f64::from(number);
            let wanted = "one that the arm can be clear of: does its normal point to the arm, are its lengths in metres?";
            let valid = parts.contains(&true);
            that(valid, "entry of the room", number, wanted)?;
        }
        self.room = room;
        Ok(self)
    }

    /// Checks that the arm can stand like this: no part may be deeper in an obstacle than the radius of the links, which may be thinner than that.
    ///
    /// # Errors
    /// The first such obstacle, counted from 1; joints that are not finite.
    pub fn stands_outside(&self, q: &JointPositions) -> Result<(), HapticsError> {
        let capsules = self.at(q);
        let rows = self.room.obstacles().iter().zip(&self.can_clear);
        for (number, (obstacle, can_clear)) in (1..).zip(rows) {
            let mut judged = capsules.all().iter().zip(can_clear).filter(|(_, is)| **is);
            let outside = judged.all(|(part, _)| obstacle.distance_m(part) > -self.config.radius_m);
            let wanted = "one that the waiting arm is outside of: are place and size in metres, in the frame of the arm's base?";
            that(outside, "entry of the room", f64::from(number), wanted)?;
        }
        Ok(())
    }

    /// The arm is known to be free here: overlapping parts must be thinner than their capsules, and are no longer checked; see
    /// [`left_out`](Self::left_out).
    pub fn fit(&mut self, q: &JointPositions) {
        let capsules = self.at(q);
        for (i, j) in capsules.strangers() {
            let apart_m = capsules.all[i].distance_m(&capsules.all[j]);
            let is_apart = apart_m > self.config.clearance_m;
            self.left_out[i][j] |= self.can_part[i][j] && !is_apart;
            self.can_part[i][j] &= is_apart;
        }
    }

    /// The parts that are not checked against each other since the arm was [fitted](Self::fit) to a posture: they may meet.
    pub fn left_out(&self) -> impl Iterator<Item = LeftOut> {
        let links = self
            .arm
            .body_points(&JointPositions::default())
            .points_m()
            .len()
            - 1;
        let part = move |index: usize| match index.checked_sub(links) {
            None => ArmPart::Link(index),
            Some(strip) => ArmPart::Board { strip },
        };
        let rows = self.left_out.iter().enumerate();
        rows.flat_map(move |(i, row)| {
            let columns = row.iter().enumerate().filter(|(_, is_out)| **is_out);
            columns.map(move |(j, _)| LeftOut([part(i), part(j)]))
        })
    }

    /// The arm.
    #[must_use]
    pub const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        &self.arm
    }

    /// The capsules at a configuration, base frame. Does not allocate. NaN in gives NaN distances.
    #[must_use]
    pub fn at(&self, q: &JointPositions) -> ArmCapsules {
        let body = self.arm.body_points(q);
        let (points_m, face) = (body.points_m(), body.base_from_tool());
        let mut all = [Capsule::ball(DVec3::ZERO, 0.0); MOST];
        let links = points_m.len() - 1;
        for (link, capsule) in all.iter_mut().enumerate().take(links) {
            *capsule = Capsule {
                from_m: points_m[link],
                to_m: points_m[link + 1],
                radius_m: self.config.radius_m,
            };
        }
        let radius_m = self.board.half_width_m / STRIPS as f64;
        for (strip, capsule) in all[links..].iter_mut().enumerate().take(STRIPS) {
            let x = (2 * strip + 1) as f64 * radius_m - self.board.half_width_m;
            let at = |y| face.transform_point(DVec3::new(x, y, -radius_m));
            *capsule = Capsule {
                from_m: at(-self.board.half_height_m),
                to_m: at(self.board.half_height_m),
                radius_m,
            };
        }
        ArmCapsules { all, links }
    }

    /// Upper bound of the speed of any part, m/s: no point is further from a joint's axis than the total length of links and board; a sliding joint
    /// moves every point by 1 m per m.
    #[must_use]
    pub fn most_m_per_s(&self, qd: &JointVelocities) -> f64 {
        self.reach_m * qd.0.iter().map(|qd| qd.abs()).sum::<f64>()
    }

    /// The nearest thing to the arm, among its own separable parts and the room.
    #[must_use]
    pub fn nearest(&self, q: &JointPositions) -> Nearest {
        let capsules = self.at(q);
        let of_arm = (capsules.strangers())
            .filter(|(i, j)| self.can_part[*i][*j])
            .map(|(i, j)| capsules.all[i].distance_m(&capsules.all[j]));
        let mut nearest = Nearest {
            distance_m: least_or_nan(of_arm),
            obstacle: None,
        };
        for (index, obstacle) in self.room.obstacles().iter().enumerate() {
            let judged = capsules.all().iter().zip(&self.can_clear[index]);
            for (part, _) in judged.filter(|(_, judged)| **judged) {
                // Most parts are far from most obstacles. NaN does not count as far.
                if obstacle.at_least_m(part) >= nearest.distance_m {
                    continue;
                }
                let distance_m = obstacle.distance_m(part);
                if distance_m < nearest.distance_m || distance_m.is_nan() {
                    nearest = Nearest {
                        distance_m,
                        obstacle: Some(index),
                    };
                }
            }
        }
        nearest
    }

    /// The nearest thing that the arm would come too close to between two configurations. It may stay as close to each thing as it is, or move away.
    /// NaN counts as too close.
    #[must_use]
    pub fn comes_too_near(&self, from: &JointPositions, to: &JointPositions) -> Option<Nearest> {
        let all = Near {
            parts: self.can_part,
            room: self.can_clear,
        };
        self.too_near_of(&self.at(from), &self.at(to), &all)
    }

    /// Pairs that can be closer than this, m.
    fn near(&self, capsules: &ArmCapsules, most_m: f64) -> Near {
        let mut near = Near::default();
        for (i, j) in capsules.strangers().filter(|(i, j)| self.can_part[*i][*j]) {
            let distance_m = capsules.all[i].distance_m(&capsules.all[j]);
            // NaN does not count as far.
            let is_far = distance_m >= most_m;
            near.parts[i][j] = !is_far;
        }
        for (index, obstacle) in self.room.obstacles().iter().enumerate() {
            for (part, capsule) in capsules.all().iter().enumerate() {
                let is_far = obstacle.at_least_m(capsule) >= most_m;
                near.room[index][part] = self.can_clear[index][part] && !is_far;
            }
        }
        near
    }

    fn too_near_of(&self, from: &ArmCapsules, to: &ArmCapsules, near: &Near) -> Option<Nearest> {
        let mut worst: Option<Nearest> = None;
        let mut see = |now_m: f64, before_m: &dyn Fn() -> f64, obstacle| {
            let is_clear = now_m >= self.config.clearance_m;
            if is_clear || now_m >= before_m() {
                return;
            }
            let is_nearer = |than: Nearest| now_m < than.distance_m || now_m.is_nan();
            if worst.is_none_or(is_nearer) {
                worst = Some(Nearest {
                    distance_m: now_m,
                    obstacle,
                });
            }
        };
        for (i, j) in to.strangers().filter(|(i, j)| near.parts[*i][*j]) {
            let between = |capsules: &ArmCapsules| capsules.all[i].distance_m(&capsules.all[j]);
            see(between(to), &|| between(from), None);
        }
        for (index, obstacle) in self.room.obstacles().iter().enumerate() {
            let judged = near.room[index].iter().zip(from.all().iter().zip(to.all()));
            for (_, (before, now)) in judged.filter(|(judged, _)| **judged) {
                // Most parts are far from most obstacles. NaN does not count as far.
                let is_far = obstacle.at_least_m(now) >= self.config.clearance_m;
                if !is_far {
                    see(
                        obstacle.distance_m(now),
                        &|| obstacle.distance_m(before),
                        Some(index),
                    );
                }
            }
        }
        worst
    }

    /// Does an arm that moves at `qd` and brakes with these accelerations (rad/s²) come too close to itself or the room before it stops? See
    /// [`comes_too_near`](Self::comes_too_near).
    ///
    /// Checked at four samples at equal time intervals: an arm of 1 m/s that brakes within 0.25 m moves by up to 0.11 m between two of them.
    #[must_use]
    pub fn meets(
        &self,
        q: &JointPositions,
        qd: &JointVelocities,
        braking_rad_per_s2: &[f64; MOST_JOINTS],
    ) -> Option<Nearest> {
        self.meets_from(&self.at(q), q, qd, braking_rad_per_s2)
    }

    /// `here`: the capsules at `q`.
    pub(crate) fn meets_from(
        &self,
        here: &ArmCapsules,
        q: &JointPositions,
        qd: &JointVelocities,
        braking_rad_per_s2: &[f64; MOST_JOINTS],
    ) -> Option<Nearest> {
        let rates = qd.0.iter().zip(braking_rad_per_s2);
        let stop_s = rates.map(|(qd, most)| qd.abs() / most).fold(0.0, f64::max);
        // Two parts that approach each other both move.
        let most_way_m = 2.0 * self.most_m_per_s(qd) * 0.5 * stop_s;
        if most_way_m == 0.0 {
            return None;
        }
        let near = self.near(here, self.config.clearance_m + most_way_m);
        if near.is_empty() {
            return None;
        }
        let at = |time_s: f64| {
            let way_s = time_s * (1.0 - 0.5 * time_s / stop_s);
            self.at(&JointPositions(std::array::from_fn(|i| {
                q[i] + qd[i] * way_s
            })))
        };
        let pieces = (1..=BRAKING_PIECES).map(|piece| piece as f64 / BRAKING_PIECES as f64);
        pieces
            .map(|share| at(share * stop_s))
            .find_map(|then| self.too_near_of(here, &then, &near))
    }

    /// The distance that parts keep from each other and from the room, m.
    #[must_use]
    pub const fn clearance_m(&self) -> f64 {
        self.config.clearance_m
    }
}

/// The capsules of an arm at a configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmCapsules {
    all: [Capsule; MOST],
    links: usize,
}

impl ArmCapsules {
    /// The links from the base on, then the board.
    #[must_use]
    pub fn all(&self) -> &[Capsule] {
        &self.all[..self.links + STRIPS]
    }

    /// The links from the base on.
    #[must_use]
    pub fn links(&self) -> &[Capsule] {
        &self.all[..self.links]
    }

    /// Distance to the nearest of the arm's capsules, m.
    #[must_use]
    pub fn distance_m(&self, other: &Capsule) -> f64 {
        let distances = self.all().iter().map(|part| part.distance_m(other));
        least_or_nan(distances)
    }

    /// Pairs of parts that are not neighbours.
    fn strangers(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let links = self.links;
        let is_long = |link: &Capsule| link.from_m.distance(link.to_m) > 2.0 * link.radius_m;
        let forearm = self.links().iter().rposition(is_long).unwrap_or(0);
        (0..links).flat_map(move |i| {
            let boards = links..if i < forearm { links + STRIPS } else { links };
            (i + 2..links).chain(boards).map(move |j| (i, j))
        })
    }
}

/// `f64::min` drops NaN.
pub(super) fn least_or_nan(distances_m: impl Iterator<Item = f64>) -> f64 {
    distances_m.fold(f64::INFINITY, |least, d| {
        match d.is_nan() || least.is_nan() {
            true => f64::NAN,
            false => least.min(d),
        }
    })
}
