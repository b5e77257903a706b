//! Hands that lean on an object, on the product's own path: a session with its supervisor, and the link to the arm.

use anyhow::ensure;
use glam::DVec3;
use hwall::haptics::board_pose;
use hwall::{SessionState, session_supervisor};
use hwall_fri::MOST_BEHIND_S;
use hwall_fri::controller::FaultConfig;
use hwall_geometry::Pose;
use hwall_lab::faults::bench::{Bench, DT_S, HINGE, Setup, TARGET_M, scene_of};
use hwall_lab::faults::fault::Phase;
use hwall_lab::feel::push::{Hand, small_rotation};
use hwall_lab::feel::stability::{Held, Lean};
use hwall_scene::Scene;
use hwall_sim::{HandBody, HandDrive};
use hwall_stage::run::simulated_arm::{ArmLevel, SimulatedArm};

/// How the commands of the session reach the servo arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Path {
    /// Directly.
    Direct,
    /// Through FRI. During the touch 10 % of the answers are missed: 7 % are lost, in bursts of one to four, 3 % come one to three cycles late. So
    /// the delay of the arm changes all the time.
    Link,
}

impl Path {
    /// All paths.
    pub(crate) const ALL: [Self; 2] = [Self::Direct, Self::Link];
}

/// Distance of the waiting hand from the surface, m.
const BEFORE_M: f64 = 0.03;
/// Distance of the touch from the hinge of the door, m.
const LEVER_M: f64 = 0.62;
/// How long a hand leans on the object without an interruption, s.
const LEANS_S: f64 = 4.0;
/// Longest simulation, s.
const MOST_S: f64 = 20.0;

/// The product with an iiwa 7, ready for any object.
pub(crate) struct Product(Setup);

impl Product {
    /// Loads the arm.
    pub(crate) fn new() -> anyhow::Result<Self> {
        Ok(Self(Setup::new()?))
    }

    /// A hand waits until the board is in place, then leans on it until 4 s have passed without a stop of the supervisor or the link.
    pub(crate) fn lean(&self, path: Path, lean: &Lean) -> anyhow::Result<Held> {
        let before = board_pose(TARGET_M + BEFORE_M * DVec3::X, DVec3::X, 0.0)?;
        let mut bench = self.in_place(path, lean, &before)?;
        let hand = Hand::Body {
            config: lean.hand,
            depth_m: lean.depth_m() + BEFORE_M,
            rise_s: 0.6,
            until_s: f64::INFINITY,
        };
        let (first_m, began_s) = (bench.arm.pose().position_m(), bench.t_s);
        let (mut sound_s, mut given_j, mut samples) = (began_s, 0.0, Vec::new());
        while bench.t_s < (sound_s + LEANS_S).min(began_s + MOST_S) {
            let was = bench.arm.pose();
            let wrench = bench.push_on(&hand.aim(&before, bench.t_s - began_s))?;
            bench.answer(Some(wrench), None, None)?;
            let is = bench.arm.pose();
            let turned = small_rotation(is.rotation() * was.rotation().transpose());
            given_j += wrench.force_n.dot(is.position_m() - was.position_m());
            given_j += wrench.moment_n_m.dot(turned);
            samples.push((given_j, (is.position_m() - first_m).x));
            if let SessionState::Safe(_) | SessionState::Holding(_) = bench.session.state() {
                sound_s = bench.t_s + DT_S;
            }
        }
        let held = Held::of(lean, &samples);
        // A hand that is interrupted again and again never showed that the board comes to rest.
        let swing_m = match bench.t_s < sound_s + LEANS_S {
            true => f64::INFINITY,
            false => held.swing_m,
        };
        Ok(Held { swing_m, ..held })
    }

    /// The board is in place, the hand waits at a pose before it, and the link begins to miss answers.
    fn in_place(&self, path: Path, lean: &Lean, before: &Pose) -> anyhow::Result<Bench> {
        let mut supervisor = session_supervisor();
        if let (Path::Link, Some(obedience)) = (path, &mut supervisor.obedience) {
            obedience.delay_s += MOST_BEHIND_S;
        }
        let mut bench = Bench::of(
            &self.0,
            (&scene(lean)?, &self.0.door.1),
            Phase::TouchedDoor,
            (path == Path::Direct).then_some(ArmLevel::Servo),
            supervisor,
            HandBody::new(lean.hand, before.position_m(), DVec3::ZERO)?,
            lean.seed,
        )?;
        let waits = HandDrive::Aim {
            position_m: before.position_m(),
            velocity_m_per_s: DVec3::ZERO,
        };
        while bench.session.state() != SessionState::InPlace {
            let state = bench.session.state();
            ensure!(bench.t_s < MOST_S, "the board does not come: {state:?}");
            let wrench = bench.push_on(&waits)?;
            bench.answer(Some(wrench), None, None)?;
        }
        if let SimulatedArm::Fri(arm) = &mut bench.arm {
            arm.set_faults(FaultConfig {
                bursts: 0.03,
                late: 0.015,
                ..FaultConfig::default()
            })?;
        }
        Ok(bench)
    }
}

/// The object under the board: a panel, or every third time a door that is as heavy at the board.
fn scene(lean: &Lean) -> anyhow::Result<Scene> {
    let asked = &lean.panel;
    let [inertia, stiffness, damping] = [asked.inertia, asked.stiffness, asked.damping];
    if !lean.seed.is_multiple_of(3) {
        let sidecar = format!(
            "[surface.panel]\nkind = \"sliding_panel\"\ndirection = [-1, 0, 0]\nrange_m = [0, 0.25]\nmass_kg = {inertia:?}\n\
             stiffness_n_per_m = {stiffness:?}\ndamping_n_s_per_m = {damping:?}\n"
        );
        return scene_of("panel", Some(&sidecar));
    }
    let [inertia, stiffness, damping] =
        [inertia, stiffness, damping].map(|x| x * LEVER_M * LEVER_M);
    let sidecar = format!(
        "{HINGE}range_deg = [0, 25]\ninertia_kg_m2 = {inertia:?}\nstiffness_n_m_per_rad = {stiffness:?}\n\
         damping_n_m_s_per_rad = {damping:?}\n"
    );
    scene_of("door", Some(&sidecar))
}
