//! Console messages about holds of the arm: every change once, and a summary at the end.

use crate::console::note;
use crate::input::numbers::counted;
use crate::run::logs::tick::Stop;
use hwall::haptics::LinkInFront;
use hwall::haptics::body::ArmBody;
use hwall::{Control, SessionState};
use hwall_bridge::{Orders, ViewSender};
use hwall_fri::FriError;
use std::collections::BTreeMap;
use std::io::{BufRead, stdin};
use std::mem::discriminant;
use std::sync::Once;

/// Number of holds printed for each reason. Further ones are only counted, so that the console stays readable; holds that need
/// a person are always printed.
const TOLD: u64 = 20;

/// The current hold; a change of it is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Hold {
    stop: Stop,
    /// Holding, withdrawing, stopped.
    state: &'static str,
    is_latched: bool,
    /// Number of changes of the cause while the arm refuses commands.
    causes: u32,
}

/// Watches the states of a session.
#[derive(Debug, Default)]
pub struct Holds {
    under_way: Option<Hold>,
    /// Start of the hold for this reason, s.
    since_s: f64,
    /// Why the arm refuses commands, and number of changes of that cause.
    cause: Option<FriError>,
    causes: u32,
    /// Number and total duration, s, by reason.
    by_stop: BTreeMap<Stop, (u64, f64)>,
    /// Is a link in front of a surface, and number of times this began.
    is_in_front: bool,
    in_front: u64,
    cycles: u64,
    last_s: Option<f64>,
    longest_gap_s: f64,
}

impl Holds {
    /// Sets why the arm refuses a command; printed with the following hold.
    pub fn refused(&mut self, cause: &FriError) {
        let is_same = |before: &FriError| match (before, cause) {
            (FriError::Unfit(before), FriError::Unfit(now)) => before == now,
            _ => discriminant(before) == discriminant(cause),
        };
        if !self.cause.as_ref().is_some_and(is_same) {
            self.cause = Some(cause.clone());
            self.causes += 1;
        }
    }

    /// Has a latched hold been printed?
    pub(super) fn is_latched(&self) -> bool {
        self.under_way.is_some_and(|hold| hold.is_latched)
    }

    /// Prints the changes of a cycle.
    pub fn see(&mut self, t_s: f64, state: SessionState, is_latched: bool) {
        if let Some(words) = self.change(t_s, state, is_latched) {
            note(format_args!("{t_s:9.3} s  {words}"));
        }
    }

    fn change(&mut self, t_s: f64, state: SessionState, is_latched: bool) -> Option<String> {
        self.cycles += 1;
        let gap_s = self.last_s.replace(t_s).map_or(0.0, |last_s| t_s - last_s);
        self.longest_gap_s = self.longest_gap_s.max(gap_s);
        let hold = Stop::of(state).map(|stop| Hold {
            stop,
            state: match state {
                SessionState::Safe(safe) => safe.name(),
                _ => "holding",
            },
            is_latched,
            causes: if stop.is_refusal() { self.causes } else { 0 },
        });
        if hold == self.under_way {
            return None;
        }
        let before = std::mem::replace(&mut self.under_way, hold);
        let stop = hold.map(|hold| hold.stop);
        let ended = before
            .map(|hold| hold.stop)
            .filter(|was| stop != Some(*was));
        let told = ended.map(|ended| self.end(ended, t_s));
        let Some(Hold { stop, .. }) = hold else {
            // Also after the last printed hold: the console must not end on "stopped" while the arm moves.
            let was_latched = before.is_some_and(|hold| hold.is_latched);
            return (told? <= TOLD + 1 || was_latched).then(|| "the arm moves again".to_owned());
        };
        let (count, _) = self.by_stop.entry(stop).or_default();
        if before.is_none_or(|before| before.stop != stop) {
            *count += 1;
            self.since_s = t_s;
        }
        let ends = match (is_latched, stop.is_refusal()) {
            (true, _) => "needs a person: Enter here, or the page's button, lets the arm go",
            _ if *count > TOLD + 1 => return None,
            _ if *count == TOLD + 1 => "more of these are only counted",
            (false, true) => "ends by itself once commands are taken again and the arm rests",
            (false, false) => "ends by itself once that is over",
        };
        let words = match state {
            SessionState::Safe(safe) => safe.to_string(),
            _ => format!("holding: {stop}"),
        };
        let cause = self.cause.as_ref().filter(|_| stop.is_refusal());
        let cause = cause.map_or_else(String::new, |cause| format!(": {cause}"));
        Some(format!("{words}{cause} ({ends})"))
    }

