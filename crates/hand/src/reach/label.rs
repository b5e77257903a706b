//! Extracts reaches with a known end from recordings.

use super::labelled::LabelledReach;
use super::onset::ReachOnset;
use super::segment::{
    Knot, MAX_GAP_S, Reach, ReachEnd, SegmentConfig, find_reaches, measured, speeds,
};
use super::touching_point::TouchingPoint;
use crate::error::HandError;
use crate::hand_point::HandPoint;
use crate::recording::{Recording, Sample};
use crate::track::FreezeConfig;
use glam::DVec3;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{non_negative, positive};

/// A hand faster than this share of the peak speed of its trial clearly moves.
const CLEAR_SHARE: f64 = 0.25;
/// At the end of a trial the hand is slow below this share of the trial's peak speed.
const SLOW_SHARE: f64 = 0.05;
/// A slow stretch at an end of a trial that is shorter than this, s, plus a tenth of the movement belongs to the movement, so that a trial cropped
/// to the movement loses nothing.
const SHORTEST_REST_S: f64 = 0.1;
/// Smallest number of samples that show the touching point.
const MIN_SAMPLES: usize = 5;
/// Slow share of a movement at either end: 6 % of a minimum-jerk motion, plus margin.
const SLOW_FLANK: f64 = 0.1;
/// A first sample is left over from the previous trial if its step is this many times as long as the next steps.
const LEAP: f64 = 4.0;
/// Shorter first steps never count as a jump, m.
const LEAST_LEAP_M: f64 = 0.02;
/// Number of steps that the first one is compared with.
const STEPS_AFTER_LEAP: usize = 5;
/// Onset, m/s, and length, m, of the first pass of [`SegmentConfig::adapted`].
const TRIAL_ONSET_M_PER_S: f64 = 0.15;
const TRIAL_LENGTH_M: f64 = 0.05;

/// Which movements of a recording are reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum ReachCut {
    /// A recording that names its trial is one reach; any other is segmented by speed into all its reaches.
    #[default]
    ByTrial,
    /// The first reach of every recording, segmented by speed: for files with one trial and the return motion.
    First,
    /// All reaches of every recording, segmented by speed.
    All,
}

/// How recordings become labelled reaches.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelConfig {
    /// The touching point; `None` (default): the index tip if it is seen in at least half of all samples, otherwise the point seen most often,
    /// among equals the first of [`HandPoint::BY_CONTACT`].
    pub point: Option<HandPoint>,
    /// Which movements are reaches. Default [`ReachCut::ByTrial`].
    pub cut: ReachCut,
    /// Use the target as the label if the recording names one (default), instead of the end of the motion.
    pub use_target: bool,
    /// A hand below this speed is slow at the end of a trial, m/s; it covers tremor and tracker noise. Default 0.02.
    pub slow_m_per_s: f64,
    /// Shortest straight displacement of the touching point, m. Default 0.05.
    pub min_length_m: f64,
    /// Segmentation by speed. `None` (default): [`SegmentConfig::adapted`] to the recordings.
    pub segment: Option<SegmentConfig>,
}

impl Default for LabelConfig {
    fn default() -> Self {
        Self {
            point: None,
            cut: ReachCut::ByTrial,
            use_target: true,
            slow_m_per_s: 0.02,
            min_length_m: 0.05,
            segment: None,
        }
    }
}

/// A movement, or a part of one, that did not become a labelled reach.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// Person, trial (or the number of the recording, from 1) and time.
    pub what: String,
    /// Why it was left out.
    pub why: &'static str,
}

/// The reaches of some recordings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Labelled {
    /// All with the same touching point; each passes [`LabelledReach::validate`].
    pub reaches: Vec<LabelledReach>,
    /// For each reach, the index of its recording.
    pub recordings: Vec<usize>,
    /// Movements that were left out.
    pub left_out: Vec<LeftOut>,
}

