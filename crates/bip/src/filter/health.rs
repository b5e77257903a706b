//! Statistics on how well a filter fits its observations.

use super::observation::Update;

/// Memory of [`Health::recent_distance`], in updates.
const MEMORY: f64 = 20.0;

/// Statistics of a filter since its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Health {
    /// Observations taken.
    pub updates: u64,
    /// Values accepted.
    pub rows: u64,
    /// Values rejected as outliers.
    pub gated: u64,
    /// Sum of the log densities of all observations, each given the earlier ones.
    pub log_likelihood: f64,
    /// Squared Mahalanobis distance per value, over about the last twenty observations: around 1 if the noise is right, far below if it is
    /// deliberately large, far above if the model does not fit the motion.
    pub recent_distance: f64,
    /// Lower bound of the condition number of the information matrix.
    pub condition: f64,
}

impl Health {
    pub(crate) const NEW: Self = Self {
        updates: 0,
        rows: 0,
        gated: 0,
        log_likelihood: 0.0,
        recent_distance: 1.0,
        condition: 1.0,
    };

    pub(crate) fn count(&mut self, update: &Update) {
        self.updates += 1;
        self.rows += update.rows as u64;
        self.gated += update.gated as u64;
        self.log_likelihood += update.log_likelihood;
        if update.rows > 0 {
            let now = update.distance_squared / update.rows as f64;
            let weight = 1.0 / MEMORY.min(self.updates as f64);
            self.recent_distance += weight * (now - self.recent_distance);
        }
    }
}
