//! From a fault to a safe state, and back.

use super::state::SafeReason;
use super::supervisor_config::{Latch, TimingConfig};
use std::mem::discriminant;

/// The response to a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Severity {
    /// Hold, then withdraw; at once if the arm rests and is pushed, because it then yields to the push.
    Unsure,
    /// Hold, then stop: with a bad command or an unknown arm state the arm cannot withdraw.
    Blind,
    /// Withdraw or yield at once, latched: a hand may be caught.
    Caught,
    /// Hold, then stop, latched.
    Broken,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fault {
    pub(super) reason: SafeReason,
    pub(super) severity: Severity,
}

impl Fault {
    pub(super) const fn new(reason: SafeReason, severity: Severity) -> Self {
        Self { reason, severity }
    }

    /// The worse of two faults; of equal ones the first.
    pub(super) fn worse(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        match (a, b) {
            (Some(a), Some(b)) if b.severity > a.severity => Some(b),
            (None, b) => b,
            (a, _) => a,
        }
    }
}

/// The current fault and the response to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Trouble {
    pub(super) fault: Fault,
    pub(super) stage: Stage,
    /// When the stage began, s of sound time.
    since_s: f64,
    /// When a fault of this severity was last found, s of sound time.
    last_found_s: f64,
    /// Since when all inputs have been sound.
    sound_since_s: Option<f64>,
    /// How often it has returned soon after it ended.
    returns: i32,
    /// The stop was requested; only a person can end it, whatever else fails meanwhile.
    asked_for: bool,
    /// A person has released it, and no fault has occurred since.
    released: bool,
}

impl Trouble {
    /// Does it take a person to end it?
    pub(super) fn is_latched(&self, rule: Latch) -> bool {
        let latches = match rule {
            Latch::Everything => true,
            Latch::Serious => self.fault.severity >= Severity::Caught,
            Latch::Nothing => false,
        };
        !self.released && (self.asked_for || latches)
    }

    /// How long inputs must be sound for it to end, s: twice as long each time that it has returned.
    fn recovery_s(&self, timing: &TimingConfig) -> f64 {
        let longest_s = MOST_RECOVERY_S.max(timing.recovery_s);
        (timing.recovery_s * 2f64.powi(self.returns)).min(longest_s)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stage {
    Hold,
    Retreat,
    Compliant,
    Stop,
}

/// The state of the arm in a cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Condition {
    /// No joint moves.
    pub(super) rests: bool,
    /// It takes torque commands.
    pub(super) torque_level: bool,
    /// The force is still above `relaxed_n`, or a torque beyond its limit.
    pub(super) is_pressed: bool,
    /// An unexpected contact was found in this cycle.
    pub(super) is_pushed: bool,
}

/// Longest recovery time of a fault that returns again and again, s: a user who has moved the arm out of an obstacle waits no longer.
const MOST_RECOVERY_S: f64 = 5.0;

/// A fault that occurs within this time after it ended has returned, s: an arm that sets off from rest meets what stopped it within a second.
const RETURNS_S: f64 = 1.0;

/// The current fault, and how far the response has progressed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct FaultMachine {
    pub(super) trouble: Option<Trouble>,
    /// The last fault that ended by itself, and when, s.
    ended: Option<(Trouble, f64)>,
}

impl FaultMachine {
    /// How many times in a row this fault has returned soon after the arm continued.
    fn returns(&self, reason: &SafeReason, now_s: f64, timing: &TimingConfig) -> i32 {
        match &self.ended {
            Some((last, ended_s))
                if reason.returns_on_motion()
                    && discriminant(&last.fault.reason) == discriminant(reason)
                    && now_s - ended_s <= RETURNS_S.max(last.recovery_s(timing)) =>
            {
                last.returns + 1
            }
            _ => 0,
        }
    }

    /// Releases latches: the fault may now end like any other. A yielding arm holds first, because it must start from rest.
    pub(super) fn reset(&mut self, now_s: f64) {
        if let Some(trouble) = &mut self.trouble {
            if matches!(trouble.stage, Stage::Retreat | Stage::Compliant) {
                (trouble.stage, trouble.since_s) = (Stage::Hold, now_s);
            }
            trouble.fault.severity = Severity::Blind;
            trouble.returns = 0;
            (trouble.asked_for, trouble.released) = (false, true);
        }
    }