/// Extracts the reaches of recordings, in order, with position and time of each end.
///
/// A trial starts at its [`ReachOnset`]. It ends when `contact` first becomes 1; without contact, when the hand is first slow after it was last
/// faster than a quarter of the trial's peak speed. The label is the target if the recording names one, otherwise the end of the touching point. If
/// the touching point is not seen at the end, another point replaces it, shifted by the last offset. A first sample far from the rest of the motion
/// is dropped and listed.
///
/// # Errors
/// A setting out of range; a recording that [`Recording::validate`] rejects. Recordings without any point of the hand give no reaches and are
/// listed.
pub fn labelled_reaches(
    recordings: &[Recording],
    config: &LabelConfig,
) -> Result<Labelled, HandError> {
    config.validate()?;
    for recording in recordings {
        recording.validate()?;
    }
    let mut labelled = Labelled::default();
    let Some(point) = config.point.or_else(|| touching_point(recordings)) else {
        let nothing = |(i, r)| LeftOut::new(r, i, None, "no point of the hand is seen");
        labelled.left_out = recordings.iter().enumerate().map(nothing).collect();
        return Ok(labelled);
    };
    let segment = match &config.segment {
        Some(segment) => segment.clone(),
        None => SegmentConfig::adapted(recordings),
    };
    for (number, recording) in recordings.iter().enumerate() {
        let mut source = Source {
            recording,
            samples: &recording.samples,
            number,
            point,
            config,
            segment: &segment,
        };
        if leaps_at_start(source.samples, point) {
            let why = "the first sample is a leap away from the rest";
            let at_s = source.samples[0].frame.t_s;
            labelled
                .left_out
                .push(LeftOut::new(recording, number, Some(at_s), why));
            source.samples = &source.samples[1..];
        }
        source.label(&mut labelled);
    }
    Ok(labelled)
}

impl SegmentConfig {
    /// Segmentation for recordings without prior knowledge.
    ///
    /// First finds all movements of at least 5 cm and 0.15 m/s. A reach must then have at least half the 90th percentile of their lengths and at
    /// least a fifth of the 90th percentile of their peak speeds. Frozen poses are detected if three points or more are tracked: the distance
    /// between two may stay constant in a live hand.
    #[must_use]
    pub fn adapted(recordings: &[Recording]) -> Self {
        let tracked = HandPoint::ALL
            .into_iter()
            .filter(|&p| share_seen(recordings, p) > 0.5)
            .count();
        let wide = Self {
            onset_m_per_s: TRIAL_ONSET_M_PER_S,
            min_length_m: TRIAL_LENGTH_M,
            freeze: (tracked >= 3).then(FreezeConfig::default),
            ..Self::default()
        };
        let mut found: Vec<Reach> = Vec::new();
        for recording in recordings {
            found.extend(find_reaches(recording, &wide));
        }
        found.retain(|reach| reach.end != ReachEnd::TrackingLost);
        let most = |value: fn(&Reach) -> f64| {
            let mut values: Vec<f64> = found.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            let place = (0.9 * values.len() as f64) as usize;
            values.get(place).copied().unwrap_or(0.0)
        };
        Self {
            onset_m_per_s: TRIAL_ONSET_M_PER_S.max(0.2 * most(|r| r.peak_speed_m_per_s)),
            min_length_m: TRIAL_LENGTH_M.max(0.5 * most(|r| r.length_m)),
            ..wide
        }
    }
}

impl LabelConfig {
    fn validate(&self) -> Result<(), ArgumentError> {
        non_negative("slow_m_per_s", self.slow_m_per_s)?;
        positive("min_length_m", self.min_length_m)?;
        self.segment
            .as_ref()
            .map_or(Ok(()), SegmentConfig::validate)
    }
}

impl LeftOut {
    fn new(recording: &Recording, number: usize, at_s: Option<f64>, why: &'static str) -> Self {
        let trial = name(recording, number, at_s);
        let what = match &recording.person {
            Some(person) => format!("{person}/{trial}"),
            None => trial,
        };
        Self { what, why }
    }
}

/// Trial or number of the recording (from 1), and a time in it.
fn name(recording: &Recording, number: usize, at_s: Option<f64>) -> String {
    let trial = recording.trial.clone();
    let trial = trial.unwrap_or_else(|| format!("recording {}", number + 1));
    match at_s {
        Some(at_s) => format!("{trial} at {at_s:.2} s"),
        None => trial,
    }
}

/// A recording, possibly without its first sample.
struct Source<'a> {
    recording: &'a Recording,
    samples: &'a [Sample],
    number: usize,
    point: HandPoint,
    config: &'a LabelConfig,
    segment: &'a SegmentConfig,
}

