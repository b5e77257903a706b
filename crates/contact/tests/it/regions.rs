//! Learned regions have the stated coverage at every moment, although errors have heavy tails and shrink towards the end.

use crate::common::{ball, minimum_jerk};
use glam::DVec3;
use hwall_contact::{
    ContactError, ContactEstimate, ContactEstimator, FusedConfig, FusedPredictor, LabelledStream,
    Predictor, PredictorInput, REGION_SHARES, RegionModel, RegionSizes, StreamContact,
    StreamFilters, TimeToContact,
};
use hwall_hand::{Gaze, HandFilter, HandFilterConfig, HandFrame, HandPoint};
use hwall_scene::Scene;
use hwall_testkit::Sampler;

const WALL: &str = "o wall\nv 0 -2 0\nv 0 2 0\nv 0 2 3\nv 0 -2 3\nf 1 2 3 4\n";
const HOME: DVec3 = DVec3::new(0.6, 0.0, 1.2);
const PERIOD_S: f64 = 1.0 / 90.0;
/// Durations of a reach, and of a reach with the return and a rest, s.
const REACH_S: f64 = 0.8;
const CYCLE_S: f64 = 2.4;
/// The stated standard deviation, m.
const STATED_M: f64 = 0.03;

/// Reaches from one place to a wall, and an estimator with a random error per reach.
#[derive(Clone)]
struct Person {
    frames: Vec<HandFrame>,
    contacts: Vec<StreamContact>,
    /// In units of the stated standard deviation.
    errors: Vec<DVec3>,
}

fn person(sampler: &mut Sampler, touches: usize) -> Person {
    let mut person = Person {
        frames: Vec::new(),
        contacts: Vec::new(),
        errors: Vec::new(),
    };
    for touch in 0..touches {
        let point_m = DVec3::new(0.0, sampler.uniform(-0.3, 0.3), sampler.uniform(1.0, 1.4));
        // Three in four errors are much smaller than stated, one is larger.
        let usual = sampler.uniform(0.0, 1.0) < 0.75;
        let size = if usual { 0.3 } else { 1.5 };
        let error = DVec3::new(0.0, sampler.normal(), sampler.normal()) * size;
        let start_s = CYCLE_S * touch as f64 + 0.5;
        person.contacts.push(StreamContact {
            point_m,
            contact_s: start_s + REACH_S,
        });
        person.errors.push(error);
        for k in 0..(CYCLE_S / PERIOD_S) as usize {
            let t_s = CYCLE_S * touch as f64 + k as f64 * PERIOD_S;
            let there = minimum_jerk((t_s - start_s) / REACH_S);
            let back = minimum_jerk((t_s - start_s - REACH_S - 0.1) / 0.6);
            let mut frame = HandFrame::empty(t_s);
            frame.set_point(HandPoint::Index, Some(HOME.lerp(point_m, there - back)));
            person.frames.push(frame);
        }
    }
    person
}

/// The error of the reach, shrinking with the remaining distance; the stated error is constant.
#[derive(Clone)]
struct Planted(Person);

impl ContactEstimator for Planted {
    fn begin(&mut self) {}

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let due = |c: &StreamContact| c.contact_s > frame.t_s;
        let next = self.0.contacts.iter().position(due)?;
        let contact = self.0.contacts[next];
        let way_m = frame.point(HandPoint::Index)?.distance(contact.point_m);
        let off_m = self.0.errors[next] * (STATED_M * (way_m / 0.3).min(1.0));
        Some(ContactEstimate {
            covariance_m2: Some(ball(STATED_M)),
            time_to_contact_s: Some(TimeToContact {
                mean_s: contact.contact_s - frame.t_s,
                sd_s: None,
            }),
            ..ContactEstimate::of_point(frame.t_s, contact.point_m + off_m)
        })
    }
}

fn config(regions: Option<RegionModel>) -> FusedConfig {
    FusedConfig {
        registration_sd_m: 0.001,
        regions,
        ..FusedConfig::default()
    }
}

fn learnt(scene: &Scene, people: &[Person]) -> Result<RegionModel, ContactError> {
    let streams: Vec<LabelledStream<'_>> = people
        .iter()
        .map(|p| LabelledStream {
            frames: &p.frames,
            contacts: &p.contacts,
        })
        .collect();
    let filters = StreamFilters {
        hand: HandFilterConfig::simulated(),
        ..StreamFilters::default()
    };
    let predictor = |k: usize| FusedPredictor::new(Planted(people[k].clone()), config(None));
    RegionModel::fit_streams(scene, &streams, predictor, &filters)
}

