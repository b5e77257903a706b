//! Comparison of numbers, arrays, vectors and matrices within a stated tolerance.

use glam::{DMat3, DMat4, DQuat, DVec2, DVec3, DVec4};
use std::fmt::Write;

/// Allowed difference of two numbers: `abs + rel · max(|a|, |b|)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tol {
    /// Absolute part, in the unit of the values.
    pub abs: f64,
    /// Relative part, without unit.
    pub rel: f64,
}

impl Tol {
    /// Both parts; their sum is the tolerance.
    #[must_use]
    pub const fn new(abs: f64, rel: f64) -> Self {
        Self { abs, rel }
    }

    /// Absolute only.
    #[must_use]
    pub const fn abs(abs: f64) -> Self {
        Self { abs, rel: 0.0 }
    }

    /// Relative only: for an expected zero only zero passes.
    #[must_use]
    pub const fn rel(rel: f64) -> Self {
        Self { abs: 0.0, rel }
    }

    /// The difference allowed between `a` and `b`.
    #[must_use]
    pub fn allowed(self, a: f64, b: f64) -> f64 {
        self.abs + self.rel * a.abs().max(b.abs())
    }

    /// Do `a` and `b` agree? NaN (in a value or in the tolerance) never agrees, an infinity only with
    /// itself.
    #[must_use]
    pub fn accepts(self, a: f64, b: f64) -> bool {
        let difference = (a - b).abs();
        if self.abs.is_nan() || self.rel.is_nan() {
            return false;
        }
        // The test for finiteness keeps `inf <= rel * inf` from passing.
        a == b || (difference.is_finite() && difference <= self.allowed(a, b))
    }
}

/// The numbers inside a value, in a fixed order: column-major for matrices, `x y z w` for
/// quaternions (`q` and `-q` therefore differ), element by element for slices of anything.
pub trait Components {
    /// Appends the numbers.
    fn push_to(&self, out: &mut Vec<f64>);

    /// All numbers.
    fn components(&self) -> Vec<f64> {
        let mut out = Vec::new();
        self.push_to(&mut out);
        out
    }
}

impl Components for f64 {
    fn push_to(&self, out: &mut Vec<f64>) {
        out.push(*self);
    }
}

impl<T: Components> Components for [T] {
    fn push_to(&self, out: &mut Vec<f64>) {
        self.iter().for_each(|item| item.push_to(out));
    }
}

impl<T: Components, const N: usize> Components for [T; N] {
    fn push_to(&self, out: &mut Vec<f64>) {
        self.as_slice().push_to(out);
    }
}

impl<T: Components> Components for Vec<T> {
    fn push_to(&self, out: &mut Vec<f64>) {
        self.as_slice().push_to(out);
    }
}

impl<T: Components + ?Sized> Components for &T {
    fn push_to(&self, out: &mut Vec<f64>) {
        (**self).push_to(out);
    }
}

macro_rules! glam_components {
    ($($kind:ty: $to_array:ident),+) => {$(
        impl Components for $kind {
            fn push_to(&self, out: &mut Vec<f64>) {
                out.extend(self.$to_array());
            }
        }
    )+};
}
glam_components!(DVec2: to_array, DVec3: to_array, DVec4: to_array, DQuat: to_array,
    DMat3: to_cols_array, DMat4: to_cols_array);

/// The message of [`assert_close!`](crate::assert_close); `None` if `a` and `b` agree.
///
/// Contains the number of components that disagree and the first eight of them, with both values, the actual and the allowed
/// difference.
#[must_use]
pub fn mismatch(
    a: &(impl Components + ?Sized),
    b: &(impl Components + ?Sized),
    tol: Tol,
) -> Option<String> {
    let (a, b) = (a.components(), b.components());
    if a.len() != b.len() {
        return Some(format!("{} components against {}", a.len(), b.len()));
    }
    let bad: Vec<usize> = (0..a.len()).filter(|&i| !tol.accepts(a[i], b[i])).collect();
    if bad.is_empty() {
        return None;
    }
    let mut text = format!(
        "{} of {} components differ (abs {:e}, rel {:e})",
        bad.len(),
        a.len(),
        tol.abs,
        tol.rel
    );
    for &i in bad.iter().take(8) {
        let (left, right) = (a[i], b[i]);
        let (difference, allowed) = ((left - right).abs(), tol.allowed(left, right));
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\n  [{i}] {left:?} against {right:?}: off by {difference:e}, allowed {allowed:e}"
        );
    }
    Some(text)
}

/// Panics unless two values agree within a [`Tol`], component by component.
///
/// Works on anything with [`Components`]; a message with format arguments may follow.
#[macro_export]
macro_rules! assert_close {
    ($a:expr, $b:expr, $tol:expr $(,)?) => {
        if let Some(difference) = $crate::mismatch(&$a, &$b, $tol) {
            panic!("{} and {}: {difference}", stringify!($a), stringify!($b));
        }
    };
    ($a:expr, $b:expr, $tol:expr, $($message:tt)+) => {
        if let Some(difference) = $crate::mismatch(&$a, &$b, $tol) {
            panic!("{}: {} and {}: {difference}", format_args!($($message)+), stringify!($a), stringify!($b));
        }
    };
}
