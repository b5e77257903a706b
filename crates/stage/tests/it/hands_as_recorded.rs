//! The main job on recordings of hands as headsets and engines write them.

use clap::Parser;
use hwall_haptics::Board;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::person::predictors::{PredictorKind, Predictors};
use hwall_stage::person::responses::Scenery;
use hwall_stage::run::people::{self, PersonRun};
use hwall_stage::run::stage::Stage;
use hwall_stage::setting::{Setting, SettingFlags};
use hwall_testkit::Sampler;

/// Three reaches of 0.45 m and back in 1.1 s each, tremor of 0.3 mm; z up, at 72 Hz. A row is a time, the index tip, the palm and the head.
fn rows() -> Vec<[f64; 10]> {
    let mut sampler = Sampler::new(3);
    let row = |i: i32| {
        let t_s = f64::from(i) / 72.0;
        let phase = t_s % 3.5;
        let tau = ((phase - 0.5) / 1.1).clamp(0.0, 1.0) - ((phase - 2.2) / 1.1).clamp(0.0, 1.0);
        let x = 0.45 * tau * tau * tau * (10.0 + tau * (6.0 * tau - 15.0));
        let place = [t_s, 0.3 + x, 0.02, 1.15, 0.2 + x, 0.0, 1.13, 0.0, 0.1, 1.5];
        // Time does not tremble.
        std::array::from_fn(|k| place[k] + if k == 0 { 0.0 } else { 3e-4 * sampler.normal() })
    };
    (0..3 * 252).map(row).collect()
}

fn text(rows: &[[f64; 10]], cell: impl Fn(usize, usize, f64) -> String) -> String {
    let mut text =
        "t,index_x,index_y,index_z,palm_x,palm_y,palm_z,head_x,head_y,head_z\n".to_owned();
    for (i, row) in rows.iter().enumerate() {
        let cells: [String; 10] = std::array::from_fn(|k| cell(i, k, row[k]));
        text += &(cells.join(",") + "\n");
    }
    text
}

struct Job(BoardArm);

impl Job {
    fn new() -> Self {
        Self(BoardArm::named("iiwa7", &Board::default()).unwrap())
    }

    fn setting(&self, name: &str, text: &str, units: &[&str]) -> anyhow::Result<Setting> {
        let path =
            std::env::temp_dir().join(format!("hwall-hands-{}-{name}.csv", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let hand = ["", "--axes=z-up", "--hand", path.to_str().unwrap()];
        let flags = SettingFlags::parse_from(hand.iter().chain(units));
        let setting = Setting::new(&self.0, &flags);
        std::fs::remove_file(&path).unwrap();
        setting
    }

    fn run(&self, name: &str, text: &str) -> (Vec<String>, PersonRun) {
        let setting = self.setting(name, text, &[]).unwrap();
        let leader = Some(PredictorKind::RayLed);
        let (scene, people) = (&setting.scene, &setting.training_people);
        let (predictors, _) = Predictors::train(scene, &self.0, people, leader).unwrap();
        let likely = setting.likely_touches.clone();
        let walls = self.0.walls_of(scene, likely, false).unwrap();
        let scenery = Scenery::of(scene, &self.0, &walls, people).textured(false);
        let stage = Stage::of(&scenery, &predictors, 2e-3);
        let mut runs = people::run(&stage, &setting.participants, |_| {}).unwrap();
        (setting.remarks, runs.pop().unwrap())
    }
}

fn in_place(run: &PersonRun) -> usize {
    let touches = run.touches.iter();
    touches.filter(|touch| touch.outcome.in_place()).count()
}

#[test]
fn zeros_are_lost_tracking_and_said() {
    let job = Job::new();
    let zeros = text(&rows(), |i, k, value| match k {
        1..=6 if (130..142).contains(&i) => "0".to_owned(),
        _ => value.to_string(),
    });
    let setting = job.setting("zeros", &zeros, &[]).unwrap();
    let said = "12 rows of zeros were taken as lost tracking".to_owned();
    assert!(setting.remarks.contains(&said), "{:?}", setting.remarks);
    assert_eq!(setting.participants[0].touches.len(), 3);
}

#[test]
fn other_units_are_named_with_their_flags() {
    let job = Job::new();
    let other = text(&rows(), |_, k, value| {
        (if k == 0 { 1e3 * value } else { 1e2 * value }).to_string()
    });
    let refused = |units: &[&str]| {
        let refused = job.setting("units", &other, units).map(|_| ());
        format!("{:#}", refused.unwrap_err())
    };
    let both = refused(&[]);
    for said in [
        "centimetres: --hand-scale 0.01",
        "milliseconds: --time-unit ms",
    ] {
        assert!(both.contains(&format!("looks like {said}")), "{both}");
    }
    let one = refused(&["--time-unit=ms"]);
    let named = ["--hand-scale 0.01", "--time-unit"].map(|flag| one.contains(flag));
    assert_eq!(named, [true, false], "{one}");
    let units = ["--hand-scale=0.01", "--time-unit=ms"];
    let setting = job.setting("units", &other, &units).unwrap();
    assert_eq!(setting.participants[0].touches.len(), 3);
}

/// Regression: values of two decimals counted as a frozen hand, and slow or ending heads as misses of the policy or the arm.
#[test]
fn few_digits_and_slow_heads_are_served_and_what_stops_the_arm_is_named() {
    let job = Job::new();
    let (_, all) = job.run("plain", &text(&rows(), |_, _, value| value.to_string()));
    let most = in_place(&all);
    assert_eq!((all.touches.len(), most), (3, 3));
    let decimals = text(&rows(), |_, k, value| match k {
        0 => value.to_string(),
        _ => format!("{value:.2}"),
    });
    let (said, run) = job.run("decimals", &decimals);
    let there = in_place(&run);
    assert!(there + 1 >= most, "{there} of {most}: {said:?}");
    let slow = text(&rows(), |i, k, value| match k {
        7.. if i % 4 > 0 => String::new(),
        _ => value.to_string(),
    });
    let (said, run) = job.run("slow", &slow);
    assert_eq!(in_place(&run), most, "{said:?}");
    let ends = text(&rows(), |i, k, value| match k {
        7.. if i > 600 => "NaN".to_owned(),
        _ => value.to_string(),
    });
    let (said, run) = job.run("ends", &ends);
    let head = "the head ends at 8.33 s";
    assert!(said.iter().any(|said| said.contains(head)), "{said:?}");
    let missed = run.touches.iter().filter(|touch| !touch.outcome.in_place());
    let stops = missed.map(|touch| touch.regret.stopped_by.map(|stop| stop.to_string()));
    let stops: Vec<Option<String>> = stops.collect();
    assert!(stops.len() <= 1, "{stops:?}");
    for stop in stops {
        assert_eq!(stop.as_deref(), Some("stale head"));
    }
}
