//! The path that the program asks for, and how far the controller has come on it.
//!
//! A command that does not arrive leaves the controller where it was. Commands after it go on from there, along the same path: the
//! arm is behind then, and never leaps. While it is behind, it goes through the path a little faster than it was asked for.

use super::braking::CommandedMotion;
use crate::limits::CommandLimits;

/// Points of the path that are kept: more than [`MOST_BEHIND_NS`] at 1 ms.
const POINTS: usize = 256;
/// An arm further behind no longer follows: it brakes, and the program has to begin anew from where it rests, ns. A joint at full speed,
/// 1.7 rad/s, is 0.3 rad from where the supervisor of a session expects it only after 0.33 s.
pub(super) const MOST_BEHIND_NS: u64 = 200_000_000;
/// Catching up adds at most this share to the speed: more than what bursts of one to four answers in 5 % of the cycles cost (12.5 %), and
/// accelerations grow by at most 32 % while it fades.
const MOST_CATCHING: f64 = 0.15;
/// That share changes by at most this in a second: at 3 rad/s it adds 2.3 rad/s².
const CATCHING_PER_S: f64 = 0.75;
/// A path that stays within this, rad, is at rest.
const RESTS_RAD: f64 = 1e-7;

/// What was sent with an answer: where the arm shall be, and which time of the path that is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sent {
    pub(super) motion: CommandedMotion,
    /// `None` for what is not on the path, as braking.
    pub(super) path_ns: Option<u64>,
    /// When, ns.
    pub(super) time_ns: u64,
}

/// What a message says about the answers before it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Arrival {
    /// Answers that should have arrived and have not.
    pub(super) missing: u32,
    /// The one that has arrived was not the newest: it came after the message that followed its own.
    pub(super) is_late: bool,
}

/// The last answers and their sequence numbers.
#[derive(Debug)]
pub(super) struct Answers {
    ring: [Option<(u32, Sent)>; POINTS],
    newest: Option<u32>,
    /// How many were sent; sequence numbers wrap.
    count: u32,
    /// The newest answer that was named as soon as it was due.
    in_time: Option<u32>,
    /// What the controller holds by that. It is kept beyond the ring, for it stays true however many answers are lost.
    held: Option<Sent>,
    /// The answer that was named last as the newest that has arrived.
    named: Option<u32>,
    /// Does the controller say which answers arrive? Known once it has named two of them.
    is_told: bool,
    /// How many answers are on their way when a message names a new one: the least in this window and the last.
    usual: u32,
    least: u32,
    counted: u32,
}

/// Named answers after which the usual number of answers on their way is found anew. A delay that has grown for good stops the arm for up
/// to twice as many answers. With 30 % of the answers late, all of a window are late once in 2·10⁸ windows.
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
            usual: 0,
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

    /// How many answers were sent after this one; `None` if it was never sent.
    fn after(&self, sequence: u32) -> Option<u32> {
        let after = self.newest?.wrapping_sub(sequence);
        (after < self.count).then_some(after)
    }

    /// A message says that the answer `reflected` has arrived.
    pub(super) fn reflected(&mut self, reflected: u32) -> Arrival {
        // An answer that was never sent says nothing.
        let (Some(newest), Some(on_the_way)) = (self.newest, self.after(reflected)) else {
            return Arrival::default();
        };
        // While none arrives more are lost, not on their way.
        let named = self.named.replace(reflected);
        let is_new = named.is_some_and(|named| named != reflected);
        if is_new {
            self.is_told = true;
            self.least = self.least.min(on_the_way);
            self.counted += 1;
        }
        self.usual = self.usual.min(self.least);
        if self.counted == WINDOW {
            (self.usual, self.least, self.counted) = (self.least, u32::MAX, 0);
        }
        // An answer named later than usual may not have been used: the last one named in time counts on.
        let known = self.in_time.map(|known| newest.wrapping_sub(known));
        if on_the_way <= self.usual || known.is_none_or(|known| known <= on_the_way) {
            self.in_time = Some(reflected);
        }
        let held = self.in_time.map(|known| known.wrapping_add(self.usual));
        self.held = held.and_then(|held| self.at(held)).or(self.held);
        Arrival {
            missing: if self.is_told {
                on_the_way - self.usual
            } else {
                0
            },
            is_late: is_new && on_the_way > 0,
        }
    }

    /// What the controller will hold when the next answer comes, by the newest answer that it says has arrived in time. A controller that
    /// does not say it is believed to have all.
    pub(super) fn held(&self, reflected: u32) -> Option<Sent> {
        match self.held {
            Some(held) if self.is_told && self.after(reflected).is_some() => Some(held),
            _ => self.at(self.newest?),
        }
    }
}

