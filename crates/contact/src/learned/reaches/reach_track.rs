//! The reach so far as a feature vector for the regression of its end.

use crate::reach_set::{mean, mean_offsets_m};
use crate::slope::slope;
use glam::{DMat3, DVec3};
use hwall_hand::reach::TouchingPoint;
use hwall_hand::{HandFrame, HandPoint, LabelledReach, NamedPoint, ReachOnset};
use std::ops::Range;

/// Shortest lag at which past positions are compared with the present one, s; each next lag is twice as long.
const FIRST_LAG_S: f64 = 0.03;
/// Largest number of lags: nearly four seconds.
pub(in crate::learned) const MOST_LAGS: usize = 8;
/// Past displacements are scaled to this much time, so that all have a similar size.
const HORIZON_S: f64 = 0.2;
/// Times over which the motion of other points is measured, s.
const MOTION_LAGS_S: [f64; 2] = [0.06, 0.2];
/// The speed is the slope over this much of the past, s.
const SPEED_WINDOW_S: f64 = 0.05;
/// An input is used if at least this share of the training samples has it.
const USUALLY_SEEN: f64 = 0.8;
/// One in this many reaches is slower than the onset is designed for.
const SLOWEST: usize = 10;
/// Number of samples of one reach that are kept; older ones are only needed for the lags.
const KEPT: usize = 512;
/// Number of scalars that describe the progress of a reach.
pub(in crate::learned) const PROGRESS: usize = 4;

/// The inputs of a regression: the touching point and everything else that was seen in most samples.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::learned) struct Inputs {
    pub(in crate::learned) point: HandPoint,
    /// Other points, relative to the touching one.
    pub(in crate::learned) others: Vec<NamedPoint>,
    pub(in crate::learned) head: bool,
    pub(in crate::learned) gaze: bool,
    /// Number of past positions that are compared with the present one.
    pub(in crate::learned) lags: usize,
    /// Mean offset of the touching point from every point, m; used early in a reach if one of them is missing.
    pub(in crate::learned) offsets_m: [Option<DVec3>; NamedPoint::COUNT],
    /// Detects the onset of a reach independently of the segmentation; `None` without training reaches.
    pub(in crate::learned) onset: Option<ReachOnset>,
    /// Mean head position relative to the touching point, and mean gaze; used until they are seen.
    pub(in crate::learned) head_m: DVec3,
    pub(in crate::learned) mean_gaze: DVec3,
}

/// An input that a model may require in addition to the touching point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::learned) enum Cue {
    Point(NamedPoint),
    Head,
    Gaze,
}

