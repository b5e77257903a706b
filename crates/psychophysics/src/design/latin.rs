//! Balanced Latin squares.

use crate::error::PsychophysicsError;
use hwall_numeric::check::that;

/// Conditions of a square, at most: it has as many entries as their square, twice that for odd numbers.
const MOST_CONDITIONS: usize = 2000;

/// Orders of `conditions` in which every condition occurs equally often at every place and follows
/// every other equally often: once for an even number (one square), twice for an odd number (a square
/// and its mirror image, 2 n rows).
///
/// Each row is the order for one subject or session, conditions counted from 0. The first row is
/// 0, 1, n − 1, 2, n − 2, …; each row is that before plus one, modulo n.
///
/// Source: Williams 1949.
///
/// # Errors
/// No condition, or more than 2000.
pub fn balanced_latin_square(conditions: usize) -> Result<Vec<Vec<usize>>, PsychophysicsError> {
    let n = conditions;
    that(
        (1..=MOST_CONDITIONS).contains(&n),
        "conditions of a Latin square",
        n as f64,
        "1 to 2000",
    )?;
    let zigzag = |place: usize| match place {
        p if p % 2 == 1 => p.div_ceil(2),
        0 => 0,
        p => n - p / 2,
    };
    let row = |k: usize| -> Vec<usize> { (0..n).map(|p| (zigzag(p) + k) % n).collect() };
    let mut rows: Vec<Vec<usize>> = (0..n).map(row).collect();
    if n % 2 == 1 && n > 1 {
        let mirrored = |k: usize| -> Vec<usize> { rows[k].iter().rev().copied().collect() };
        rows.extend((0..n).map(mirrored).collect::<Vec<_>>());
    }
    Ok(rows)
}
