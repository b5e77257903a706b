//! The server: it listens, serves the page, and connects clients with a loop.

mod broadcast;
mod client;
mod reply;
mod shared;

use crate::bridge::{Bridge, ViewSender};
use crate::config::BridgeConfig;
use crate::counts::BridgeCounts;
use crate::error::BridgeError;
use crate::hands::{HAND_QUEUE, HandQueue};
use crate::http::request::{self, Request};
use crate::http::response;
use crate::pacing::Pacing;
use hwall_view::{ViewScene, live_page};
use shared::{FromLoop, locked};
use std::io::{self, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::sync_channel;
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

pub(crate) use shared::Shared;
pub use shared::{Order, Orders};

/// Most connections at a time, pages included.
const MAX_CONNECTIONS: usize = 64;
/// Views and events that wait for the server at most.
const VIEW_QUEUE: usize = 8;
const EVENT_QUEUE: usize = 256;
/// An answer must be taken within this time.
const ANSWER: Duration = Duration::from_secs(5);

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
            // Wakes the thread that waits for connections.
            let _ = TcpStream::connect_timeout(&reachable(self.address), ANSWER);
        }
    }
}

/// An address of this machine by which it reaches itself.
fn reachable(mut address: SocketAddr) -> SocketAddr {
    match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => address.set_ip(Ipv4Addr::LOCALHOST.into()),
        IpAddr::V6(ip) if ip.is_unspecified() => address.set_ip(Ipv6Addr::LOCALHOST.into()),
        _ => {}
    }
    address
}

impl BridgeServer {
    /// Listens and serves the page.
    ///
    /// # Errors
    /// A setting outside its range; an address that cannot be listened on.
    pub fn start(config: BridgeConfig) -> Result<Self, BridgeError> {
        config.validate()?;
        let asked = config.listen;
        let listen = |source| BridgeError::Listen {
            address: asked,
            source,
        };
        let listener = TcpListener::bind(asked).map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
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
        format!("http://{}/", reachable(self.address))
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

/// Takes connections until the server stops, each on a thread of its own.
fn accept(shared: &Arc<Shared>, listener: &TcpListener) {
    let page: Arc<str> = Arc::from(live_page());
    while !shared.is_stopped() {
        let Ok((stream, _)) = listener.accept() else {
            // Out of file descriptors, for instance: others must end first.
            std::thread::sleep(Duration::from_millis(20));
            continue;
        };
        if shared.is_stopped() {
            return;
        }
        let Some(slot) = Slot::of(shared) else {
            shared.tally.refused_requests.add(1);
            // An empty buffer takes it; if not, nobody waits for it.
            let _ = stream.set_nonblocking(true);
            let _ = (&stream).write(&response::refusal(request::BUSY));
            continue;
        };
        let html = Arc::clone(&page);
        // A thread that cannot be started gives its slot back as one that ends.
        let _ = Builder::new()
            .name("bridge-client".to_owned())
            .spawn(move || {
                // Whatever became of the connection: it has ended.
                let _ = serve(&slot.0, stream, &html);
            });
    }
}

/// One of the connections there may be at a time; given back when it is dropped, also by a thread that panics.
struct Slot(Arc<Shared>);

impl Slot {
    /// `None`: there are enough.
    fn of(shared: &Arc<Shared>) -> Option<Self> {
        let slot = Self(Arc::clone(shared));
        let before = shared.connections.fetch_add(1, Ordering::SeqCst);
        (before < MAX_CONNECTIONS).then_some(slot)
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        self.0.connections.fetch_sub(1, Ordering::SeqCst);
    }
}

/// One request, and if it asks for a WebSocket all that follows.
fn serve(shared: &Arc<Shared>, mut stream: TcpStream, html: &str) -> io::Result<()> {
    stream.set_write_timeout(Some(ANSWER))?;
    let within = Duration::from_secs_f64(shared.config.request_s);
    let asked = match request::read_head(&mut stream, within)? {
        Ok(None) => return Ok(()),
        Ok(Some(head)) => {
            request::judge(&head.bytes, &shared.config.hosts).map(|asked| (asked, head.rest))
        }
        Err(refused) => Err(refused),
    };
    let answer = match asked {
        Ok((Request::Socket { key }, rest)) => {
            stream.write_all(&response::switch_to_socket(&key))?;
            return client::serve(shared, stream, rest);
        }
        Ok((Request::Page { host, body }, _)) => {
            shared.tally.pages.add(1);
            response::page(html, &host, body)
        }
        Ok((Request::Icon, _)) => response::no_content(),
        Err(refused) => {
            shared.tally.refused_requests.add(1);
            if refused == request::TOO_LARGE {
                shared.tally.too_large.add(1);
            }
            response::refusal(refused)
        }
    };
    stream.write_all(&answer)?;
    stream.shutdown(Shutdown::Write)?;
    linger(&mut stream)
}

/// Takes what the client still sends, for a moment: a connection that is cut with bytes unread loses its answer.
fn linger(stream: &mut TcpStream) -> io::Result<()> {
    stream.set_read_timeout(Some(Duration::from_millis(200)))?;
    let mut rest = [0; 1024];
    for _ in 0..64 {
        if io::Read::read(stream, &mut rest)? == 0 {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{MAX_CONNECTIONS, Slot};
    use crate::config::BridgeConfig;
    use crate::server::Shared;
    use std::sync::Arc;
    use std::sync::atomic::Ordering;

    #[test]
    fn a_thread_that_panics_gives_its_slot_back() {
        let shared = Arc::new(Shared::new(BridgeConfig::default(), ""));
        for _ in 0..MAX_CONNECTIONS + 1 {
            let slot = Slot::of(&shared).expect("there is space");
            let thread = std::thread::spawn(move || {
                let _slot = slot;
                std::panic::resume_unwind(Box::new("a fault of the server"));
            });
            assert!(thread.join().is_err());
        }
        assert_eq!(shared.connections.load(Ordering::SeqCst), 0);
        let all: Vec<_> = (0..MAX_CONNECTIONS).map(|_| Slot::of(&shared)).collect();
        assert!(all.iter().all(Option::is_some));
        assert!(Slot::of(&shared).is_none(), "there are enough");
        drop(all);
        assert!(Slot::of(&shared).is_some());
    }
}
