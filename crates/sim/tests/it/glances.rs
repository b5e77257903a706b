//! People who look around between touches, and those who do not.

use crate::common::{self, plan};
use glam::DVec3;
use hwall_sim::{Glance, Person, PersonConfig, ReachPlan, TouchPlan, TouchSequence, TouchTruth};
use hwall_testkit::{Sampler, Tol, assert_close};

/// Points to glance at, all over the walls.
fn in_view() -> Vec<DVec3> {
    let mut sampler = Sampler::new(99);
    let one = |_| sampler.point_in_box(DVec3::new(0.3, -0.8, 0.2), DVec3::new(0.6, 0.8, 1.4));
    (0..40).map(one).collect()
}

fn looking(config: PersonConfig, seed: u64, count: usize) -> TouchSequence {
    let reaches: Vec<ReachPlan> = plan(seed, count).into_iter().map(Into::into).collect();
    let person = Person::new(config, seed).unwrap();
    person.plan_looking(&reaches, &in_view()).unwrap()
}

fn glances(touch: &TouchTruth) -> Vec<Glance> {
    touch.glances.iter().flatten().copied().collect()
}

/// Angle of the true gaze to a point, rad.
fn off_rad(sequence: &TouchSequence, t_s: f64, at_m: DVec3) -> f64 {
    let truth = sequence.truth(t_s);
    truth.gaze.angle_between(at_m - truth.head_m)
}

#[test]
fn glances_last_as_asked_and_lead_to_the_target_without_a_break() {
    let config = PersonConfig::glancing();
    let mut counts = [0; PersonConfig::MOST_GLANCES + 1];
    let (mut back, mut all) = (0, 0_u32);
    for seed in 0..40 {
        let sequence = looking(config, seed, 12);
        let mut rest_from_s = 0.0;
        for touch in sequence.touches() {
            let glances = glances(touch);
            counts[glances.len()] += 1;
            if let (Some(first), Some(last)) = (glances.first(), glances.last()) {
                assert!(first.from_s >= rest_from_s - 1e-9);
                assert_close!(last.until_s, touch.look_s, Tol::abs(1e-12));
            }
            for pair in glances.windows(2) {
                assert_close!(pair[0].until_s, pair[1].from_s, Tol::abs(1e-12));
                assert!(pair[0].at_m.distance(pair[1].at_m) >= 0.2);
            }
            for glance in &glances {
                let rest_s = glance.until_s - glance.landed_s;
                assert!((0.2 - 1e-9..=0.6 + 1e-9).contains(&rest_s), "{rest_s}");
                assert_close!(glance.landed_s - glance.from_s, 0.06, Tol::abs(1e-9));
                assert!(glance.at_m.distance(touch.target_m) >= 0.2);
                // Three standard deviations in each direction.
                for t_s in [glance.landed_s + 1e-6, glance.until_s - 1e-6] {
                    let off = off_rad(&sequence, t_s, glance.at_m).to_degrees();
                    assert!(off < 5.5, "{off} degrees off");
                }
            }
            all += 1;
            let seen = |g: &Glance| glances.iter().filter(|o| o.at_m == g.at_m).count() > 1;
            back += u32::from(glances.iter().any(seen));
            // The pause has the drawn length, or is longer if the glances need more time.
            let pause_s = touch.look_s - rest_from_s;
            assert!((0.5..=4.0 * 0.66).contains(&pause_s), "{pause_s}");
            rest_from_s = touch.end_s;
        }
    }
    // 0 to 3 glances are equally frequent, and sometimes there is a return; with a single point, only to the
    // point touched before.
    let share = |n: usize| f64::from(counts[n]) / f64::from(all);
    assert!((0.15..0.25).contains(&share(0)), "{counts:?}");
    assert!((0.04..0.12).contains(&share(4)), "{counts:?}");
    assert!(back > 0 && back * 10 < all * 3);
}

#[test]
fn the_gaze_lands_on_the_target_when_it_is_said_to() {
    for config in [
        PersonConfig::default(),
        PersonConfig::fast(),
        PersonConfig::slow(),
        PersonConfig::glancing(),
        PersonConfig::varied(),
    ] {
        for seed in 0..20 {
            let sequence = looking(config, seed, 6);
            for touch in sequence.touches() {
                assert_eq!(touch.landed_s.is_none(), touch.gaze_missed);
                let Some(landed_s) = touch.landed_s else {
                    // The gaze is off target until the hand withdraws.
                    let from_s = touch.look_s + 0.06;
                    for share in 0..=20 {
                        let t_s = from_s + f64::from(share) / 20.0 * (touch.contact_s - from_s);
                        assert!(off_rad(&sequence, t_s, touch.target_m) > 0.2);
                    }
                    continue;
                };
                assert_close!(landed_s, touch.look_s + 0.06, Tol::abs(1e-9));
                let there = off_rad(&sequence, landed_s + 1e-6, touch.target_m);
                assert!(there.to_degrees() < 5.5, "{}", there.to_degrees());
            }
        }
    }
}

#[test]
fn a_change_of_mind_lands_on_what_is_touched_in_the_end() {
    let sequence = common::changing(PersonConfig::default(), 3, 8);
    for touch in sequence.touches() {
        let switch_s = touch.changed.unwrap().switch_s;
        let landed_s = touch.landed_s.unwrap();
        assert!(landed_s > touch.look_s + 0.06 && landed_s < switch_s + 0.06);
        let there = off_rad(&sequence, landed_s + 1e-6, touch.target_m);
        assert!(there.to_degrees() < 5.5);
    }
}

