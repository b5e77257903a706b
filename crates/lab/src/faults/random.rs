//! Faults and wrong numbers at random moments of repeated touches: does every command satisfy its contract?

use super::bench::{Bench, DT_S, Setup};
use super::fault::{Fault, Other, Phase};
use super::run::{Reached, safe_state};
use super::spoiled::WrongNumber;
use hwall::SessionState;
use hwall::haptics::{ArmCommand, Planner, PlannerConfig};
use hwall_kinematics::JointPositions;
use hwall_stage::input::counted::Asked;
use hwall_stage::run::simulated_arm::{ArmLevel, SimulatedArm};
use hwall_testkit::{AttackReport, Finding, Sampler};
use rayon::prelude::*;
use std::iter::zip;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// Consecutive runs on one arm; a touch without a fault follows and must succeed.
const RUNS_OF_AN_ARM: u64 = 50;
/// Possible durations of a fault, cycles.
const CYCLES: [usize; 5] = [1, 3, 20, 150, 400];
/// Cycles after the fault, before a reset.
const AFTERWARDS: usize = 350;
/// Cycles after the reset, before the check.
const AFTER_RESET: usize = 150;
/// Largest distance of a commanded position from the arm, rad: a disobedient arm may deviate this far before detection.
const APART_RAD: f64 = 0.75;
/// Largest distance of the first position after a hold from the arm, rad.
const BEGINS_RAD: f64 = 0.15;
/// Rounding tolerance of the speed limit of commands.
const SLACK: f64 = 1.0 + 1e-6;
/// A command that moves less than this counts as repeated, rad.
const ROUNDING_RAD: f64 = 1e-12;
/// Largest number of cycles that a command makes up for after a stall.
const CAUGHT_UP: u32 = 4;
/// Factor by which a servo that catches up may be faster than its commands.
const SERVO_SHARE: f64 = 1.05;
/// Largest number of findings kept.
const MOST_FINDINGS: usize = 20;

/// The disturbance of a run.
#[derive(Debug, Clone, Copy)]
struct Disturbance {
    fault: Option<Fault>,
    number: Option<WrongNumber>,
    cycles: usize,
}

impl Disturbance {
    /// On an arm behind FRI, half of the faults are of its link.
    fn draw(faults: &[Fault], behind_fri: bool, sampler: &mut Sampler) -> Self {
        let links = behind_fri && sampler.bool();
        let first_link = faults.iter().position(|f| matches!(f, Fault::Link(_)));
        let faults = match first_link {
            Some(first) if links => &faults[first..],
            Some(first) => &faults[..first],
            None => faults,
        };
        let kind = sampler.index(4);
        let fault = (kind != 0).then(|| faults[sampler.index(faults.len())]);
        let number = (kind < 2).then(|| WrongNumber::draw(sampler));
        Self {
            fault,
            number,
            cycles: CYCLES[sampler.index(CYCLES.len())],
        }
    }
}

/// The last command, if it was a position.
#[derive(Debug, Clone, Copy)]
struct Before {
    q: JointPositions,
    /// Cycles since it was first commanded.
    cycles: u32,
}

/// Largest numbers of forward and inverse kinematics queries per step: about 20 us each. Inverse: 11 for the path of an object that comes near its
/// end (a slide on a wall solves 4), and 4 for a target without a map, one for each quarter turn.
const MOST_FORWARD: u32 = 60;
const MOST_INVERSE: u32 = 15;

/// A bench with monitored commands.
struct Watched {
    bench: Bench,
    max_velocity_rad_per_s: [f64; 7],
    before: Option<Before>,
}