    /// Stops, latched. An arm that yields to a force continues to yield and stops afterwards: a rigid arm would clamp a hand.
    pub(super) fn stop(&mut self, reason: SafeReason, now_s: f64) {
        if let Some(trouble) = &mut self.trouble
            && trouble.fault.severity == Severity::Caught
            && trouble.stage != Stage::Stop
        {
            (trouble.asked_for, trouble.released) = (true, false);
            return;
        }
        self.trouble = Some(Trouble {
            fault: Fault::new(reason, Severity::Broken),
            stage: Stage::Stop,
            since_s: now_s,
            last_found_s: now_s,
            sound_since_s: None,
            returns: 0,
            asked_for: true,
            released: false,
        });
    }

    /// One cycle with the fault found in it, if any. An arm whose state was unknown, or that took no commands, continues only after it `rests`; one
    /// that `is_pressed` yields for as long as it is.
    pub(super) fn advance(
        &mut self,
        found: Option<Fault>,
        arm: Condition,
        now_s: f64,
        timing: &TimingConfig,
        latch: Latch,
    ) {
        let Condition {
            rests,
            torque_level,
            ..
        } = arm;
        let Some(fault) = found else {
            let Some(trouble) = &mut self.trouble else {
                return;
            };
            let since_s = *trouble.sound_since_s.get_or_insert(now_s);
            // An arm whose state was always sound may continue in motion.
            let was_unknown = trouble.fault.severity >= Severity::Blind;
            let holds = matches!(trouble.stage, Stage::Hold | Stage::Stop);
            let moves = was_unknown && holds && !rests;
            if !moves && !trouble.is_latched(latch) && now_s - since_s >= trouble.recovery_s(timing)
            {
                self.ended = Some((*trouble, now_s));
                self.trouble = None;
                return;
            }
            self.escalate(now_s, timing, arm, true);
            return;
        };
        let stage = match (fault.severity, torque_level) {
            (Severity::Caught, true) => Stage::Compliant,
            (Severity::Caught, false) => Stage::Retreat,
            _ => Stage::Hold,
        };
        match &mut self.trouble {
            Some(trouble) if fault.severity <= trouble.fault.severity => {
                // Keep the newest values of the same fault, and the newest fault of the same kind. A fault that a person has released is replaced by
                // any new one.
                let is_alike = fault.severity == trouble.fault.severity;
                if trouble.released && trouble.stage == Stage::Hold && !is_alike {
                    // A fault of another kind holds for its own time before the arm withdraws.
                    trouble.since_s = now_s;
                }
                if is_alike {
                    trouble.last_found_s = now_s;
                }
                if trouble.released || is_alike {
                    trouble.fault = fault;
                } else if !trouble.is_latched(latch)
                    && now_s - trouble.last_found_s > timing.recovery_s
                {
                    // The worse fault has ended; name this one, which now holds the arm. The severity stays, unless the arm may give way.
                    trouble.fault.reason = fault.reason;
                    if arm.is_pushed && rests {
                        trouble.fault.severity = fault.severity;
                    }
                }
                (trouble.sound_since_s, trouble.released) = (None, false);
                // An arm that stands for a worse reason would go on clamping. That reason is over: otherwise it would have been found in this cycle.
                let stands = matches!(trouble.stage, Stage::Hold | Stage::Stop);
                if fault.severity == Severity::Caught && !is_alike && stands {
                    (trouble.fault, trouble.stage, trouble.since_s) = (fault, stage, now_s);
                    trouble.last_found_s = now_s;
                }
            }
            Some(trouble)
                if fault.severity != Severity::Caught
                    && trouble.stage == Stage::Stop
                    && !trouble.released =>
            {
                (trouble.fault, trouble.sound_since_s) = (fault, None);
            }
            before => {
                let asked_for = before.as_ref().is_some_and(|trouble| trouble.asked_for);
                let returns = self.returns(&fault.reason, now_s, timing);
                self.trouble = Some(Trouble {
                    fault,
                    stage,
                    since_s: now_s,
                    last_found_s: now_s,
                    sound_since_s: None,
                    returns,
                    asked_for,
                    released: false,
                });
            }
        }
        // An arm in an unknown state cannot withdraw or float.
        let is_known = !matches!(fault.severity, Severity::Blind | Severity::Broken);
        if let Some(trouble) = self.trouble.as_mut().filter(|_| !is_known)
            && matches!(trouble.stage, Stage::Retreat | Stage::Compliant)
        {
            (trouble.stage, trouble.since_s) = (Stage::Hold, now_s);
        }
        self.escalate(now_s, timing, arm, is_known);
    }

