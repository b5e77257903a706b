//! A first-order low pass.

/// Weight of a new sample after a step, both times in s; 1 without a time constant.
pub(crate) fn share(dt_s: f64, time_constant_s: f64) -> f64 {
    match time_constant_s > 0.0 {
        true => -(-dt_s / time_constant_s).exp_m1(),
        false => 1.0,
    }
}
