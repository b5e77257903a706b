//! State shared by the threads of a server.

use super::client::Client;
use super::reply;
use crate::calibration::{Procedure, Step};
use crate::config::BridgeConfig;
use crate::counts::{BridgeCounts, Tally};
use crate::hands::Intake;
use crate::http::key::Key;
use crate::locked::locked;
use crate::tls::Security;
use hwall::haptics::Board;
use hwall::{Event, Explanations};
use hwall_view::{ViewArm, ViewFrame};
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// An order of a person to the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Stop, latched.
    Stop,
    /// Release a stopped arm.
    LetGo,
}

/// Passes orders to the loop, from any thread. A pending stop cannot be revoked.
#[derive(Debug, Clone, Default)]
pub struct Orders(Arc<Asked>);

#[derive(Debug, Default)]
struct Asked {
    order: AtomicU8,
    /// The enabling switch is held.
    enabled: LastSaid,
    /// The headset's space is not calibrated.
    uncalibrated: AtomicBool,
}

/// Time of the last statement, such as "the switch is held", that is valid for a while.
#[derive(Debug)]
pub(crate) struct LastSaid {
    began: Instant,
    /// Microseconds after the beginning; 0: never.
    last_us: AtomicU64,
}

impl Default for LastSaid {
    fn default() -> Self {
        Self {
            began: Instant::now(),
            last_us: AtomicU64::new(0),
        }
    }
}

impl LastSaid {
    /// The statement is made now.
    pub(crate) fn say(&self) {
        let now_us = self.began.elapsed().as_micros();
        let now_us = u64::try_from(now_us).unwrap_or(u64::MAX).max(1);
        self.last_us.store(now_us, Ordering::SeqCst);
    }

    /// Was it made within this time?
    pub(crate) fn is_within(&self, time: Duration) -> bool {
        let last_us = self.last_us.load(Ordering::SeqCst);
        let last = Duration::from_micros(last_us);
        last_us > 0 && self.began.elapsed().saturating_sub(last) <= time
    }
}

impl Orders {
    const STOP: u8 = 2;
    const LET_GO: u8 = 1;

    /// Stops the arm with the next cycle.
    pub fn stop(&self) {
        self.0.order.fetch_max(Self::STOP, Ordering::SeqCst);
    }

    /// Releases a stopped arm with the next cycle.
    pub fn let_go(&self) {
        self.0.order.fetch_max(Self::LET_GO, Ordering::SeqCst);
    }

    /// Reports that the enabling switch is held now.
    pub fn enable(&self) {
        self.0.enabled.say();
    }

    /// Was the enabling switch held within this time?
    #[must_use]
    pub fn is_enabled(&self, within: Duration) -> bool {
        self.0.enabled.is_within(within)
    }

    /// Must the arm stand until the headset's space is calibrated or checked?
    #[must_use]
    pub fn is_uncalibrated(&self) -> bool {
        self.0.uncalibrated.load(Ordering::SeqCst)
    }

    /// Takes the pending order.
    #[must_use]
    pub fn take(&self) -> Option<Order> {
        match self.0.order.swap(0, Ordering::SeqCst) {
            Self::STOP => Some(Order::Stop),
            Self::LET_GO => Some(Order::LetGo),
            _ => None,
        }
    }
}

/// State shared by the threads of a server. The loop uses only the tally and the flags, which are atomic.
pub(crate) struct Shared {
    pub(crate) config: BridgeConfig,
    /// Encrypts the connections.
    pub(crate) security: Option<Security>,
    /// Required for the page and the WebSocket.
    pub(crate) key: Option<Key>,
    pub(crate) tally: Tally,
    pub(crate) start: Instant,
    pub(crate) intake: Mutex<Intake>,
    pub(crate) procedure: Mutex<Procedure>,
    /// Sent to every new client: the scene, or that it is being prepared.
    pub(crate) greeting: Mutex<Arc<str>>,
    pub(crate) clients: Mutex<Vec<Arc<Client>>>,
    /// The channels from the loop.
    pub(crate) from_loop: Mutex<Option<FromLoop>>,
    pub(crate) orders: Orders,
    /// A page requests the supervisor's parts.
    pub(crate) parts: LastSaid,
    /// A page requests explanations of the policy.
    pub(crate) explained: LastSaid,
    next_client: AtomicU64,
    stopped: AtomicBool,
}

