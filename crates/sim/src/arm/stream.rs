//! The commanded motion, interpolated from a stream of positions.

use hwall_kinematics::JointPositions;
use hwall_motion::{JointBounds, JointPoint};
use std::collections::VecDeque;

/// Commands within this interval are a stream, s: a position interface at 8 ms, with tolerance for a late command.
const STREAM_S: f64 = 0.02;
/// A stream has a corner where its velocity changes by more than this many times what the joint can do.
const CORNER: f64 = 4.0;
/// The change must also exceed the change caused by noise: a displacement of this size, rad.
const CORNER_RAD: f64 = 5e-5;
/// Averaging time of a stream with a corner at every command, s.
const AVERAGE_S: f64 = 8e-3;
/// Rounding of clocks and angles allowed in a feasible stream, as a fraction of the velocity and acceleration limits; for jerk, a hundred times
/// this fraction.
const ROUNDING: f64 = 1e-6;
/// Index of the command in force; the two commands before it are kept for the slopes.
const IN_FORCE: usize = 2;

/// A command, its time of effect, and its relation to its neighbours.
#[derive(Debug, Clone, Copy)]
struct Knot {
    effect_s: f64,
    /// `None` brakes to rest.
    target: Option<JointPositions>,
    /// True if this command continues a stream.
    joined: bool,
    /// One bit per joint: the stream begins, ends or has a corner here.
    corners: u8,
}

impl Knot {
    const NONE: Self = Self {
        effect_s: f64::NEG_INFINITY,
        target: None,
        joined: false,
        corners: !0,
    };

    fn is_corner(&self, joint: usize) -> bool {
        self.corners & (1 << joint) != 0
    }

    fn q_rad(&self, joint: usize) -> f64 {
        self.target.map_or(f64::NAN, |q| q[joint])
    }
}

/// The commanded motion from the command in force on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    pub(super) start_s: f64,
    /// When the next command takes effect, or when extrapolation of the last one ends.
    pub(super) end_s: f64,
    /// Coefficients of powers of the time since the start.
    cubics: [[f64; 4]; 7],
    /// One bit per joint: a motion within the limits can pass through the surrounding commands.
    feasible: u8,
    moving: bool,
}

impl Segment {
    fn resting(start_s: f64, end_s: f64, q: &JointPositions) -> Self {
        Self {
            start_s,
            end_s,
            cubics: q.0.map(|q| [q, 0.0, 0.0, 0.0]),
            feasible: 0,
            moving: false,
        }
    }

    /// True if the commanded position changes during the segment.
    pub(super) const fn is_moving(&self) -> bool {
        self.moving
    }

    pub(super) fn is_feasible(&self, joint: usize) -> bool {
        self.feasible & (1 << joint) != 0
    }

    pub(super) fn at(&self, joint: usize, t_s: f64) -> JointPoint {
        let [c0, c1, c2, c3] = self.cubics[joint];
        let t = t_s.min(self.end_s) - self.start_s;
        JointPoint::new(
            c0 + t * (c1 + t * (c2 + t * c3)),
            c1 + t * (2.0 * c2 + t * 3.0 * c3),
            2.0 * c2 + 6.0 * c3 * t,
        )
    }
}

/// The commands, ordered by their time of effect.
///
/// Between two commands of a stream the commanded motion is a cubic through both, with slopes from four commands where the stream is smooth.
/// So the motion towards a command starts when the previous one takes effect: a stream command gives the position at its time of effect.
#[derive(Debug)]
pub(super) struct Stream {
    /// Two past commands, the one in force, and the pending ones, in this order.
    knots: VecDeque<Knot>,
    capacity: usize,
    delay_s: f64,
    bounds: [JointBounds; 7],
    /// Mean slope of the latest commands, for streams with a corner at every command.
    mean_rad_per_s: [f64; 7],
    segment: Option<Segment>,
    outdated: bool,
}

impl Stream {
    /// Empty, with at most `capacity` pending commands.
    pub(super) fn new(capacity: usize, delay_s: f64, bounds: [JointBounds; 7]) -> Self {
        let mut knots = VecDeque::with_capacity(capacity + IN_FORCE + 1);
        knots.extend([Knot::NONE; IN_FORCE + 1]);
        Self {
            knots,
            capacity,
            delay_s,
            bounds,
            mean_rad_per_s: [0.0; 7],
            segment: None,
            outdated: false,
        }
    }

