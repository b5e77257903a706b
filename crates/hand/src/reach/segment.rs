//! Segments a recording into reaches by the speed of the hand.

use super::onset::ReachOnset;
use crate::error::HandError;
use crate::hand_point::HandPoint;
use crate::recording::Recording;
use crate::track::{FreezeConfig, LATE};
use glam::DVec3;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{positive, that};

/// Speed is measured over a window of this width around each sample, s.
const SPEED_WINDOW_S: f64 = 0.06;
/// Longest gap in the point that is bridged, s.
pub(super) const MAX_GAP_S: f64 = 0.1;
/// Fastest plausible hand, m/s. A faster step ends a reach.
const MAX_SPEED_M_PER_S: f64 = 6.0;
/// Allowance on the step length of the fastest plausible hand, m.
const JUMP_SLACK_M: f64 = 0.02;

/// Criteria for a reach.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentConfig {
    /// The point that is segmented; `None` (default) takes [`Recording::steadiest_point`].
    pub point: Option<HandPoint>,
    /// A reach must reach this speed, m/s. Default 0.3.
    pub onset_m_per_s: f64,
    /// A reach lasts while the speed stays above this, m/s; at most the onset. Default 0.1. The hysteresis keeps a slow end from being split.
    pub offset_m_per_s: f64,
    /// Shortest straight distance from start to end, m. Default 0.3.
    pub min_length_m: f64,
    /// Excludes stretches in which the tracker repeats one shape of the hand; `None` keeps them, for simulated hands with a fixed shape. Only the
    /// rigid test is used: a hand that does not move makes no reach anyway.
    pub freeze: Option<FreezeConfig>,
}

impl Default for SegmentConfig {
    fn default() -> Self {
        Self {
            point: None,
            onset_m_per_s: 0.3,
            offset_m_per_s: 0.1,
            min_length_m: 0.3,
            freeze: Some(FreezeConfig::default()),
        }
    }
}

/// How a reach ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReachEnd {
    /// The hand slowed down.
    Stopped,
    /// The recording ends while the hand moves, as in trials that end at contact.
    RecordingEnded,
    /// The tracker lost the hand: a jump, a gap or a frozen pose. The hand continued elsewhere.
    TrackingLost,
}

/// One movement from rest to rest, or its tracked part: after a loss it starts where the hand was found again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// First sample, an index into [`Recording::samples`].
    pub first: usize,
    /// Last sample, included.
    pub last: usize,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Time of the last sample, s.
    pub end_s: f64,
    /// The followed point.
    pub point: HandPoint,
    /// Start, m.
    pub start_m: DVec3,
    /// End, m.
    pub end_m: DVec3,
    /// Unit vector from start to end.
    pub direction: DVec3,
    /// Straight distance from start to end, m.
    pub length_m: f64,
    /// Largest windowed speed, m/s.
    pub peak_speed_m_per_s: f64,
    /// How it ends.
    pub end: ReachEnd,
}

/// The reaches of a recording, in order of time; they do not overlap.
///
/// # Errors
/// A setting that is not positive and finite where it must be, or an offset above the onset. A recording without tracked points has no reaches;
/// that is not an error.
pub fn reaches(recording: &Recording, config: &SegmentConfig) -> Result<Vec<Reach>, HandError> {
    config.validate()?;
    Ok(find_reaches(recording, config))
}

/// The reaches of a recording; `config` is valid.
pub(super) fn find_reaches(recording: &Recording, config: &SegmentConfig) -> Vec<Reach> {
    let Some(point) = config.point.or_else(|| recording.steadiest_point()) else {
        return Vec::new();
    };
    // Only the rigid test: a hand that does not move makes no reach anyway.
    let frozen = config.freeze.map(|freeze| {
        recording.frozen_samples(FreezeConfig {
            still_after_s: f64::INFINITY,
            value_step_m: freeze.value_step_m.max(recording.value_step_m()),
            ..freeze
        })
    });
    let is_frozen = |index: usize| frozen.as_ref().is_some_and(|frozen| frozen[index]);
    let seen = recording.frames().enumerate().filter_map(|(index, frame)| {
        let position_m = frame.point(point).filter(|_| !is_frozen(index))?;
        Some(Knot::new(index, frame.t_s, position_m))
    });
    let mut found = Vec::new();
    let mut stretch: Vec<Knot> = Vec::new();
    for knot in measured(seen.collect()) {
        let breaks =
            |before: &Knot| knot.breaks_from(before) || (before.index..knot.index).any(is_frozen);
        if stretch.last().is_some_and(breaks) {
            cut(
                &mut stretch,
                ReachEnd::TrackingLost,
                point,
                config,
                &mut found,
            );
        }
        stretch.push(knot);
    }
    let lost_before_end = match (stretch.last(), recording.samples.last()) {
        (Some(knot), Some(sample)) => {
            let mut after = knot.index..recording.samples.len();
            sample.frame.t_s - knot.seen_s > MAX_GAP_S || after.any(is_frozen)
        }
        _ => false,
    };
    let end = if lost_before_end {
        ReachEnd::TrackingLost
    } else {
        ReachEnd::RecordingEnded
    };
    cut(&mut stretch, end, point, config, &mut found);
    found
}

impl SegmentConfig {
    /// The onset definition with these speeds.
    #[must_use]
    pub const fn onset(&self) -> ReachOnset {
        ReachOnset {
            slow_m_per_s: self.offset_m_per_s,
            clear_m_per_s: self.onset_m_per_s,
        }
    }

