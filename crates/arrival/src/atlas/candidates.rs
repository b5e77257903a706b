//! Candidates of a node: the fastest configurations to present the board there, with their prices.

use super::config::AtlasConfig;
use super::sweep::Choice;
use crate::passage::{MEDIUM, Passage};
use crate::presentation::{Holding, Presentation};
use glam::DVec3;
use hwall_kinematics::JointPositions;
use hwall_motion::MotionLimits;
use hwall_reachability::WallPlane;

/// At most the count divided by this may be of one branch and roll.
const OF_A_KIND: usize = 3;

/// Inputs of the prices.
pub(super) struct Pricing<'a> {
    pub(super) passage: Passage<'a>,
    pub(super) limits: &'a MotionLimits,
    pub(super) waiting: &'a JointPositions,
    pub(super) config: &'a AtlasConfig,
}

impl Pricing<'_> {
    /// Arrival time and strain, s.
    fn alone_s(&self, q: &JointPositions) -> f64 {
        let strain = self.config.strain.price_of_s(self.passage.arm, q);
        self.limits.travel_time_s(self.waiting, q) + strain
    }

    /// Price of a path that is not clear, s; proportional to its violation.
    fn blocked_s(&self, q: &JointPositions) -> f64 {
        let shares = MEDIUM.iter().copied();
        self.config.blocked_s_per_m * self.passage.excess_m(self.waiting, q, shares)
    }

    /// Price of a choice without its neighbours, s.
    pub(super) fn price_s(&self, q: &JointPositions) -> f64 {
        self.alone_s(q) + self.blocked_s(q)
    }
}

/// The candidates of a node, also as choices.
#[derive(Default)]
pub(super) struct Candidates {
    pub(super) ways: Vec<Presentation>,
    pub(super) choices: Vec<Choice>,
}

/// Buffers of the enumeration.
#[derive(Default)]
pub(super) struct Scratch {
    ways: Vec<Presentation>,
    order: Vec<(f64, usize)>,
}

/// The candidates for a place; none if the arm cannot present the board there.
pub(super) fn of_node(
    holding: &Holding<'_>,
    pricing: &Pricing,
    plane: &WallPlane,
    point_m: DVec3,
    scratch: &mut Scratch,
) -> Candidates {
    let config = pricing.config;
    scratch.ways.clear();
    holding.present(plane, point_m, pricing.waiting, &mut scratch.ways);
    scratch.order.clear();
    let alone = scratch.ways.iter().map(|way| pricing.alone_s(&way.q));
    scratch.order.extend(alone.enumerate().map(|(i, s)| (s, i)));
    scratch
        .order
        .sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut found = Candidates::default();
    let mut kinds = vec![0_usize; 8 * holding.rolls_rad().len()];
    let most_of_a_kind = config.candidates.div_ceil(OF_A_KIND);
    for &(alone_s, i) in &scratch.order {
        let way = scratch.ways[i];
        let kind = &mut kinds[usize::from(way.roll) * 8 + way.branch.index()];
        if *kind >= most_of_a_kind {
            continue;
        }
        *kind += 1;
        found.ways.push(way);
        found.choices.push(Choice {
            q: way.q,
            price_s: alone_s + pricing.blocked_s(&way.q),
        });
        if found.ways.len() == config.candidates {
            break;
        }
    }
    found
}
