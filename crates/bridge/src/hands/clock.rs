//! The headset's clock relative to the server's.

use super::window::WindowMinimum;

/// Samples are compared over this time, s; the one with the least delay counts.
const WINDOW_S: f64 = 10.0;
/// A clock whose offset changes by more than this has jumped, s; delays do not shrink by as much.
const LEAP_S: f64 = 0.05;
/// This many samples in a row must agree that the clock has jumped.
const AGREEING: u32 = 3;
/// The estimate changes by at most this share of the elapsed time, so that times stay in order.
const SLEW: f64 = 0.02;

/// Interpretation of a time of the headset's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ClockReading {
    /// The same instant on the server's clock, s.
    At(f64),
    /// The clock has jumped; the next samples show the new offset.
    Leapt,
}

/// Offset between two clocks from samples with unknown delays.
///
/// For each sample, offset = (time of receipt) - (time of sending) - (delay). The least difference within ten seconds has the least delay;
/// half of the least round trip within that time is subtracted from it. The error is at most half of that round trip, plus the drift of the
/// clocks within ten seconds (1 ms at 100 ppm).
/// Source: the clock filter of NTP, [RFC 5905], section 10, for one-way samples.
#[derive(Debug, Clone)]
pub(crate) struct ClockOffset {
    one_way_s: WindowMinimum,
    round_trip_s: WindowMinimum,
    /// Current offset, s, and when it was set, s.
    offset: Option<(f64, f64)>,
    suspects: u32,
    suspect_s: f64,
    suspected_since_s: f64,
    /// The newest round trip: its begin and its duration, s.
    newest_trip: Option<(f64, f64)>,
}

impl ClockOffset {
    pub(crate) const fn new() -> Self {
        Self {
            one_way_s: WindowMinimum::new(WINDOW_S),
            round_trip_s: WindowMinimum::new(WINDOW_S),
            offset: None,
            suspects: 0,
            suspect_s: 0.0,
            suspected_since_s: 0.0,
            newest_trip: None,
        }
    }

    /// A message sent at `client_s` arrived at `now_s`. All times are finite.
    pub(crate) fn sample(&mut self, now_s: f64, client_s: f64) -> ClockReading {
        let difference_s = now_s - client_s;
        if self.has_leapt(now_s, difference_s) {
            return ClockReading::Leapt;
        }
        self.one_way_s.add(now_s, difference_s);
        let one_way_s = self.one_way_s.minimum(now_s).unwrap_or(difference_s);
        let trip_s = self.round_trip_s.minimum(now_s).unwrap_or(0.0);
        let wanted_s = one_way_s - 0.5 * trip_s;
        let offset_s = match self.offset {
            None => wanted_s,
            Some((offset_s, set_s)) => {
                let most_s = SLEW * (now_s - set_s).max(0.0);
                offset_s + (wanted_s - offset_s).clamp(-most_s, most_s)
            }
        };
        self.offset = Some((offset_s, now_s));
        // The first samples may have been the slowest. Until the offset has followed, no sample may be in the future.
        ClockReading::At((client_s + offset_s).min(now_s))
    }

    /// A message sent to the client at `sent_s` was answered at `now_s`.
    pub(crate) fn round_trip(&mut self, sent_s: f64, now_s: f64) {
        let trip_s = now_s - sent_s;
        if trip_s >= 0.0 {
            self.round_trip_s.add(now_s, trip_s);
            self.newest_trip = Some((sent_s, trip_s));
        }
    }

