//! What stops the arm, said on the console: every change once, and a summary at the end.

use crate::console::note;
use crate::input::numbers::counted;
use crate::run::kept::tick::Stop;
use hwall::SessionState;
use hwall::haptics::LinkInFront;
use hwall_bridge::ViewSender;
use std::collections::BTreeMap;
use std::io::{BufRead, stdin};

/// Holds of the same kind that are told one by one; more are only counted, for a console that scrolls tells nobody anything.
const TOLD: u64 = 20;

/// The hold under way.
#[derive(Debug)]
struct Hold {
    name: String,
    is_latched: bool,
    since_s: f64,
}

/// Watches the states of a session.
#[derive(Debug, Default)]
pub struct Holds {
    under_way: Option<Hold>,
    /// How many, and for how long, s, by name.
    by_name: BTreeMap<String, (u64, f64)>,
    /// A link is in front of a surface.
    is_in_front: bool,
    cycles: u64,
    last_s: Option<f64>,
    longest_gap_s: f64,
}

impl Holds {
    /// Says what is new in a cycle.
    pub fn see(&mut self, t_s: f64, state: SessionState, is_latched: bool) {
        self.cycles += 1;
        let gap_s = self.last_s.replace(t_s).map_or(0.0, |last_s| t_s - last_s);
        self.longest_gap_s = self.longest_gap_s.max(gap_s);
        let hold = named(state);
        let name = hold.as_ref().map(|(name, _)| (name.as_str(), is_latched));
        let under_way = self.under_way.as_ref();
        if name == under_way.map(|hold| (hold.name.as_str(), hold.is_latched)) {
            return;
        }
        let ended = self.end(t_s);
        match hold {
            Some((name, words)) => {
                let (count, _) = self.by_name.entry(name.clone()).or_default();
                *count += 1;
                if *count <= TOLD {
                    let ends = match is_latched {
                        true => "needs a person: Enter here, or the page's button, lets the arm go",
                        false => "ends by itself once that is over",
                    };
                    note(format_args!("{t_s:9.3} s  {words} ({ends})"));
                } else if *count == TOLD + 1 {
                    note(format_args!(
                        "{t_s:9.3} s  {words} (more of these are only counted)"
                    ));
                }
                self.under_way = Some(Hold {
                    name,
                    is_latched,
                    since_s: t_s,
                });
            }
            None => {
                if ended.is_some_and(|count| count <= TOLD) {
                    note(format_args!("{t_s:9.3} s  the arm moves again"));
                }
            }
        }
    }

    /// Says that a link is in front of a surface, once until none is.
    pub fn see_link(&mut self, t_s: f64, found: Option<LinkInFront>) {
        let Some(LinkInFront { link, in_front_m }) = found else {
            self.is_in_front = false;
            return;
        };
        if std::mem::replace(&mut self.is_in_front, true) {
            return;
        }
        let (count, _) = (self.by_name.entry("in front of a wall".to_owned())).or_default();
        *count += 1;
        if *count <= TOLD {
            let mm = 1e3 * in_front_m;
            note(format_args!(
                "{t_s:9.3} s  link {link} of the arm is {mm:.0} mm in front of a wall, within reach of the person"
            ));
        }
    }

    /// Ends the hold under way; how many there were of its kind.
    fn end(&mut self, t_s: f64) -> Option<u64> {
        let hold = self.under_way.take()?;
        let (count, lasted_s) = self.by_name.get_mut(&hold.name)?;
        *lasted_s += t_s - hold.since_s;
        Some(*count)
    }

    /// Says the summary.
    pub fn finish(mut self) {
        if let Some(t_s) = self.last_s {
            self.end(t_s);
        }
        let (cycles, gap_ms) = (self.cycles, 1e3 * self.longest_gap_s);
        note(format_args!(
            "{cycles} cycles, the longest gap between two {gap_ms:.1} ms"
        ));
        for (name, (count, lasted_s)) in &self.by_name {
            let times = counted(*count as usize, "time", "times");
            note(format_args!("{name}: {times}, {lasted_s:.1} s in all"));
        }
    }
}

/// A state in which the arm does not go where it is wanted: its name without numbers, and its words.
fn named(state: SessionState) -> Option<(String, String)> {
    let name = Stop::of(state)?.to_string();
    let words = match state {
        SessionState::Safe(safe) => safe.to_string(),
        _ => format!("holding: {name}"),
    };
    Some((name, words))
}

/// Enter on the console lets a latched stop go, `s` and Enter stops the arm.
pub(super) fn listen_to_console(view: &ViewSender) {
    let orders = view.orders();
    let listens = move || {
        for line in stdin().lock().lines() {
            match line.as_deref().map(str::trim) {
                Ok("") => orders.let_go(),
                Ok("s" | "stop") => orders.stop(),
                Ok(_) => note("Enter lets a stopped arm go; s and Enter stops it"),
                Err(_) => return,
            }
        }
    };
    // Without it the page still has its buttons.
    let _ = std::thread::Builder::new()
        .name("console".to_owned())
        .spawn(listens);
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall::haptics::safety::Channel;
    use hwall::haptics::{SafeReason, SafeState};

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
        let held = holds.by_name.get("stale head");
        assert_eq!(held, Some(&(30, 30.0)));
        assert_eq!((holds.cycles, holds.longest_gap_s), (90, 1.0));
    }
}
