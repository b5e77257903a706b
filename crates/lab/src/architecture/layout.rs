//! Where boxes stand and how arrows run between them, in layers.
//!
//! The method of Sugiyama, Tagawa and Toda (1981): arrows over several layers get a place in each, layers are sorted by the means
//! of their neighbours until fewest arrows cross, and then everything moves as near to its neighbours as there is room.

use super::graph::{CrateGraph, Use};
use std::cmp::Ordering;

/// Rounds of sorting, and of moving.
const ROUNDS: usize = 60;

/// What stands in a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A crate.
    Crate(usize),
    /// An arrow on its way, by its index.
    Arrow(usize),
}

/// A drawing without sizes in the vertical.
#[derive(Debug, Clone)]
pub struct Layout {
    /// From the lowest layer up, from left to right; each with the middle of its place.
    pub layers: Vec<Vec<(Place, f64)>>,
    /// The arrows.
    pub uses: Vec<Use>,
}

/// Widths of places, and the least room between two.
#[derive(Debug, Clone, Copy)]
pub(super) struct Widths {
    pub(super) crate_px: f64,
    pub(super) arrow_px: f64,
    pub(super) gap_px: f64,
}

impl Layout {
    /// The graph in layers; `shown` says which crates have a place. `None` for a graph with a circle.
    pub(super) fn new(
        graph: &CrateGraph,
        widths: &Widths,
        shown: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let depths = graph.layers()?;
        let count = depths.iter().max().map_or(0, |most| most + 1);
        let mut layers = vec![Vec::new(); count];
        for (node, &depth) in depths.iter().enumerate().filter(|(node, _)| shown(*node)) {
            layers[depth].push((Place::Crate(node), 0.0));
        }
        for (arrow, one) in graph.uses.iter().enumerate() {
            for layer in &mut layers[depths[one.to] + 1..depths[one.from]] {
                layer.push((Place::Arrow(arrow), 0.0));
            }
        }
        let mut layout = Self {
            layers,
            uses: graph.uses.clone(),
        };
        layout.sort();
        layout.spread(widths);
        Some(layout)
    }

    /// Indices in the layer below of what a place is joined to.
    fn below(&self, layer: usize, place: Place) -> Vec<usize> {
        let Some(lower) = layer
            .checked_sub(1)
            .and_then(|lower| self.layers.get(lower))
        else {
            return Vec::new();
        };
        let joined = |other: Place| match (place, other) {
            (Place::Arrow(a), Place::Arrow(b)) => a == b,
            (Place::Arrow(a), Place::Crate(node)) => self.uses[a].to == node,
            (Place::Crate(node), Place::Arrow(b)) => self.uses[b].from == node,
            (Place::Crate(a), Place::Crate(b)) => {
                self.uses.iter().any(|u| (u.from, u.to) == (a, b))
            }
        };
        let indices = lower.iter().enumerate();
        indices
            .filter(|(_, other)| joined(other.0))
            .map(|(index, _)| index)
            .collect()
    }

    /// For each place of a layer, the indices of what it is joined to in the layer below or above.
    fn neighbours(&self, layer: usize, lower: bool) -> Vec<Vec<usize>> {
        if lower {
            let places = self.layers[layer].iter();
            return places.map(|place| self.below(layer, place.0)).collect();
        }
        let mut above = vec![Vec::new(); self.layers[layer].len()];
        for (index, place) in self.layers.get(layer + 1).into_iter().flatten().enumerate() {
            for here in self.below(layer + 1, place.0) {
                above[here].push(index);
            }
        }
        above
    }

    /// Arrows that cross.
    pub fn crossings(&self) -> usize {
        let mut crossings = 0;
        for layer in 1..self.layers.len() {
            let places = self.layers[layer].iter().enumerate();
            let joins: Vec<(usize, usize)> = places
                .flat_map(|(i, place)| self.below(layer, place.0).into_iter().map(move |j| (i, j)))
                .collect();
            for (k, a) in joins.iter().enumerate() {
                let crossed =
                    |b: &&(usize, usize)| (a.0 < b.0 && a.1 > b.1) || (a.0 > b.0 && a.1 < b.1);
                crossings += joins[k + 1..].iter().filter(crossed).count();
            }
        }
        crossings
    }

