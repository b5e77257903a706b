//! Refines the chosen arm angles, since the tried ones are degrees apart.

use super::candidates::Pricing;
use super::sweep::{Choice, Grid, NONE};
use crate::presentation::{Presentation, Presenter};
use glam::DVec3;
use hwall_kinematics::JointPositions;
use hwall_reachability::WallPlane;

/// Steps that are tried, as shares of the arm angle step.
const SHARES: [f64; 4] = [0.5, 0.25, 0.25, 0.1];

/// Turns the arm angle of every node to the least price of the node and its neighbour pairs, node by node.
///
/// `ways` holds the chosen configuration of every node, and the grid one choice for each.
pub(super) fn arm_angles(
    presenter: &Presenter,
    pricing: &Pricing,
    grid: &Grid,
    plane: &WallPlane,
    points_m: &[DVec3],
    ways: &mut [Option<(Presentation, Choice)>],
) {
    for share in SHARES {
        let step_rad = share * pricing.config.arm_angle_step_rad;
        for node in 0..ways.len() {
            let Some((way, choice)) = ways[node] else {
                continue;
            };
            let beside = grid
                .neighbours(node)
                .map(|other| other.and_then(|o| ways[o]).map(|(_, choice)| choice.q));
            let pairs_s = |q: &JointPositions| {
                let prices = beside.iter().flatten().map(|b| grid.pair.of_s(b, q));
                prices.sum::<f64>()
            };
            let mut least_s = choice.price_s + pairs_s(&choice.q);
            for turn in [step_rad, -step_rad] {
                let at = way.arm_angle_rad + turn;
                let Some(moved) = presenter.at(plane, points_m[node], &way, at) else {
                    continue;
                };
                let price_s = pricing.price_s(&moved.q);
                let total_s = price_s + pairs_s(&moved.q);
                if total_s < least_s {
                    least_s = total_s;
                    let choice = Choice {
                        q: moved.q,
                        price_s,
                    };
                    ways[node] = Some((moved, choice));
                }
            }
        }
    }
}

/// The chosen configurations.
pub(super) fn chosen(
    candidates: &[Vec<Presentation>],
    grid: &Grid,
    chosen: &[u16],
) -> Vec<Option<(Presentation, Choice)>> {
    let of_node = |(node, &index): (usize, &u16)| {
        let index = usize::from(index);
        (index != usize::from(NONE)).then(|| (candidates[node][index], grid.choices[node][index]))
    };
    chosen.iter().enumerate().map(of_node).collect()
}
