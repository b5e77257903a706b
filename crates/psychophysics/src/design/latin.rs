//! Balanced Latin squares.

use crate::PsychophysicsError;
use crate::error::check;

/// Conditions of a square, at most: it holds their square, twice for odd numbers.
const MOST_CONDITIONS: usize = 2000;

/// Orders of `conditions` in which every condition stands equally often at every place and follows
/// every other equally often: once for an even number (one square), twice for an odd one (a square
/// and its mirror image, 2 n rows).
///
/// Rows are orders for one subject or session, conditions counted from 0. First row
/// 0, 1, n − 1, 2, n − 2, …; each row is one more than that before, modulo n.
///
/// Source: Williams 1949.
///
/// # Errors
/// No condition, or more than 2000.
pub fn balanced_latin_square(conditions: usize) -> Result<Vec<Vec<usize>>, PsychophysicsError> {
    let n = conditions;
    check(
        "conditions of a Latin square",
        n as f64,
        (1..=MOST_CONDITIONS).contains(&n),
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