    /// Adds a command; `false` if too many are pending. Of two commands at one instant the later one wins.
    pub(super) fn push(&mut self, effect_s: f64, target: Option<JointPositions>) -> bool {
        if self.waiting().is_some() && self.knots.back().is_some_and(|k| k.effect_s == effect_s) {
            self.knots.pop_back();
        }
        let place = self.knots.len();
        if place > IN_FORCE + self.capacity {
            return false;
        }
        let before = self.knots[place - 1];
        let period_s = effect_s - before.effect_s;
        let knot = Knot {
            effect_s,
            target,
            joined: before.target.is_some()
                && target.is_some()
                && period_s > 0.0
                && period_s <= STREAM_S,
            corners: !0,
        };
        let corners = self.corners(&self.knots[place - 2], &before, &knot);
        self.knots[place - 1].corners = corners;
        self.knots.push_back(knot);
        self.outdated |= place <= IN_FORCE + 2;
        true
    }

    /// Joints whose slope at a knot changes by more than the joint can follow.
    fn corners(&self, before: &Knot, knot: &Knot, after: &Knot) -> u8 {
        if !(knot.joined && after.joined) {
            return !0;
        }
        let (h0, h1) = (
            knot.effect_s - before.effect_s,
            after.effect_s - knot.effect_s,
        );
        let mut corners = 0;
        for (i, bounds) in self.bounds.iter().enumerate() {
            let (q0, q1, q2) = (before.q_rad(i), knot.q_rad(i), after.q_rad(i));
            let change = (q2 - q1) / h1 - (q1 - q0) / h0;
            let most = CORNER * bounds.acceleration_rad_per_s2() * 0.5 * (h0 + h1)
                + CORNER_RAD * (1.0 / h0 + 1.0 / h1);
            corners |= u8::from(change.abs() > most) << i;
        }
        corners
    }

    fn waiting(&self) -> Option<&Knot> {
        self.knots.get(IN_FORCE + 1)
    }

    /// Applies the commands that take effect up to a time and returns the commanded motion from then on; `None` means hold.
    pub(super) fn advance_to(&mut self, t_s: f64, rounding_s: f64) -> Option<&Segment> {
        while self
            .waiting()
            .is_some_and(|next| next.effect_s <= t_s + rounding_s)
        {
            self.knots.pop_front();
            self.average();
            self.outdated = true;
        }
        let ended = |s: &Segment| s.end_s <= t_s + rounding_s;
        if self.outdated || self.segment.as_ref().is_some_and(ended) {
            self.outdated = false;
            self.segment = self.build(t_s + rounding_s);
        }
        self.segment.as_ref()
    }

    /// Time of the next change of the commanded motion, s.
    pub(super) fn next_event_s(&self) -> f64 {
        let effect_s = self.waiting().map_or(f64::INFINITY, |next| next.effect_s);
        let end_s = self.segment.map_or(f64::INFINITY, |s| s.end_s);
        effect_s.min(end_s)
    }

    fn average(&mut self) {
        let (before, now) = (&self.knots[IN_FORCE - 1], &self.knots[IN_FORCE]);
        let period_s = now.effect_s - before.effect_s;
        let share = (period_s / AVERAGE_S).min(1.0);
        for (i, mean) in self.mean_rad_per_s.iter_mut().enumerate() {
            let slope = (now.q_rad(i) - before.q_rad(i)) / period_s;
            let follows = now.joined && slope.abs() <= 2.0 * self.bounds[i].velocity_rad_per_s();
            *mean = if follows {
                *mean + share * (slope - *mean)
            } else {
                0.0
            };
        }
    }

    fn build(&self, t_s: f64) -> Option<Segment> {
        let now = &self.knots[IN_FORCE];
        let q = now.target?;
        let start_s = now.effect_s;
        let Some(next) = self.waiting() else {
            return Some(self.open(start_s, t_s, &q));
        };
        if !next.joined {
            return Some(Segment::resting(start_s, next.effect_s, &q));
        }
        let mut segment = Segment::resting(start_s, next.effect_s, &q);
        // Where past or future knots are missing there is a corner, so the substitutes are not read.
        let after = self.knots.get(IN_FORCE + 2).unwrap_or(next);
        let [first, before] = [&self.knots[IN_FORCE - 2], &self.knots[IN_FORCE - 1]];
        let periods = [
            before.effect_s - first.effect_s,
            start_s - before.effect_s,
            next.effect_s - start_s,
            after.effect_s - next.effect_s,
        ];
        for (i, cubic) in segment.cubics.iter_mut().enumerate() {
            let q = [first, before, now, next, after].map(|knot| knot.q_rad(i));
            let smooth = [before, now, next].map(|knot| !knot.is_corner(i));
            let fit = Fit::new(&q, &periods, &smooth);
            let slopes = fit.slopes(&smooth);
            let (h, mean) = (periods[2], fit.secants[2]);
            *cubic = match slopes {
                Some([start, end]) => [
                    q[2],
                    start,
                    (3.0 * mean - 2.0 * start - end) / h,
                    (start + end - 2.0 * mean) / (h * h),
                ],
                None => [q[2], self.mean_rad_per_s[i], 0.0, 0.0],
            };
            segment.moving |= cubic[1] != 0.0 || cubic[2] != 0.0 || cubic[3] != 0.0;
            let feasible = smooth == [true; 3] && fit.is_within(&self.bounds[i]);
            segment.feasible |= u8::from(feasible) << i;
        }
        Some(segment)
    }

