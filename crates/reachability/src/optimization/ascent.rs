//! Ascent along a line within limits: the inner part of the optimization solver.
//!
//! Feasible configurations form a manifold (the constraints) with boundaries (the limits). At a point
//! of this manifold, the gradient of s is projected on the tangent space of the constraints, for the
//! joints that are not held at a limit. The tangent space has few dimensions, so differences of
//! projected gradients give the Hessian. A Newton step follows, within a trust radius and up to the
//! first limit. Gauss-Newton steps return to the manifold. A joint leaves its limit when the sign of
//! its multiplier shows that s would then increase further.

use super::tangent::{Point, Tangent, least_step};
use super::vector::{add, offset, square};
use crate::wall::WallLine;
use glam::{DMat3, DVec3};
use hwall_kinematics::{Chain, ChainScratch, JointLimit, rotation_vector};
use hwall_numeric::dense::{Matrix, SymmetricEigen, dot};

/// Largest change of a joint in one step, rad.
const TRUST_RAD: f64 = 0.3;

/// Half width of the differences for the Hessian, rad.
const DIFFERENCE_RAD: f64 = 1e-4;

/// A projected gradient (lengths in arm lengths) below this counts as zero.
const FLAT: f64 = 1e-11;

/// One line of a wall and one arm: maximize s under the constraints.
pub(super) struct Ascent<'a> {
    chain: &'a Chain,
    limits: Vec<JointLimit>,
    normal: DVec3,
    along: DVec3,
    distance_m: f64,
    height_m: f64,
    /// Orientation of the board, or only its normal where the roll is free.
    board: Option<DMat3>,
    /// Length of the arm, m: the unit of lengths.
    size_m: f64,
    scratch: ChainScratch,
}

/// Where an ascent ended.
pub(super) struct AscentEnd {
    pub(super) q: Vec<f64>,
    /// True if the projected gradient is zero and no joint would increase s by leaving its limit.
    pub(super) stationary: bool,
}

impl<'a> Ascent<'a> {
    pub(super) fn new(
        chain: &'a Chain,
        line: &WallLine,
        roll_rad: Option<f64>,
        size_m: f64,
    ) -> Self {
        Self {
            chain,
            limits: chain.joints().iter().map(|joint| joint.limit).collect(),
            normal: line.plane.normal(),
            along: line.plane.along(),
            distance_m: line.plane.distance_m(),
            height_m: line.height_m,
            board: roll_rad.map(|roll| line.plane.board_rotation(roll)),
            size_m,
            scratch: chain.scratch(),
        }
    }

    pub(super) fn limits(&self) -> &[JointLimit] {
        &self.limits
    }

    /// Position along the line, distance from the line and orientation error: m and rad.
    pub(super) fn measure(&self, q: &[f64]) -> Option<[f64; 3]> {
        let pose = self.chain.forward(q).ok()?;
        let (p, z) = (pose.position_m(), pose.rotation().z_axis);
        let off_plane = self.normal.dot(p) - self.distance_m;
        let off = off_plane.abs().max((p.z - self.height_m).abs());
        let turned = match self.board {
            Some(board) => rotation_vector(board * pose.rotation().transpose()).length(),
            None => z.cross(self.normal).length().atan2(z.dot(self.normal)),
        };
        Some([self.along.dot(p), off, turned])
    }

    fn at(&mut self, q: &[f64]) -> Option<Point> {
        let pose = self
            .chain
            .forward_jacobian_into(q, &mut self.scratch)
            .ok()?;
        let (p, rotation) = (pose.position_m(), pose.rotation());
        let unit = 1.0 / self.size_m;
        let mut residual = vec![
            (self.normal.dot(p) - self.distance_m) * unit,
            (p.z - self.height_m) * unit,
        ];
        // Orientation error of the board, as components about axes.
        let error = match self.board {
            Some(board) => rotation_vector(rotation * board.transpose()),
            None => self.normal.cross(rotation.z_axis),
        };
        let mut axes = vec![self.along, DVec3::Z];
        if self.board.is_some() {
            axes.push(self.normal);
        } else if rotation.z_axis.dot(self.normal) < 0.0 {
            // The board faces away: the cross product alone would accept the opposite normal, too.
            residual.extend([3.0 + error.dot(self.along), error.z]);
        }
        if residual.len() == 2 {
            residual.extend(axes.iter().map(|axis| axis.dot(error)));
        }
        let columns = self.scratch.jacobian_columns();
        let linear = |axis: DVec3| {
            let of = |c: &[f64; 6]| axis.dot(DVec3::new(c[0], c[1], c[2])) * unit;
            columns.iter().map(of).collect::<Vec<f64>>()
        };
        let angular = |axis: &DVec3| {
            let of = |c: &[f64; 6]| axis.dot(DVec3::new(c[3], c[4], c[5]));
            columns.iter().map(of).collect::<Vec<f64>>()
        };
        let mut rows = vec![linear(self.normal), linear(DVec3::Z)];
        rows.extend(axes.iter().map(angular));
        Some(Point {
            s: self.along.dot(p) * unit,
            residual,
            rows,
            gradient: linear(self.along),
        })
    }

