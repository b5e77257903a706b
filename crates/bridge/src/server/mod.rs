//! The server: it listens, serves the page, and connects clients with a loop.

mod broadcast;
mod client;
mod connection;
mod reply;
pub(crate) mod shared;

use crate::bridge::{Bridge, ViewSender};
use crate::calibration::Procedure;
use crate::config::BridgeConfig;
use crate::counts::BridgeCounts;
use crate::error::BridgeError;
use crate::hands::{HAND_QUEUE, HandQueue};
use crate::http::key::Key;
use crate::http::request::{self, Admission, Refusal, Request};
use crate::http::serve;
use crate::locked::locked;
use crate::pacing::Pacing;
use crate::tls::{Security, invitation};
use hwall::Explanations;
use hwall_view::{ViewScene, live_page};
use shared::{FromLoop, Shared};
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

pub use shared::{Order, Orders};

/// Most connections at a time, pages included.
const MAX_CONNECTIONS: usize = 64;
/// Most views and events that wait for the server.
const VIEW_QUEUE: usize = 8;
const EVENT_QUEUE: usize = 256;

/// One small HTTP and WebSocket server on threads: a page, hands in, views and events out.
/// It serves from the start; until [`BridgeServer::connect`] provides a scene, the page says that it is being prepared. Dropping the server
/// stops it.
pub struct BridgeServer {
    shared: Arc<Shared>,
    address: SocketAddr,
    threads: Vec<JoinHandle<()>>,
}

/// Stops a server from another thread or a signal handler.
#[derive(Clone)]
pub struct StopHandle {
    shared: Arc<Shared>,
    address: SocketAddr,
}

impl StopHandle {
    /// Ends the loop of every [`Bridge`] with its cycle, and disconnects all clients.
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
    /// A setting outside its range; the server cannot listen on the address; a certificate or a calibration that cannot be read or is malformed;
    /// a certificate in a build without the feature `tls`.
    pub fn start(mut config: BridgeConfig) -> Result<Self, BridgeError> {
        config.validate()?;
        let security = config.certificate.as_ref().map(Security::open);
        let security = security.transpose()?;
        if let Some(security) = &security {
            config.hosts.extend(security.names());
        }
        let procedure = Procedure::open(
            config.calibration.as_deref(),
            config.hand.calibrates().name(),
        )?;
        let (listener, address) = serve::listen(config.listen)?;
        let key = Key::of_server(address, &config.hosts, security.is_some())?;
        let shared = Arc::new(Shared::new(config, security, key, procedure));
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

    /// The address that it listens on.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// The URL to open in a browser on this machine. If other machines can connect, with a certificate, or with
    /// [hosts](BridgeConfig::hosts), it ends with a key, random for each start, which the page and the WebSocket require.
    #[must_use]
    pub fn url(&self) -> String {
        let secure = if self.shared.security.is_some() {
            "s"
        } else {
            ""
        };
        let address = serve::reachable(self.address);
        format!("http{secure}://{address}/{}", self.query())
    }

    fn query(&self) -> String {
        let key = self.shared.key.as_ref();
        key.map_or_else(String::new, Key::query)
    }

    /// Text for a person: the address to open, and a warning if others can connect. With TLS also all addresses for other devices, what the
    /// browser asks, and a QR code.
    #[must_use]
    pub fn invitation(&self) -> String {
        let Shared {
            security, config, ..
        } = &*self.shared;
        let query = self.query();
        let text = invitation(
            &self.url(),
            &query,
            security.as_ref(),
            self.address,
            &config.hosts,
        );
        if self.shared.key.is_none() {
            return text;
        }
        format!(
            "{text}\nWhoever has an address with its key can open the page and move the arm. The key is new at every start."
        )
    }

    /// Tells all clients what is being prepared before there is a scene.
    pub fn prepare(&self, text: &str) {
        self.greet(&reply::preparing(text));
    }

    /// Shows a scene, with the headset's space as configured, and returns the loop's side of the bridge. A previously connected loop is cut
    /// off.
    #[must_use]
    pub fn connect(&self, scene: &ViewScene) -> Bridge {
        let config = &self.shared.config;
        let (hand_sender, hands) = sync_channel(HAND_QUEUE);
        let (view_sender, views) = sync_channel(VIEW_QUEUE);
        let (event_sender, events) = sync_channel(EVENT_QUEUE);
        let explanations = Explanations::default();
        locked(&self.shared.intake).connect(hand_sender);
        *locked(&self.shared.from_loop) = Some(FromLoop {
            views,
            events,
            explanations: explanations.clone(),
            arm: scene.arm.clone(),
            board: scene.board,
        });
        let placed = ViewScene {
            base_from_headset: config.base_from_headset,
            ..scene.clone()
        };
        self.greet(&placed.to_json());
        Bridge {
            pacing: Pacing::new(config.period_s, config.max_behind_s),
            hands: HandQueue::new(hands, self.shared.start, config.lost_after_s),
            view: ViewSender::new(view_sender, event_sender, Arc::clone(&self.shared)),
            explanations,
        }
    }

    /// Counts of what was received, dropped and sent.
    #[must_use]
    pub fn counts(&self) -> BridgeCounts {
        self.shared.counts()
    }

    /// A handle to stop the server from elsewhere.
    #[must_use]
    pub fn stop_handle(&self) -> StopHandle {
        StopHandle {
            shared: Arc::clone(&self.shared),
            address: self.address,
        }
    }

    /// Was the server stopped?
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

/// Accepts connections until the server stops.
fn accept(shared: &Arc<Shared>, listener: &TcpListener) {
    let page: Arc<str> = Arc::from(live_page());
    let own = Arc::clone(shared);
    serve::accept(
        listener,
        MAX_CONNECTIONS,
        "bridge-client",
        || shared.is_stopped(),
        || shared.tally.refused_requests.add(1),
        move |tcp| {
            let within = Duration::from_secs_f64(own.config.request_s);
            let security = own.security.as_ref();
            let opened = serve::open(tcp, security, within, &own.config.hosts);
            let Ok(Some(mut stream)) = opened else {
                own.tally.failed_handshakes.add(1);
                return opened.map(drop);
            };
            let mut json = false;
            let judged = |asked: Result<&Request, Refusal>| match asked {
                Ok(Request::Page { .. }) => own.tally.pages.add(1),
                Ok(Request::Icon) => {}
                Ok(Request::Socket { json: is_asked, .. }) => json = *is_asked,
                Err(refused) => {
                    own.tally.refused_requests.add(1);
                    let is_large = refused == request::TOO_LARGE;
                    own.tally.too_large.add(u64::from(is_large));
                }
            };
            let admission = Admission {
                hosts: &own.config.hosts,
                key: own.key.as_ref(),
            };
            match serve::answer(&mut stream, within, admission, &page, judged)? {
                Some(rest) => connection::serve(&own, stream, rest, json),
                None => Ok(()),
            }
        },
    );
}