    /// The commanded motion when no command is pending. If the delay is too short to know the next command of a stream,
    /// the stream is extrapolated by one period.
    fn open(&self, start_s: f64, t_s: f64, q: &JointPositions) -> Segment {
        let (before, now) = (&self.knots[IN_FORCE - 1], &self.knots[IN_FORCE]);
        let period_s = start_s - before.effect_s;
        let end_s = start_s + period_s;
        if !now.joined || period_s <= self.delay_s || end_s <= t_s {
            return Segment::resting(start_s, f64::INFINITY, q);
        }
        let mut segment = Segment::resting(start_s, end_s, q);
        for (i, cubic) in segment.cubics.iter_mut().enumerate() {
            let secant = (now.q_rad(i) - before.q_rad(i)) / period_s;
            let most = self.bounds[i].velocity_rad_per_s();
            if secant.abs() <= 2.0 * most {
                cubic[1] = self.last_slope(IN_FORCE, i).0.clamp(-most, most);
                segment.moving |= cubic[1] != 0.0;
            }
        }
        segment
    }

    /// Slope and curvature of a joint at a knot that continues a stream, from the previous commands.
    fn last_slope(&self, place: usize, joint: usize) -> (f64, f64) {
        let knots = [place - 2, place - 1, place].map(|place| &self.knots[place]);
        let [q0, q1, q2] = knots.map(|knot| knot.q_rad(joint));
        let (h0, h1) = (
            knots[1].effect_s - knots[0].effect_s,
            knots[2].effect_s - knots[1].effect_s,
        );
        let secant = (q2 - q1) / h1;
        if knots[1].is_corner(joint) {
            return (secant, 0.0);
        }
        let bend = (secant - (q1 - q0) / h0) / (h0 + h1);
        (secant + bend * h1, 2.0 * bend)
    }

    /// The known commanded motion of a joint up to the next corner, or up to the latest command.
    pub(super) fn ahead(&self, segment: &Segment, joint: usize, t_s: f64) -> Ahead {
        let mut from = segment.at(joint, t_s);
        let mut least_s = 0.0;
        if !segment.is_feasible(joint) {
            // Noisy commands need a minimum interval for acceleration differences.
            least_s = NOISE_S;
            from.qdd_rad_per_s2 = 0.0;
        }
        let mut way = Way::new(from);
        let mut place = IN_FORCE;
        let mut begin = &self.knots[IN_FORCE];
        while let Some(next) = self.knots.get(place + 1).filter(|next| next.joined) {
            let corner = self.knots[place].is_corner(joint);
            if corner && (place > IN_FORCE || next.is_corner(joint)) {
                break;
            }
            place += 1;
            let period_s = next.effect_s - begin.effect_s;
            if period_s >= least_s {
                way.extend(next.q_rad(joint), period_s, begin.q_rad(joint));
                begin = next;
            }
        }
        way.ahead(&self.bounds[joint])
    }
}

/// Minimum interval for acceleration differences of infeasible commands, s.
const NOISE_S: f64 = 5e-3;

/// Finite differences along the commanded motion of one joint.
struct Way {
    end: JointPoint,
    /// Slope and length of the last piece, rad/s and s.
    piece: Option<[f64; 2]>,
    qdd_rad_per_s2: Option<f64>,
    range_rad_per_s2: [f64; 2],
    first_rad_per_s2: f64,
}

impl Way {
    fn new(from: JointPoint) -> Self {
        Self {
            end: from,
            piece: None,
            qdd_rad_per_s2: None,
            range_rad_per_s2: [f64::INFINITY, f64::NEG_INFINITY],
            first_rad_per_s2: from.qdd_rad_per_s2,
        }
    }

