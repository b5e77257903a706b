//! Chooses one configuration per node of a grid so that the sum of node prices and neighbour pair prices is small.
//!
//! Dynamic programming chooses a whole row at once, exactly, with the adjacent rows fixed; then every column; and again until nothing changes. The
//! sum never rises, so this ends, at a minimum that no change of a single row or column improves.

use hwall_kinematics::JointPositions;

/// A hole.
pub(super) const NONE: u16 = u16::MAX;

/// Most sweeps; rooms need three to six.
const MOST_SWEEPS: usize = 30;

/// Least gain for changing a row or column, s: less is rounding.
const LEAST_GAIN_S: f64 = 1e-12;

/// One configuration of a node, and its own price.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    pub(super) q: JointPositions,
    pub(super) price_s: f64,
}

/// Price of the difference between two neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PairPrice {
    pub(super) seam_rad: f64,
    pub(super) seam_price_s: f64,
}

impl PairPrice {
    #[inline]
    pub(super) fn of_s(&self, a: &JointPositions, b: &JointPositions) -> f64 {
        let share = a.max_abs_difference(b) / self.seam_rad;
        self.seam_price_s * (share * share).min(1.0)
    }
}

/// The grid and its choices.
pub(super) struct Grid<'a> {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Choices of each node, row by row; none at a hole.
    pub(super) choices: &'a [Vec<Choice>],
    pub(super) pair: PairPrice,
}

impl Grid<'_> {
    /// The index of the choice of every node; [`NONE`] at holes.
    pub(super) fn choose(&self) -> Vec<u16> {
        let cheapest = |choices: &Vec<Choice>| {
            let prices = choices.iter().enumerate();
            let best = prices.min_by(|a, b| a.1.price_s.total_cmp(&b.1.price_s));
            best.map_or(NONE, |(i, _)| i as u16)
        };
        let mut chosen: Vec<u16> = self.choices.iter().map(cheapest).collect();
        let mut line = Line::default();
        for _ in 0..MOST_SWEEPS {
            let mut changed = false;
            for row in 0..self.rows {
                let first = row * self.columns;
                let nodes: Vec<usize> = (first..first + self.columns).collect();
                changed |= self.improve(&nodes, [2, 3], &mut chosen, &mut line);
            }
            for column in 0..self.columns {
                let nodes: Vec<usize> = (0..self.rows).map(|r| r * self.columns + column).collect();
                changed |= self.improve(&nodes, [0, 1], &mut chosen, &mut line);
            }
            if !changed {
                break;
            }
        }
        chosen
    }

    /// The neighbours of a node: left, right, below, above.
    pub(super) fn neighbours(&self, node: usize) -> [Option<usize>; 4] {
        let (column, row) = (node % self.columns, node / self.columns);
        [
            (column > 0).then(|| node - 1),
            (column + 1 < self.columns).then_some(node + 1),
            (row > 0).then(|| node - self.columns),
            (row + 1 < self.rows).then_some(node + self.columns),
        ]
    }

    /// Chooses again along a line of nodes; `beside` are the indices of their other neighbours in [`neighbours`](Self::neighbours).
    fn improve(
        &self,
        nodes: &[usize],
        beside: [usize; 2],
        chosen: &mut [u16],
        line: &mut Line,
    ) -> bool {
        let mut changed = false;
        for run in nodes.split(|&node| self.choices[node].is_empty()) {
            if run.is_empty() {
                continue;
            }
            line.alone.clear();
            line.starts.clear();
            for &node in run {
                line.starts.push(line.alone.len());
                let neighbours = self.neighbours(node);
                let beside = beside.map(|side| {
                    let other = neighbours[side]?;
                    let choice = usize::from(chosen[other]);
                    self.choices[other].get(choice).map(|choice| choice.q)
                });
                for choice in &self.choices[node] {
                    let pairs: f64 = beside
                        .iter()
                        .flatten()
                        .map(|q| self.pair.of_s(q, &choice.q))
                        .sum();
                    line.alone.push(choice.price_s + pairs);
                }
            }
            let before = self.price_of(run, line, |i| usize::from(chosen[run[i]]));
            self.run_through(run, line);
            let after = self.price_of(run, line, |i| usize::from(line.best[i]));
            if after < before - LEAST_GAIN_S {
                for (&node, &best) in run.iter().zip(&line.best) {
                    chosen[node] = best;
                }
                changed = true;
            }
        }
        changed
    }

    fn price_of(&self, run: &[usize], line: &Line, chosen: impl Fn(usize) -> usize) -> f64 {
        let mut sum = 0.0;
        for i in 0..run.len() {
            sum += line.alone[line.starts[i] + chosen(i)];
            if i > 0 {
                let a = &self.choices[run[i - 1]][chosen(i - 1)].q;
                let b = &self.choices[run[i]][chosen(i)].q;
                sum += self.pair.of_s(a, b);
            }
        }
        sum
    }

    /// The cheapest choices along a run, by dynamic programming.
    fn run_through(&self, run: &[usize], line: &mut Line) {
        line.total.clone_from(&line.alone);
        line.from.clear();
        line.from.resize(line.alone.len(), 0);
        for i in 1..run.len() {
            let (before, now) = (&self.choices[run[i - 1]], &self.choices[run[i]]);
            let (start_before, start) = (line.starts[i - 1], line.starts[i]);
            for (k, choice) in now.iter().enumerate() {
                let mut best = (f64::INFINITY, 0);
                for (j, other) in before.iter().enumerate() {
                    let so_far = line.total[start_before + j];
                    if so_far < best.0 {
                        let price = so_far + self.pair.of_s(&other.q, &choice.q);
                        if price < best.0 {
                            best = (price, j);
                        }
                    }
                }
                line.total[start + k] += best.0;
                line.from[start + k] = best.1 as u16;
            }
        }
        let last = run.len() - 1;
        let totals = &line.total[line.starts[last]..];
        let cheapest = (0..totals.len()).min_by(|&a, &b| totals[a].total_cmp(&totals[b]));
        let mut k = cheapest.unwrap_or(0);
        line.best.clear();
        line.best.resize(run.len(), 0);
        for i in (0..run.len()).rev() {
            line.best[i] = k as u16;
            k = usize::from(line.from[line.starts[i] + k]);
        }
    }
}

/// Buffers of one line.
#[derive(Default)]
struct Line {
    /// Own price of every choice plus pairs with the adjacent lines, node by node from `starts`.
    alone: Vec<f64>,
    starts: Vec<usize>,
    total: Vec<f64>,
    from: Vec<u16>,
    best: Vec<u16>,
}
