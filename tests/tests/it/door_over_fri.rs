//! A door opened over FRI, in simulated time: session, client, codec, controller and arm at torque level in one program.

use anyhow::{Context, ensure};
use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::glam::DVec3;
use hwall::hand::{HandFilterConfig, HandFrame};
use hwall::haptics::{ArmCommand, Board};
use hwall::scene::{Scene, SurfaceId};
use hwall::{Session, SessionConfig, SessionState, Surroundings, drive, maps_of};
use hwall_fri::codec::ClientCommandMode;
use hwall_fri::controller::{Controller, ControllerConfig, ImpedanceConfig, InProcess};
use hwall_fri::{FriClient, FriClientConfig, FriError, FriVersion};
use hwall_sim::{HandContact, TorqueArm, TorqueConfig, minimum_jerk};
use hwall_stage::input::arms::BoardArm;
use hwall_stage::run::simulated_arm::{ArmLevel, dynamics};
use std::sync::Arc;
use std::time::Duration;

/// Half a metre from the hinge of the door in the plane x = 0.6.
const TARGET_M: DVec3 = DVec3::new(0.6, 0.2, 0.6);
const DOOR: SurfaceId = SurfaceId(0);
/// Into the door, m.
const DEPTH_M: f64 = 0.05;
/// When the hand leaves its rest, presses, lets go, and is back, s.
const TIMES_S: [f64; 4] = [0.5, 2.0, 3.5, 4.0];
const TRACKER_S: f64 = 1.0 / 90.0;

/// Stiffer springs of the joints than the simulated controller's usual ones, and less damped.
fn stiff() -> ImpedanceConfig {
    ImpedanceConfig {
        joint_stiffness_n_m_per_rad: [1000.0, 1000.0, 1000.0, 1000.0, 500.0, 300.0, 300.0],
        damping_ratio: 0.2,
        ..ImpedanceConfig::default()
    }
}

type Client = FriClient<InProcess<TorqueArm>>;

/// A hand that reaches straight for the door, pushes it open and lets go.
fn tip_m(t_s: f64) -> DVec3 {
    let share = |from_s: f64, to_s: f64| minimum_jerk((t_s - from_s) / (to_s - from_s));
    let out = share(TIMES_S[0], TIMES_S[1]) - share(TIMES_S[2], TIMES_S[3]);
    let rest_m = TARGET_M + DVec3::new(0.4, 0.1, 0.1);
    rest_m.lerp(TARGET_M - DVec3::X * DEPTH_M, out)
}

fn frame(t_s: f64) -> HandFrame {
    let tip_m = tip_m(t_s);
    let head_m = TARGET_M + DVec3::new(0.7, -0.1, 0.4);
    HandFrame {
        palm_m: Some(tip_m + DVec3::X * 0.15),
        tips_m: [None, Some(tip_m), None, None, None],
        head_m: Some(head_m),
        gaze: Some((TARGET_M - head_m).normalize()),
        ..HandFrame::empty(t_s)
    }
}

/// The controller's clock, and a hand that is tracked at 90 Hz.
struct Room {
    /// When commanding began; that message is not answered yet.
    unanswered: Option<f64>,
    began_s: f64,
    frames: u32,
}

impl Surroundings<Client> for Room {
    fn next_cycle(&mut self, arm: &mut Client) -> Result<Option<f64>, FriError> {
        let now_s = match self.unanswered.take() {
            Some(now_s) => now_s,
            None => arm.wait_for_message(Duration::from_secs(1))?,
        };
        Ok((now_s < self.began_s + TIMES_S[3] + 2.0).then_some(now_s))
    }

    fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        let t_s = f64::from(self.frames) * TRACKER_S;
        (self.began_s + t_s <= now_s).then(|| {
            self.frames += 1;
            HandFrame {
                t_s: self.began_s + t_s,
                ..frame(t_s)
            }
        })
    }
}

/// What is left of a run.
#[derive(Debug, Default, PartialEq)]
struct Outcome {
    /// Bits of all commands, folded.
    commands: u64,
    torques: u32,
    positions: u32,
    most_rad: f64,
    last_rad: f64,
    /// Between the face and the door where it stands, while it is touched, m.
    off_m: f64,
    was_in_place: bool,
}

impl Outcome {
    fn command(&mut self, command: &ArmCommand) {
        let values = match command {
            ArmCommand::Torque(torque) => {
                self.torques += 1;
                torque.0
            }
            ArmCommand::Position(q) => {
                self.positions += 1;
                q.0
            }
            _ => [0.0; 7],
        };
        for value in values {
            self.commands = (self.commands ^ value.to_bits())
                .wrapping_mul(0x0000_0100_0000_01b3)
                .rotate_left(17);
        }
    }
}