    /// Moves a configuration onto the constraints by damped Gauss-Newton steps; held joints stay,
    /// the others stop at their limits. False on failure.
    pub(super) fn restore(&mut self, q: &mut [f64], held: &[bool], most_steps: usize) -> bool {
        let mut damping = 1e-12;
        let Some(mut here) = self.at(q) else {
            return false;
        };
        let mut error = square(&here.residual);
        for _ in 0..most_steps {
            if error < 1e-30 {
                return true;
            }
            // A joint on its limit that the step would push outwards is held for this step.
            let mut free: Vec<bool> = held.iter().map(|h| !h).collect();
            let mut step = least_step(&here, &free, damping);
            for _ in 0..2 {
                let mut pushed = false;
                for (i, limit) in self.limits.iter().enumerate() {
                    let outwards = (q[i] >= limit.max_rad && step[i] > 0.0)
                        || (q[i] <= limit.min_rad && step[i] < 0.0);
                    if free[i] && outwards {
                        (free[i], pushed) = (false, true);
                    }
                }
                if !pushed {
                    break;
                }
                step = least_step(&here, &free, damping);
            }
            let longest = step.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            let scale = (0.8 / longest).min(1.0);
            let mut next = q.to_vec();
            for ((x, d), limit) in next.iter_mut().zip(&step).zip(&self.limits) {
                *x = (*x + scale * d).clamp(limit.min_rad, limit.max_rad);
            }
            let Some(there) = self.at(&next) else {
                return false;
            };
            let there_error = square(&there.residual);
            if there_error < error {
                q.copy_from_slice(&next);
                let stalled = there_error > 0.9 * error && damping > 1e-3;
                (here, error) = (there, there_error);
                damping = (0.2 * damping).max(1e-14);
                if stalled {
                    break;
                }
            } else if error < 1e-26 {
                // Converged to rounding.
                return true;
            } else {
                damping = (20.0 * damping).max(1e-6);
                if damping > 1e3 {
                    break;
                }
            }
        }
        error < 1e-24
    }

    /// Ascends (`sign` 1) or descends (-1) from a point of the manifold.
    pub(super) fn climb(&mut self, start: &[f64], sign: f64, most_steps: usize) -> AscentEnd {
        let mut q = start.to_vec();
        let mut trust = TRUST_RAD;
        let mut held = self.at_limits(&q);
        let end = |q: Vec<f64>, stationary: bool| AscentEnd { q, stationary };
        for _ in 0..most_steps {
            let Some(here) = self.at(&q) else {
                return end(q, false);
            };
            let mut tangent = Tangent::new(&here, &held, sign);
            // One joint at a time leaves its limit: the one that increases s most.
            if let Some(joint) = tangent.would_climb(&here, &q, &held, &self.limits, sign) {
                held[joint] = false;
                tangent = Tangent::new(&here, &held, sign);
            } else if tangent.length() < FLAT {
                return end(q, true);
            }
            let direction = self.newton(&q, &held, &tangent, sign, trust);
            match self.step(&q, &direction, &held, sign * here.s, sign) {
                Some((next, hit)) => {
                    let gained = self
                        .at(&next)
                        .map_or(0.0, |there| sign * (there.s - here.s));
                    q = next;
                    for joint in hit {
                        held[joint] = true;
                    }
                    trust = (2.0 * trust).min(TRUST_RAD);
                    if gained < 1e-15 && tangent.length() < 1e-7 {
                        return end(q, true);
                    }
                }
                None => {
                    trust *= 0.25;
                    if trust < 1e-9 {
                        return end(q, tangent.length() < 1e-6);
                    }
                }
            }
        }
        end(q, false)
    }

