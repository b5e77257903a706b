//! The arm with its board as capsules.

use super::capsule::Capsule;
use crate::board::Board;
use crate::error::HapticsError;
use glam::DVec3;
use hwall_kinematics::{ArmKinematics, JointPositions, MOST_BODY_POINTS};
use hwall_numeric::check::{non_negative, positive};
use std::sync::Arc;

/// How thick an arm is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyConfig {
    /// Radius of the links, m; default 0.09, roughly that of an iiwa.
    pub radius_m: f64,
    /// Parts of the arm keep this distance from each other, m; default 0.01.
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

/// Capsules that the board is covered by: strips beside each other, along its height.
const STRIPS: usize = 3;
/// Most capsules of an arm: one between two neighbouring points of its body, and the board.
pub(super) const MOST: usize = MOST_BODY_POINTS - 1 + STRIPS;
/// Configurations from which it is known which parts touch by construction.
const SAMPLES: u32 = 512;

/// An arm as capsules: its links between the [points of its body](ArmKinematics::body_points), and its board.
#[derive(Debug, Clone)]
pub struct ArmBody {
    arm: Arc<dyn ArmKinematics>,
    board: Board,
    config: BodyConfig,
    /// Can these two parts be apart from each other?
    can_part: [[bool; MOST]; MOST],
}

impl ArmBody {
    /// Of an arm whose tool frame is the face of the board.
    ///
    /// Neighbours always touch, and so do parts that overlap in all of 512 configurations, such as the short links of a wrist; they are not
    /// judged. Nor is the board judged against the forearm (the last link that is longer than thick) and what follows it: that depends on
    /// the true thickness of the wrist.
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
            can_part: [[false; MOST]; MOST],
        };
        for sample in 0..SAMPLES {
            let capsules = body.at(&body.sample(sample));
            for (i, j) in capsules.strangers() {
                let apart_m = capsules.all[i].distance_m(&capsules.all[j]);
                body.can_part[i][j] |= apart_m > config.clearance_m;
            }
        }
        Ok(body)
    }

    /// The arm is known to be free here: parts that overlap are thinner than their capsules, and are not judged from now on.
    pub fn fit(&mut self, q: &JointPositions) {
        let capsules = self.at(q);
        for (i, j) in capsules.strangers() {
            let apart_m = capsules.all[i].distance_m(&capsules.all[j]);
            self.can_part[i][j] &= apart_m > self.config.clearance_m;
        }
    }

    /// A configuration within the limits, spread evenly.
    fn sample(&self, number: u32) -> JointPositions {
        const PRIMES: [u32; 7] = [2, 3, 5, 7, 11, 13, 17];
        let limits = self.arm.limits();
        JointPositions(std::array::from_fn(|joint| {
            let share = radical_inverse(number + 1, PRIMES[joint]);
            limits[joint].min_rad + share * (limits[joint].max_rad - limits[joint].min_rad)
        }))
    }

    /// The arm.
    #[must_use]
    pub const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        &self.arm
    }

    /// At a configuration, base frame. Does not allocate. NaN in gives NaN distances.
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

    /// The links in a row and the board, m: the same in every configuration of an arm of turning joints.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        let capsules = self.at(&JointPositions::default());
        let links = capsules.links().iter();
        let length_m: f64 = links.map(|link| link.from_m.distance(link.to_m)).sum();
        length_m + self.board.half_width_m.hypot(self.board.half_height_m)
    }

    /// Least distance between two parts that can be apart, m; infinite if there are none.
    #[must_use]
    pub fn self_distance_m(&self, q: &JointPositions) -> f64 {
        let capsules = self.at(q);
        let mut least = f64::INFINITY;
        for (i, j) in capsules.strangers() {
            if self.can_part[i][j] {
                let apart_m = capsules.all[i].distance_m(&capsules.all[j]);
                if apart_m.is_nan() {
                    return f64::NAN;
                }
                least = least.min(apart_m);
            }
        }
        least
    }

    /// The distance that parts keep from each other, m.
    #[must_use]
    pub const fn clearance_m(&self) -> f64 {
        self.config.clearance_m
    }
}

/// The digits of a number behind the point, in reverse: in [0, 1).
fn radical_inverse(mut number: u32, base: u32) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0);
    while number > 0 {
        digit /= f64::from(base);
        value += digit * f64::from(number % base);
        number /= base;
    }
    value
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

    /// Least distance to a capsule, m.
    #[must_use]
    pub fn distance_m(&self, other: &Capsule) -> f64 {
        let distances = self.all().iter().map(|part| part.distance_m(other));
        least_or_nan(distances)
    }

    /// Parts that are no neighbours.
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