/// Coverage of the regions at this remaining distance, m.
fn held(scene: &Scene, people: &[Person], regions: Option<RegionModel>, left_m: f64) -> [f64; 3] {
    let (mut held, mut count) = ([0.0; 3], 0.0);
    for person in people {
        let mut predictor =
            FusedPredictor::new(Planted(person.clone()), config(regions)).expect("settings");
        let mut hand = HandFilter::new(HandFilterConfig::simulated()).expect("settings");
        let mut due = person.contacts.iter().peekable();
        for frame in &person.frames {
            let Some(contact) = due.peek() else { break };
            let tracking = hand.step(frame);
            let input = PredictorInput {
                frame,
                hand: tracking.state(),
                gaze: Gaze::Lost,
            };
            let first = predictor.predict(scene, &input).first().copied();
            let near_m = frame
                .point(HandPoint::Index)
                .map_or(9.0, |p| p.distance(contact.point_m));
            let reaches = frame.t_s > contact.contact_s - REACH_S;
            if near_m > left_m || !reaches {
                continue;
            }
            let first = first.expect("a wall");
            let squared = first.squared_deviations(contact.point_m).expect("stated");
            for (held, most) in held.iter_mut().zip(first.regions.squared()) {
                *held += f64::from(squared <= most);
            }
            count += 1.0;
            due.next();
        }
    }
    assert!(count > 100.0);
    held.map(|held| held / count)
}

#[test]
fn they_hold_what_they_say_at_every_moment() {
    let (scene, _) = Scene::from_obj_str(WALL, None).expect("a wall");
    let mut sampler = Sampler::new(7);
    let people: Vec<Person> = (0..30).map(|_| person(&mut sampler, 12)).collect();
    let (training, others) = people.split_at(12);
    let model = learnt(&scene, training).expect("enough");
    assert_eq!(model.touches(), 12 * 12);
    for left_m in [0.3, 0.1, 0.03] {
        let normal = held(&scene, others, None, left_m);
        let learnt = held(&scene, others, Some(model), left_m);
        assert!(normal[0] > 0.7);
        for (held, stated) in learnt.into_iter().zip(REGION_SHARES) {
            assert!((held - stated).abs() < 0.1, "{left_m}: {held} of {stated}");
        }
    }
}

#[test]
fn few_touches_claim_no_more_than_they_tell() {
    let (scene, _) = Scene::from_obj_str(WALL, None).expect("a wall");
    let mut sampler = Sampler::new(8);
    let people: Vec<Person> = (0..20).map(|_| person(&mut sampler, 10)).collect();
    let (one, others) = people.split_at(1);
    let model = learnt(&scene, one).expect("enough");
    let held = held(&scene, others, Some(model), 0.1);
    assert!(held[2] > 0.8 && held[0] > 0.3, "{held:?}");
    let mut least = one[0].clone();
    least.contacts.truncate(3);
    let refused = learnt(&scene, &[least]);
    assert!(matches!(
        refused,
        Err(ContactError::TooFewReaches { got: 3, .. })
    ));
    let mut nowhere = one[0].clone();
    nowhere.contacts[2].point_m.y = f64::NAN;
    assert!(learnt(&scene, &[nowhere]).is_err());
    // A contact off all surfaces is not used.
    let mut beside = one[0].clone();
    beside.contacts[2].point_m.x = 0.5;
    assert_eq!(learnt(&scene, &[beside]).expect("the others").touches(), 9);
}

#[test]
fn sizes_rise_with_the_share_and_are_finite_anywhere() {
    let (scene, _) = Scene::from_obj_str(WALL, None).expect("a wall");
    let mut sampler = Sampler::new(9);
    let people: Vec<Person> = (0..3).map(|_| person(&mut sampler, 6)).collect();
    let model = learnt(&scene, &people).expect("enough");
    for way_m in [0.0, 1e-6, 0.02, 0.7, 1e9, f64::INFINITY, f64::NAN, -1.0] {
        let [a, b, c] = model.at(way_m).squared();
        assert!(a > 0.0 && a <= b && b <= c && c.is_finite(), "{way_m}");
    }
    for (squared, share) in RegionSizes::NORMAL.squared().into_iter().zip(REGION_SHARES) {
        assert!((squared + 2.0 * (1.0 - share).ln()).abs() < 1e-12);
    }
    let own = RegionSizes::from_squared([0.5, 0.5, 3.0]).expect("rising");
    assert_eq!(own.squared(), [0.5, 0.5, 3.0]);
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    for wrong in [
        [0.0, 1.0, 2.0],
        [1.0, 0.9, 2.0],
        [1.0, nan, 2.0],
        [1.0, 2.0, infinite],
    ] {
        assert!(RegionSizes::from_squared(wrong).is_err(), "{wrong:?}");
    }
}
