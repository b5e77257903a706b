//! The path requested by the program, and the controller's progress on it.
//!
//! If a command is lost, the controller stays where it was. Later commands continue from there along the same path: the arm is delayed, and never
//! jumps. While it is delayed, it follows the path slightly faster than requested.

use super::braking::CommandedMotion;
use crate::limits::CommandLimits;

/// Number of path points stored: more than [`MOST_BEHIND_NS`] at 1 ms.
const POINTS: usize = 256;
/// Largest delay of the arm, ns. With a larger one it brakes, and the program has to begin again from where it rests.
pub(super) const MOST_BEHIND_NS: u64 = 200_000_000;
/// The same, s. Whoever checks that the arm obeys must allow for it (`ObedienceConfig::delay_s` of `hwall-haptics`).
pub const MOST_BEHIND_S: f64 = MOST_BEHIND_NS as f64 * 1e-9;
/// Catching up adds at most this share to the speed. That exceeds the loss from bursts of one to four answers in 5 % of the cycles (12.5 %), and
/// accelerations grow by at most 32 % while it fades.
const MOST_CATCHING: f64 = 0.15;
/// Largest change of that share per second: at 3 rad/s it adds 2.3 rad/s².
const CATCHING_PER_S: f64 = 0.75;
/// A path that stays within this is at rest, rad.
const RESTS_RAD: f64 = 1e-7;

/// The content of an answer: the commanded motion, and its time on the path.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sent {
    pub(super) motion: CommandedMotion,
    /// `None` for motions off the path, such as braking.
    pub(super) path_ns: Option<u64>,
    /// Time when it was sent, ns.
    pub(super) time_ns: u64,
}

/// What a message reports about earlier answers.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Arrival {
    /// Answers that should have arrived but have not.
    pub(super) missing: u32,
    /// The answer that arrived was not the newest: it came after the message that followed its own.
    pub(super) is_late: bool,
}

/// The last answers and their sequence numbers.
#[derive(Debug)]
pub(super) struct Answers {
    ring: [Option<(u32, Sent)>; POINTS],
    newest: Option<u32>,
    /// Number of answers sent; sequence numbers wrap.
    count: u32,
    /// The newest answer that was acknowledged in time.
    in_time: Option<u32>,
    /// What the controller therefore holds. Stored outside the ring, since it stays true however many answers are lost.
    held: Option<Sent>,
    /// The last acknowledged answer.
    named: Option<u32>,
    /// Does the controller acknowledge answers? Known after two different acknowledgements.
    is_told: bool,
    /// Answers in transit when a message acknowledges a new one: the minimum of this window and the last, and of this window.
    nominal: u32,
    least: u32,
    counted: u32,
}

/// Acknowledgements after which the nominal number of answers in transit is determined again. A permanently longer delay stops the arm for up to
/// twice as many answers. With 30 % of the answers late, all of a window are late once in 2·10⁸ windows.
const WINDOW: u32 = 16;

impl Answers {
    pub(super) const fn new() -> Self {
        Self {
            ring: [None; POINTS],
            newest: None,
            count: 0,
            in_time: None,
            held: None,
            named: None,
            is_told: false,
            nominal: 0,
            least: u32::MAX,
            counted: 0,
        }
    }

    pub(super) fn push(&mut self, sequence: u32, sent: Sent) {
        self.ring[sequence as usize % POINTS] = Some((sequence, sent));
        self.count = self.count.saturating_add(1);
        self.newest = Some(sequence);
    }

    fn at(&self, sequence: u32) -> Option<Sent> {
        let (number, sent) = self.ring[sequence as usize % POINTS]?;
        (number == sequence).then_some(sent)
    }

    /// Number of answers sent after this one; `None` if it was never sent.
    fn after(&self, sequence: u32) -> Option<u32> {
        let after = self.newest?.wrapping_sub(sequence);
        (after < self.count).then_some(after)
    }

