//! A controller and a client in simulated time: no sockets, no clock.

use hwall_fri::codec::{
    ClientCommandMode, Codec, CommandData, CommandMessage, DATAGRAM_BYTES, Datagram, Header,
    MonitorMessage, SessionState,
};
use hwall_fri::controller::{
    Controller, ControllerConfig, ControllerEvent, EventKind, Link, LinkConfig, SimulatedPlant,
    iiwa7_torque,
};
use hwall_kinematics::{JointPositions, SrsArm};
use hwall_sim::{ServoArm, ServoConfig, TorqueArm};
use std::sync::Arc;

pub fn start() -> JointPositions {
    JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0])
}

pub fn servo() -> ServoArm {
    let config = ServoConfig {
        reaction_delay_s: 0.005,
        ..ServoConfig::default()
    };
    ServoArm::new(Arc::new(SrsArm::iiwa7()), start(), config).expect("an arm")
}

/// An application in this mode that asks for commands after 0.1 s.
pub fn config(mode: ClientCommandMode) -> ControllerConfig {
    ControllerConfig {
        mode,
        ready_s: Some(0.1),
        ..ControllerConfig::default()
    }
}

pub fn torque_arm() -> TorqueArm {
    iiwa7_torque(0).expect("an arm")
}

/// A client like the manufacturer's samples: mirrors while it waits, then applies `overlay` from time 0.
pub struct SampleClient {
    pub codec: Codec,
    pub state: SessionState,
    sequence: u32,
    since_answer: u32,
    active_s: f64,
}

impl SampleClient {
    pub fn new(codec: Codec) -> Self {
        Self {
            codec,
            state: SessionState::Idle,
            sequence: 0,
            since_answer: 0,
            active_s: 0.0,
        }
    }

    pub fn answer(
        &mut self,
        datagram: &[u8],
        overlay: &mut dyn FnMut(f64, &MonitorMessage, &mut CommandData),
    ) -> Option<Vec<u8>> {
        let message = self.codec.decode_monitor(datagram).expect("a message");
        let connection = message.connection;
        if connection.state != self.state && connection.state == SessionState::CommandingActive {
            self.active_s = 0.0;
        }
        self.state = connection.state;
        let mut data = CommandData::default();
        match connection.state {
            SessionState::Idle => return None,
            SessionState::MonitoringWait | SessionState::MonitoringReady => {}
            SessionState::CommandingWait | SessionState::CommandingActive => {
                let interpolator = message.interpolator.expect("an interpolator");
                data.position_rad = interpolator.position_rad;
                match interpolator.command_mode {
                    Some(ClientCommandMode::Torque) => data.torque_n_m = Some([0.0; 7]),
                    Some(ClientCommandMode::Wrench) => data.wrench = Some([0.0; 6]),
                    _ => {}
                }
                if connection.state == SessionState::CommandingActive {
                    overlay(self.active_s, &message, &mut data);
                    self.active_s += f64::from(connection.send_period_ms.unwrap_or(0)) * 1e-3;
                }
            }
        }
        self.since_answer += 1;
        if self.since_answer < connection.receive_multiplier.unwrap_or(1) {
            return None;
        }
        self.since_answer = 0;
        let command = CommandMessage {
            header: Header {
                sequence: self.sequence,
                reflected_sequence: message.header.sequence,
            },
            data: Some(data),
        };
        self.sequence += 1;
        let mut buffer: Datagram = [0; DATAGRAM_BYTES];
        let length = self
            .codec
            .encode_command(&command, &mut buffer)
            .expect("it fits");
        Some(buffer[..length].to_vec())
    }
}

/// Both, with the network between them.
pub struct Bench<P> {
    pub controller: Controller<P>,
    pub client: SampleClient,
    pub out: Link,
    pub back: Link,
    pub events: Vec<ControllerEvent>,
}

impl<P: SimulatedPlant> Bench<P> {
    pub fn new(plant: P, config: ControllerConfig, link: LinkConfig) -> Self {
        let controller = Controller::new(plant, config).expect("a controller");
        let back = LinkConfig {
            seed: link.seed + 1,
            ..link
        };
        Self {
            controller,
            client: SampleClient::new(Codec::new(config.version)),
            out: Link::new(link).expect("a link"),
            back: Link::new(back).expect("a link"),
            events: Vec::new(),
        }
    }

    /// Time advances in steps of 0.1 ms; the client answers at once.
    pub fn run(
        &mut self,
        seconds: f64,
        mut overlay: impl FnMut(f64, &MonitorMessage, &mut CommandData),
    ) {
        let mut buffer: Datagram = [0; DATAGRAM_BYTES];
        let until_s = self.controller.t_s() + seconds;
        while self.controller.t_s() < until_s - 1e-9 {
            let now_s = self.controller.t_s();
            while let Some(length) = self.back.take(now_s, &mut buffer) {
                self.controller.receive(&buffer[..length]);
            }
            let length = self.controller.cycle(&mut buffer).expect("a cycle");
            self.out.offer(now_s, &buffer[..length]);
            for step in 0..10 {
                let t_s = now_s + f64::from(step) * 0.1 * (self.controller.t_s() - now_s);
                while let Some(length) = self.out.take(t_s, &mut buffer) {
                    if let Some(answer) = self.client.answer(&buffer[..length], &mut overlay) {
                        self.back.offer(t_s, &answer);
                    }
                }
            }
            while let Some(event) = self.controller.next_event() {
                self.events.push(event);
            }
        }
    }

    pub fn states(&self) -> Vec<SessionState> {
        let to = |event: &ControllerEvent| match event.kind {
            EventKind::State { to, .. } => Some(to),
            _ => None,
        };
        self.events.iter().filter_map(to).collect()
    }
}
