//! The arm of a study behind FRI, and the tracked hands.

use anyhow::{Context, ensure};
use clap::ArgGroup;
use hwall::contact::{DeterministicConfig, DeterministicPredictor, Predictor};
use hwall::hand::HandFrame;
use hwall::haptics::Board;
use hwall::{Cycle, Event, LikelyTouches, Session, Surroundings};
use hwall_bridge::{BridgeServer, Order};
use hwall_fri::{FriClient, FriError};
use hwall_stage::input::address::{receivable, socket_address};
use hwall_stage::input::arms::BoardArm;
use hwall_stage::live::{Driven, Holds, LedArmFlags, asked, brake, tell_left_out};
use hwall_stage::note;
use hwall_stage::person::predictors::TrainingPeople;
use hwall_stage::person::responses::Scenery;
use hwall_stage::setting::load_scene;
use hwall_study::{
    ArmKind, ArmStage, ArmTrialConfig, Protocol, Stimulus, StudyRoom, check_surfaces, scene_of,
};
use hwall_view::ViewScene;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Period at which waiting for a controller checks its time limit.
const LOOK: Duration = Duration::from_millis(200);

/// Flags of an arm behind FRI, with the same meaning as for `bridge`.
#[derive(Debug, Clone, clap::Args)]
#[command(group(ArgGroup::new("led").args(LED).multiple(true).requires("fri")))]
pub struct ArmArgs {
    /// Listens here for the FRI controller of an iiwa, whose arm presents the trials instead of the simulated one: 127.0.0.1:30200 for a simulated controller
    #[arg(long, requires = "hands", value_name = "HOST:PORT", value_parser = socket_address)]
    fri: Option<SocketAddr>,
    /// Address of the page that provides the hand, from a headset or a mouse: localhost:8080
    #[arg(long, requires = "fri", value_name = "HOST:PORT", value_parser = socket_address)]
    hands: Option<SocketAddr>,
    /// OBJ scene, z up, metres, in the frame of the arm's base, with a roughness for each touched surface [default: one wall, door or panel
    /// 0.6 m ahead]
    #[arg(long, requires = "fri")]
    scene: Option<PathBuf>,
    /// The arm moves only while somebody holds the switch on that page (its address followed by #switch, for instance on a phone).
    /// Releasing the switch or losing the connection stops the arm
    #[arg(long, requires = "fri")]
    enabling_switch: bool,
    #[command(flatten)]
    led: LedArmFlags,
}

/// The flags of [`LedArmFlags`], which have no effect without an arm.
const LED: [&str; 9] = [
    "fri_controller",
    "fri_version",
    "hosts",
    "room",
    "origin",
    "arm_level",
    "hand",
    "watch_frozen",
    "no_head",
];

impl ArmArgs {
    /// Is an arm behind FRI requested instead of the simulated one?
    #[must_use]
    pub fn is_given(&self) -> bool {
        self.fri.is_some()
    }

    /// Does the arm move only while somebody holds the switch on the page?
    #[must_use]
    pub fn has_enabling_switch(&self) -> bool {
        self.enabling_switch
    }
}

/// An arm ready for its controller, with scene, session and both addresses.
pub struct WaitingArm {
    /// The page that provides hands.
    pub server: BridgeServer,
    client: FriClient,
    session: Session<DeterministicPredictor>,
    enabling_switch: bool,
    /// Repairs of the scene.
    pub remarks: Vec<String>,
}

/// An arm under command, and the server of its hands.
pub struct LedArm {
    /// Presents the trials. Ends before the server does.
    pub stage: ArmStage,
    /// The page that provides hands.
    pub server: BridgeServer,
}