    /// Ends the hold for this reason; returns the number of such holds.
    fn end(&mut self, stop: Stop, t_s: f64) -> u64 {
        if stop.is_refusal() {
            self.cause = None;
        }
        let (count, lasted_s) = self.by_stop.entry(stop).or_default();
        *lasted_s += t_s - self.since_s;
        *count
    }

    /// Prints once that a link is in front of a surface, until none is.
    pub fn see_link(&mut self, t_s: f64, found: Option<LinkInFront>) {
        let Some(LinkInFront { link, in_front_m }) = found else {
            self.is_in_front = false;
            return;
        };
        if std::mem::replace(&mut self.is_in_front, true) {
            return;
        }
        self.in_front += 1;
        if self.in_front <= TOLD {
            let mm = 1e3 * in_front_m;
            note(format_args!(
                "{t_s:9.3} s  link {link} of the arm is {mm:.0} mm in front of a wall, within reach of the person"
            ));
        }
    }

    /// Prints the summary.
    pub fn finish(mut self) {
        if let (Some(hold), Some(t_s)) = (self.under_way, self.last_s) {
            self.end(hold.stop, t_s);
        }
        let (cycles, gap_ms) = (self.cycles, 1e3 * self.longest_gap_s);
        note(format_args!(
            "{cycles} cycles, the longest gap between two {gap_ms:.1} ms"
        ));
        for (stop, (count, lasted_s)) in &self.by_stop {
            let times = counted(*count as usize, "time", "times");
            note(format_args!(
                "held for `{stop}`: {times}, {lasted_s:.1} s in all"
            ));
        }
        if self.in_front > 0 {
            let times = counted(self.in_front as usize, "time", "times");
            note(format_args!("a link in front of a wall: {times}"));
        }
    }
}

/// Prints, once in a program, which parts of the arm are not checked against each other from where it began.
pub fn tell_left_out(control: &Control) {
    static TOLD: Once = Once::new();
    let supervisor = control.supervisor();
    if let Some(supervisor) = supervisor.filter(|supervisor| supervisor.began().is_some())
        && let Some(line) = left_out(supervisor.separation().body())
    {
        TOLD.call_once(|| note(line));
    }
}

/// `None`: no part is left out.
fn left_out(body: &ArmBody) -> Option<String> {
    let pairs: Vec<String> = body.left_out().map(|pair| pair.to_string()).collect();
    (!pairs.is_empty()).then(|| {
        format!(
            "parts of the arm that are not kept apart, because their capsules overlap where it begins: {}",
            pairs.join(", ")
        )
    })
}

/// On the console, Enter resets a latched stop, `s` and Enter stops the arm.
pub(super) fn listen_to_console(view: &ViewSender) {
    let orders = view.orders();
    let listens = move || heed_console(&orders, stdin().lock());
    // Without the thread the page still has its buttons.
    let _ = std::thread::Builder::new()
        .name("console".to_owned())
        .spawn(listens);
}

