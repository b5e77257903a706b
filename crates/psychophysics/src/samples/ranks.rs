//! Ranks, with mean ranks for ties.

/// Ranks from 1; equal values share the mean of their ranks.
pub(crate) fn average_ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_unstable_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut before = 0;
    for tied in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let mean = before as f64 + 0.5 * (tied.len() + 1) as f64;
        for &i in tied {
            ranks[i] = mean;
        }
        before += tied.len();
    }
    ranks
}

/// Sizes of the sets of equal values.
pub(crate) fn tie_sizes(values: &[f64]) -> Vec<usize> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.chunk_by(|a, b| a == b).map(<[f64]>::len).collect()
}

#[cfg(test)]
mod tests {
    use super::{average_ranks, tie_sizes};

    #[test]
    fn ties_share_the_mean_rank() {
        let values = [3.0, 1.0, 3.0, -0.0, 0.0, 3.0];
        assert_eq!(average_ranks(&values), [5.0, 3.0, 5.0, 1.5, 1.5, 5.0]);
        assert_eq!(tie_sizes(&values), [2, 1, 3]);
        assert!(average_ranks(&[]).is_empty());
    }
}