impl Inputs {
    /// All inputs other than the touching point.
    pub(in crate::learned) fn cues(&self) -> impl Iterator<Item = Cue> + '_ {
        let points = self.others.iter().copied().map(Cue::Point);
        let head = self.head.then_some(Cue::Head);
        points.chain(head).chain(self.gaze.then_some(Cue::Gaze))
    }

    /// The common inputs of the reaches. The touching point is the most frequent one.
    pub(in crate::learned) fn of(reaches: &[&LabelledReach], use_gaze: bool, lags: usize) -> Self {
        let touching = |p: HandPoint| reaches.iter().filter(|r| r.point == p).count();
        // `max_by_key` keeps the last of equals: the first in `BY_CONTACT`.
        let order = HandPoint::BY_CONTACT.into_iter().rev();
        let point = order
            .max_by_key(|&p| touching(p))
            .unwrap_or(HandPoint::Index);
        let frames = || reaches.iter().flat_map(|r| &r.frames);
        let total = frames().count() as f64;
        let typical = |seen: &dyn Fn(&HandFrame) -> bool| {
            frames().filter(|f| seen(f)).count() as f64 >= USUALLY_SEEN * total
        };
        let others = NamedPoint::ALL
            .into_iter()
            .filter(|&p| p != NamedPoint::Hand(point) && typical(&|f| f.named(p).is_some()))
            .collect();
        let head = |f: &HandFrame| f.gaze_ray().map(|g| g.origin_m).or(head_of(f));
        let gaze = |f: &HandFrame| f.gaze_ray().map(|g| g.direction);
        let inputs = Self {
            point,
            others,
            head: typical(&|f| head(f).is_some()),
            gaze: use_gaze && typical(&|f| gaze(f).is_some()),
            lags,
            offsets_m: mean_offsets_m(reaches, point),
            head_m: mean(reaches, |f| Some(head(f)? - f.point(point)?)).unwrap_or(DVec3::ZERO),
            mean_gaze: mean(reaches, gaze).unwrap_or(DVec3::ZERO),
            onset: None,
        };
        let mut peaks: Vec<f64> = reaches.iter().map(|r| inputs.peak_m_per_s(r)).collect();
        peaks.sort_by(f64::total_cmp);
        let slowest = peaks.get(peaks.len() / SLOWEST);
        let onset = slowest.map(|peak| ReachOnset::of_peak(*peak));
        Self { onset, ..inputs }
    }

    /// Largest speed of the touching point in a reach, m/s.
    fn peak_m_per_s(&self, reach: &LabelledReach) -> f64 {
        let mut track = ReachTrack::new(self);
        reach.frames.iter().for_each(|frame| {
            track.push(frame);
        });
        track.peak.0
    }

    /// Onset of a segmented reach, s; the first sample that shows the hand if it never clearly moves.
    pub(in crate::learned) fn start_s(&self, reach: &LabelledReach) -> f64 {
        let mut track = ReachTrack::new(self);
        let mut first_s = None;
        for frame in &reach.frames {
            if track.push(frame) {
                first_s.get_or_insert(frame.t_s);
            }
            if track.has_started {
                break;
            }
        }
        let start = track.start.filter(|_| track.has_started);
        start.map(|start| start.0).or(first_s).unwrap_or(0.0)
    }

    /// The offsets from points of the hand, m.
    fn hand_offsets_m(&self) -> [Option<DVec3>; 6] {
        HandPoint::ALL.map(|p| self.offsets_m[NamedPoint::Hand(p).index()])
    }

    fn lags_s(&self) -> impl Iterator<Item = f64> {
        (0..self.lags).map(|k| FIRST_LAG_S * f64::from(1 << k))
    }

    pub(in crate::learned) fn points(&self) -> usize {
        1 + self.others.len()
    }

    /// Blocks of columns of the feature vector, in order.
    pub(in crate::learned) fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let mut push = |kind, width| {
            let first = blocks.last().map_or(0, |b: &Block| b.columns.end);
            blocks.push(Block {
                kind,
                columns: first..first + width,
            });
        };
        push(BlockKind::Path, 3 * (1 + self.lags) + SCALARS);
        push(BlockKind::Start, 3);
        if self.head {
            push(BlockKind::HeadPlace, 3);
            push(BlockKind::HeadMotion, 3 * (1 + MOTION_LAGS_S.len()));
        }
        if self.gaze {
            push(BlockKind::Gaze, 3);
        }
        for &other in &self.others {
            push(BlockKind::Place(other), 3);
            push(BlockKind::Motion(other), 3 * MOTION_LAGS_S.len());
        }
        blocks
    }

    /// Length of the feature vector.
    pub(in crate::learned) fn width(&self) -> usize {
        self.blocks().last().map_or(0, |b| b.columns.end)
    }
}

/// Columns of the feature vector that are used or left out together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::learned) struct Block {
    pub(in crate::learned) kind: BlockKind,
    pub(in crate::learned) columns: Range<usize>,
}

/// Content of a block of columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::learned) enum BlockKind {
    /// Displacement of the touching point since the start, its lags, speeds and times.
    Path,
    /// Start of the reach in the room.
    Start,
    /// Position of the head at the start, relative to the hand.
    HeadPlace,
    /// Displacement of the head since the start, and its motion.
    HeadMotion,
    /// The direction of gaze.
    Gaze,
    /// Position of another point relative to the touching one.
    Place(NamedPoint),
    /// Motion of that point relative to the touching one.
    Motion(NamedPoint),
}