#[test]
fn a_gaze_that_glances_never_leaps() {
    let [a, b] = [(); 2].map(|()| looking(PersonConfig::glancing(), 4, 12));
    assert_eq!(a, b);
    // The peak speed of a saccade is 1.875 times its angle over its duration.
    let dt_s = 1e-4;
    let steps = (a.duration_s() / dt_s) as u32;
    let mut before = a.truth(0.0).gaze;
    for i in 1..steps {
        let gaze = a.truth(f64::from(i) * dt_s).gaze;
        assert!(gaze.angle_between(before) < 1.9 * 2.5 / 0.06 * dt_s);
        before = gaze;
    }
}

#[test]
fn glances_change_nothing_but_the_gaze_and_the_pauses() {
    let of = |config| looking(config, 8, 12);
    let (plain, glancing) = (of(PersonConfig::default()), of(PersonConfig::glancing()));
    for (a, b) in plain.touches().iter().zip(glancing.touches()) {
        let touched = |t: &TouchTruth| (t.target_m, t.normal, t.depth_m);
        assert_eq!(touched(a), touched(b));
        assert_close!(a.start_s - a.look_s, b.start_s - b.look_s, Tol::abs(1e-9));
        // The crossing of the surface depends on the phase of the tremor.
        let [a_s, b_s] = [a, b].map(|t| t.contact_s - t.start_s);
        assert_close!(a_s, b_s, Tol::abs(5e-3));
        let [a_s, b_s] = [a, b].map(|t| t.end_s - t.withdraw_s);
        assert_close!(a_s, b_s, Tol::abs(1e-9));
    }
    // Without glances the points in view have no effect; without points there are no glances.
    let reaches: Vec<ReachPlan> = plan(8, 12).into_iter().map(Into::into).collect();
    for config in [PersonConfig::default(), PersonConfig::varied()] {
        let person = Person::new(config, 8).unwrap();
        let without = person.plan_reaches(&reaches).unwrap();
        assert_eq!(person.plan_looking(&reaches, &in_view()).unwrap(), without);
    }
    let person = Person::new(PersonConfig::glancing(), 8).unwrap();
    let blind = person.plan_reaches(&reaches).unwrap();
    // The gaze may still return to the point touched before.
    let touched = |t_m: DVec3| reaches.iter().any(|r| r.touch.target_m == t_m);
    for touch in blind.touches() {
        assert!(glances(touch).len() <= 1);
        assert!(glances(touch).iter().all(|g| touched(g.at_m)));
    }
}

const GOLDEN: &str = "
plain 1 6.9168886311032205 7.180962460686765 7.687600982547226 8.965087375971626
-0.9819898831808425 0.0010183855223979167 -0.18893076038962744
-0.877374457442695 0.298849091294624 -0.37537085936379505;
plain 7 8.23125426315882 8.541624486693724 9.371964474141222 11.025379787732557
-0.9810032679646346 -0.010012925910756873 -0.1937326238851188
-0.8804984411135099 0.3347541969379237 -0.3356517880618619;
varied 1 6.894743315943233 7.217165932080454 7.724031461379857 9.047072461883749
-0.9782115871216019 0.003500186565032639 -0.20758092281095164
-0.8784694217020019 0.2636440382678483 -0.3984762178855489;
varied 7 8.54429770726021 8.89474062563079 9.666738209491765 11.415737944930795
-0.9783643926495532 -0.009193062872458886 -0.20668479090270334
-0.8942735477977054 0.4042911639112042 -0.19189444101544215";

/// Regression: sequences of nominal and varied people without glances are unchanged.
#[test]
fn people_of_a_seed_stay_who_they_were() {
    let plans = [(0.6, -0.2, 0.5), (0.5, 0.3, 0.7), (0.55, 0.0, 0.4)].map(|(x, y, z)| TouchPlan {
        target_m: DVec3::new(x, y, z),
        normal: DVec3::X,
    });
    // Gaze shift, start, contact and end of the last touch; gaze at 30 % and 50 % of the time.
    for row in GOLDEN.split(';') {
        let mut words = row.split_whitespace();
        let config = match words.next() {
            Some("plain") => PersonConfig::default(),
            _ => PersonConfig::varied(),
        };
        let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
        let [seed, times_s @ .., a, b, c, d, e, f] = &numbers[..] else {
            panic!("{row}");
        };
        let person = Person::new(config, *seed as u64).unwrap();
        let sequence = person.plan(&plans).unwrap();
        let last = sequence.touches()[2];
        let measured_s = [last.look_s, last.start_s, last.contact_s, last.end_s];
        assert_close!(measured_s.to_vec(), times_s.to_vec(), Tol::abs(1e-12));
        // The noise of a sample is seeded by the bits of its time, which have not changed.
        for (share, golden) in [(0.3, [*a, *b, *c]), (0.5, [*d, *e, *f])] {
            let gaze = sequence.sample(share * sequence.duration_s()).gaze;
            assert!(gaze.distance(DVec3::from_array(golden)) < 1e-9);
        }
    }
}

#[test]
fn what_is_in_view_must_be_finite() {
    let person = Person::new(PersonConfig::glancing(), 1).unwrap();
    let reaches: Vec<ReachPlan> = plan(1, 2).into_iter().map(Into::into).collect();
    let nan = [DVec3::X, DVec3::new(0.5, f64::NAN, 0.5)];
    let error = person.plan_looking(&reaches, &nan).unwrap_err().to_string();
    assert!(error.contains("in_view_m"), "{error}");
}
