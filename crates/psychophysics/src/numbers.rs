//! Numbers as text.

/// Placeholder for a missing number.
pub(crate) fn missing() -> String {
    "–".to_owned()
}

/// Formats with five digits; whole numbers without decimals.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    if value == value.round() && size < 1e6 {
        format!("{value:.0}")
    } else if (1e-3..1e6).contains(&size) {
        let digits = (4 - size.log10().floor() as i32).clamp(0, 7) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.4e}")
    }
}

pub(crate) fn probability(p: Option<f64>) -> String {
    p.map_or_else(missing, |p| {
        if p >= 0.001 || p == 0.0 {
            format!("{p:.4}")
        } else {
            format!("{p:.2e}")
        }
    })
}

pub(crate) fn share(value: Option<f64>) -> String {
    value.map_or_else(missing, |v| format!("{v:.4}"))
}
