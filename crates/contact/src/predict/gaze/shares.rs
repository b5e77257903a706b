//! How often a look of some age is at the place that will be touched.

use super::super::hand::phase::{PHASES, ReachPhase};
use crate::error::ContactError;
use hwall_numeric::check::that;

/// Which look is at the place that will be touched; the three are shares of one whole.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TargetShares {
    /// The present one.
    pub now: f64,
    /// The one before it. This is its share right after it has ended; it fades over [`GazeModel::memory_s`](super::GazeModel::memory_s).
    pub before: f64,
    /// Neither.
    pub elsewhere: f64,
}

impl TargetShares {
    /// The same whole among the looks that there are: the present one or not, and as much of the one before as is left.
    pub(in crate::predict) fn among(self, has_now: bool, before_left: f64) -> Self {
        let whole = self.now + self.before + self.elsewhere;
        let kept = Self {
            now: if has_now { self.now } else { 0.0 },
            before: self.before * before_left,
            elsewhere: self.elsewhere,
        };
        let left = kept.now + kept.before + kept.elsewhere;
        if left <= 0.0 {
            return Self {
                elsewhere: whole,
                ..Self::default()
            };
        }
        Self {
            now: kept.now * (whole / left),
            before: kept.before * (whole / left),
            elsewhere: kept.elsewhere * (whole / left),
        }
    }
}

/// Where the next contact is, by hand and eyes: six shares that add up to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookShares {
    /// The contact is where the motion of the hand leads, as the estimator says.
    pub as_moves: TargetShares,
    /// The motion says nothing about it: the hand rests, it only seemed to start, or the person has changed their mind. The
    /// contact is anywhere about the resting hand.
    pub anew: TargetShares,
}

impl LookShares {
    pub(in crate::predict) const fn to_array(self) -> [f64; 6] {
        let (a, b) = (self.as_moves, self.anew);
        [a.now, a.before, a.elsewhere, b.now, b.before, b.elsewhere]
    }

    pub(in crate::predict) const fn from_array(shares: [f64; 6]) -> Self {
        let [a, b, c, d, e, f] = shares;
        Self {
            as_moves: TargetShares {
                now: a,
                before: b,
                elsewhere: c,
            },
            anew: TargetShares {
                now: d,
                before: e,
                elsewhere: f,
            },
        }
    }

    /// Among the looks that there are.
    pub(in crate::predict) fn among(self, has_now: bool, before_left: f64) -> Self {
        Self {
            as_moves: self.as_moves.among(has_now, before_left),
            anew: self.anew.among(has_now, before_left),
        }
    }

    /// The share of all contacts that are looked at now.
    #[must_use]
    pub fn now(&self) -> f64 {
        self.as_moves.now + self.anew.now
    }
}

/// Ages of a look at which its shares are kept, s; between them they are interpolated.
pub const LOOK_AGES_S: [f64; 6] = [0.05, 0.15, 0.27, 0.45, 0.8, 1.5];

/// By phase and age.
pub(in crate::predict) type Shares = [[[f64; 6]; LOOK_AGES_S.len()]; PHASES];

/// The shares by the phase of the reach, the age of the present look, and whether this person's eyes rest at its place in
/// pauses, too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookTable {
    /// Of all looks.
    pub(in crate::predict) shares: Shares,
    /// Of looks at a place where the eyes rest in no pause, and in every one.
    pub(in crate::predict) by_idle: [Shares; 2],
}

/// Shares that nothing was learnt about: people look at what they touch in five of six cases.
const AT_REST: [f64; 6] = [0.0, 0.0, 0.0, 0.7, 0.15, 0.15];
const REACHING: [f64; 6] = [0.62, 0.21, 0.15, 0.01, 0.005, 0.005];

impl Default for LookTable {
    /// The same at every age.
    fn default() -> Self {
        let mut shares = [[REACHING; LOOK_AGES_S.len()]; PHASES];
        for phase in [ReachPhase::Rest, ReachPhase::Stirring] {
            shares[phase as usize] = [AT_REST; LOOK_AGES_S.len()];
        }
        Self {
            shares,
            by_idle: [shares; 2],
        }
    }
}

impl LookTable {
    /// The shares at a phase and an age of the present look, s, of a person of whom nothing else is known.
    #[must_use]
    pub fn at(&self, phase: ReachPhase, age_s: f64) -> LookShares {
        Self::between(&self.shares[phase as usize], age_s)
    }

    /// The same at a place where this person's eyes rest in pauses without a reach that follows: from 0, never, to 1, always.
    #[must_use]
    pub fn of_look(&self, phase: ReachPhase, age_s: f64, idle: Option<f64>) -> LookShares {
        let Some(idle) = idle else {
            return self.at(phase, age_s);
        };
        let [never, always] = self
            .by_idle
            .map(|shares| Self::between(&shares[phase as usize], age_s).to_array());
        LookShares::from_array(std::array::from_fn(|i| {
            (1.0 - idle) * never[i] + idle * always[i]
        }))
    }

