//! Time-scaled copies of reaches.

use hwall_hand::{LabelledReach, Recording, Sample};

/// Longest gap between samples that is interpolated, in median sample intervals.
const LONGEST_GAP_STEPS: f64 = 2.5;
/// Multiples of this number, the hardest to approximate by fractions, are spread evenly modulo 1, and so is any regular subsequence of them.
const GOLDEN_RATIO: f64 = 1.618_033_988_749_895;

/// One copy of each reach, half of them slower by this factor, the others faster.
///
/// People move along much the same paths at different speeds, with proportional speed profiles [Atkeson 1985]. So a scaled reach shows how other
/// people would have moved, and a model of a few people does not have to extrapolate to slower hands.
pub(in crate::learned) fn at_another_speed(
    reaches: &[&LabelledReach],
    times: f64,
) -> Vec<LabelledReach> {
    // Not in step with any cycle of places: otherwise a person who alternates between walls would be learned as slow at one and fast at the other.
    let speed = |index: usize| match (index as f64 * GOLDEN_RATIO).fract() < 0.5 {
        true => times,
        false => times.recip(),
    };
    let copies = reaches.iter().enumerate();
    copies.map(|(k, reach)| at_speed(reach, speed(k))).collect()
}

/// The reach slowed down by the factor `times`, with the same contact and sampling rate.
fn at_speed(reach: &LabelledReach, times: f64) -> LabelledReach {
    let mut copy = reach.clone();
    if let Some(samples) = resampled(reach, times) {
        copy.frames = samples.into_iter().map(|sample| sample.frame).collect();
    }
    slow_down(&mut copy, times);
    if copy.validate().is_err() {
        // Too few samples remain after resampling.
        copy.frames.clone_from(&reach.frames);
        slow_down(&mut copy, times);
    }
    copy
}

/// The samples at `times` times the rate; `None` if the recording cannot be resampled.
fn resampled(reach: &LabelledReach, times: f64) -> Option<Vec<Sample>> {
    let samples: Vec<Sample> = reach
        .frames
        .iter()
        .map(|frame| Sample {
            frame: *frame,
            ..Sample::default()
        })
        .collect();
    let (first, last) = (samples.first()?.frame.t_s, samples.last()?.frame.t_s);
    let step_s = (last - first) / (samples.len() - 1) as f64;
    let recording = Recording {
        samples,
        ..Recording::default()
    };
    let dense = recording.resampled(step_s / times, LONGEST_GAP_STEPS * step_s);
    dense.ok().map(|dense| dense.samples)
}

/// Scales all times before the contact by `times`.
fn slow_down(reach: &mut LabelledReach, times: f64) {
    let contact_s = reach.contact_s;
    for frame in &mut reach.frames {
        // Rounding can put the last sample after the contact; it then counts as at the contact.
        let before_s = (contact_s - frame.t_s).max(0.0);
        frame.t_s = contact_s - times * before_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hwall_hand::{HandFrame, HandPoint};

    fn place_m(share: f64) -> DVec3 {
        DVec3::new(0.4 * share, 0.1 * share * share, 0.7)
    }

    /// 0.8 s at 90 Hz.
    fn reach() -> LabelledReach {
        let frames = (0..=72).map(|i| {
            let mut frame = HandFrame::empty(3.0 + f64::from(i) / 90.0);
            frame.set_point(HandPoint::Index, Some(place_m(f64::from(i) / 72.0)));
            frame
        });
        LabelledReach::new(HandPoint::Index, frames.collect(), place_m(1.0), 3.8)
    }

    #[test]
    fn a_copy_takes_the_same_way_in_another_time() {
        let made = reach();
        let copies = at_another_speed(&[&made, &made], 1.6);
        for (copy, times) in copies.iter().zip([1.6, 1.0 / 1.6]) {
            copy.validate().expect("a reach");
            assert_eq!(copy.contact_s, made.contact_s);
            assert!((copy.duration_s() - times * 0.8).abs() < 1e-9);
            let steps = copy.frames.windows(2).map(|w| w[1].t_s - w[0].t_s);
            // The sampling rate is kept, to one sample.
            assert!(steps.into_iter().all(|s| (s * 90.0 - 1.0).abs() < 1e-6));
            for frame in &copy.frames {
                let share = 1.0 - (copy.contact_s - frame.t_s) / (times * 0.8);
                let seen_m = frame.point(HandPoint::Index).expect("seen");
                assert!(seen_m.distance(place_m(share)) < 1e-4);
            }
        }
    }

    #[test]
    fn no_turn_of_places_is_only_made_slow() {
        let made = reach();
        let copies = at_another_speed(&[&made; 120], 2.0);
        let is_slow = |copy: &LabelledReach| copy.duration_s() > made.duration_s();
        for of in 1..=8 {
            for place in 0..of {
                let of_place = || copies.iter().skip(place).step_by(of);
                let slow = of_place().filter(|copy| is_slow(copy)).count();
                let share = slow as f64 / of_place().count() as f64;
                assert!((0.25..=0.75).contains(&share), "{place} of {of}: {share}");
            }
        }
    }

    #[test]
    fn a_reach_of_which_hardly_anything_was_seen_has_a_copy_too() {
        let mut made = reach();
        for (i, frame) in made.frames.iter_mut().enumerate() {
            if i % 12 != 0 {
                frame.set_point(HandPoint::Index, None);
            }
        }
        for copy in at_another_speed(&[&made, &made], 1.7) {
            copy.validate().expect("a reach");
        }
    }
}