/// The orders of a console, until it ends.
pub fn heed_console(orders: &Orders, console: impl BufRead) {
    for line in console.lines() {
        match line
            .as_deref()
            .map(|line| line.trim().to_lowercase())
            .as_deref()
        {
            Ok("") => orders.let_go(),
            Ok("s" | "stop") => orders.stop(),
            Ok(_) => note("Enter lets a stopped arm go; s and Enter stops it"),
            Err(_) => return,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall::haptics::body::BodyConfig;
    use hwall::haptics::safety::Channel;
    use hwall::haptics::{Board, SafeReason, SafeState};
    use hwall::kinematics::{ArmKinematics, JointPositions, SrsArm};
    use hwall_fri::Unfit;
    use hwall_fri::codec::SafetyState;

    #[test]
    fn parts_that_are_not_kept_apart_are_told() {
        let board = Board::default();
        let tool = board.flange_from_board_face().unwrap();
        let arm = SrsArm::iiwa7().carrying(tool);
        let mut body = ArmBody::new(arm, board, BodyConfig::default()).unwrap();
        body.fit(&JointPositions::default());
        assert_eq!(left_out(&body), None);
        let folded = [0.0, 100.0, 0.0, -119.0, 0.0, 115.0, 0.0];
        body.fit(&JointPositions::from_deg(folded));
        let line = left_out(&body).unwrap();
        assert!(line.contains("overlap where it begins: link "), "{line}");
    }

    #[test]
    fn holds_are_counted_by_reason_and_not_by_number() {
        let mut holds = Holds::default();
        for k in 0..30_u32 {
            let age_s = f64::from(k);
            let channel = Channel::Head;
            let reason = SafeReason::Stale { channel, age_s };
            let state = SessionState::Safe(SafeState::Holding { reason });
            holds.see(f64::from(2 * k), state, false);
            holds.see(f64::from(2 * k) + 0.5, state, false);
            holds.see(f64::from(2 * k + 1), SessionState::Waiting, false);
        }
        let held = holds.by_stop.values().next();
        assert_eq!(held, Some(&(30, 30.0)));
        assert_eq!((holds.cycles, holds.longest_gap_s), (90, 1.0));
    }

    /// Regression: only a new reason was printed.
    #[test]
    fn a_hold_that_withdraws_and_stops_is_told_and_counted_once() {
        let mut holds = Holds::default();
        let mut said = Vec::new();
        for cycle in 0..50 {
            let age_s = f64::from(cycle);
            let channel = Channel::Fingertip;
            let reason = SafeReason::Stale { channel, age_s };
            let state = match cycle {
                0..10 => SafeState::Holding { reason },
                10..30 => SafeState::Retreating { reason },
                _ => SafeState::Stopped { reason },
            };
            said.extend(holds.change(age_s, SessionState::Safe(state), false));
        }
        said.extend(holds.change(50.0, SessionState::Waiting, false));
        let begins = ["holding: ", "withdrawing: ", "stopped: ", "the arm moves"];
        let found = said
            .iter()
            .zip(begins)
            .all(|(line, begin)| line.starts_with(begin));
        assert!(found && said.len() == begins.len(), "{said:?}");
        assert_eq!(holds.by_stop.values().next(), Some(&(1, 50.0)));
    }

    #[test]
    fn an_arm_that_takes_no_commands_is_told_with_the_cause() {
        let refused = SessionState::Safe(SafeState::Holding {
            reason: SafeReason::Refused,
        });
        let unfit = |safety| FriError::Unfit(Unfit::Safety(safety));
        let mut holds = Holds::default();
        let mut said = Vec::new();
        for (cycle, cause) in [
            FriError::Behind { behind_s: 0.2 },
            FriError::Behind { behind_s: 0.3 },
            unfit(SafetyState::StopLevel1),
            unfit(SafetyState::StopLevel1),
        ]
        .iter()
        .enumerate()
        {
            holds.refused(cause);
            said.extend(holds.change(cycle as f64, refused, false));
        }
        said.extend(holds.change(4.0, SessionState::Waiting, false));
        assert_eq!(said.len(), 3, "{said:?}");
        assert!(said[0].contains("0.20 s behind") && said[1].contains("safety state"));
    }
}
