//! The connection of a client: a thread that reads, a thread that writes.

use super::client::Client;
use super::reply::{Reply, setup};
use super::shared::Shared;
use crate::hands::{ClientStream, PageMessage};
use crate::http::stream::Stream;
use crate::locked::locked;
use std::io::{self, Read, Write};
use std::sync::Arc;
use std::time::Duration;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};
use tungstenite::{Error, Message, Utf8Bytes, WebSocket};

/// A write that takes longer ends the connection.
const WRITE: Duration = Duration::from_secs(2);
/// A client is told about errors in its messages at most once in this time, s.
const SAY_S: f64 = 1.0;
const NAMELESS: &str = "this hand does not count: the client has not said which headset it is; send a `headset` message first";

/// A stream shared by two WebSockets, one reading, one writing. A WebSocket writes whole frames, and each write is complete.
struct Half(Stream);

impl Read for Half {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            // Caused by half of an encrypted record, or by a program that was stopped and resumed.
            match self.0.read(buffer) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                read => return read,
            }
        }
    }
}

impl Write for Half {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.0.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Serves a WebSocket until it ends. `rest`: bytes received after the head of its request.
pub(super) fn serve(
    shared: &Arc<Shared>,
    stream: Stream,
    rest: Vec<u8>,
    json: bool,
) -> io::Result<()> {
    let silent = Duration::from_secs_f64(shared.config.silent_s);
    stream.tcp().set_nodelay(true)?;
    stream.tcp().set_read_timeout(Some(silent))?;
    stream.tcp().set_write_timeout(Some(WRITE))?;
    let limits = WebSocketConfig::default()
        .read_buffer_size(8192)
        // The outbox limits what waits; a scene may be of any size.
        .write_buffer_size(0)
        .max_message_size(Some(shared.config.max_message_bytes))
        .max_frame_size(Some(shared.config.max_message_bytes));
    let half = Half(stream.clone());
    let mut reader = WebSocket::from_partially_read(half, rest, Role::Server, Some(limits));
    let id = shared.new_client_id();
    let client = Arc::new(Client::new(id, stream.clone(), json));
    if !join(shared, &client) {
        shared.tally.refused_clients.add(1);
        let text = "too many clients; try again when one has left";
        let _ = reader.send(Message::text(Reply::Error { text }.to_json()));
        close(&mut reader, CloseCode::Again, "too many clients");
        return Ok(());
    }
    let joined = Joined { shared, client };
    let client = &joined.client;
    let mut writer = WebSocket::from_raw_socket(Half(stream), Role::Server, Some(limits));
    let sender = {
        let (shared, client) = (Arc::clone(shared), Arc::clone(client));
        std::thread::Builder::new()
            .name("bridge-write".to_owned())
            .spawn(move || write(&shared, &client, &mut writer))
    };
    let mut stream_of_hands = ClientStream::new(client.id);
    if sender.is_ok() {
        read(shared, client, &mut reader, &mut stream_of_hands);
    }
    drop(joined);
    if let Ok(thread) = sender {
        // It ends with the connection.
        let _ = thread.join();
    }
    Ok(())
}

/// A registered client; dropping this removes it, also on a panic.
struct Joined<'a> {
    shared: &'a Shared,
    client: Arc<Client>,
}

impl Drop for Joined<'_> {
    fn drop(&mut self) {
        let id = self.client.id;
        locked(&self.shared.clients).retain(|other| other.id != id);
        locked(&self.shared.intake).forget(id);
        self.client.end();
    }
}

/// Registers and greets a client, unless there are enough.
fn join(shared: &Shared, client: &Arc<Client>) -> bool {
    let mut clients = locked(&shared.clients);
    if clients.len() >= shared.config.max_clients || shared.is_stopped() {
        return false;
    }
    // Under the lock, so that a new scene reaches both current and joining clients.
    client.say(&setup(shared.security.as_ref()), &shared.tally);
    client.say(&locked(&shared.greeting), &shared.tally);
    let calibration = locked(&shared.procedure).to_json(None);
    client.say(&calibration, &shared.tally);
    clients.push(Arc::clone(client));
    true
}