/// The server's ends of the loop's channels.
pub(crate) struct FromLoop {
    pub(crate) views: Receiver<ViewFrame>,
    pub(crate) events: Receiver<Event>,
    pub(crate) explanations: Explanations,
    pub(crate) arm: ViewArm,
    pub(crate) board: Board,
}

impl Shared {
    pub(crate) fn new(
        config: BridgeConfig,
        security: Option<Security>,
        key: Option<Key>,
        procedure: Procedure,
    ) -> Self {
        let shared = Self {
            intake: Mutex::new(Intake::new(&config)),
            config,
            security,
            key,
            tally: Tally::default(),
            start: Instant::now(),
            greeting: Mutex::new(Arc::from(reply::preparing("preparing"))),
            clients: Mutex::default(),
            from_loop: Mutex::default(),
            orders: Orders::default(),
            parts: LastSaid::default(),
            explained: LastSaid::default(),
            procedure: Mutex::new(procedure),
            next_client: AtomicU64::new(1),
            stopped: AtomicBool::new(false),
        };
        shared.heed(&locked(&shared.procedure));
        shared
    }

    /// Performs a step of the calibration, requested by the page of a headset or by another page; tells all pages the result.
    pub(crate) fn calibrate(&self, step: Step, from: Option<u64>, now_s: f64) {
        let kept = {
            let mut procedure = locked(&self.procedure);
            if step == Step::Recentred {
                if procedure.is_of_another(from) {
                    return;
                }
                // Needed without a calibration, too: head and hand are then not where the session expects them.
                self.orders.stop();
            }
            let kept = procedure.act(step, from, now_s);
            self.heed(&procedure);
            kept
        };
        // Write without holding a lock, because disks can be slow.
        if let Some((file, text)) = kept
            && let Err(error) = hwall_files::write(file, text)
        {
            locked(&self.procedure).not_kept(&error);
        }
        self.tell_calibration();
    }

    /// Tells all pages how the calibration stands.
    pub(crate) fn tell_calibration(&self) {
        // Lock clients before the procedure, as when a client joins: the other order could deadlock.
        let clients = locked(&self.clients);
        let procedure = locked(&self.procedure);
        for client in clients.iter() {
            client.say(&procedure.to_json(client.headset()), &self.tally);
        }
    }

    /// Applies the calibration to hands and arm.
    fn heed(&self, procedure: &Procedure) {
        let mut intake = locked(&self.intake);
        intake.serve(procedure.serves());
        if let Some(base_from_headset) = procedure.base_from_headset() {
            intake.place(&base_from_headset);
        }
        let uncalibrated = &self.orders.0.uncalibrated;
        uncalibrated.store(procedure.must_stand(), Ordering::SeqCst);
    }

    /// Time on the server's clock, s.
    pub(crate) fn now_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    pub(crate) fn counts(&self) -> BridgeCounts {
        self.tally.counts(locked(&self.clients).len())
    }

    pub(crate) fn new_client_id(&self) -> u64 {
        self.next_client.fetch_add(1, Ordering::Relaxed)
    }

    /// Sends a text to all clients.
    pub(crate) fn say(&self, text: &str) {
        for client in locked(&self.clients).iter() {
            client.say(text, &self.tally);
        }
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    /// Ends all threads; returns true the first time.
    pub(crate) fn stop(&self) -> bool {
        let first = !self.stopped.swap(true, Ordering::SeqCst);
        for client in locked(&self.clients).iter() {
            client.end();
        }
        first
    }
}
