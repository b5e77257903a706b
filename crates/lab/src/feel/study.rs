//! The runs of the study: felt against requested parameters.

use super::identify::{Felt, identify};
use super::push::{self, Hand, PERIOD_S, Profile, Push};
use super::rig::{Rig, Way};
use super::stability::{self, Held};
use super::subject::{Kind, Subject, made};
use hwall_haptics::{MovingObject, ObjectConfig, ObjectRenderingConfig, PortLedger};
use hwall_testkit::Sampler;

/// One object in one control mode.
#[derive(Debug, Clone)]
pub struct Row {
    /// Control mode.
    pub way: Way,
    /// Kind of path.
    pub kind: Kind,
    /// Requested parameters.
    pub asked: ObjectConfig,
    /// Identified parameters.
    pub felt: Felt,
    /// Periods in which the arm could not follow.
    pub unreachable: usize,
    /// The energy between hand and board, as the rendering accounts for it.
    pub ledger: PortLedger,
    /// The same for the held push; `None` without one.
    pub held_ledger: Option<PortLedger>,
    /// Largest distance from the path, m.
    pub off_path_m: f64,
    /// Error of the position under a held push of [`HELD_N`], m at the face.
    pub held_m: f64,
    /// Least energy given, minus the object's least stored energy, J: negative means generated energy.
    pub least_given_j: f64,
}

impl Row {
    /// Stiffness, inertia and damping: felt and requested.
    pub const fn pairs(&self) -> [(f64, f64); 3] {
        let (felt, asked) = (&self.felt, &self.asked);
        [
            (felt.stiffness, asked.stiffness),
            (felt.inertia, asked.inertia),
            (felt.damping, asked.damping),
        ]
    }

    /// Their relative errors; `None` if the requested value is zero.
    pub fn errors(&self) -> [Option<f64>; 3] {
        let error = |(felt, asked)| (asked > 0.0).then(|| felt / asked - 1.0);
        self.pairs().map(error)
    }
}

/// The whole study.
#[derive(Debug, Clone)]
pub struct Results {
    /// Every object in every control mode.
    pub rows: Vec<Row>,
    /// Light objects as they are rendered.
    pub held: Vec<(Way, Held)>,
}

/// The held push, N.
pub const HELD_N: f64 = 10.0;
/// Frequencies of the excitation, Hz.
pub const EXCITED_HZ: [f64; 5] = [0.4, 0.9, 1.7, 2.6, 3.7];
/// Largest acceleration of the ideal object's face under the excitation, m/s²; an arm can follow it.
pub const MOST_M_PER_S2: f64 = 1.8;
/// Largest displacement of the ideal object's face by the sines, m; must be within the arm's reach.
pub const MOST_M: f64 = 0.06;
/// Number of pushes per object.
pub const PUSHES: u64 = 3;
/// Duration of a push, s.
const SECONDS: f64 = 8.0;

/// The panels: stiffness, inertia, damping.
const PANELS: [[f64; 3]; 9] = [
    [0.0, 4.0, 10.0],
    [0.0, 10.0, 20.0],
    [200.0, 4.0, 20.0],
    [200.0, 10.0, 40.0],
    [500.0, 4.0, 30.0],
    [500.0, 10.0, 60.0],
    [1000.0, 4.0, 40.0],
    [1000.0, 10.0, 80.0],
    [2000.0, 5.0, 80.0],
];
const DOORS: [[f64; 3]; 4] = [
    [0.0, 4.3, 4.0],
    [30.0, 4.3, 12.0],
    [50.0, 2.0, 8.0],
    [150.0, 4.3, 12.0],
];
const BUTTONS: [[f64; 3]; 3] = [[400.0, 4.0, 25.0], [1000.0, 4.0, 40.0], [2000.0, 4.0, 60.0]];