    /// Each layer by the means of its neighbours, down and up; the order with the fewest crossings stays.
    fn sort(&mut self) {
        let mut best = (self.crossings(), self.layers.clone());
        for round in 0..ROUNDS {
            let lower = round % 2 == 0;
            for step in 0..self.layers.len() {
                let layer = if lower {
                    step
                } else {
                    self.layers.len() - 1 - step
                };
                let neighbours = self.neighbours(layer, lower);
                let mut keyed: Vec<(f64, (Place, f64))> = self.layers[layer]
                    .iter()
                    .enumerate()
                    .map(|(index, place)| {
                        (mean(&neighbours[index]).unwrap_or(index as f64), *place)
                    })
                    .collect();
                keyed.sort_by(|a, b| a.0.partial_cmp(&b.0).unwrap_or(Ordering::Equal));
                self.layers[layer] = keyed.into_iter().map(|(_, place)| place).collect();
            }
            self.exchange();
            let crossings = self.crossings();
            if crossings < best.0 {
                best = (crossings, self.layers.clone());
            }
        }
        self.layers = best.1;
    }

    /// Neighbours change places while that saves crossings.
    fn exchange(&mut self) {
        let mut crossings = self.crossings();
        let mut better = true;
        while std::mem::take(&mut better) {
            for layer in 0..self.layers.len() {
                for index in 1..self.layers[layer].len() {
                    self.layers[layer].swap(index - 1, index);
                    let after = self.crossings();
                    if after < crossings {
                        (crossings, better) = (after, true);
                    } else {
                        self.layers[layer].swap(index - 1, index);
                    }
                }
            }
        }
    }

    /// Places move to the means of their neighbours as far as there is room; arrows insist more than crates.
    fn spread(&mut self, widths: &Widths) {
        let half = |place: Place| match place {
            Place::Crate(_) => 0.5 * widths.crate_px,
            Place::Arrow(_) => 0.5 * widths.arrow_px,
        };
        for layer in &mut self.layers {
            let mut end_px = 0.0;
            for (place, at_px) in layer.iter_mut() {
                *at_px = end_px + half(*place);
                end_px += 2.0 * half(*place) + widths.gap_px;
            }
            for (_, at_px) in layer.iter_mut() {
                *at_px -= 0.5 * end_px;
            }
        }
        for round in 0..ROUNDS {
            for step in 0..self.layers.len() {
                let up = round % 2 == 0;
                let layer = if up {
                    step
                } else {
                    self.layers.len() - 1 - step
                };
                let (down, over) = (self.neighbours(layer, true), self.neighbours(layer, false));
                // Distances from the first place, if all stand as close as they may.
                let mut offset_px = 0.0;
                let mut asked = Vec::new();
                for (index, &(place, at_px)) in self.layers[layer].iter().enumerate() {
                    if let Some(&(before, _)) = index.checked_sub(1).map(|i| &self.layers[layer][i])
                    {
                        offset_px += half(before) + half(place) + widths.gap_px;
                    }
                    let at = |layer: usize, indices: &[usize]| -> Vec<f64> {
                        indices.iter().map(|&i| self.layers[layer][i].1).collect()
                    };
                    let mut joined = Vec::new();
                    if !down[index].is_empty() {
                        joined.extend(at(layer - 1, &down[index]));
                    }
                    if !over[index].is_empty() {
                        joined.extend(at(layer + 1, &over[index]));
                    }
                    let wish_px = match joined.len() {
                        0 => at_px,
                        count => joined.iter().sum::<f64>() / count as f64,
                    };
                    let weight = if matches!(place, Place::Arrow(_)) {
                        8.0
                    } else {
                        1.0
                    };
                    asked.push((wish_px - offset_px, weight, offset_px));
                }
                let given = isotonic(&asked);
                for ((place, given), asked) in self.layers[layer].iter_mut().zip(given).zip(&asked)
                {
                    place.1 = given + asked.2;
                }
            }
        }
    }
}

fn mean(indices: &[usize]) -> Option<f64> {
    let sum: usize = indices.iter().sum();
    (!indices.is_empty()).then(|| sum as f64 / indices.len() as f64)
}

/// The sequence that does not fall and is nearest to the values, by their weights: neighbours that fall are pooled.
fn isotonic(values: &[(f64, f64, f64)]) -> Vec<f64> {
    let mut pools: Vec<(f64, f64, usize)> = Vec::new();
    for &(value, weight, _) in values {
        let mut pool = (value, weight, 1);
        while let Some(&before) = pools.last()
            && before.0 > pool.0
        {
            pools.pop();
            let weight = before.1 + pool.1;
            let value = (before.0 * before.1 + pool.0 * pool.1) / weight;
            pool = (value, weight, before.2 + pool.2);
        }
        pools.push(pool);
    }
    pools
        .into_iter()
        .flat_map(|(value, _, count)| std::iter::repeat_n(value, count))
        .collect()
}