    pub(super) fn validate(&self) -> Result<(), ArgumentError> {
        positive("onset_m_per_s", self.onset_m_per_s)?;
        positive("offset_m_per_s", self.offset_m_per_s)?;
        positive("min_length_m", self.min_length_m)?;
        that(
            self.offset_m_per_s <= self.onset_m_per_s,
            "offset_m_per_s",
            self.offset_m_per_s,
            "at most onset_m_per_s",
        )?;
        self.freeze.as_ref().map_or(Ok(()), FreezeConfig::validate)
    }
}

/// A tracked sample of the followed point.
#[derive(Clone, Copy)]
pub(super) struct Knot {
    pub(super) index: usize,
    pub(super) t_s: f64,
    pub(super) position_m: DVec3,
    /// Time of the last sample that repeats it, s.
    seen_s: f64,
}

impl Knot {
    pub(super) const fn new(index: usize, t_s: f64, position_m: DVec3) -> Self {
        Self {
            index,
            t_s,
            position_m,
            seen_s: t_s,
        }
    }

    /// Is the step from another sample longer than a hand can move?
    pub(super) fn jumps_from(&self, before: &Self) -> bool {
        let reach_m = MAX_SPEED_M_PER_S * (self.t_s - before.t_s) + JUMP_SLACK_M;
        self.position_m.distance(before.position_m) > reach_m
    }

    fn breaks_from(&self, before: &Self) -> bool {
        self.t_s - before.seen_s > MAX_GAP_S || self.jumps_from(before)
    }
}

/// With fewer changes of a point, the rate of its tracker cannot be measured.
const LEAST_CHANGES: usize = 3;
/// Share of the changes that may come faster than the tracker measures, by chance or by a late sample.
const FASTER: f64 = 0.1;

/// Removes samples that only repeat the previous one because the recording is faster than the tracker. They would look like a hand that rests and
/// jumps.
pub(super) fn measured(seen: Vec<Knot>) -> Vec<Knot> {
    let runs = seen.chunk_by(|a, b| a.position_m == b.position_m);
    let mut lasting_s: Vec<f64> = runs
        .map(|run| run[run.len() - 1].t_s - run[0].t_s)
        .collect();
    // The last run may be truncated.
    lasting_s.pop();
    lasting_s.sort_by(f64::total_cmp);
    let shortest = (FASTER * lasting_s.len() as f64) as usize;
    let repeat_s = match lasting_s.get(shortest) {
        Some(&repeat_s) if lasting_s.len() >= LEAST_CHANGES => repeat_s.min(MAX_GAP_S),
        _ => return seen,
    };
    let repeats = |knot: &Knot, before: &Knot| {
        knot.position_m == before.position_m
            && knot.t_s - before.seen_s <= MAX_GAP_S
            && before.seen_s - before.t_s <= LATE * repeat_s
    };
    let mut measured: Vec<Knot> = Vec::new();
    for knot in seen {
        match measured.last_mut() {
            Some(before) if repeat_s > 0.0 && repeats(&knot, before) => before.seen_s = knot.t_s,
            _ => measured.push(knot),
        }
    }
    measured
}

/// Finds the reaches of one uninterrupted stretch, and clears it.
fn cut(
    stretch: &mut Vec<Knot>,
    end_of_stretch: ReachEnd,
    point: HandPoint,
    config: &SegmentConfig,
    found: &mut Vec<Reach>,
) {
    let speeds = speeds(stretch);
    let onset = config.onset();
    let mut next = 0;
    while let Some([first, clear]) = onset.find(&speeds[next..]) {
        let (first, clear) = (next + first, next + clear);
        let moving = speeds[clear..].iter().take_while(|&&v| !onset.is_slow(v));
        let last = clear + moving.count() - 1;
        next = last + 1;
        let peak_speed_m_per_s = speeds[first..=last].iter().fold(0.0, |m: f64, &v| m.max(v));
        let (a, b) = (stretch[first], stretch[last]);
        let length_m = a.position_m.distance(b.position_m);
        if length_m < config.min_length_m {
            continue;
        }
        found.push(Reach {
            first: a.index,
            last: b.index,
            start_s: a.t_s,
            end_s: b.t_s,
            point,
            start_m: a.position_m,
            end_m: b.position_m,
            direction: (b.position_m - a.position_m) / length_m,
            length_m,
            peak_speed_m_per_s,
            end: if next == speeds.len() {
                end_of_stretch
            } else {
                ReachEnd::Stopped
            },
        });
    }
    stretch.clear();
}

/// Speed at each sample, m/s: the straight displacement across a window around it.
///
/// A window holds the sample and at least one neighbour, so slow trackers have a speed too; a lone sample gets 0. The speed is capped at that of
/// the fastest hand, because the allowance for jumps permits an unbounded speed over a very short step.
pub(super) fn speeds(stretch: &[Knot]) -> Vec<f64> {
    let n = stretch.len();
    let (mut from, mut to) = (0, 0);
    (0..n)
        .map(|i| {
            let t = stretch[i].t_s;
            while stretch[from].t_s < t - SPEED_WINDOW_S / 2.0 {
                from += 1;
            }
            while to + 1 < n && stretch[to + 1].t_s <= t + SPEED_WINDOW_S / 2.0 {
                to += 1;
            }
            let (a, b) = if from == to {
                (i.saturating_sub(1), (i + 1).min(n - 1))
            } else {
                (from, to)
            };
            let step_s = stretch[b].t_s - stretch[a].t_s;
            if step_s > 0.0 {
                let way_m = stretch[a].position_m.distance(stretch[b].position_m);
                (way_m / step_s).min(MAX_SPEED_M_PER_S)
            } else {
                0.0
            }
        })
        .collect()
}