impl Watched {
    fn new(
        setup: &Setup,
        phase: Phase,
        level: Option<ArmLevel>,
        seed: u64,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            bench: Bench::new(setup, phase, level, seed)?,
            max_velocity_rad_per_s: setup.max_velocity_rad_per_s,
            before: None,
        })
    }

    /// One cycle: checks the contract of its command, and returns whether a safe state is in force.
    fn cycle(
        &mut self,
        fault: Option<(Fault, f64)>,
        number: Option<&WrongNumber>,
    ) -> Result<bool, String> {
        let (bench, before) = (&mut self.bench, &mut self.before);
        let max_velocity_rad_per_s = &self.max_velocity_rad_per_s;
        let from = bench.arm.q();
        bench
            .cycle(fault, number)
            .map_err(|error| format!("the arm refused a command: {error:#}"))?;
        // For any fault of the link: a lagging servo catches up slightly faster.
        if let SimulatedArm::Fri(_) = &bench.arm {
            let to = bench.arm.q();
            let moved_rad = zip(to.0, from.0).map(|(to, from)| (to - from).abs());
            for (joint, (moved_rad, most)) in zip(moved_rad, max_velocity_rad_per_s).enumerate() {
                let share = moved_rad / (most * DT_S);
                if share > SERVO_SHARE {
                    return Err(format!("joint {} at {share} of its speed", joint + 1));
                }
            }
        }
        while bench.session.next_event().is_some() {}
        let samples = bench.session.control().renderer().follower().samples();
        if samples > PlannerConfig::default().samples + Planner::MOST_SAMPLES {
            return Err(format!(
                "a call of the planner with {samples} samples of paths"
            ));
        }
        let Asked { forward, inverse } = bench.asked;
        if forward > MOST_FORWARD || inverse > MOST_INVERSE {
            let asked = format!("{forward} poses and {inverse} configurations");
            return Err(format!("a step with {asked}"));
        }
        if let Some(before) = before {
            before.cycles += 1;
        }
        let Some(command) = bench.command else {
            return Ok(false);
        };
        match command {
            ArmCommand::Position(q) => {
                for (joint, limit) in bench.session.control().arm().limits().iter().enumerate() {
                    if !(q.0[joint] >= limit.min_rad - 1e-9 && q.0[joint] <= limit.max_rad + 1e-9) {
                        return Err(format!("joint {} commanded to {}", joint + 1, q.0[joint]));
                    }
                    let Some(last) = before else { continue };
                    let step_rad = (q.0[joint] - last.q.0[joint]).abs();
                    let dt_s = DT_S * f64::from(last.cycles.min(CAUGHT_UP));
                    if step_rad > max_velocity_rad_per_s[joint] * dt_s * SLACK {
                        return Err(format!("joint {}: a step of {step_rad} rad", joint + 1));
                    }
                }
                let apart_rad = q.max_abs_difference(&bench.arm.q());
                let most_rad = before.map_or(BEGINS_RAD, |_| APART_RAD);
                // A NaN has already failed at the limits above.
                if apart_rad > most_rad {
                    return Err(format!("{apart_rad} rad from the arm"));
                }
                // While the clock stands still the command is repeated; a clock may also advance by rounding.
                let repeated =
                    before.filter(|before| before.q.max_abs_difference(&q) <= ROUNDING_RAD);
                *before = Some(repeated.unwrap_or(Before { q, cycles: 0 }));
            }
            ArmCommand::Torque(torque) => {
                if torque.0.iter().any(|torque| !torque.is_finite()) {
                    return Err(format!("torques {torque:?}"));
                }
                *before = None;
            }
            // A hold, or anything else that ends the sequence of positions.
            _ => *before = None,
        }
        Ok(command == ArmCommand::Hold || safe_state(&bench.session, true).0 > Reached::Slowed)
    }

    /// One run: some normal cycles, the disturbance, time to recover, a reset. True if a safe state was reported.
    fn run(&mut self, disturbance: &Disturbance, sound: usize) -> Result<bool, String> {
        let mut named = false;
        for _ in 0..sound {
            self.hurried_cycle(None, None)?;
            self.is_open("without a fault")?;
        }
        if disturbance.fault == Some(Fault::Other(Other::Stop)) {
            self.bench.session.stop();
        }
        for k in 0..disturbance.cycles {
            let fault = disturbance.fault.map(|fault| (fault, k as f64 * DT_S));
            named |= self.hurried_cycle(fault, disturbance.number.as_ref())?;
        }
        for _ in 0..AFTERWARDS {
            named |= self.hurried_cycle(None, None)?;
        }
        self.bench.reset();
        for _ in 0..AFTER_RESET {
            self.hurried_cycle(None, None)?;
        }
        self.is_open("after a reset")?;
        Ok(named)
    }

    /// One cycle of a hurried hand that touches repeatedly.
    fn hurried_cycle(
        &mut self,
        fault: Option<(Fault, f64)>,
        number: Option<&WrongNumber>,
    ) -> Result<bool, String> {
        self.bench.goes_again(true);
        self.cycle(fault, number)
    }

    /// Checks that nothing is latched.
    fn is_open(&self, when: &str) -> Result<(), String> {
        let session = &self.bench.session;
        match session.control().is_latched() {
            true => Err(format!("latched {when}: {:?}", session.state())),
            false => Ok(()),
        }
    }

    /// Checks that a touch without a fault is served. A door that stays open is touched at another place than expected.
    fn is_served(&mut self) -> Result<(), String> {
        // Finish the current touch first.
        let mut begun = 0;
        for _ in 0..30_000 {
            // This hand leaves the arm enough time.
            begun += u32::from(self.bench.goes_again(false));
            self.cycle(None, None)?;
            if begun == 1 && self.bench.session.state() == SessionState::Touched {
                return Ok(());
            }
            if begun == 2 {
                break;
            }
        }
        let state = self.bench.session.state();
        Err(format!("the next touch is not served: {state:?}"))
    }
}