impl BlockKind {
    /// The input that it needs in addition to the touching point.
    pub(in crate::learned) const fn cue(self) -> Option<Cue> {
        match self {
            Self::Path | Self::Start => None,
            Self::HeadPlace | Self::HeadMotion => Some(Cue::Head),
            Self::Gaze => Some(Cue::Gaze),
            Self::Place(point) | Self::Motion(point) => Some(Cue::Point(point)),
        }
    }
}

/// Time, speed, peak speed, their ratio, distance from the start, time since the peak.
const SCALARS: usize = 6;

fn head_of(frame: &HandFrame) -> Option<DVec3> {
    frame.head_m.filter(|h| h.is_finite())
}

/// Inputs other than the touching point in one sample.
#[derive(Debug, Clone, Copy)]
struct Beside {
    head_m: Option<DVec3>,
    relative_m: [Option<DVec3>; NamedPoint::COUNT],
}

/// One reach from its start to now. A missing finger does not stop the prediction.
#[derive(Debug, Clone)]
pub(in crate::learned) struct ReachTrack {
    /// Times, s, and positions of the touching point, m.
    history: Vec<(f64, DVec3)>,
    /// Head and other points, relative to the touching one, at the same times.
    beside: Vec<Beside>,
    start: Option<(f64, DVec3)>,
    onset: Option<ReachOnset>,
    /// Has the hand clearly moved? Until then the start is the last sample at which it was slow.
    has_started: bool,
    touching: TouchingPoint,
    /// The other points relative to the touching point, as last seen, m; by [`NamedPoint`].
    relative_m: [Option<DVec3>; NamedPoint::COUNT],
    head_m: Option<DVec3>,
    /// First seen position of the head, m.
    start_head_m: Option<DVec3>,
    gaze: Option<DVec3>,
    velocity_m_per_s: DVec3,
    /// Largest speed so far, m/s, and when it was reached, s.
    peak: (f64, f64),
}

impl ReachTrack {
    pub(in crate::learned) fn new(inputs: &Inputs) -> Self {
        Self {
            history: Vec::with_capacity(KEPT),
            beside: Vec::with_capacity(KEPT),
            start: None,
            onset: inputs.onset,
            has_started: false,
            touching: TouchingPoint::new(inputs.point, inputs.hand_offsets_m()),
            relative_m: [None; NamedPoint::COUNT],
            head_m: None,
            start_head_m: None,
            gaze: None,
            velocity_m_per_s: DVec3::ZERO,
            peak: (0.0, 0.0),
        }
    }

    pub(in crate::learned) fn begin(&mut self) {
        self.history.clear();
        self.beside.clear();
        self.start = None;
        self.has_started = false;
        self.start_head_m = None;
        self.touching.begin();
        self.relative_m = [None; NamedPoint::COUNT];
        (self.head_m, self.gaze) = (None, None);
        self.velocity_m_per_s = DVec3::ZERO;
        self.peak = (0.0, 0.0);
    }