/// Where the arm shall be at the times of the last commands.
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

    /// The next point begins a new path.
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

    /// The point that is `back` before the newest.
    const fn point(&self, back: usize) -> &(u64, [f64; 7]) {
        &self.points[(self.newest + POINTS - back) % POINTS]
    }

    /// The time of the path to send next, ns, and its positions: a period after what is held, or a little more while the arm is behind.
    /// At least one point was pushed.
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
        // A rest is left out: the arm need not stand as long as it was asked to, and as long as it is behind.
        let due_ns = self.rests_until(due_ns);
        if due_ns >= now_ns {
            self.catching = 0.0;
            return (now_ns, asked_rad);
        }
        let period_s = period_ns as f64 * 1e-9;
        let step = CATCHING_PER_S * period_s;
        let slower = (self.catching - step).max(0.0);
        let behind_s = (now_ns - due_ns) as f64 * 1e-9;
        // It can end without a jolt when there is nothing left.
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

    /// Linear between its points.
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

    /// Until when the path stays where it is at that time, ns.
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

    #[test]
    fn an_answer_counts_as_missing_beyond_what_is_usually_on_its_way() {
        for usual in [0_u32, 2] {
            let mut answers = Answers::new();
            for k in 0..200_u32 {
                answers.push(k, sent([f64::from(k); 7]));
                let missing = answers.reflected(k.saturating_sub(usual)).missing;
                assert!(missing == 0 || k < 2 * WINDOW, "{usual} {k}");
            }
            assert_eq!(answers.reflected(199 - usual - 3).missing, 3);
            let held = answers.held(199 - usual - 3).expect("an answer");
            assert_eq!(held.motion.q_rad[0], 196.0);
        }
    }

    #[test]
    fn an_answer_that_is_named_late_may_be_unused() {
        let mut answers = Answers::new();
        let mut held_rad = |sequence, reflected| {
            answers.push(sequence, sent([f64::from(sequence); 7]));
            answers.reflected(reflected);
            answers.held(reflected).expect("an answer").motion.q_rad[0]
        };
        for k in 0..10 {
            assert_eq!(held_rad(k, k), f64::from(k));
        }
        // 10 is late, 11 is lost; whether 10 was used is not known.
        assert_eq!(held_rad(10, 9), 9.0);
        assert_eq!(held_rad(11, 10), 9.0);
        assert_eq!(held_rad(12, 12), 12.0);
    }

    /// As many cycles as 0.2 s have at 1 ms: nothing that was sent meanwhile is believed to be on its way.
    #[test]
    fn a_stall_is_no_long_way() {
        let mut answers = Answers::new();
        for k in 0..400_u32 {
            answers.push(k, sent([f64::from(k); 7]));
            let reflected = k.min(199);
            assert_eq!(answers.reflected(reflected).missing, k - reflected);
            let held = answers.held(reflected).expect("an answer");
            assert!(
                k == 0 || held.motion.q_rad[0] == f64::from(reflected),
                "{k}"
            );
        }
    }

    /// Only the last 255 answers were counted.
    #[test]
    fn a_long_row_of_lost_answers_is_counted_to_its_end() {
        let mut answers = Answers::new();
        for k in 0..12_000_u32 {
            answers.push(k, sent([0.0; 7]));
            let reflected = k.min(99);
            assert_eq!(answers.reflected(reflected).missing, k - reflected);
        }
        // One that was never sent.
        assert_eq!(answers.reflected(12_000).missing, 0);
    }

    /// After 256 lost answers the newest was believed to be held: the arm would have leapt to it. Sequence numbers wrap meanwhile.
    #[test]
    fn what_is_held_is_remembered_however_many_answers_are_lost() {
        for first in [0, u32::MAX - 150, u32::MAX - 300] {
            let mut answers = Answers::new();
            for k in 0..2000_u32 {
                answers.push(first.wrapping_add(k), sent([f64::from(k); 7]));
                // 99 is the last one that arrives for long.
                let arrived = if k < 1500 { k.min(99) } else { k };
                let reflected = first.wrapping_add(arrived);
                let missing = answers.reflected(reflected).missing;
                let held = answers.held(reflected).expect("an answer");
                assert_eq!(missing, k - arrived, "{first} {k}");
                assert_eq!(held.motion.q_rad[0], f64::from(arrived), "{first} {k}");
            }
        }
    }

    /// The way there and back takes longer than a period: every message names a new answer, never the newest.
    #[test]
    fn answers_that_arrive_after_the_next_message_are_late_and_not_lost() {
        let mut answers = Answers::new();
        let mut late = 0;
        for k in 0..100_u32 {
            answers.push(k, sent([0.0; 7]));
            let arrival = answers.reflected(k.saturating_sub(2));
            late += u32::from(arrival.is_late);
            assert!(arrival.missing == 0 || k < 2 * WINDOW);
        }
        assert_eq!(late, 97);
    }

    #[test]
    fn a_controller_that_says_nothing_is_believed_to_have_all() {
        let mut answers = Answers::new();
        for k in 0..600_u32 {
            answers.push(k, sent([f64::from(k); 7]));
            assert_eq!(answers.reflected(0).missing, 0);
            assert_eq!(
                answers.held(0).expect("an answer").motion.q_rad[0],
                f64::from(k)
            );
        }
    }

    /// An arm that was 0.16 s behind stood still for the 0.15 s that the path had rested, while it was asked to move: it seemed to be frozen.
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

    /// Answers are lost in bursts while the arm goes there and back; what arrives keeps to the limits, and it ends where it was asked to.
    #[test]
    fn bursts_make_an_arm_late_and_never_throw_it() {
        let limits = CommandLimits::new(&SrsArm::iiwa7(), [0.0; 7]);
        let most = [8.65, 5.44, 5.69, 11.01, 11.78, 13.76, 13.17];
        for (seed, period_ms) in [(1_u64, 1_u64), (2, 5), (3, 5), (4, 10)] {
            let period_ns = period_ms * 1_000_000;
            let period_s = period_ns as f64 * 1e-9;
            let asked = |k: u64| {
                let t_s = (k as f64 * period_s).min(2.5);
                // A smooth way of 2.5 s; up to 0.94 rad/s and 1.2 rad/s².
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
