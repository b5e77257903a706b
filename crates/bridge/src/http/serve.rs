//! Connections: listens, accepts while there is room, and answers one request of each.

use super::request::{self, Admission, Refusal, Request};
use super::response;
use super::stream::Stream;
use crate::error::BridgeError;
use crate::locked::locked;
use crate::tls::Security;
use std::io::{self, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread::Builder;
use std::time::Duration;

/// Time limit for sending an answer.
const ANSWER: Duration = Duration::from_secs(5);

/// Listens; also returns the actual address.
pub(crate) fn listen(address: SocketAddr) -> Result<(TcpListener, SocketAddr), BridgeError> {
    let listening = TcpListener::bind(address).and_then(|listener| {
        let taken = listener.local_addr()?;
        Ok((listener, taken))
    });
    listening.map_err(|source| BridgeError::Listen { address, source })
}

/// The address at which this machine reaches itself.
pub(crate) fn reachable(mut address: SocketAddr) -> SocketAddr {
    match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => address.set_ip(Ipv4Addr::LOCALHOST.into()),
        IpAddr::V6(ip) if ip.is_unspecified() => address.set_ip(Ipv6Addr::LOCALHOST.into()),
        _ => {}
    }
    address
}

/// Wakes the thread that [accepts](accept) connections.
pub(crate) fn wake(address: SocketAddr) {
    let _ = TcpStream::connect_timeout(&reachable(address), ANSWER);
}

/// Accepts connections until the server stops, each on its own thread of this name: at most `most` at a time, half of them from one address.
/// `busy` is called for those that are rejected.
pub(crate) fn accept<S>(
    listener: &TcpListener,
    most: usize,
    name: &str,
    is_stopped: impl Fn() -> bool,
    busy: impl Fn(),
    serve: S,
) where
    S: Fn(TcpStream) -> io::Result<()> + Clone + Send + 'static,
{
    let connections = Arc::default();
    while !is_stopped() {
        let Ok((stream, from)) = listener.accept() else {
            // For example, out of file descriptors: other connections must end first.
            std::thread::sleep(Duration::from_millis(20));
            continue;
        };
        if is_stopped() {
            return;
        }
        let slot = match Slot::of(&connections, from.ip(), most) {
            Ok(slot) => slot,
            Err(refused) => {
                busy();
                // Fits into an empty buffer; does not block otherwise.
                let _ = stream.set_nonblocking(true);
                let _ = (&stream).write(&response::refusal(refused));
                continue;
            }
        };
        let serve = serve.clone();
        // If the thread cannot be started, the slot is released as well.
        let _ = Builder::new().name(name.to_owned()).spawn(move || {
            let _slot = slot;
            // The connection has ended either way.
            let _ = serve(stream);
        });
    }
}

/// One of the available connections; released when dropped, also on a panic.
struct Slot {
    /// Where all connections come from.
    all: Arc<Mutex<Vec<IpAddr>>>,
    from: IpAddr,
}

impl Slot {
    fn of(all: &Arc<Mutex<Vec<IpAddr>>>, from: IpAddr, most: usize) -> Result<Self, Refusal> {
        let from = subscriber(from);
        let mut open = locked(all);
        if open.len() >= most {
            return Err(request::BUSY);
        }
        if open.iter().filter(|other| **other == from).count() >= most.div_ceil(2) {
            return Err(request::CROWDED);
        }
        open.push(from);
        let all = Arc::clone(all);
        Ok(Self { all, from })
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        let mut open = locked(&self.all);
        if let Some(at) = open.iter().position(|from| *from == self.from) {
            open.swap_remove(at);
        }
    }
}

/// The part of an address that identifies a subscriber: with IPv6 one machine has a whole network of 2^64 addresses.
fn subscriber(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(ip) => IpAddr::V6(Ipv6Addr::from_bits(ip.to_bits() >> 64 << 64)),
        ip => ip,
    }
}

/// A TLS connection begins with a record of this type: a handshake.
const HANDSHAKE: u8 = 22;