/// `count` runs from number `first` on, on a separate arm.
fn runs_of_an_arm(
    setup: &Setup,
    (first, count): (u64, u64),
    seed: u64,
) -> anyhow::Result<AttackReport> {
    let scenes = [Phase::TouchedWall, Phase::TouchedDoor, Phase::Sliding];
    let arm = first / RUNS_OF_AN_ARM;
    let phase = scenes[(arm % 3) as usize];
    let level = [Some(ArmLevel::Servo), Some(ArmLevel::Torque), None][(arm / 3 % 3) as usize];
    let faults = Fault::all();
    let mut sampler = Sampler::new(seed.wrapping_mul(1_000_003).wrapping_add(first));
    // A run begins with a moving arm: its first position is not the first after a hold.
    let mut watched = Watched::new(setup, phase, level, seed.wrapping_add(first))?;
    let mut report = AttackReport::default();
    for number in first..first + count {
        let disturbance = Disturbance::draw(&faults, level.is_none(), &mut sampler);
        let sound = 100 + sampler.index(1200);
        let start = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            let named = watched.run(&disturbance, sound)?;
            if number + 1 == first + count && phase != Phase::TouchedDoor {
                watched.is_served()?;
            }
            Ok(named)
        }));
        let took_ms = 1e3 * start.elapsed().as_secs_f64();
        report.inputs += 1;
        if took_ms > report.slowest_ms {
            (report.slowest_ms, report.slowest) = (took_ms, number);
        }
        let what = match outcome {
            Ok(Ok(named)) => {
                report.refused += u64::from(named);
                report.accepted += u64::from(!named);
                continue;
            }
            Ok(Err(what)) => what,
            Err(_) => "panic".to_owned(),
        };
        report.findings += 1;
        let input = format!("{} {level:?} {disturbance:?}", phase.name()).into_bytes();
        report.examples.push(Finding {
            number,
            what,
            input,
        });
        watched = Watched::new(setup, phase, level, seed.wrapping_add(number))?;
    }
    Ok(report)
}

/// Disturbs the loop `runs` times, on all cores. A run counts as refused if a safe state was reported, as accepted if the
/// session went on. A finding is a command that exceeds joint limits, jumps, or is far from the arm; a step with
/// too many path checks; a latch that a reset does not release; a later touch that is not served; or a panic.
///
/// # Errors
/// A simulation that cannot be set up.
pub fn attack(runs: u64, seed: u64) -> anyhow::Result<AttackReport> {
    attack_range(0..runs, seed)
}

/// Repeats one run of [`attack`], with the other runs on its arm.
///
/// # Errors
/// As for [`attack`].
pub fn attack_again(run: u64, seed: u64) -> anyhow::Result<AttackReport> {
    let first = run - run % RUNS_OF_AN_ARM;
    attack_range(first..first.saturating_add(RUNS_OF_AN_ARM), seed)
}

/// Runs a range that starts with the first run of an arm.
fn attack_range(runs: Range<u64>, seed: u64) -> anyhow::Result<AttackReport> {
    let setup = Setup::new()?;
    let end = runs.end;
    let arms: Vec<u64> = runs.step_by(RUNS_OF_AN_ARM as usize).collect();
    let runs = arms.par_iter().map(|first| {
        let count = RUNS_OF_AN_ARM.min(end - first);
        runs_of_an_arm(&setup, (*first, count), seed)
    });
    let reports = runs.collect::<anyhow::Result<Vec<AttackReport>>>()?;
    let mut all = AttackReport {
        name: "loop".to_owned(),
        ..AttackReport::default()
    };
    for report in reports {
        all.inputs += report.inputs;
        all.refused += report.refused;
        all.accepted += report.accepted;
        all.findings += report.findings;
        all.examples.extend(report.examples);
        if report.slowest_ms > all.slowest_ms {
            (all.slowest_ms, all.slowest) = (report.slowest_ms, report.slowest);
        }
    }
    all.examples.truncate(MOST_FINDINGS);
    Ok(all)
}
