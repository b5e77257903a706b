//! The last measurements and their ages.

/// The last measurement of a degree of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LastMeasurement {
    pub value: f64,
    clock: f64,
    travelled: f64,
}

/// The last measurement of every degree of freedom.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LastMeasurements {
    /// Time since the start.
    clock: f64,
    /// Time since the start during which the phase moved.
    travelled: f64,
    last: Vec<Option<LastMeasurement>>,
}

impl LastMeasurements {
    pub(super) fn new(dofs: usize) -> Self {
        Self {
            clock: 0.0,
            travelled: 0.0,
            last: vec![None; dofs],
        }
    }

    pub(super) fn copy_from(&mut self, other: &Self) {
        self.copy_time_from(other);
        self.last.copy_from_slice(&other.last);
    }

    pub(super) fn copy_time_from(&mut self, other: &Self) {
        self.clock = other.clock;
        self.travelled = other.travelled;
    }

    /// Lets time pass while the phase moves.
    pub(super) fn travel(&mut self, dt: f64) {
        self.clock += dt;
        self.travelled += dt;
    }

    /// Lets time pass while the phase rests.
    pub(super) fn rest(&mut self, dt: f64) {
        self.clock += dt;
    }

    pub(super) fn of(&self, dof: usize) -> Option<LastMeasurement> {
        self.last[dof]
    }

    pub(super) fn time_since(&self, last: &LastMeasurement) -> f64 {
        self.clock - last.clock
    }

    /// Time since a measurement during which the phase moved.
    pub(super) fn travelled_since(&self, last: &LastMeasurement) -> f64 {
        self.travelled - last.travelled
    }

    pub(super) fn remember(&mut self, dof: usize, value: f64) {
        self.last[dof] = Some(LastMeasurement {
            value,
            clock: self.clock,
            travelled: self.travelled,
        });
    }

    /// Forgets all measurements: after a change of shape, old deviations are void.
    pub(super) fn forget(&mut self) {
        self.last.fill(None);
    }

    /// Forgets the travel since each measurement: after a change of velocity, the phase cannot be
    /// extrapolated back to it.
    pub(super) fn forget_travel(&mut self) {
        for last in self.last.iter_mut().flatten() {
            last.travelled = self.travelled;
        }
    }
}