/// Opens the connection, encrypted if the server is; the handshake may take as long as a request. `None`: it has ended, or its client used
/// plain HTTP with an encrypted server and got an answer that says so.
pub(crate) fn open(
    tcp: TcpStream,
    security: Option<&Security>,
    within: Duration,
    hosts: &[String],
) -> io::Result<Option<Stream>> {
    tcp.set_write_timeout(Some(ANSWER))?;
    let Some(security) = security else {
        return Ok(Some(Stream::plain(tcp)));
    };
    tcp.set_read_timeout(Some(within))?;
    let mut first = [0];
    if tcp.peek(&mut first)? == 0 {
        return Ok(None);
    }
    if first == [HANDSHAKE] {
        return Stream::secured(tcp, security, within).map(Some);
    }
    let mut stream = Stream::plain(tcp);
    let asked = match request::read_head(&mut stream, within)? {
        Ok(None) => return Ok(None),
        // A key in this request crossed the network unencrypted, so the answer does not repeat it.
        Ok(Some(head)) => request::judge(&head.bytes, Admission { hosts, key: None }).ok(),
        Err(_) => None,
    };
    let answer = match asked {
        Some(Request::Page { host, .. }) => response::elsewhere(&format!("https://{host}/")),
        _ => response::refusal(request::NOT_ENCRYPTED),
    };
    last_words(&mut stream, &answer)?;
    Ok(None)
}

/// Answers the one request of a connection; `judged` gets the result. `Some`: it is now a WebSocket, and these bytes came after the head.
pub(crate) fn answer(
    stream: &mut Stream,
    within: Duration,
    admission: Admission<'_>,
    html: &str,
    judged: impl FnOnce(Result<&Request, Refusal>),
) -> io::Result<Option<Vec<u8>>> {
    let (asked, rest) = match request::read_head(stream, within)? {
        Ok(None) => return Ok(None),
        Ok(Some(head)) => (request::judge(&head.bytes, admission), head.rest),
        Err(refused) => (Err(refused), Vec::new()),
    };
    judged(asked.as_ref().map_err(|refused| *refused));
    let answer = match asked {
        Ok(Request::Socket { key, .. }) => {
            stream.write_all(&response::switch_to_socket(&key))?;
            return Ok(Some(rest));
        }
        Ok(Request::Page { host, body, .. }) => response::page(html, &host, body),
        Ok(Request::Icon) => response::no_content(),
        Err(refused) => response::refusal(refused),
    };
    last_words(stream, &answer)?;
    Ok(None)
}

/// Sends an answer and ends the connection.
fn last_words(stream: &mut Stream, answer: &[u8]) -> io::Result<()> {
    stream.write_all(answer)?;
    stream.finish()?;
    // Read what the client still sends for a moment: closing a connection with unread bytes can discard the answer.
    let mut tcp = stream.tcp();
    tcp.set_read_timeout(Some(Duration::from_millis(200)))?;
    let mut rest = [0; 1024];
    for _ in 0..64 {
        if tcp.read(&mut rest)? == 0 {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_panics_gives_its_slot_back() {
        const MOST: usize = 64;
        let connections = Arc::default();
        let from = |host: u8| IpAddr::from([10, 0, 0, host]);
        for _ in 0..MOST + 1 {
            let slot = Slot::of(&connections, from(1), MOST).expect("there is space");
            let thread = std::thread::spawn(move || {
                let _slot = slot;
                std::panic::resume_unwind(Box::new("a fault of the server"));
            });
            assert!(thread.join().is_err());
        }
        assert!(locked(&connections).is_empty());
        let all: Vec<_> = (0..MOST)
            .map(|count| Slot::of(&connections, from((count % 2) as u8), MOST))
            .collect();
        assert!(all.iter().all(Result::is_ok));
        let refused = Slot::of(&connections, from(9), MOST).err();
        assert_eq!(refused, Some(request::BUSY), "there are enough");
        drop(all);
        assert!(Slot::of(&connections, from(9), MOST).is_ok());
    }

    #[test]
    fn one_address_gets_half_of_the_connections() {
        let connections = Arc::default();
        let slot = |ip: &str| Slot::of(&connections, ip.parse().expect("an address"), 8);
        for (from, others) in [
            ("10.0.0.1", ["10.0.0.1", "::ffff:10.0.0.1"]),
            ("2001:db8::1", ["2001:db8::2", "2001:db8::ffff:1"]),
        ] {
            let open: Vec<_> = (0..4).map(|_| slot(from).expect("its share")).collect();
            for other in others {
                assert_eq!(slot(other).err(), Some(request::CROWDED), "{other}");
            }
            assert!(slot("10.0.0.2").is_ok() && slot("2001:db8:0:1::1").is_ok());
            drop(open);
            assert!(slot(from).is_ok());
        }
    }
}
