//! Receives datagrams and returns targets.

use super::datagram::BoardDatagram;
use crate::counts::{BridgeCounts, Tally};
use crate::error::BridgeError;
use crate::hands::seen;
use glam::DVec3;
use hwall::geometry::Pose;
use hwall::haptics::{BoardTarget, HapticsError, Slide, board_pose};
use hwall::numeric::check::positive;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Most datagrams that wait for the loop; the newest counts.
const QUEUE: usize = 64;
/// How often the thread checks whether to end.
const LOOK: Duration = Duration::from_millis(100);

/// Settings of a [`UnityReceiver`].
#[derive(Debug, Clone, PartialEq)]
pub struct UnityConfig {
    /// Address to listen on. Default 127.0.0.1:5005.
    pub listen: SocketAddr,
    /// The sender's frame (z up, m) in the arm's base frame; default the base itself.
    pub base_from_unity: Pose,
    /// Another sender may take over after the first one was silent for this long, s; default 1.
    pub takeover_s: f64,
}

impl Default for UnityConfig {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 5005)),
            base_from_unity: Pose::IDENTITY,
            takeover_s: 1.0,
        }
    }
}

/// The target of the board, and its motion while it is touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnityTarget {
    /// The target, stamped with the time of the loop's cycle that first saw it; rolled by the angle of the roughness code.
    pub target: BoardTarget,
    /// Motion along the x axis of the rolled board at the speed of the code; `None` for speed zero.
    pub slide: Option<Slide>,
    /// Does the object move?
    pub is_dynamic: bool,
}

impl UnityTarget {
    /// From a datagram, stamped with `stamp_s` on the arm's clock.
    ///
    /// # Errors
    /// A position that is not finite in the base frame.
    pub fn of(
        datagram: &BoardDatagram,
        base_from_unity: &Pose,
        stamp_s: f64,
    ) -> Result<Self, HapticsError> {
        let (sin, cos) = datagram.orientation_deg.to_radians().sin_cos();
        let point_m = 1e-3 * DVec3::from_array(datagram.position_mm);
        let point_m = base_from_unity.transform_point(point_m);
        let normal = base_from_unity.transform_vector(DVec3::new(cos, sin, 0.0));
        let roll_rad = datagram.roughness.angle_rad();
        let speed_m_per_s = datagram.roughness.speed_m_per_s();
        let board = board_pose(point_m, normal, roll_rad)?;
        let slide = (speed_m_per_s > 0.0).then(|| Slide {
            velocity_m_per_s: speed_m_per_s * board.rotation().x_axis,
            turn_rad_per_s: 0.0,
        });
        Ok(Self {
            target: BoardTarget {
                roll_rad: Some(roll_rad),
                ..BoardTarget::new(point_m, normal, stamp_s)
            },
            slide,
            is_dynamic: datagram.is_dynamic,
        })
    }
}

/// Receives the dissertation's datagrams on its own thread and converts them to targets for a [`TargetControl`](hwall::TargetControl). As
/// for hands, a position at exactly 0,0,0 is absent: the datagram is ignored.
pub struct UnityReceiver {
    config: UnityConfig,
    address: SocketAddr,
    datagrams: Receiver<BoardDatagram>,
    tally: Arc<Tally>,
    stopped: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl UnityReceiver {
    /// Starts to listen.
    ///
    /// # Errors
    /// A setting outside its range; the receiver cannot listen on the address.
    pub fn start(config: UnityConfig) -> Result<Self, BridgeError> {
        positive("takeover_s", config.takeover_s)?;
        let address = config.listen;
        let listen = |source| BridgeError::Listen { address, source };
        let socket = UdpSocket::bind(address).map_err(listen)?;
        let address = socket.local_addr().map_err(listen)?;
        socket.set_read_timeout(Some(LOOK))?;
        let (sender, datagrams) = sync_channel(QUEUE);
        let (tally, stopped) = (Arc::<Tally>::default(), Arc::<AtomicBool>::default());
        let takeover = Duration::from_secs_f64(config.takeover_s.min(3600.0));
        let receive = {
            let (tally, stopped) = (Arc::clone(&tally), Arc::clone(&stopped));
            move || receive(&socket, &sender, takeover, &tally, &stopped)
        };
        let thread = std::thread::Builder::new()
            .name("bridge-unity".to_owned())
            .spawn(receive)?;
        Ok(Self {
            config,
            address,
            datagrams,
            tally,
            stopped,
            thread: Some(thread),
        })
    }

    /// The address that it listens on.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// The newest target since the last call, stamped with the time of this cycle, s on the arm's clock. Takes no lock and allocates
    /// nothing.
    pub fn newest(&mut self, now_s: f64) -> Option<UnityTarget> {
        let datagram = self.datagrams.try_iter().last()?;
        // Decoded values are finite, and so is the pose.
        UnityTarget::of(&datagram, &self.config.base_from_unity, now_s).ok()
    }

    /// Only [`BridgeCounts::datagrams`], [`BridgeCounts::unseen_datagrams`] and [`BridgeCounts::refused_datagrams`] are counted.
    #[must_use]
    pub fn counts(&self) -> BridgeCounts {
        self.tally.counts(0)
    }
}

impl Drop for UnityReceiver {
    fn drop(&mut self) {
        self.stopped.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn receive(
    socket: &UdpSocket,
    datagrams: &SyncSender<BoardDatagram>,
    takeover: Duration,
    tally: &Tally,
    stopped: &AtomicBool,
) {
    // One byte more than a datagram has, to detect longer ones.
    let mut bytes = [0; BoardDatagram::BYTES + 1];
    let mut leader: Option<(SocketAddr, std::time::Instant)> = None;
    while !stopped.load(Ordering::Relaxed) {
        let Ok((length, sender)) = socket.recv_from(&mut bytes) else {
            continue;
        };
        let is_led_by_another =
            leader.is_some_and(|(who, heard)| who != sender && heard.elapsed() <= takeover);
        let read = BoardDatagram::decode(bytes.get(..length).unwrap_or_default());
        match read {
            Ok(datagram) if !is_led_by_another => {
                leader = Some((sender, std::time::Instant::now()));
                if seen(Some(datagram.position_mm)).is_none() {
                    tally.unseen_datagrams.add(1);
                    continue;
                }
                match datagrams.try_send(datagram) {
                    Ok(()) => tally.datagrams.add(1),
                    Err(_) => tally.overflow.add(1),
                }
            }
            _ => tally.refused_datagrams.add(1),
        }
    }
}
