//! The clock of the control loop.

use crate::nominal_step::NominalStep;
use crate::safety::state::{Channel, SafeReason};
use crate::safety::supervisor_config::SupervisorConfig;

/// Checks the time of each step and sums the sound steps.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::safety) struct Clock {
    last_s: Option<f64>,
    steps: NominalStep,
    repeated: usize,
    /// Sum of the sound steps, s: the durations of states use it instead of the clock.
    pub(in crate::safety) elapsed_s: f64,
}

impl Clock {
    /// The time by which a command advances, s.
    pub(in crate::safety) fn tick(
        &mut self,
        now_s: f64,
        config: &SupervisorConfig,
    ) -> Result<f64, SafeReason> {
        let channel = Channel::Time;
        // With a faulty clock, time advances by the nominal step: states with a duration must still end.
        let most_s = config.timing.max_step_s;
        let fault_s = self.steps.nominal_s().unwrap_or(most_s);
        if !now_s.is_finite() {
            self.elapsed_s += fault_s;
            return Err(SafeReason::NonFinite(channel));
        }
        let dt_s = now_s - self.last_s.replace(now_s).unwrap_or(now_s);
        if dt_s < 0.0 || dt_s > config.largest_tick_s {
            self.elapsed_s += fault_s;
            return Err(SafeReason::Jump { channel, by: dt_s });
        }
        self.elapsed_s += dt_s;
        self.repeated = if dt_s == 0.0 { self.repeated + 1 } else { 0 };
        if self.repeated > config.repeated_times {
            self.elapsed_s += fault_s;
            let for_s = 0.0;
            return Err(SafeReason::Frozen { channel, for_s });
        }
        Ok(self.steps.advance(dt_s, most_s))
    }
}