impl Source<'_> {
    fn label(&self, labelled: &mut Labelled) {
        let mut ends = Ends::new(self);
        let one_trial = self.config.cut == ReachCut::ByTrial && self.recording.trial.is_some();
        if one_trial {
            let reach = self
                .trial()
                .and_then(|(first, last)| self.reach(first, last, &mut ends));
            self.keep(reach, None, labelled);
            return;
        }
        let recording = Recording {
            samples: self.samples.to_vec(),
            ..Recording::default()
        };
        let mut found = find_reaches(&recording, self.segment);
        if found.is_empty() {
            self.keep(Err("no reach in it"), None, labelled);
        }
        let first_only = self.config.cut == ReachCut::First;
        if first_only {
            found.truncate(1);
        }
        for reach in found {
            let start_s = reach.start_s;
            let cut = match reach.end {
                ReachEnd::TrackingLost => Err("the tracker loses the hand"),
                // A single-trial file may end at the contact.
                ReachEnd::RecordingEnded if !first_only => Err("the hand does not stop"),
                _ => {
                    let (first, last) = if first_only {
                        self.with_short_rests(reach.first, reach.last)
                    } else {
                        (reach.first, reach.last)
                    };
                    let contact = rising_contact(&self.samples[first..=last]);
                    self.reach(first, contact.map_or(last, |c| first + c), &mut ends)
                }
            };
            let name = (!first_only || self.recording.trial.is_none()).then_some(start_s);
            self.keep(cut, name, labelled);
        }
    }

    fn keep(
        &self,
        reach: Result<LabelledReach, &'static str>,
        start_s: Option<f64>,
        labelled: &mut Labelled,
    ) {
        match reach {
            Ok(reach) => {
                labelled.recordings.push(self.number);
                labelled.reaches.push(LabelledReach {
                    trial: Some(name(self.recording, self.number, start_s)),
                    ..reach
                });
            }
            Err(why) => {
                let left_out = LeftOut::new(self.recording, self.number, start_s, why);
                labelled.left_out.push(left_out);
            }
        }
    }

    /// First and last sample of the movement of a trial.
    fn trial(&self) -> Result<(usize, usize), &'static str> {
        let contact = rising_contact(self.samples);
        if contact.is_none() && self.samples.iter().any(|s| s.contact == Some(true)) {
            return Err("in contact from the first sample on");
        }
        let seen_until = contact.map_or(self.samples.len(), |c| c + 1);
        let mut touching = TouchingPoint::new(self.point, [None; 6]);
        let mut knots: Vec<Knot> = Vec::new();
        for (index, sample) in self.samples[..seen_until].iter().enumerate() {
            if let Some(position_m) = touching.locate(&sample.frame.points()) {
                knots.push(Knot::new(index, sample.frame.t_s, position_m));
            }
        }
        let knots = measured(knots);
        if knots.len() < 2 {
            return Err("the touching point is not seen");
        }
        let jump = |w: &[Knot]| w[1].jumps_from(&w[0]);
        if knots.windows(2).any(jump) {
            return Err("the tracker jumps");
        }
        let speeds = speeds(&knots);
        let peak = speeds.iter().fold(0.0, |m: f64, &v| m.max(v));
        let slow = (SLOW_SHARE * peak).max(self.config.slow_m_per_s);
        let Some([start, clear]) = ReachOnset::of_peak(peak).find(&speeds) else {
            return Err("the hand does not move");
        };
        // After the last clear movement, because noise at rest may also exceed the slow speed.
        let last_clear = speeds
            .iter()
            .rposition(|&v| v >= CLEAR_SHARE * peak && v > slow)
            .unwrap_or(clear);
        // The configured slow speed may exceed this hand's peak.
        let rest = speeds[last_clear..].iter().skip(1).position(|&v| v <= slow);
        let end = rest.map_or(speeds.len() - 1, |after| last_clear + after);
        let moving = (knots[start].index, knots[end].index);
        let (first, last) = self.with_short_rests(moving.0, moving.1);
        Ok((first, contact.unwrap_or(last)))
    }

    /// Extends a movement to the ends of the recording if they are near.
    fn with_short_rests(&self, first: usize, last: usize) -> (usize, usize) {
        let t_s = |at: usize| self.samples[at].frame.t_s;
        let end = self.samples.len() - 1;
        // The slow flanks of a movement scale with its duration.
        let short_s = SHORTEST_REST_S + SLOW_FLANK * (t_s(last) - t_s(first));
        let is_short = |rest_s: f64| rest_s < short_s;
        (
            if is_short(t_s(first) - t_s(0)) {
                0
            } else {
                first
            },
            if is_short(t_s(end) - t_s(last)) {
                end
            } else {
                last
            },
        )
    }

    /// The reach between two samples, or the reason for rejecting it.
    fn reach(
        &self,
        first: usize,
        last: usize,
        ends: &mut Ends<'_>,
    ) -> Result<LabelledReach, &'static str> {
        let samples = &self.samples[first..=last];
        let positions: Vec<DVec3> = samples
            .iter()
            .filter_map(|s| s.frame.point(self.point))
            .collect();
        if positions.len() < MIN_SAMPLES {
            return Err("too few samples of the touching point");
        }
        let end_m = ends.at(last);
        let target_m = samples.iter().rev().find_map(|s| s.target_m);
        let contact_m = match target_m.filter(|_| self.config.use_target) {
            Some(target_m) => target_m,
            None => end_m.ok_or("the touching point is not seen at the end")?,
        };
        let way_m = positions[0].distance(end_m.unwrap_or(positions[positions.len() - 1]));
        if way_m < self.config.min_length_m {
            return Err("the hand ends where it starts");
        }
        let reach = LabelledReach {
            person: self.recording.person.clone(),
            trial: self.recording.trial.clone(),
            point: self.point,
            frames: samples.iter().map(|s| s.frame).collect(),
            contact_m,
            contact_s: samples[samples.len() - 1].frame.t_s,
            normal: None,
        };
        reach
            .validate()
            .map(|()| reach)
            .map_err(|_| "nothing can be learnt from it")
    }
}