    /// Takes a sample; returns whether it adds anything. A sample not later than the last one is ignored.
    pub(in crate::learned) fn push(&mut self, frame: &HandFrame) -> bool {
        let t_s = frame.t_s;
        let late_enough = self.history.last().is_none_or(|last| t_s > last.0);
        if !t_s.is_finite() || !late_enough {
            return false;
        }
        let points = frame.points();
        let Some(position_m) = self.touching.locate(&points) else {
            return false;
        };
        for (relative_m, which) in self.relative_m.iter_mut().zip(NamedPoint::ALL) {
            let seen_m = frame.named(which);
            *relative_m = seen_m.map(|seen_m| seen_m - position_m).or(*relative_m);
        }
        self.head_m = frame
            .gaze_ray()
            .map(|g| g.origin_m)
            .or(head_of(frame))
            .or(self.head_m);
        self.gaze = frame.gaze_ray().map(|g| g.direction).or(self.gaze);
        if self.history.len() == KEPT {
            self.history.drain(..KEPT / 2);
            self.beside.drain(..KEPT / 2);
        }
        self.beside.push(Beside {
            head_m: self.head_m,
            relative_m: self.relative_m,
        });
        self.start_head_m = self.start_head_m.or(self.head_m);
        self.history.push((t_s, position_m));
        self.start.get_or_insert((t_s, position_m));
        self.velocity_m_per_s = self.velocity_m_per_s();
        let speed = self.velocity_m_per_s.length();
        if let Some(onset) = self.onset.filter(|_| !self.has_started) {
            if onset.is_slow(speed) {
                self.start = Some((t_s, position_m));
                self.start_head_m = self.head_m;
                self.peak = (0.0, t_s);
            }
            self.has_started = onset.is_clear(speed);
        }
        if speed > self.peak.0 {
            self.peak = (speed, t_s);
        }
        true
    }

    /// Time since the first sample of the reach, s.
    pub(in crate::learned) fn followed_s(&self) -> f64 {
        match (self.history.first(), self.history.last()) {
            (Some(first), Some(last)) => last.0 - first.0,
            _ => 0.0,
        }
    }

    pub(in crate::learned) fn has_seen(&self, cue: Cue) -> bool {
        match cue {
            Cue::Point(point) => self.relative_m[point.index()].is_some(),
            Cue::Head => self.head_m.is_some(),
            Cue::Gaze => self.gaze.is_some(),
        }
    }

    /// Is the latest sample the start of the reach?
    pub(in crate::learned) fn is_at_start(&self) -> bool {
        self.now() == self.start
    }

    /// Time and position of the touching point now; `None` before the first sample.
    pub(in crate::learned) fn now(&self) -> Option<(f64, DVec3)> {
        self.history.last().copied()
    }

    /// Positions of all used points, the touching one first, m; a point not seen now keeps its last offset from the touching one.
    pub(in crate::learned) fn points_into(&self, inputs: &Inputs, out: &mut Vec<f64>) {
        out.clear();
        let Some((_, now_m)) = self.now() else { return };
        out.extend(now_m.to_array());
        for &other in &inputs.others {
            out.extend((now_m + self.relative(inputs, other)).to_array());
        }
    }

    fn relative(&self, inputs: &Inputs, other: NamedPoint) -> DVec3 {
        let typical_m = || inputs.offsets_m[other.index()].map_or(DVec3::ZERO, |o| -o);
        self.relative_m[other.index()].unwrap_or_else(typical_m)
    }

    /// Time and position of the start.
    pub(in crate::learned) fn start(&self) -> Option<(f64, DVec3)> {
        self.start
    }

    /// Slope over the last samples, m/s; zero for a single one.
    fn velocity_m_per_s(&self) -> DVec3 {
        let n = self.history.len();
        let since = self.history[n - 1].0 - SPEED_WINDOW_S;
        // At least two samples, however slow the tracker.
        let back = self.history.iter().rev().take_while(|h| h.0 >= since);
        let window = &self.history[n - back.count().max(2).min(n)..];
        slope(window.iter().copied())
    }

    /// Position of the touching point at a time, m, interpolated linearly between samples; the first one for earlier times.
    fn before(&self, t_s: f64) -> DVec3 {
        let next = self.history.iter().rposition(|h| h.0 <= t_s);
        let Some(k) = next else {
            return self.history[0].1;
        };
        match self.history.get(k + 1) {
            Some(b) => {
                let a = self.history[k];
                a.1.lerp(b.1, (t_s - a.0) / (b.0 - a.0))
            }
            None => self.history[k].1,
        }
    }