    /// Processes the acknowledgement of the answer `reflected`.
    pub(super) fn reflected(&mut self, reflected: u32) -> Arrival {
        // An answer that was never sent carries no information.
        let (Some(newest), Some(on_the_way)) = (self.newest, self.after(reflected)) else {
            return Arrival::default();
        };
        // Without new acknowledgements, missing answers are lost rather than in transit.
        let named = self.named.replace(reflected);
        let is_new = named.is_some_and(|named| named != reflected);
        if is_new {
            self.is_told = true;
            self.least = self.least.min(on_the_way);
            self.counted += 1;
        }
        self.nominal = self.nominal.min(self.least);
        if self.counted == WINDOW {
            (self.nominal, self.least, self.counted) = (self.least, u32::MAX, 0);
        }
        // An answer acknowledged late may not have been used: the last one acknowledged in time stays valid.
        let known = self.in_time.map(|known| newest.wrapping_sub(known));
        if on_the_way <= self.nominal || known.is_none_or(|known| known <= on_the_way) {
            self.in_time = Some(reflected);
        }
        let held = self.in_time.map(|known| known.wrapping_add(self.nominal));
        self.held = held.and_then(|held| self.at(held)).or(self.held);
        Arrival {
            missing: if self.is_told {
                on_the_way - self.nominal
            } else {
                0
            },
            is_late: is_new && on_the_way > 0,
        }
    }

    /// What the controller will hold when the next answer arrives, based on the newest answer acknowledged in time. A controller that does not
    /// acknowledge answers is assumed to have all of them.
    pub(super) fn held(&self, reflected: u32) -> Option<Sent> {
        match self.held {
            Some(held) if self.is_told && self.after(reflected).is_some() => Some(held),
            _ => self.at(self.newest?),
        }
    }
}

/// The requested positions at the times of the last commands.
#[derive(Debug)]
pub(super) struct AskedPath {
    points: [(u64, [f64; 7]); POINTS],
    newest: usize,
    count: usize,
    catching: f64,
}

impl AskedPath {
    pub(super) const fn new() -> Self {
        Self {
            points: [(0, [0.0; 7]); POINTS],
            newest: 0,
            count: 0,
            catching: 0.0,
        }
    }

    /// Starts a new path with the next point.
    pub(super) const fn clear(&mut self) {
        (self.count, self.catching) = (0, 0.0);
    }

    pub(super) const fn push(&mut self, time_ns: u64, q_rad: [f64; 7]) {
        self.newest = (self.newest + 1) % POINTS;
        self.points[self.newest] = (time_ns, q_rad);
        if self.count < POINTS {
            self.count += 1;
        }
    }

    /// The point `back` places before the newest.
    const fn point(&self, back: usize) -> &(u64, [f64; 7]) {
        &self.points[(self.newest + POINTS - back) % POINTS]
    }

    /// The next path time to send, ns, and its positions: one period after what is held, or slightly more while the arm is delayed. Requires at least
    /// one point.
    pub(super) fn next(
        &mut self,
        held: &Sent,
        period_ns: u64,
        limits: &CommandLimits,
        most_rad_per_s2: &[f64; 7],
    ) -> (u64, [f64; 7]) {
        let (now_ns, asked_rad) = *self.point(0);
        let first_ns = self.point(self.count.saturating_sub(1)).0;
        let due_ns = match held.path_ns {
            Some(path_ns) if path_ns >= first_ns => path_ns + period_ns,
            _ => first_ns,
        };
        // Skip a rest while the arm is delayed: it need not stand for the full time.
        let due_ns = self.rests_until(due_ns);
        if due_ns >= now_ns {
            self.catching = 0.0;
            return (now_ns, asked_rad);
        }
        let period_s = period_ns as f64 * 1e-9;
        let step = CATCHING_PER_S * period_s;
        let slower = (self.catching - step).max(0.0);
        let behind_s = (now_ns - due_ns) as f64 * 1e-9;
        // Limited so that catching up can end smoothly when the delay is gone.
        let most = MOST_CATCHING.min((2.0 * CATCHING_PER_S * behind_s).sqrt());
        let shares = [self.catching + step, self.catching];
        let found = shares.into_iter().filter(|s| *s <= most).find_map(|share| {
            let to_ns = (due_ns + (share * period_ns as f64) as u64).min(now_ns);
            let q_rad = self.at(to_ns);
            let next = held.motion.moved_to(q_rad, period_s);
            let is_within = limits.bears(&held.motion, &next, most_rad_per_s2, period_s);
            is_within.then_some((share, to_ns, q_rad))
        });
        let (share, to_ns, q_rad) = found.unwrap_or_else(|| {
            let to_ns = (due_ns + (slower * period_ns as f64) as u64).min(now_ns);
            (slower, to_ns, self.at(to_ns))
        });
        self.catching = share;
        (to_ns, q_rad)
    }

