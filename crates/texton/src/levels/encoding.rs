//! Levels for virtual textures.

use super::level::{Level, LevelTable};
use crate::error::{Result, TextonError};
use hwall_numeric::check::finite;

/// n virtual textures assigned to n of m levels, one to one, in the order of their roughness.
#[derive(Debug, Clone, PartialEq)]
pub struct Encoding {
    /// Level of each texture, in the order in which they were given.
    levels: Vec<Level>,
    /// Roughness of the textures, sorted, and their levels.
    sorted: Vec<f64>,
    table: LevelTable,
}

impl Encoding {
    /// Chooses levels for textures of these roughnesses (any scale, any order).
    ///
    /// Rougher textures get levels of greater magnitude. The n magnitudes are spread as evenly as the levels allow
    /// over their whole range: the choice minimises the sum of squared differences between its steps and
    /// `range / (n - 1)` (exact, by dynamic programming). A single texture gets the level nearest to the middle.
    /// Equally rough textures get neighbouring levels in the order given: the assignment is one to one.
    ///
    /// # Errors
    /// No texture, more textures than levels, or a number that is not finite.
    pub fn new(roughness: &[f64], levels: &[Level]) -> Result<Self> {
        let n = roughness.len();
        if n == 0 || n > levels.len() {
            return Err(TextonError::TooFewLevels {
                wanted: n,
                levels: levels.len(),
            });
        }
        for value in roughness {
            finite("roughness", *value)?;
        }
        let all = LevelTable::new(levels.to_vec())?;
        let magnitudes: Vec<f64> = all.levels().iter().map(|level| level.magnitude).collect();
        let chosen: Vec<Level> = spread(&magnitudes, n)
            .into_iter()
            .map(|i| all.levels()[i])
            .collect();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| roughness[*a].total_cmp(&roughness[*b]));
        let mut assigned = chosen.clone();
        for (level, texture) in chosen.iter().zip(&order) {
            assigned[*texture] = *level;
        }
        Ok(Self {
            levels: assigned,
            sorted: order.iter().map(|i| roughness[*i]).collect(),
            table: LevelTable::new(chosen)?,
        })
    }

    /// The level of a texture, by its index in the list given.
    #[must_use]
    pub fn level(&self, texture: usize) -> Option<&Level> {
        self.levels.get(texture)
    }

    /// The level of the texture with the nearest roughness; ties give the smoother one; `None` for NaN.
    #[must_use]
    pub fn level_for(&self, roughness: f64) -> Option<&Level> {
        if roughness.is_nan() {
            return None;
        }
        let above = self.sorted.partition_point(|r| *r < roughness);
        let nearest = match (above.checked_sub(1), self.sorted.get(above)) {
            (Some(below), Some(upper)) if upper - roughness < roughness - self.sorted[below] => {
                above
            }
            (Some(below), _) => below,
            (None, _) => above,
        };
        self.table.levels().get(nearest)
    }

    /// The chosen levels, from the smoothest.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        self.table.levels()
    }

    /// Smallest difference of neighbouring magnitudes; `None` for one texture.
    #[must_use]
    pub fn least_step(&self) -> Option<f64> {
        let steps = self.levels().windows(2);
        steps
            .map(|w| w[1].magnitude - w[0].magnitude)
            .reduce(f64::min)
    }
}

/// Indices of the n sorted values whose steps are closest to equal.
fn spread(sorted: &[f64], n: usize) -> Vec<usize> {
    let m = sorted.len();
    let range = sorted[m - 1] - sorted[0];
    if n == 1 {
        let middle = sorted[0] + 0.5 * range;
        let off = |i: &usize| (sorted[*i] - middle).abs();
        return (0..m)
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .into_iter()
            .collect();
    }
    let step = range / (n - 1) as f64;
    // cost[i]: least sum if the k-th choice is i; from[k][i]: the choice before it.
    let mut cost = vec![0.0; m];
    let mut from = vec![vec![0; m]; n];
    for (k, from) in from.iter_mut().enumerate().skip(1) {
        let mut next = vec![f64::INFINITY; m];
        for j in k..m {
            for i in k - 1..j {
                let sum = cost[i] + (sorted[j] - sorted[i] - step).powi(2);
                if sum < next[j] {
                    (next[j], from[j]) = (sum, i);
                }
            }
        }
        cost = next;
    }
    let mut place = (n - 1..m)
        .min_by(|a, b| cost[*a].total_cmp(&cost[*b]))
        .unwrap_or(m - 1);
    let mut places = vec![place; n];
    for k in (1..n).rev() {
        place = from[k][place];
        places[k - 1] = place;
    }
    places
}
