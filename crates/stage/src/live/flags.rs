//! A live session from the flags of a command line.

use crate::input::address::{host, receivable, socket_address};
use crate::input::file_plan::FilePlan;
use crate::input::floor_pose::FloorPose;
use crate::input::real_room::RealRoom;
use crate::input::scene_file::SceneFlags;
use crate::numbers::positive;
use crate::person::predictors::PredictorKind;
use crate::person::responses::Scenery;
use crate::recording;
use crate::run::simulated_arm::ArmLevel;
use crate::run::stage::SessionSettings;
use crate::setting::load_scene;
use anyhow::Context;
use clap::ValueEnum;
use hwall::geometry::Pose;
use hwall::hand::HandFilterConfig;
use hwall_bridge::{BridgeConfig, Certificate, FollowedHand};
use hwall_fri::{FriClientConfig, FriVersion, MOST_BEHIND_S};
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;

/// Which hand the board serves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum HandChoice {
    /// The left one
    Left,
    /// The right one; a mouse counts as one
    #[default]
    Right,
    /// The hand that is seen first; the other one when that is lost
    Either,
}

impl From<HandChoice> for FollowedHand {
    fn from(hand: HandChoice) -> Self {
        match hand {
            HandChoice::Left => Self::Left,
            HandChoice::Right => Self::Right,
            HandChoice::Either => Self::Either,
        }
    }
}

/// The folder for a user's data.
fn user_data() -> anyhow::Result<PathBuf> {
    let folder = |name: &str| {
        let named = std::env::var_os(name).filter(|value| !value.is_empty());
        named.map(PathBuf::from).filter(|path| path.is_absolute())
    };
    let home = || folder("HOME").map(|home| home.join(".local/share"));
    let found = folder("XDG_DATA_HOME").or_else(|| folder("LOCALAPPDATA"));
    found
        .or_else(home)
        .context("no folder for the user's data: name a file with --tls-file")
}

/// Flags of every program that leads an arm: the arm, its surroundings, and the person it serves.
#[derive(Debug, Clone, clap::Args)]
pub struct LedArmFlags {
    /// Address of the controller; datagrams from elsewhere are counted and dropped [default: the first sender]
    #[arg(long, requires = "fri", value_name = "HOST", value_parser = host)]
    pub fri_controller: Option<IpAddr>,
    /// Version of its interface: 1.15, 2.5 or 2.7
    #[arg(long, default_value = "1.15")]
    pub fri_version: FriVersion,
    /// Name of a proxy by which browsers reach the page; may be given more than once
    #[arg(long = "host")]
    pub hosts: Vec<String>,
    /// TOML file of the real obstacles around the arm, as planes and boxes in the frame of its base [default: a floor at the lowest point
    /// of the scene, or at the base]
    #[arg(long)]
    pub room: Option<PathBuf>,
    /// Origin of the headset's space in the arm's base frame: x,y,z in metres, yaw in degrees. A headset's space lies on the floor; in the built-in room that is 0.6 m below the base
    #[arg(long, value_parser = FloorPose::parse, allow_hyphen_values = true, default_value = "1.5,0,-0.6,180")]
    pub origin: FloorPose,
    /// servo: the arm takes positions, a simulated one with a delay; torque: it takes torques, by which doors are rendered, and a simulated one has rigid bodies, friction and sensors
    #[arg(long, value_enum, default_value_t)]
    pub arm_level: ArmLevel,
    /// Which hand the board serves
    #[arg(long, value_enum, default_value_t)]
    pub hand: HandChoice,
    /// A hand or head that stands quite still counts as lost: for a headset that repeats its last pose
    #[arg(long)]
    pub watch_frozen: bool,
    /// The person's head is not tracked: the arm does not wait for it, and nothing keeps the arm away from head, torso and arms
    #[arg(long)]
    pub no_head: bool,
}

impl LedArmFlags {
    /// The settings of the page's server.
    ///
    /// # Errors
    /// An origin that is not a rigid motion.
    pub fn server(&self, listen: SocketAddr) -> anyhow::Result<BridgeConfig> {
        Ok(BridgeConfig {
            listen,
            hosts: self.hosts.clone(),
            hand: self.hand.into(),
            base_from_headset: Pose::from_affine(&self.origin.outer_from_here())?,
            ..BridgeConfig::default()
        })
    }

    /// The settings of the controller's client.
    #[must_use]
    pub fn client(&self, listen: SocketAddr) -> FriClientConfig {
        FriClientConfig {
            listen,
            controller: self.fri_controller,
            version: self.fri_version,
            ..FriClientConfig::default()
        }
    }

    /// The real obstacles around the arm, if a file describes them.
    ///
    /// # Errors
    /// A file that cannot be read, or is malformed.
    pub fn real_room(&self) -> anyhow::Result<Option<RealRoom>> {
        let room = self.room.as_deref().map(RealRoom::read);
        room.transpose().context("--room")
    }

