//! Balanced Latin squares.

use crate::error::Result;
use hwall_numeric::check::that;

/// Largest number of conditions n: a square has n² entries, 2 n² for odd n.
const MOST_CONDITIONS: usize = 2000;

/// Orders of `conditions` in which every condition occurs equally often at every position and follows
/// every other condition equally often. This happens once for an even number of conditions (one
/// square) and twice for an odd number (a square and its mirror image, 2 n rows).
///
/// Each row is the order for one subject or session, conditions counted from 0. The first row is
/// 0, 1, n − 1, 2, n − 2, …; each row is the previous one plus one, modulo n.
///
/// Source: Williams 1949.
///
/// # Errors
/// No condition, or more than 2000.
pub fn balanced_latin_square(conditions: usize) -> Result<Vec<Vec<usize>>> {
    check_conditions(conditions)?;
    Ok((0..row_count(conditions))
        .map(|row| square_row(conditions, row))
        .collect())
}

/// Refuses squares that are empty or too large.
pub(super) fn check_conditions(conditions: usize) -> Result<()> {
    let holds = (1..=MOST_CONDITIONS).contains(&conditions);
    let what = "conditions of a Latin square";
    that(holds, what, conditions as f64, "1 to 2000")?;
    Ok(())
}

/// Number of rows of the square.
pub(super) const fn row_count(conditions: usize) -> usize {
    match conditions % 2 == 1 && conditions > 1 {
        true => 2 * conditions,
        false => conditions,
    }
}

/// One row of the square; rows count from 0.
pub(super) fn square_row(conditions: usize, row: usize) -> Vec<usize> {
    let n = conditions;
    let zigzag = |place: usize| match place {
        p if p % 2 == 1 => p.div_ceil(2),
        0 => 0,
        p => n - p / 2,
    };
    let order = (0..n).map(|place| (zigzag(place) + row) % n);
    // The second half is the mirror image of the first.
    match row < n {
        true => order.collect(),
        false => order.rev().collect(),
    }
}