fn close(socket: &mut WebSocket<Half>, code: CloseCode, reason: &'static str) {
    let reason = Utf8Bytes::from_static(reason);
    let _ = socket.close(Some(CloseFrame { code, reason }));
    let _ = socket.flush();
}

/// Takes messages until the connection ends.
fn read(shared: &Shared, client: &Client, socket: &mut WebSocket<Half>, hands: &mut ClientStream) {
    let tally = &shared.tally;
    let mut said_s = f64::NEG_INFINITY;
    let mut complain = |malformed: u64, text: &str, now_s: f64| {
        tally.malformed.add(malformed);
        if now_s - said_s > SAY_S {
            said_s = now_s;
            client.say(&Reply::Error { text }.to_json(), tally);
        }
    };
    loop {
        let message = socket.read();
        let now_s = shared.now_s();
        match message {
            Ok(Message::Text(text)) => match PageMessage::parse(&text) {
                Ok(PageMessage::Ping { id, client_ms }) => {
                    let pong = Reply::Pong {
                        id,
                        client_ms,
                        server_ms: 1e3 * now_s,
                    };
                    client.say(&pong.to_json(), tally);
                }
                Ok(PageMessage::Hand(hand)) => {
                    let tip_m = hand.touching_m(shared.config.hand.calibrates());
                    if let Some((headset, tip_m)) = hands.headset.zip(tip_m) {
                        let head_m = hand.frame.head_m;
                        locked(&shared.procedure).see_tip(now_s, headset, tip_m, head_m);
                    }
                    locked(&shared.intake).take(hands, &hand, now_s, tally);
                    if hands.in_seconds {
                        complain(0, "stamps look like seconds, not milliseconds", now_s);
                    }
                    if hands.is_nameless {
                        complain(0, NAMELESS, now_s);
                    }
                }
                Ok(PageMessage::Stop) => shared.orders.stop(),
                Ok(PageMessage::Release) => shared.orders.let_go(),
                Ok(PageMessage::Enable) => shared.orders.enable(),
                Ok(PageMessage::Parts) => shared.parts.say(),
                Ok(PageMessage::Explain) => shared.explained.say(),
                Ok(PageMessage::Calibrate(step)) => {
                    shared.calibrate(step, client.headset(), now_s);
                }
                Ok(PageMessage::Headset(id)) => {
                    hands.headset = Some(id);
                    client.is_in(id);
                    let told = locked(&shared.procedure).to_json(Some(id));
                    client.say(&told, tally);
                }
                Err(refused) => complain(1, &format!("message refused: {refused}"), now_s),
            },
            Ok(Message::Binary(_)) => complain(1, "binary messages have no meaning", now_s),
            Ok(Message::Pong(payload)) => {
                let number = payload.as_ref().try_into().map(u64::from_le_bytes);
                if let Some(sent_s) = number.ok().and_then(|number| client.answered(number)) {
                    hands.clock.round_trip(sent_s, now_s);
                }
            }
            Ok(_) => {}
            Err(Error::Capacity(_)) => {
                tally.too_large.add(1);
                close(socket, CloseCode::Size, "message too large");
                return;
            }
            Err(Error::Protocol(_) | Error::Utf8(_) | Error::AttackAttempt) => {
                // A connection that was cut ends here too; its messages are not malformed.
                if socket.can_write() {
                    tally.malformed.add(1);
                    close(socket, CloseCode::Protocol, "not a WebSocket frame");
                }
                return;
            }
            Err(_) => return,
        }
    }
}

/// Sends waiting messages until the connection ends.
fn write(shared: &Shared, client: &Client, socket: &mut WebSocket<Half>) {
    loop {
        let Some((texts, view, ping)) = client.wait() else {
            return;
        };
        let is_view = view.is_some();
        let all = texts
            .into_iter()
            .map(Message::Text)
            .chain(view)
            .chain(ping.map(|number| Message::Ping(number.to_le_bytes().to_vec().into())));
        for message in all {
            if socket.send(message).is_err() {
                client.end();
                return;
            }
        }
        shared.tally.views_sent.add(u64::from(is_view));
    }
}