    /// Linear between the points.
    fn at(&self, time_ns: u64) -> [f64; 7] {
        let mut after = self.point(0);
        for back in 1..self.count {
            let before = self.point(back);
            if before.0 <= time_ns {
                let span = (after.0 - before.0).max(1) as f64;
                let share = ((time_ns - before.0) as f64 / span).min(1.0);
                return std::array::from_fn(|i| before.1[i] + share * (after.1[i] - before.1[i]));
            }
            after = before;
        }
        after.1
    }

    /// End of the path's rest at that time, ns.
    fn rests_until(&self, time_ns: u64) -> u64 {
        let from_rad = self.at(time_ns);
        let rests =
            |at_rad: &[f64; 7]| (0..7).all(|i| (at_rad[i] - from_rad[i]).abs() <= RESTS_RAD);
        let points = (0..self.count).rev().map(|back| self.point(back));
        let after = points.skip_while(|point| point.0 <= time_ns);
        let last = after.take_while(|point| rests(&point.1)).last();
        last.map_or(time_ns, |point| point.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_kinematics::SrsArm;

    fn sent(q_rad: [f64; 7]) -> Sent {
        Sent {
            motion: CommandedMotion::at_rest(q_rad),
            path_ns: None,
            time_ns: 0,
        }
    }

    /// Answers whose first joint stands at their number, rad.
    #[derive(Debug)]
    struct Numbered(Answers);

    impl Numbered {
        const fn new() -> Self {
            Self(Answers::new())
        }

        /// Sends an answer and reads an acknowledgement: what it reports, and the number of the answer that is held.
        fn next(&mut self, k: u32, sequence: u32, reflected: u32) -> (Arrival, f64) {
            self.0.push(sequence, sent([f64::from(k); 7]));
            let arrival = self.0.reflected(reflected);
            let held = self.0.held(reflected).expect("an answer");
            (arrival, held.motion.q_rad[0])
        }
    }

    #[test]
    fn an_answer_counts_as_missing_beyond_what_is_usually_on_its_way() {
        for nominal in [0_u32, 2] {
            let (mut answers, mut late) = (Numbered::new(), 0);
            for k in 0..200_u32 {
                let (arrival, _) = answers.next(k, k, k.saturating_sub(nominal));
                assert!(arrival.missing == 0 || k < 2 * WINDOW, "{nominal} {k}");
                late += u32::from(arrival.is_late);
            }
            // If the round trip takes longer than a period, every message acknowledges a new answer, never the newest: late, not lost.
            assert_eq!(late, if nominal == 0 { 0 } else { 197 });
            let (arrival, held) = answers.next(200, 200, 200 - nominal - 3);
            assert_eq!((arrival.missing, held), (3, 197.0));
        }
    }

    #[test]
    fn an_answer_that_is_named_late_may_be_unused() {
        let mut answers = Numbered::new();
        for k in 0..10 {
            assert_eq!(answers.next(k, k, k).1, f64::from(k));
        }
        // 10 is late, 11 is lost; whether 10 was used is unknown.
        for (sequence, reflected, held) in [(10, 9, 9.0), (11, 10, 9.0), (12, 12, 12.0)] {
            assert_eq!(answers.next(sequence, sequence, reflected).1, held);
        }
    }

    /// As many cycles as 0.2 s at 1 ms: none of the answers sent meanwhile counts as in transit. Regressions: after 256 lost answers the newest counted
    /// as held, and the arm would have jumped to it; only the last 255 answers were counted.
    #[test]
    fn what_is_held_is_remembered_however_many_answers_are_lost() {
        // Sequence numbers wrap meanwhile.
        for first in [0, u32::MAX - 150, u32::MAX - 300] {
            for (last, from) in [(199, 400), (99, 1500), (99, 12_000)] {
                let mut answers = Numbered::new();
                for k in 0..from + 500 {
                    // For a long time, `last` is the last one that arrives.
                    let arrived = if k < from { k.min(last) } else { k };
                    let reflected = first.wrapping_add(arrived);
                    let (arrival, held) = answers.next(k, first.wrapping_add(k), reflected);
                    assert_eq!(arrival.missing, k - arrived, "{first} {k}");
                    assert_eq!(held, f64::from(arrived), "{first} {k}");
                }
                // An answer that was never sent.
                let never = first.wrapping_add(from + 500);
                assert_eq!(answers.0.reflected(never).missing, 0);
            }
        }
    }

    #[test]
    fn a_controller_that_says_nothing_is_believed_to_have_all() {
        let mut answers = Numbered::new();
        for k in 0..600_u32 {
            let (arrival, held) = answers.next(k, k, 0);
            assert_eq!((arrival.missing, held), (0, f64::from(k)));
        }
    }

    /// Regression: an arm delayed by 0.16 s stood still for the 0.15 s of a rest on the path while it was asked to move: it seemed frozen.
    #[test]
    fn an_arm_that_is_behind_leaves_out_a_rest() {
        let limits = CommandLimits::new(&SrsArm::iiwa7(), [0.0; 7]);
        let ms = |k: u64| k * 1_000_000;
        // It moves until 100 ms, rests until 250 ms, and moves on.
        let asked = |k: u64| [1e-3 * (k.min(100) + k.saturating_sub(250)) as f64; 7];
        let mut path = AskedPath::new();
        for k in (0..=260).step_by(5) {
            path.push(ms(k), asked(k));
        }
        let held = |k: u64| Sent {
            path_ns: Some(ms(k)),
            ..sent(asked(k))
        };
        let mut next = |k| path.next(&held(k), ms(5), &limits, &[1.0; 7]).0 / ms(1);
        assert_eq!((next(100), next(200), next(50)), (250, 250, 55));
    }

    /// Answers are lost in bursts on a path back and forth; the resulting motion respects the limits, and ends where requested.
    #[test]
    fn bursts_make_an_arm_late_and_never_throw_it() {
        let limits = CommandLimits::new(&SrsArm::iiwa7(), [0.0; 7]);
        let most = [8.65, 5.44, 5.69, 11.01, 11.78, 13.76, 13.17];
        for (seed, period_ms) in [(1_u64, 1_u64), (2, 5), (3, 5), (4, 10)] {
            let period_ns = period_ms * 1_000_000;
            let period_s = period_ns as f64 * 1e-9;
            let asked = |k: u64| {
                let t_s = (k as f64 * period_s).min(2.5);
                // A smooth path of 2.5 s; up to 0.94 rad/s and 1.2 rad/s².
                [1.5 * (0.5 - 0.5 * (std::f64::consts::PI * t_s / 2.5).cos()); 7]
            };
            let mut path = AskedPath::new();
            let mut held = sent(asked(0));
            let (mut burst, mut random) = (0, seed);
            let mut worst_behind_ns = 0;
            for k in 1..4000 / period_ms {
                path.push(k * period_ns, asked(k));
                let (path_ns, q_rad) = path.next(&held, period_ns, &limits, &most);
                assert!(path_ns <= k * period_ns);
                let next = held.motion.moved_to(q_rad, period_s);
                worst_behind_ns = worst_behind_ns.max(k * period_ns - path_ns);
                let changes = next
                    .speed_rad_per_s
                    .iter()
                    .zip(&held.motion.speed_rad_per_s);
                for ((to, from), most) in changes.zip(&most) {
                    assert!((to - from).abs() <= 1.5 * most * period_s + 1e-9, "{k}");
                }
                random = random
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                if burst == 0 && (random >> 33) % 20 == 0 {
                    burst = 1 + (random >> 50) % 4;
                }
                if burst > 0 {
                    burst -= 1;
                    continue;
                }
                held = Sent {
                    motion: next,
                    path_ns: Some(path_ns),
                    time_ns: k * period_ns,
                };
            }
            assert!(worst_behind_ns > 0, "something was lost");
            assert_eq!(held.motion.q_rad, asked(u64::MAX / 2_000_000_000));
        }
    }
}