impl WaitingArm {
    /// Reads the scene, computes its walls, and listens for hands and for the controller.
    ///
    /// # Errors
    /// Flags without addresses; a malformed scene, or one without surfaces that the protocol needs; without a scene, a protocol with several
    /// kinds of surfaces; addresses that cannot be bound.
    pub fn prepare(flags: &ArmArgs, protocol: &Protocol) -> anyhow::Result<Self> {
        let (listen, hands) = flags.fri.zip(flags.hands).context("--fri needs --hands")?;
        receivable("--fri", listen)?;
        let room = flags.led.real_room()?;
        let (scene, mut remarks) = match &flags.scene {
            Some(path) => load_scene(Some(path.as_path().into())).context("--scene")?,
            None => {
                let first = Stimulus::of(protocol, 0)?.surface;
                for condition in 1..protocol.conditions() {
                    ensure!(
                        Stimulus::of(protocol, condition)?.surface == first,
                        "the factor surface needs --scene on a real arm: a file with all of the study's surfaces"
                    );
                }
                (scene_of(first)?, Vec::new())
            }
        };
        remarks.extend(flags.led.warning());
        check_surfaces(&scene, protocol).context("--scene")?;
        let server = BridgeServer::start(flags.led.server(hands)?)?;
        let arm = BoardArm::named("iiwa7", &Board::default())?;
        server.prepare("mapping where the arm can hold its board");
        let walls = arm.walls_of(&scene, LikelyTouches::default(), true)?;
        let people = TrainingPeople::default();
        let scenery = Scenery::of(&scene, &arm, &walls, &people);
        let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led())?;
        let settings = flags.led.session(scenery, room.as_ref(), true);
        let session = settings.session(predictor)?;
        let client = FriClient::bind(session.control().arm(), flags.led.client(listen))?;
        Ok(Self {
            server,
            client,
            session,
            enabling_switch: flags.enabling_switch,
            remarks,
        })
    }

    /// The local address for the controller.
    ///
    /// # Errors
    /// Errors of the system.
    pub fn fri_address(&self) -> anyhow::Result<SocketAddr> {
        Ok(self.client.local_address()?)
    }

    /// Waits until the controller accepts commands, and starts the loop of the arm.
    ///
    /// # Errors
    /// No commanding within that time; a controller that the client does not understand.
    pub fn connect(mut self, within: Duration) -> anyhow::Result<LedArm> {
        let scene = ViewScene::of("iiwa 7 over FRI", &self.session)?;
        self.server.prepare("waiting for the FRI controller");
        let began = Instant::now();
        let begun_s = loop {
            match self.client.wait_for_commanding(LOOK) {
                Ok(begun_s) => break begun_s,
                Err(error @ (FriError::Silent { .. } | FriError::Unfit(_))) => ensure!(
                    began.elapsed() < within,
                    "no FRI controller reached commanding within {} s ({error}); {} datagrams were malformed, {} from others",
                    within.as_secs(),
                    self.client.statistics().malformed,
                    self.client.statistics().foreign
                ),
                Err(error) => return Err(error.into()),
            }
        };
        // A study ends when it is done, not by the clock.
        let bridge = self.server.connect(&scene);
        self.session
            .perception_mut()
            .explain_to(&bridge.explanations);
        let room = HandsRoom {
            driven: Driven::new(bridge, begun_s, f64::INFINITY),
            holds: Holds::default(),
            enabling_switch: self.enabling_switch,
        };
        let trial = ArmTrialConfig::default();
        let stage = ArmStage::start(ArmKind::Fri, self.session, self.client, room, trial)?;
        Ok(LedArm {
            stage,
            server: self.server,
        })
    }
}

/// The surroundings of a live session, for a study.
struct HandsRoom {
    driven: Driven,
    /// Reports holds on the console, as `bridge` does.
    holds: Holds,
    enabling_switch: bool,
}

impl Surroundings<FriClient> for HandsRoom {
    fn next_cycle(&mut self, arm: &mut FriClient) -> Result<Option<f64>, FriError> {
        self.driven.next_cycle(arm)
    }

    fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        self.driven.next_frame(now_s)
    }

    fn refused(&mut self, reason: &FriError) {
        self.holds.refused(reason);
    }
}

impl StudyRoom<FriClient> for HandsRoom {
    fn event(&mut self, event: &Event) {
        self.driven.bridge.view.event(event);
    }

    fn after<P: Predictor>(
        &mut self,
        session: &mut Session<P>,
        _: &mut FriClient,
        cycle: &Cycle,
    ) -> Result<(), FriError> {
        let is_latched = session.control().is_latched();
        let bridge = &mut self.driven.bridge;
        match asked(&bridge.view.orders(), is_latched, self.enabling_switch) {
            Some(Order::Stop) => session.stop(),
            Some(Order::LetGo) => session.reset(),
            None => {}
        }
        self.holds.see(cycle.t_s, session.state(), is_latched);
        self.holds
            .see_link(cycle.t_s, session.control().link_in_front());
        tell_left_out(session.control());
        bridge.show(session, &cycle.state);
        Ok(())
    }

    fn ended(&mut self, arm: &mut FriClient) {
        brake(arm);
        std::mem::take(&mut self.holds).finish();
        note(arm.statistics());
    }
}