/// Runs everything; `seed`: of the pushes and the sensors' noise; `progress` receives the share done.
///
/// # Errors
/// A simulation that fails.
pub fn run(seed: u64, mut progress: impl FnMut(f64)) -> anyhow::Result<Results> {
    let rig = Rig::new()?;
    let objects: Vec<(Kind, [f64; 3])> = [
        (Kind::Panel, &PANELS[..]),
        (Kind::Door, &DOORS[..]),
        (Kind::Button, &BUTTONS[..]),
    ]
    .into_iter()
    .flat_map(|(kind, list)| list.iter().map(move |numbers| (kind, *numbers)))
    .collect();
    let mut rows = Vec::new();
    for (k, way) in Way::ALL.into_iter().enumerate() {
        for (i, (kind, numbers)) in objects.iter().enumerate() {
            for seed in seed..seed.saturating_add(PUSHES) {
                rows.push(felt(&rig, way, *kind, *numbers, seed)?);
            }
            progress((k as f64 + i as f64 / objects.len() as f64) / 4.0);
        }
    }
    let leans = stability::at_random(stability::HANDS, seed);
    let mut held = Vec::new();
    for way in Way::ALL {
        for lean in &leans {
            held.push((way, stability::rendered(&rig, way, lean)?));
        }
    }
    progress(1.0);
    Ok(Results { rows, held })
}

fn felt(
    rig: &Rig,
    way: Way,
    kind: Kind,
    [stiffness, inertia, damping]: [f64; 3],
    seed: u64,
) -> anyhow::Result<Row> {
    let asked = ObjectConfig {
        stiffness,
        damping,
        ..ObjectConfig::new(inertia)
    };
    let subject = made(rig, kind, String::new(), asked.clone())?;
    let mut push = Push {
        way,
        hand: Hand::Profile(excitation(&subject, seed)?),
        seconds: SECONDS,
        seed,
        config: ObjectRenderingConfig::default(),
    };
    let trace = push::run(rig, &subject, &push)?;
    let felt = identify(&trace.samples)?;
    let lever_m = subject.lever_m();
    let mut held_ledger = None;
    let held_m = if stiffness > 0.0 {
        push.hand = Hand::Profile(Profile::held(HELD_N, f64::INFINITY));
        push.seconds = 4.0;
        let held = push::run(rig, &subject, &push)?;
        held_ledger = Some(held.ledger);
        let last = held.samples.iter().rev().take(500);
        last.map(|s| (s.position - s.ideal).abs() * lever_m)
            .fold(0.0, f64::max)
    } else {
        f64::NAN
    };
    let samples = || trace.samples.iter();
    Ok(Row {
        unreachable: trace.unreachable,
        way,
        kind,
        asked,
        felt,
        ledger: trace.ledger,
        held_ledger,
        off_path_m: samples().map(|s| s.off_path_m).fold(0.0, f64::max),
        held_m,
        least_given_j: samples().map(|s| s.given_j).fold(0.0, f64::min),
    })
}

/// Sines of random phase on a mean force, limited by what the arm can follow and a hand can exert.
fn excitation(subject: &Subject, seed: u64) -> anyhow::Result<Profile> {
    let mut sampler = Sampler::new(seed);
    let sines = EXCITED_HZ.map(|hz| [1.0, hz, sampler.uniform(0.0, std::f64::consts::TAU)]);
    let lever_m = subject.lever_m();
    let config = subject.object.object.config();
    // The mean bends a spring by 3 cm at the face, with 12 N at most.
    let mean_n = (0.03 * config.stiffness / (lever_m * lever_m)).min(12.0);
    let shape = Profile {
        sines: sines.to_vec(),
        ..Profile::held(0.0, f64::INFINITY)
    };
    let mut ideal = MovingObject::new(config.clone())?;
    let (mut most, mut farthest) = (0.0_f64, 0.0_f64);
    for k in 0..(SECONDS / PERIOD_S) as usize {
        let force = shape.force_n(k as f64 * PERIOD_S) * lever_m;
        most = most.max((ideal.acceleration(force) * lever_m).abs());
        ideal.step(force, PERIOD_S)?;
        farthest = farthest.max((ideal.position() * lever_m).abs());
    }
    let scale = (MOST_M_PER_S2 / most).min(MOST_M / farthest).min(4.0);
    Ok(Profile {
        mean_n,
        sines: sines.map(|[a, hz, phase]| [a * scale, hz, phase]).to_vec(),
        ..shape
    })
}
