//! The server: it listens, serves the page, and connects clients with a loop.

mod broadcast;
mod client;
mod connection;
pub(crate) mod locked;
mod reply;
pub(crate) mod shared;

use crate::bridge::{Bridge, ViewSender};
use crate::config::BridgeConfig;
use crate::counts::BridgeCounts;
use crate::error::BridgeError;
use crate::hands::{HAND_QUEUE, HandQueue};
use crate::http::request::{self, Refusal, Request};
use crate::http::serve;
use crate::pacing::Pacing;
use hwall_view::{ViewScene, live_page};
use locked::locked;
use shared::{FromLoop, Shared};
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

pub use shared::{Order, Orders};

/// Most connections at a time, pages included.
const MAX_CONNECTIONS: usize = 64;
/// Views and events that wait for the server at most.
const VIEW_QUEUE: usize = 8;
const EVENT_QUEUE: usize = 256;

/// One small HTTP and WebSocket server on threads: a page, hands in, views and events out.
///
/// It serves from the start; the page says that it is being prepared until [`BridgeServer::connect`] brings a scene.
/// Dropping it stops it.
pub struct BridgeServer {
    shared: Arc<Shared>,
    address: SocketAddr,
    threads: Vec<JoinHandle<()>>,
}

/// Stops a server from another thread, or from a handler of signals.
#[derive(Clone)]
pub struct StopHandle {
    shared: Arc<Shared>,
    address: SocketAddr,
}

impl StopHandle {
    /// The loop of every [`Bridge`] ends with its cycle, all clients are disconnected.
    pub fn stop(&self) {
        if self.shared.stop() {
            serve::wake(self.address);
        }
    }
}

impl BridgeServer {
    /// Listens and serves the page.
    ///
    /// # Errors
    /// A setting outside its range; an address that cannot be listened on.
    pub fn start(config: BridgeConfig) -> Result<Self, BridgeError> {
        config.validate()?;
        let (listener, address) = serve::listen(config.listen)?;
        let shared = Arc::new(Shared::new(config, &reply::preparing("preparing")));
        let thread = |name: &str| Builder::new().name(name.to_owned());
        let speaks = Arc::clone(&shared);
        let broadcast = thread("bridge-view").spawn(move || broadcast::broadcast(&speaks))?;
        let listens = Arc::clone(&shared);
        let accept = thread("bridge-listen").spawn(move || accept(&listens, &listener));
        let mut server = Self {
            shared,
            address,
            threads: vec![broadcast],
        };
        server.threads.push(accept?);
        Ok(server)
    }

    /// Where it listens.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// What to open in a browser on this machine.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://{}/", serve::reachable(self.address))
    }

    /// Tells all clients what is being done before there is a scene.
    pub fn prepare(&self, text: &str) {
        self.greet(&reply::preparing(text));
    }

    /// Shows a scene, with the headset's space where the settings have it, and returns the loop's end of the bridge. A loop that was connected before is cut off.
    #[must_use]
    pub fn connect(&self, scene: &ViewScene) -> Bridge {
        let config = &self.shared.config;
        let (hand_sender, hands) = sync_channel(HAND_QUEUE);
        let (view_sender, views) = sync_channel(VIEW_QUEUE);
        let (event_sender, events) = sync_channel(EVENT_QUEUE);
        locked(&self.shared.intake).connect(hand_sender);
        *locked(&self.shared.from_loop) = Some(FromLoop { views, events });
        let placed = ViewScene {
            base_from_headset: config.base_from_headset,
            ..scene.clone()
        };
        self.greet(&placed.to_json());
        Bridge {
            pacing: Pacing::new(config.period_s, config.max_behind_s),
            hands: HandQueue::new(hands, self.shared.start, config.lost_after_s),
            view: ViewSender::new(view_sender, event_sender, Arc::clone(&self.shared)),
        }
    }

    /// What came in, what was dropped and why.
    #[must_use]
    pub fn counts(&self) -> BridgeCounts {
        self.shared.counts()
    }

    /// To stop it from elsewhere.
    #[must_use]
    pub fn stop_handle(&self) -> StopHandle {
        StopHandle {
            shared: Arc::clone(&self.shared),
            address: self.address,
        }
    }

    /// Was it told to stop?
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.shared.is_stopped()
    }

    fn greet(&self, text: &str) {
        let clients = locked(&self.shared.clients);
        *locked(&self.shared.greeting) = Arc::from(text);
        for client in clients.iter() {
            client.say(text, &self.shared.tally);
        }
    }
}

impl Drop for BridgeServer {
    fn drop(&mut self) {
        self.stop_handle().stop();
        for thread in self.threads.drain(..) {
            // A thread that panicked has ended, too.
            let _ = thread.join();
        }
    }
}

/// Takes connections until the server stops.
fn accept(shared: &Arc<Shared>, listener: &TcpListener) {
    let page: Arc<str> = Arc::from(live_page());
    let own = Arc::clone(shared);
    serve::accept(
        listener,
        MAX_CONNECTIONS,
        "bridge-client",
        || shared.is_stopped(),
        || shared.tally.refused_requests.add(1),
        move |mut stream| {
            let within = Duration::from_secs_f64(own.config.request_s);
            let judged = |asked: Result<&Request, Refusal>| match asked {
                Ok(Request::Page { .. }) => own.tally.pages.add(1),
                Ok(Request::Icon | Request::Socket { .. }) => {}
                Err(refused) => {
                    own.tally.refused_requests.add(1);
                    let is_large = refused == request::TOO_LARGE;
                    own.tally.too_large.add(u64::from(is_large));
                }
            };
            match serve::answer(&mut stream, within, &own.config.hosts, &page, judged)? {
                Some(rest) => connection::serve(&own, stream, rest),
                None => Ok(()),
            }
        },
    );
}