fn run(
    level: ArmLevel,
    mode: ClientCommandMode,
    version: FriVersion,
    impedance: ImpedanceConfig,
) -> anyhow::Result<Outcome> {
    let obj = "o door\nv 0.6 -0.3 0\nv 0.6 0.6 0\nv 0.6 0.6 2\nv 0.6 -0.3 2\nf 1 2 3 4\n";
    let sidecar = "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = [0.6, -0.3, 0.0]\n\
                   hinge_axis = [0.0, 0.0, 1.0]\nrange_deg = [0.0, 60.0]\ninertia_kg_m2 = 2.0\n\
                   stiffness_n_m_per_rad = 20.0\ndamping_n_m_s_per_rad = 12.0\n";
    let (scene, _) = Scene::from_obj_str(obj, Some(sidecar))?;
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    let srs = arm.closed_form().context("an iiwa")?;
    let maps = maps_of(&scene, srs)?;
    let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led())?;
    let config = SessionConfig {
        hand: HandFilterConfig::simulated(),
        object_command: level.object_command(&arm)?,
        ..SessionConfig::default()
    };
    let mut session = Session::new(srs, &board, scene, maps, predictor, config)?;
    let model = Arc::clone(session.control().arm());
    let config = TorqueConfig {
        command_delay_s: 0.0,
        ..TorqueConfig::default()
    };
    let plant = TorqueArm::new(Arc::clone(&model), dynamics(&arm)?, arm.start(), config)?;
    let config = ControllerConfig {
        version,
        mode,
        ready_s: Some(0.1),
        impedance,
        ..ControllerConfig::default()
    };
    let controller = Controller::new(plant, config)?;
    let config = FriClientConfig {
        version,
        ..FriClientConfig::default()
    };
    let mut client = FriClient::over(&model, config, InProcess::new(controller))?;
    let began_s = client.wait_for_commanding(Duration::from_secs(60))?;
    let mut room = Room {
        unanswered: Some(began_s),
        began_s,
        frames: 0,
    };
    let finger = HandContact::default();
    let mut outcome = Outcome::default();
    let ended = drive(
        &mut session,
        &mut client,
        &mut room,
        |session, client, room, cycle| {
            outcome.command(&cycle.command);
            outcome.was_in_place |= session.state() == SessionState::InPlace;
            let door = session.control().moving().next();
            let plant = client.transport_mut().controller_mut().plant_mut();
            if let Some(door) = door {
                outcome.most_rad = outcome.most_rad.max(door.position);
                outcome.last_rad = door.position;
                if door.touched {
                    let face_m = plant.pose().position_m();
                    let closest = session.perception().scene().project_on(DOOR, face_m);
                    outcome.off_m = closest.map_or(f64::NAN, |c| outcome.off_m.max(c.distance_m));
                }
            }
            let t_s = cycle.t_s - room.began_s;
            let velocity_m_per_s = (tip_m(t_s + 1e-5) - tip_m(t_s - 1e-5)) / 2e-5;
            let relative = velocity_m_per_s - plant.twist().linear_m_per_s;
            let wrench = finger.wrench(&plant.pose(), tip_m(t_s), relative);
            let wrench = wrench.ok().flatten().unwrap_or_default();
            // A wrench of finite numbers is never refused.
            let _ = plant.apply_wrench(wrench);
            Ok(())
        },
    );
    let controller = client.transport().controller();
    ensure!(controller.ended().is_none(), "{:?}", controller.ended());
    ended?;
    let (statistics, client) = (controller.statistics(), client.statistics());
    ensure!(
        statistics.missed + statistics.expired == 0 && client.refused == 0,
        "{statistics:?} {client:?}"
    );
    Ok(outcome)
}

#[test]
fn a_door_opens_over_fri_by_torques() -> anyhow::Result<()> {
    // The softer the springs, the further the arm hangs behind before torques take over.
    for (version, springs) in [
        (FriVersion::V1_15, ImpedanceConfig::default()),
        (FriVersion::V2_5, stiff()),
        (FriVersion::V2_7, stiff()),
    ] {
        let (level, mode) = (ArmLevel::Torque, ClientCommandMode::Torque);
        let by_torques = || run(level, mode, version, springs);
        let outcome = by_torques()?;
        println!("{outcome:?}");
        assert!(outcome.was_in_place, "{outcome:?}");
        assert!(outcome.torques > 1000 && outcome.positions > 1000);
        assert!(outcome.most_rad > 0.04, "{outcome:?}");
        assert!(outcome.last_rad.abs() < 0.005, "{outcome:?}");
        assert!(outcome.off_m < 0.015, "{outcome:?}");
        // Both codecs, and both settings of the springs.
        if version != FriVersion::V2_5 {
            assert_eq!(by_torques()?, outcome, "again, to the last bit");
        }
    }
    Ok(())
}

#[test]
fn a_door_opens_over_fri_by_positions() -> anyhow::Result<()> {
    let outcome = run(
        ArmLevel::Servo,
        ClientCommandMode::Position,
        FriVersion::V1_15,
        ImpedanceConfig::default(),
    )?;
    println!("{outcome:?}");
    assert!(outcome.was_in_place && outcome.torques == 0, "{outcome:?}");
    assert!(outcome.most_rad > 0.04, "{outcome:?}");
    assert!(outcome.last_rad.abs() < 0.005, "{outcome:?}");
    Ok(())
}