    /// Was the clock set? Once several samples agree, the new offset is used.
    fn has_leapt(&mut self, now_s: f64, difference_s: f64) -> bool {
        let Some(least_s) = self.one_way_s.minimum(now_s) else {
            return false;
        };
        let excess_s = difference_s - least_s;
        let forward = excess_s < -LEAP_S;
        // A late sample may only have been delayed, unless a round trip since then was fast.
        let late = excess_s > LEAP_S;
        if !(forward || late) {
            self.suspects = 0;
            return false;
        }
        if self.suspects == 0 || (difference_s - self.suspect_s).abs() > LEAP_S {
            self.suspects = 0;
            self.suspected_since_s = now_s;
            self.suspect_s = difference_s;
        }
        self.suspects += 1;
        let was_fast = self.newest_trip.is_some_and(|(sent_s, trip_s)| {
            sent_s >= self.suspected_since_s && trip_s < excess_s - LEAP_S
        });
        let is_set = self.suspects >= AGREEING && (forward || was_fast);
        if is_set {
            let round_trip_s = self.round_trip_s.clone();
            *self = Self {
                round_trip_s,
                ..Self::new()
            };
            return false;
        }
        forward
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::Sampler;

    /// The time of a reading that is no leap.
    fn at_s(reading: ClockReading) -> f64 {
        match reading {
            ClockReading::At(t_s) => t_s,
            leapt => panic!("{leapt:?}"),
        }
    }

    /// Feeds samples at 72 Hz, with a delay of `least_s` to `least_s + more_s`; returns the largest error after `from_s`.
    fn worst_error_s(drift: f64, least_s: f64, more_s: f64, from_s: f64) -> f64 {
        let mut clock = ClockOffset::new();
        let mut sampler = Sampler::new(7);
        let mut worst_s: f64 = 0.0;
        let mut last_s = f64::NEG_INFINITY;
        for n in 0..72 * 60 {
            let sent_s = f64::from(n) / 72.0;
            let client_s = 1234.5 + sent_s * (1.0 + drift);
            let now_s = sent_s + sampler.uniform(least_s, least_s + more_s);
            if n % 18 == 0 {
                let back_s = sampler.uniform(least_s, least_s + more_s);
                let there_s = sampler.uniform(least_s, least_s + more_s);
                clock.round_trip(now_s - back_s - there_s, now_s);
            }
            let t_s = at_s(clock.sample(now_s, client_s));
            assert!(t_s > last_s, "times stay in order");
            last_s = t_s;
            if sent_s > from_s {
                worst_s = worst_s.max((t_s - sent_s).abs());
            }
        }
        worst_s
    }

    #[test]
    fn the_offset_is_found_within_half_of_the_least_round_trip() {
        assert!(worst_error_s(0.0, 0.001, 0.01, 5.0) < 0.003);
        assert!(worst_error_s(0.0, 0.02, 0.04, 5.0) < 0.01);
    }

    #[test]
    fn a_drifting_clock_is_followed() {
        for drift in [-1e-4, 1e-4] {
            assert!(worst_error_s(drift, 0.001, 0.01, 5.0) < 0.003);
        }
    }

    #[test]
    fn no_sample_is_of_the_future() {
        let mut clock = ClockOffset::new();
        let (mut last_s, mut error_s) = (f64::NEG_INFINITY, f64::INFINITY);
        for n in 0..1000 {
            // The first samples come late and together.
            let sent_s = 0.014 * f64::from(n);
            let now_s = (sent_s + 0.001).max(0.045);
            let t_s = at_s(clock.sample(now_s, sent_s));
            assert!(t_s <= now_s && t_s >= last_s, "{last_s} {t_s} {now_s}");
            (last_s, error_s) = (t_s, t_s - sent_s);
        }
        assert!(error_s.abs() < 0.002, "{error_s}");
    }

    #[test]
    fn a_clock_that_is_set_forward_is_believed_after_three_samples() {
        let mut clock = ClockOffset::new();
        for n in 0..10 {
            let t_s = 0.01 * f64::from(n);
            at_s(clock.sample(t_s, t_s));
        }
        // One wrong stamp changes nothing.
        assert_eq!(clock.sample(0.11, 50.0), ClockReading::Leapt);
        assert_eq!(clock.sample(0.12, 0.12), ClockReading::At(0.12));
        assert_eq!(clock.sample(0.13, 100.13), ClockReading::Leapt);
        assert_eq!(clock.sample(0.14, 100.14), ClockReading::Leapt);
        assert!((at_s(clock.sample(0.15, 100.15)) - 0.15).abs() < 1e-9);
    }

    #[test]
    fn a_clock_that_is_set_back_is_told_from_a_slow_network_by_a_round_trip() {
        let mut clock = ClockOffset::new();
        for n in 0..10 {
            let t_s = 0.01 * f64::from(n);
            clock.sample(t_s, t_s + 100.0);
        }
        // Without a round trip since then it may be the network: stale, but no jump.
        for n in 10..20 {
            let t_s = 0.01 * f64::from(n);
            assert!(t_s - at_s(clock.sample(t_s, t_s)) > 99.0);
        }
        clock.round_trip(0.2, 0.202);
        assert!((at_s(clock.sample(0.21, 0.21)) - 0.209).abs() < 2e-3);
    }
}