    fn between(row: &[[f64; 6]; LOOK_AGES_S.len()], age_s: f64) -> LookShares {
        let [(a, x), (b, y)] = nodes(age_s);
        LookShares::from_array(std::array::from_fn(|i| x * row[a][i] + y * row[b][i]))
    }

    /// Sets the shares of a phase, the same at every age and place.
    pub fn set(&mut self, phase: ReachPhase, shares: LookShares) {
        let everywhere = [shares.to_array(); LOOK_AGES_S.len()];
        let [never, always] = &mut self.by_idle;
        for table in [&mut self.shares, never, always] {
            table[phase as usize] = everywhere;
        }
    }

    pub(in crate::predict) fn validate(&self) -> Result<(), ContactError> {
        let [never, always] = &self.by_idle;
        for row in [&self.shares, never, always]
            .into_iter()
            .flatten()
            .flatten()
        {
            for &share in row {
                that((0.0..=1.0).contains(&share), "share", share, "in [0, 1]")?;
            }
            let sum: f64 = row.iter().sum();
            that((sum - 1.0).abs() < 1e-6, "sum of shares", sum, "1")?;
        }
        Ok(())
    }
}

/// The two nodes around an age, with the weight of each.
pub(in crate::predict) fn nodes(age_s: f64) -> [(usize, f64); 2] {
    let last = LOOK_AGES_S.len() - 1;
    let above = LOOK_AGES_S.partition_point(|&node_s| node_s <= age_s);
    match above {
        0 => [(0, 1.0), (0, 0.0)],
        above if above > last => [(last, 1.0), (last, 0.0)],
        above => {
            let (low, high) = (LOOK_AGES_S[above - 1], LOOK_AGES_S[above]);
            let share = (age_s - low) / (high - low);
            [(above - 1, 1.0 - share), (above, share)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_that_is_missing_leaves_the_whole_to_the_others() {
        let shares = LookTable::default().at(ReachPhase::UnderWay, 0.3);
        let cases = [
            (true, 1.0),
            (true, 0.3),
            (true, 0.0),
            (false, 0.5),
            (false, 0.0),
        ];
        for (has_now, left) in cases {
            let among = shares.among(has_now, left);
            let sum = |s: TargetShares| s.now + s.before + s.elsewhere;
            assert!((sum(among.as_moves) - sum(shares.as_moves)).abs() < 1e-12);
            assert!((sum(among.anew) - sum(shares.anew)).abs() < 1e-12);
            assert_eq!(among.as_moves.now > 0.0, has_now);
        }
    }

    #[test]
    fn a_place_where_the_eyes_rest_has_shares_of_its_own() {
        let mut table = LookTable::default();
        table.by_idle[0][0] = [[0.0, 0.0, 0.0, 0.9, 0.0, 0.1]; LOOK_AGES_S.len()];
        table.by_idle[1][0] = [[0.0, 0.0, 0.0, 0.1, 0.0, 0.9]; LOOK_AGES_S.len()];
        table.validate().expect("shares");
        let now = |idle| table.of_look(ReachPhase::Rest, 0.3, idle).now();
        let of_any = table.of_look(ReachPhase::Rest, 0.3, None);
        assert_eq!(of_any, table.at(ReachPhase::Rest, 0.3));
        for (idle, expected) in [(0.0, 0.9), (0.25, 0.7), (1.0, 0.1)] {
            assert!((now(Some(idle)) - expected).abs() < 1e-12);
        }
        table.by_idle[1][0][2] = [0.5; 6];
        assert!(table.validate().is_err());
    }

    #[test]
    fn shares_are_interpolated_and_add_up() {
        let mut table = LookTable::default();
        table.shares[0][0] = [0.0, 0.0, 0.0, 0.2, 0.2, 0.6];
        table.shares[0][1] = [0.0, 0.0, 0.0, 0.8, 0.1, 0.1];
        table.validate().expect("shares");
        let now = |age_s| table.at(ReachPhase::Rest, age_s).now();
        assert!((now(0.0) - 0.2).abs() < 1e-12 && (now(0.15) - 0.8).abs() < 1e-12);
        assert!((now(0.10) - 0.5).abs() < 1e-12);
        for age_s in [-1.0, 0.0, 0.07, 0.3, 1.49, 1.5, 9.0, f64::INFINITY] {
            for phase in ReachPhase::ALL {
                let sum: f64 = table.at(phase, age_s).to_array().iter().sum();
                assert!((sum - 1.0).abs() < 1e-12, "{age_s}");
            }
        }
        table.shares[2][3][0] = 0.9;
        assert!(table.validate().is_err());
    }
}