    fn extend(&mut self, to_rad: f64, period_s: f64, from_rad: f64) {
        let slope = (to_rad - from_rad) / period_s;
        self.end.q_rad = to_rad;
        self.end.qd_rad_per_s = slope;
        if let Some([before, before_s]) = self.piece {
            let qdd = 2.0 * (slope - before) / (before_s + period_s);
            // The difference is valid midway between two pieces; extrapolate it to the end.
            let per_s = self
                .qdd_rad_per_s2
                .map_or(0.0, |last| (qdd - last) / before_s);
            let end = qdd + per_s * 0.5 * (before_s + period_s);
            self.end.qd_rad_per_s += period_s * (0.5 * end - per_s * period_s / 6.0);
            self.end.qdd_rad_per_s2 = end;
            let [least, most] = self.range_rad_per_s2;
            self.range_rad_per_s2 = [least.min(qdd), most.max(qdd)];
            if self.qdd_rad_per_s2.is_none() {
                self.first_rad_per_s2 = qdd;
            }
            self.qdd_rad_per_s2 = Some(qdd);
        } else {
            self.end.qdd_rad_per_s2 = 0.0;
        }
        self.piece = Some([slope, period_s]);
    }

    fn ahead(mut self, bounds: &JointBounds) -> Ahead {
        let (v, a) = (
            bounds.velocity_rad_per_s(),
            bounds.acceleration_rad_per_s2(),
        );
        self.end.qd_rad_per_s = self.end.qd_rad_per_s.clamp(-v, v);
        self.end.qdd_rad_per_s2 = self.end.qdd_rad_per_s2.clamp(-a, a);
        let first = self.first_rad_per_s2.clamp(-a, a);
        let [least, most] = self.range_rad_per_s2;
        Ahead {
            rest_rad: self.end.stopping_point_rad(bounds),
            qdd_rad_per_s2: first,
            range_rad_per_s2: [least.clamp(-a, first), most.clamp(first, a)],
        }
    }
}

/// The known commanded motion of a joint from now on.
pub(super) struct Ahead {
    /// Where it would come to rest if it braked at the end, rad.
    pub(super) rest_rad: f64,
    /// Acceleration in the next milliseconds, rad/s².
    pub(super) qdd_rad_per_s2: f64,
    /// Smallest and largest acceleration up to its end, rad/s².
    pub(super) range_rad_per_s2: [f64; 2],
}

/// Divided differences of five commands; the third is the one in force.
struct Fit {
    periods: [f64; 4],
    secants: [f64; 4],
    /// Second differences at the three inner commands, zero at corners.
    bends: [f64; 3],
    /// Third differences that end and begin at the segment.
    twists: [f64; 2],
}

impl Fit {
    fn new(q: &[f64; 5], periods: &[f64; 4], smooth: &[bool; 3]) -> Self {
        let secants: [f64; 4] = std::array::from_fn(|k| (q[k + 1] - q[k]) / periods[k]);
        let bends: [f64; 3] = std::array::from_fn(|k| {
            if smooth[k] {
                (secants[k + 1] - secants[k]) / (periods[k] + periods[k + 1])
            } else {
                0.0
            }
        });
        let twists = std::array::from_fn(|k| {
            if smooth[k] && smooth[k + 1] {
                (bends[k + 1] - bends[k]) / (periods[k] + periods[k + 1] + periods[k + 2])
            } else {
                0.0
            }
        });
        Self {
            periods: *periods,
            secants,
            bends,
            twists,
        }
    }

    /// Slopes at both ends of the segment; `None` between two corners.
    ///
    /// At a smooth end, this is the slope of the cubic through the command at that end, the two before it and the one after it. So neighbouring
    /// segments agree, and motion with constant jerk is reproduced exactly.
    fn slopes(&self, smooth: &[bool; 3]) -> Option<[f64; 2]> {
        let [_, before, h, after] = self.periods;
        let [_, smooth_start, smooth_end] = *smooth;
        let inner_start = || self.secants[1] + before * (self.bends[1] - h * self.twists[0]);
        let inner_end = || self.secants[2] + h * (self.bends[2] - after * self.twists[1]);
        match (smooth_start, smooth_end) {
            (true, true) => Some([inner_start(), inner_end()]),
            (true, false) => Some([inner_start(), self.secants[2] + h * self.bends[1]]),
            (false, true) => Some([self.secants[2] - h * self.bends[2], inner_end()]),
            (false, false) => None,
        }
    }

    /// True if a joint within its bounds can pass through these commands.
    fn is_within(&self, bounds: &JointBounds) -> bool {
        let slack = 1.0 + ROUNDING;
        let most = bounds.acceleration_rad_per_s2() * slack;
        let jerk = bounds.jerk_rad_per_s3() * (1.0 + 100.0 * ROUNDING);
        self.secants[2].abs() <= bounds.velocity_rad_per_s() * slack
            && self.bends.iter().all(|bend| (2.0 * bend).abs() <= most)
            && self.twists.iter().all(|twist| (6.0 * twist).abs() <= jerk)
    }
}