    /// Moves on from holding to withdrawing, and from withdrawing to stopped.
    fn escalate(&mut self, now_s: f64, timing: &TimingConfig, arm: Condition, is_known: bool) {
        let Some(trouble) = &mut self.trouble else {
            return;
        };
        let lasted_s = now_s - trouble.since_s;
        let severity = trouble.fault.severity;
        let gives_way = severity == Severity::Unsure && is_known && arm.is_pushed && arm.rests;
        let next = match trouble.stage {
            // Yielding was interrupted and that fault is over, but the force is not.
            Stage::Hold if severity == Severity::Caught => {
                match (lasted_s > timing.hold_s && is_known, arm.torque_level) {
                    (false, _) => Stage::Hold,
                    (true, true) if arm.is_pressed => Stage::Compliant,
                    (true, false) if arm.is_pressed => Stage::Retreat,
                    (true, _) => Stage::Stop,
                }
            }
            Stage::Hold if trouble.sound_since_s.is_none() => {
                let may_withdraw = severity == Severity::Unsure && is_known;
                match (may_withdraw, lasted_s > timing.hold_s) {
                    (true, true) => Stage::Retreat,
                    (true, false) if gives_way => Stage::Retreat,
                    (false, true) => Stage::Stop,
                    (_, false) => Stage::Hold,
                }
            }
            Stage::Stop if gives_way && !trouble.asked_for => Stage::Retreat,
            // It gives way for as long as it is pushed.
            Stage::Retreat if arm.is_pushed => {
                trouble.since_s = now_s;
                Stage::Retreat
            }
            Stage::Retreat if lasted_s > timing.retreat_s && !arm.is_pressed => Stage::Stop,
            // Without torques only friction brakes the arm.
            Stage::Compliant if !arm.is_pressed => Stage::Hold,
            stage => stage,
        };
        if next != trouble.stage {
            (trouble.stage, trouble.since_s) = (next, now_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::safety::Channel;
    use Severity::{Blind, Broken, Caught, Unsure};

    /// A machine with a clock. By default the arm rests, takes positions and is not pressed.
    struct Run {
        machine: FaultMachine,
        now_s: f64,
        arm: Condition,
        latch: Latch,
    }

    impl Run {
        fn new() -> Self {
            Self {
                machine: FaultMachine::default(),
                now_s: 0.0,
                arm: Condition {
                    rests: true,
                    torque_level: false,
                    is_pressed: false,
                    is_pushed: false,
                },
                latch: Latch::Serious,
            }
        }

        /// The stages after a time with this fault, in ms.
        fn go(&mut self, ms: u32, severity: Option<Severity>) -> Option<Stage> {
            let reason = SafeReason::NonFinite(Channel::Head);
            let found = severity.map(|severity| Fault::new(reason, severity));
            let timing = TimingConfig::default();
            for _ in 0..ms {
                self.now_s += 1e-3;
                (self.machine).advance(found, self.arm, self.now_s, &timing, self.latch);
            }
            self.stage()
        }

        fn stage(&self) -> Option<Stage> {
            self.machine.trouble.map(|trouble| trouble.stage)
        }

        fn is_latched(&self) -> bool {
            (self.machine.trouble).is_some_and(|trouble| trouble.is_latched(self.latch))
        }
    }

    #[test]
    fn a_resting_arm_gives_way_at_once_and_for_as_long_as_it_is_pushed() {
        let pushed = || {
            let mut run = Run::new();
            run.arm.is_pushed = true;
            run
        };
        let mut run = pushed();
        assert_eq!(run.go(1, Some(Unsure)), Some(Stage::Retreat));
        assert_eq!(run.go(5000, Some(Unsure)), Some(Stage::Retreat));
        // A moving arm brakes first.
        let mut run = pushed();
        run.arm.rests = false;
        assert_eq!(run.go(100, Some(Unsure)), Some(Stage::Hold));
        // An arm that stands for a fault that is over gives way, too.
        for before in [Blind, Unsure] {
            let mut run = Run::new();
            assert_eq!(run.go(3000, Some(before)), Some(Stage::Stop));
            run.arm.is_pushed = true;
            let stage = run.go(300, Some(Unsure));
            assert_eq!(stage, Some(Stage::Retreat), "{before:?}");
        }
        // Somebody wants it to stand.
        let mut run = pushed();
        run.machine.stop(SafeReason::Requested, 0.0);
        assert_eq!(run.go(300, Some(Unsure)), Some(Stage::Stop));
    }

    #[test]
    fn every_severity_goes_its_way() {
        use Stage::{Hold, Retreat, Stop};
        for (severity, stages, is_latched) in [
            (Unsure, [Hold, Retreat, Stop], false),
            (Blind, [Hold, Stop, Stop], false),
            (Caught, [Retreat, Retreat, Stop], true),
            (Broken, [Hold, Stop, Stop], true),
        ] {
            let mut run = Run::new();
            // At once, after the hold (0.3 s), after the retreat (1.5 s).
            for (ms, stage) in [1, 310, 1600].into_iter().zip(stages) {
                assert_eq!(run.go(ms, Some(severity)), Some(stage), "{severity:?} {ms}");
            }
            assert_eq!(run.is_latched(), is_latched, "{severity:?}");
            // Sound inputs end it after 0.25 s, unless it is latched; then a reset does.
            assert!(run.go(240, None).is_some(), "{severity:?}");
            assert_eq!(run.go(20, None).is_some(), is_latched, "{severity:?}");
            run.machine.reset(run.now_s);
            assert_eq!(run.go(260, None), None, "{severity:?}");
        }
    }

    #[test]
    fn a_hand_that_is_still_caught_is_given_way_to_for_as_long_as_it_is() {
        let mut run = Run::new();
        run.arm.is_pressed = true;
        assert_eq!(run.go(5000, Some(Caught)), Some(Stage::Retreat));
        assert_eq!(run.go(5000, None), Some(Stage::Retreat));
        run.arm.is_pressed = false;
        assert_eq!(run.go(10, None), Some(Stage::Stop));
        // The same at torque level, where the arm floats, after a cycle with an unknown state.
        let mut run = Run::new();
        (run.arm.is_pressed, run.arm.torque_level) = (true, true);
        assert_eq!(run.go(10, Some(Caught)), Some(Stage::Compliant));
        assert_eq!(run.go(1, Some(Blind)), Some(Stage::Hold));
        assert_eq!(run.go(310, Some(Caught)), Some(Stage::Compliant));
        // The force ends: it holds, and stops.
        run.arm.is_pressed = false;
        assert_eq!(run.go(1, None), Some(Stage::Hold));
        assert_eq!(run.go(310, None), Some(Stage::Stop));
    }

    /// Regression: a stop made the arm rigid, and it stopped again after every release, so the hand stayed clamped.
    #[test]
    fn a_stop_does_not_clamp_a_caught_hand() {
        for (torque_level, gives_way) in [(false, Stage::Retreat), (true, Stage::Compliant)] {
            let mut run = Run::new();
            (run.arm.is_pressed, run.arm.torque_level) = (true, torque_level);
            run.go(10, Some(Caught));
            run.machine.stop(SafeReason::Requested, run.now_s);
            assert_eq!(run.go(2000, Some(Caught)), Some(gives_way));
            run.arm.is_pressed = false;
            run.go(310, None);
            assert_eq!((run.stage(), run.is_latched()), (Some(Stage::Stop), true));
            // Released, and pressed again: it yields again.
            run.machine.reset(run.now_s);
            run.arm.is_pressed = true;
            assert_eq!(run.go(10, Some(Caught)), Some(gives_way));
        }
    }

    /// Regression: a clamp that was noticed after a stop, or after another latched fault, left the arm rigid.
    #[test]
    fn an_arm_that_stands_gives_way_to_a_clamp() {
        for (torque_level, gives_way) in [(false, Stage::Retreat), (true, Stage::Compliant)] {
            for was in [None, Some(Broken), Some(Blind), Some(Unsure)] {
                let mut run = Run::new();
                run.arm.torque_level = torque_level;
                match was {
                    None => run.machine.stop(SafeReason::Requested, run.now_s),
                    Some(_) => {
                        run.go(5000, was);
                    }
                }
                assert_eq!(run.stage(), Some(Stage::Stop), "{was:?}");
                run.arm.is_pressed = true;
                assert_eq!(run.go(10, Some(Caught)), Some(gives_way), "{was:?}");
                // A worse fault meanwhile makes it hold, and no longer than it lasts.
                assert_eq!(run.go(1, Some(Broken)), Some(Stage::Hold));
                assert_eq!(run.go(1, Some(Caught)), Some(gives_way));
                run.arm.is_pressed = false;
                run.go(2000, None);
                assert_eq!(run.stage(), Some(Stage::Stop), "{was:?}");
                // Whoever asked for the stop has to end it, whatever the rule.
                run.latch = Latch::Nothing;
                assert_eq!(run.go(1000, None).is_some(), was.is_none(), "{was:?}");
            }
        }
    }

    /// Regression: the arm continued at the speed to which it had been pushed, into its end stop.
    #[test]
    fn an_arm_that_gave_way_goes_on_only_from_rest() {
        for torque_level in [false, true] {
            let mut run = Run::new();
            (run.arm.is_pressed, run.arm.rests) = (true, false);
            run.arm.torque_level = torque_level;
            run.go(500, Some(Caught));
            run.machine.reset(run.now_s);
            assert_eq!(run.go(1000, None), Some(Stage::Hold));
            run.arm.rests = true;
            assert_eq!(run.go(1, None), None);
        }
    }

    #[test]
    fn a_short_fault_ends_by_itself_and_a_worse_one_takes_its_place() {
        let mut run = Run::new();
        assert_eq!(run.go(5, Some(Unsure)), Some(Stage::Hold));
        assert_eq!(run.go(249, None), Some(Stage::Hold));
        assert_eq!(run.go(5, None), None);
        // A fault that returns within the recovery time is the same one, and the arm withdraws in the end.
        for _ in 0..4 {
            run.go(50, Some(Unsure));
            run.go(50, None);
        }
        assert_eq!(run.go(1, Some(Unsure)), Some(Stage::Retreat));
        // A worse fault ends the withdrawal; a lesser one afterwards changes nothing.
        assert_eq!(run.go(1, Some(Broken)), Some(Stage::Hold));
        run.go(310, Some(Unsure));
        assert_eq!((run.stage(), run.is_latched()), (Some(Stage::Stop), true));
    }

    /// Regression: an arm that began inside an obstacle held and continued ten times a second. So did one whose link squeezed a hand.
    #[test]
    fn an_arm_that_is_stopped_whenever_it_continues_tries_ever_less_often() {
        let timing = TimingConfig::default();
        // The fault is found when the arm has gone on for a time, s.
        let tries = |reason: SafeReason, recovery_s: f64, after_s: f64| {
            let timing = TimingConfig {
                recovery_s,
                ..timing
            };
            let (mut run, mut tries, mut free_s) = (Run::new(), 0, f64::INFINITY);
            for _ in 0..60_000 {
                run.now_s += 1e-3;
                let goes_on = run.machine.trouble.is_none();
                free_s = if goes_on { free_s + 1e-3 } else { 0.0 };
                let is_found = free_s > after_s;
                tries += u32::from(is_found);
                let found = is_found.then_some(Fault::new(reason, Unsure));
                (run.machine).advance(found, run.arm, run.now_s, &timing, run.latch);
            }
            (run, tries)
        };
        let pushed = SafeReason::UnexpectedContact {
            joint: 1,
            torque_n_m: 9.0,
        };
        for reason in [SafeReason::SelfCollision { distance_m: 0.0 }, pushed] {
            let (mut run, count) = tries(reason, 0.25, 0.0);
            // After 0.25, 0.5, 1, 2 and 4 s, then every 5 s.
            assert!((14..=18).contains(&count), "{reason:?} {count}");
            // With a session's recovery time, an arm that meets the obstacle after 0.3 s.
            let (_, count) = tries(reason, 0.1, 0.3);
            assert!((14..=18).contains(&count), "{reason:?} {count}");
            // A person's reset makes it as short as at first.
            run.go(1, Some(Unsure));
            run.machine.reset(run.now_s);
            assert_eq!(run.go(260, None), None);
        }
        // A fault of the inputs ends when they are sound, each time.
        let (_, count) = tries(SafeReason::NonFinite(Channel::Head), 0.25, 0.0);
        assert!(count > 200, "{count}");
    }

    #[test]
    fn an_arm_that_was_not_known_goes_on_only_from_rest() {
        let mut run = Run::new();
        run.arm.rests = false;
        run.go(5, Some(Blind));
        assert_eq!(run.go(2000, None), Some(Stage::Hold));
        run.arm.rests = true;
        assert_eq!(run.go(1, None), None);
        // An arm whose state was always known may continue in motion.
        run.arm.rests = false;
        run.go(5, Some(Unsure));
        assert_eq!(run.go(260, None), None);
    }
}