    fn at_limits(&self, q: &[f64]) -> Vec<bool> {
        let at = |(x, limit): (&f64, &JointLimit)| *x <= limit.min_rad || *x >= limit.max_rad;
        q.iter().zip(&self.limits).map(at).collect()
    }

    /// The ascent direction of a Newton step in the tangent space, at most `trust` long.
    fn newton(
        &mut self,
        q: &[f64],
        held: &[bool],
        tangent: &Tangent,
        sign: f64,
        trust: f64,
    ) -> Vec<f64> {
        let n = tangent.basis.len();
        let slope: Vec<f64> = tangent
            .basis
            .iter()
            .map(|z| dot(z, &tangent.projected))
            .collect();
        let mut hessian = Matrix::zeros(n, n);
        for (i, z) in tangent.basis.iter().enumerate() {
            let mut sides = [-1.0, 1.0].map(|side| {
                let mut moved = offset(q, z, side * DIFFERENCE_RAD);
                // Limits are ignored here, because half of the directions point outside them.
                let restored = self.restore_freely(&mut moved, held);
                restored
                    .then(|| self.at(&moved))
                    .flatten()
                    .map(|p| Tangent::new(&p, held, sign).projected)
            });
            let [Some(before), Some(after)] = &mut sides else {
                continue;
            };
            for (j, w) in tangent.basis.iter().enumerate() {
                hessian[(j, i)] = (dot(w, after) - dot(w, before)) / (2.0 * DIFFERENCE_RAD);
            }
        }
        let eigen = SymmetricEigen::new(&hessian);
        let mut step = vec![0.0; q.len()];
        for (i, value) in eigen.values.iter().enumerate() {
            let vector = eigen.vectors.row(i);
            let along = dot(vector, &slope) / value.abs().max(1e-4);
            for (coefficient, z) in vector.iter().zip(&tangent.basis) {
                add(&mut step, z, along * coefficient);
            }
        }
        let longest = step.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        if longest > trust {
            step.iter_mut().for_each(|x| *x *= trust / longest);
        }
        step
    }

    /// Two Gauss-Newton steps without limits, for differences close to the manifold.
    fn restore_freely(&mut self, q: &mut [f64], held: &[bool]) -> bool {
        let free: Vec<bool> = held.iter().map(|h| !h).collect();
        for _ in 0..3 {
            let Some(here) = self.at(q) else {
                return false;
            };
            if square(&here.residual) < 1e-28 {
                return true;
            }
            let step = least_step(&here, &free, 1e-14);
            add(q, &step, 1.0);
        }
        true
    }

    /// Moves along a direction up to the first limits and back onto the manifold. Returns the new
    /// configuration and the joints that reached their limits, if s improves.
    fn step(
        &mut self,
        q: &[f64],
        direction: &[f64],
        held: &[bool],
        height: f64,
        sign: f64,
    ) -> Option<(Vec<f64>, Vec<usize>)> {
        let mut share: f64 = 1.0;
        for ((x, d), limit) in q.iter().zip(direction).zip(&self.limits) {
            let room = if *d > 0.0 {
                limit.max_rad - x
            } else {
                limit.min_rad - x
            };
            if *d != 0.0 && room / d < share {
                share = (room / d).max(0.0);
            }
        }
        let mut next = offset(q, direction, share);
        let mut holds = held.to_vec();
        let mut hit = Vec::new();
        for (i, limit) in self.limits.iter().enumerate() {
            next[i] = next[i].clamp(limit.min_rad, limit.max_rad);
            let room = if direction[i] > 0.0 {
                limit.max_rad - next[i]
            } else {
                next[i] - limit.min_rad
            };
            if !held[i] && direction[i] != 0.0 && room <= 1e-12 {
                next[i] = if direction[i] > 0.0 {
                    limit.max_rad
                } else {
                    limit.min_rad
                };
                holds[i] = true;
                hit.push(i);
            }
        }
        if !self.restore(&mut next, &holds, 12) {
            return None;
        }
        // Restoring may have moved further joints onto their limits.
        let at = self.at_limits(&next);
        hit.extend((0..next.len()).filter(|&i| at[i] && !holds[i]));
        let there = self.at(&next)?;
        (sign * there.s > height || (share < 1e-9 && !hit.is_empty())).then_some((next, hit))
    }
}