    /// A warning about these flags for the user, if one is needed.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        let text = "no head is waited for: nothing keeps the arm away from head, torso and arms";
        self.no_head.then(|| text.to_owned())
    }

    /// The settings of a session in this room.
    #[must_use]
    pub fn session<'a>(
        &self,
        scenery: Scenery<'a>,
        room: Option<&'a RealRoom>,
        is_behind_fri: bool,
    ) -> SessionSettings<'a> {
        SessionSettings {
            link_s: if is_behind_fri { MOST_BEHIND_S } else { 0.0 },
            room: room.map(|read| &read.room),
            level: self.arm_level,
            filter: match self.watch_frozen {
                true => HandFilterConfig::default(),
                false => HandFilterConfig::simulated(),
            },
            sees_head: !self.no_head,
            watches_head: self.watch_frozen,
            ..SessionSettings::of(scenery)
        }
    }
}

/// Flags of a live session: source of hands, arm, recordings.
#[derive(Debug, Clone, clap::Parser)]
pub struct LiveFlags {
    /// Where to listen; any address other than 127.0.0.1 lets in other machines that have the key, which is printed as a part of the
    /// address. With --tls, which is for other devices, the default is 0.0.0.0:8443
    #[arg(long, default_value = "127.0.0.1:8080", default_value_if("tls", "true", "0.0.0.0:8443"), value_parser = socket_address)]
    pub listen: SocketAddr,
    /// Serves the page over HTTPS, which headsets on the network need, with a certificate that is made at the first start. Needs a build with the feature `tls`
    #[arg(long)]
    pub tls: bool,
    /// File of that certificate and its key [default: hwall/bridge.pem among the user's data]
    #[arg(long, requires = "tls", conflicts_with = "tls_cert")]
    pub tls_file: Option<PathBuf>,
    /// A certificate of your own, its chain as PEM
    #[arg(long, requires = "tls", requires = "tls_key")]
    pub tls_cert: Option<PathBuf>,
    /// Its key, as PEM
    #[arg(long, requires = "tls_cert")]
    pub tls_key: Option<PathBuf>,
    /// Keeps the pose of the headset's space, found by touching three corners of the board, in this file. The calibration belongs to one
    /// headset. The arm stands until it is done; at the next start the arm stands until two touches have checked it
    #[arg(long)]
    pub calibration: Option<PathBuf>,
    /// The scene.
    #[command(flatten)]
    pub scene: SceneFlags,
    /// The arm.
    #[command(flatten)]
    pub led: LedArmFlags,
    /// The predictor that leads the board [default: fused, or ray-led without training data]
    #[arg(long, value_enum)]
    pub predictor: Option<PredictorKind>,
    /// Listens here for the FRI controller of an iiwa and leads its arm instead of the simulated one: 127.0.0.1:30200 for a simulated
    /// controller; for a real one, this computer's address on the controller's network, with a port of 30200 to 30209
    #[arg(long, conflicts_with = "unity_udp", value_parser = socket_address)]
    pub fri: Option<SocketAddr>,
    /// Receives the dissertation's UDP datagrams here, which command the board; hands are then not followed
    #[arg(long, value_parser = socket_address)]
    pub unity_udp: Option<SocketAddr>,
    /// The arm moves only while somebody holds the switch on the page (its address followed by #switch, for instance on a phone). Releasing
    /// the switch or losing the connection stops the arm
    #[arg(long, conflicts_with = "unity_udp")]
    pub enabling_switch: bool,
    /// Records the session to this file, for Foxglove, Rerun and `hwall --replay`, with the arm's capsules as URDF in the same folder
    #[arg(long, conflicts_with = "unity_udp")]
    pub record: Option<PathBuf>,
    /// End after this many seconds [default: never]
    #[arg(long, allow_negative_numbers = true, value_parser = positive)]
    pub seconds: Option<f64>,
    /// Seed of the sensors' noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
}

impl LiveFlags {
    /// The server's settings.
    ///
    /// # Errors
    /// An origin that is not a rigid motion; no place for a certificate.
    pub fn server(&self) -> anyhow::Result<BridgeConfig> {
        Ok(BridgeConfig {
            certificate: self.certificate()?,
            calibration: self.calibration.clone(),
            ..self.led.server(self.listen)?
        })
    }

    fn certificate(&self) -> anyhow::Result<Option<Certificate>> {
        if let (Some(certificates), Some(key)) = (&self.tls_cert, &self.tls_key) {
            return Ok(Some(Certificate::Own {
                certificates: certificates.clone(),
                key: key.clone(),
            }));
        }
        let file = match &self.tls_file {
            _ if !self.tls => return Ok(None),
            Some(file) => file.clone(),
            None => user_data()?.join("hwall/bridge.pem"),
        };
        Ok(Some(Certificate::SelfSigned(file)))
    }

    /// Checks, before anybody is served, for errors that would end the session after preparation: an unreadable scene or room, a
    /// recording that cannot be written or would overwrite the scene, an address that cannot be bound.
    ///
    /// # Errors
    /// The first such error.
    pub fn check(&self) -> anyhow::Result<()> {
        let plan = FilePlan::default()
            .read_scene("--scene", self.scene.scene.as_deref())
            .read("--room", self.led.room.as_deref())
            .read("--tls-cert", self.tls_cert.as_deref())
            .read("--tls-key", self.tls_key.as_deref())
            .write("--calibration", self.calibration.as_deref());
        recording::planned(plan, "--record", self.record.as_deref()).check()?;
        load_scene(self.scene.file())?;
        self.led.real_room()?;
        for (flag, address) in [("--fri", self.fri), ("--unity-udp", self.unity_udp)] {
            if let Some(address) = address {
                receivable(flag, address)?;
            }
        }
        Ok(())
    }
}