    /// Progress of the reach: time, distance from the start, speed, speed over its peak.
    pub(in crate::learned) fn progress(&self) -> [f64; PROGRESS] {
        let (Some((t_s, now_m)), Some((start_s, start_m))) = (self.now(), self.start) else {
            return [0.0; PROGRESS];
        };
        let speed = self.velocity_m_per_s.length();
        [
            t_s - start_s,
            now_m.distance(start_m),
            speed,
            speed / self.peak.0.max(1e-9),
        ]
    }

    /// An input other than the touching point this long ago, or at the first sample, and its age; `None` if not seen then.
    fn earlier<T>(&self, ago_s: f64, seen: impl Fn(&Beside) -> Option<T>) -> Option<(f64, T)> {
        let (now_s, _) = self.now()?;
        let k = self.history.iter().rposition(|h| h.0 <= now_s - ago_s);
        let k = k.unwrap_or(0);
        let since_s = now_s - self.history.get(k)?.0;
        Some((since_s, seen(self.beside.get(k)?)?))
    }

    /// Displacement of an input other than the touching point over `HORIZON_S`, extrapolated from its motion over `lag_s`, m; zero while unknown.
    fn moves(&self, lag_s: f64, seen: impl Fn(&Beside) -> Option<DVec3>) -> DVec3 {
        let now = self.beside.last().and_then(&seen);
        match (now, self.earlier(lag_s, seen)) {
            // Early in a reach less time than the lag has passed; divide by the lag all the same, as the hand was at rest before.
            (Some(now), Some((since_s, then))) => (now - then) * (HORIZON_S / since_s.max(lag_s)),
            _ => DVec3::ZERO,
        }
    }

    /// The features, in m or of comparable size, in the order of [`Inputs::blocks`].
    pub(in crate::learned) fn features_into(&self, inputs: &Inputs, out: &mut Vec<f64>) {
        out.clear();
        let (Some((t_s, now_m)), Some((start_s, start_m))) = (self.now(), self.start) else {
            out.resize(inputs.width(), 0.0);
            return;
        };
        out.extend((now_m - start_m).to_array());
        for lag_s in inputs.lags_s() {
            let moved_m = (now_m - self.before(t_s - lag_s)) * (HORIZON_S / lag_s);
            out.extend(moved_m.to_array());
        }
        let [elapsed_s, gone_m, speed, of_peak] = self.progress();
        out.extend([
            elapsed_s,
            speed * HORIZON_S,
            self.peak.0 * HORIZON_S,
            of_peak,
            gone_m,
            t_s - self.peak.1.max(start_s),
        ]);
        out.extend(start_m.to_array());
        if inputs.head {
            let from_m = self.start_head_m.unwrap_or(start_m + inputs.head_m);
            out.extend((from_m - start_m).to_array());
            out.extend((self.head_m.unwrap_or(from_m) - from_m).to_array());
            for lag_s in MOTION_LAGS_S {
                out.extend(self.moves(lag_s, |b| b.head_m).to_array());
            }
        }
        if inputs.gaze {
            out.extend(self.gaze.unwrap_or(inputs.mean_gaze).to_array());
        }
        for &other in &inputs.others {
            out.extend(self.relative(inputs, other).to_array());
            for lag_s in MOTION_LAGS_S {
                let moves = self.moves(lag_s, |b| b.relative_m[other.index()]);
                out.extend(moves.to_array());
            }
        }
    }
}

/// Axes along which errors of an end point differ: from the start towards the end, horizontal and across it, and across both. Columns are unit
/// vectors in the frame of the samples.
///
/// People miss more along their path than across it. "Horizontal" means orthogonal to z, which is wrong in a y-up frame, but any fixed choice works
/// as long as training and use share it.
pub(in crate::learned) fn way_axes(start_m: DVec3, end_m: DVec3) -> DMat3 {
    let ahead = (end_m - start_m).try_normalize().unwrap_or(DVec3::X);
    let level = ahead
        .cross(DVec3::Z)
        .try_normalize()
        .unwrap_or_else(|| ahead.any_orthonormal_vector());
    DMat3::from_cols(ahead, level, ahead.cross(level))
}