/// Locates the touching point in samples queried in order of time; each sample is processed once, however many reaches a recording has.
struct Ends<'a> {
    samples: &'a [Sample],
    touching: TouchingPoint,
    /// Next sample to process, and last time and position of the point.
    next: usize,
    latest: Option<(f64, DVec3)>,
}

impl<'a> Ends<'a> {
    fn new(source: &Source<'a>) -> Self {
        Self {
            samples: source.samples,
            touching: TouchingPoint::new(source.point, [None; 6]),
            next: 0,
            latest: None,
        }
    }

    /// Position of the touching point in a sample; if it is not seen, from another point and the last offset, or from a slightly earlier sample.
    fn at(&mut self, last: usize) -> Option<DVec3> {
        while self.next <= last {
            let sample = &self.samples[self.next];
            let position_m = self.touching.locate(&sample.frame.points());
            self.latest = position_m.map(|p| (sample.frame.t_s, p)).or(self.latest);
            self.next += 1;
        }
        let (t_s, end_m) = self.latest?;
        let ago_s = self.samples[last].frame.t_s - t_s;
        (ago_s <= MAX_GAP_S).then_some(end_m)
    }
}

/// The first sample in which `contact` changes to 1.
fn rising_contact(samples: &[Sample]) -> Option<usize> {
    let touches = |s: &Sample| s.contact == Some(true);
    (1..samples.len()).find(|&i| touches(&samples[i]) && !touches(&samples[i - 1]))
}

/// Does the point jump after its first sample?
fn leaps_at_start(samples: &[Sample], point: HandPoint) -> bool {
    let mut seen = samples.iter().filter_map(|s| s.frame.point(point));
    if samples.first().and_then(|s| s.frame.point(point)).is_none() {
        return false;
    }
    let positions: Vec<DVec3> = seen.by_ref().take(STEPS_AFTER_LEAP + 2).collect();
    let step = |i: usize| positions[i].distance(positions[i + 1]);
    if positions.len() < STEPS_AFTER_LEAP + 2 {
        return false;
    }
    let after = (1..=STEPS_AFTER_LEAP).map(step).fold(0.0, f64::max);
    step(0) > LEAST_LEAP_M && step(0) > LEAP * after
}

/// Share of the samples that show a point.
fn share_seen(recordings: &[Recording], point: HandPoint) -> f64 {
    let frames = || recordings.iter().flat_map(Recording::frames);
    let seen = frames().filter(|f| f.point(point).is_some()).count();
    seen as f64 / (frames().count().max(1)) as f64
}

fn touching_point(recordings: &[Recording]) -> Option<HandPoint> {
    if share_seen(recordings, HandPoint::Index) >= 0.5 {
        return Some(HandPoint::Index);
    }
    // `max_by` keeps the last of equals.
    let best = HandPoint::BY_CONTACT
        .into_iter()
        .rev()
        .max_by(|&a, &b| share_seen(recordings, a).total_cmp(&share_seen(recordings, b)))?;
    (share_seen(recordings, best) > 0.0).then_some(best)
}
