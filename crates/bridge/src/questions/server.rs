//! The server of the page.

use super::page::PAGE;
use super::question::{Question, Said, Told};
use crate::error::BridgeError;
use crate::http::request::{self, Request};
use crate::http::response;
use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

/// Most connections at a time.
const MOST: usize = 16;
/// How often a connection looks for something new to tell.
const LOOKS: Duration = Duration::from_millis(30);
/// A request or an answer must be through within this time.
const WITHIN: Duration = Duration::from_secs(5);
/// Longest message of the page, bytes.
const LONGEST: usize = 1024;

/// Serves a page that shows a status or one question, and takes the first answer that fits.
///
/// Every browser that is open sees the same; the first answer counts. Requests are judged as those of
/// [`BridgeServer`](crate::BridgeServer): only names that are this machine's or were allowed. Dropping it stops it.
pub struct QuestionServer {
    board: Arc<Board>,
    address: SocketAddr,
    threads: Vec<JoinHandle<()>>,
}

/// What is shown, and what was answered.
struct Board {
    state: Mutex<State>,
    changed: Condvar,
    stopped: AtomicBool,
    connections: AtomicUsize,
    hosts: Vec<String>,
}

struct State {
    /// Counts what was shown; number of a question.
    version: u64,
    status: String,
    question: Option<Question>,
    answer: Option<f64>,
}

fn locked(board: &Board) -> MutexGuard<'_, State> {
    // A thread that panicked while it held the state left it whole: every change is one assignment.
    board.state.lock().unwrap_or_else(PoisonError::into_inner)
}

impl QuestionServer {
    /// Listens; port 0 takes a free one. `hosts`: names of proxies, see [`BridgeConfig::hosts`](crate::BridgeConfig::hosts).
    ///
    /// # Errors
    /// An address that cannot be listened on.
    pub fn start(listen: SocketAddr, hosts: Vec<String>) -> Result<Self, BridgeError> {
        let failed = |source| BridgeError::Listen {
            address: listen,
            source,
        };
        let listener = TcpListener::bind(listen).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let board = Arc::new(Board {
            state: Mutex::new(State {
                version: 0,
                status: "One moment".to_owned(),
                question: None,
                answer: None,
            }),
            changed: Condvar::new(),
            stopped: AtomicBool::new(false),
            connections: AtomicUsize::new(0),
            hosts,
        });
        let own = Arc::clone(&board);
        let accept = Builder::new()
            .name("questions".to_owned())
            .spawn(move || accept(&own, &listener))?;
        Ok(Self {
            board,
            address,
            threads: vec![accept],
        })
    }

    /// What to open in a browser on this machine.
    #[must_use]
    pub fn url(&self) -> String {
        let mut address = self.address;
        if address.ip().is_unspecified() {
            address.set_ip(Ipv4Addr::LOCALHOST.into());
        }
        format!("http://{address}/")
    }

    /// Shows a text, and nothing to answer; a question that was shown is taken back.
    pub fn tell(&self, text: &str) {
        let mut state = locked(&self.board);
        state.version += 1;
        text.clone_into(&mut state.status);
        state.question = None;
        state.answer = None;
    }

    /// Shows a question.
    pub fn ask(&self, question: Question) {
        let mut state = locked(&self.board);
        state.version += 1;
        state.question = Some(question);
        state.answer = None;
    }

    /// Waits for the answer to the question that is shown; `None` if there is none within the time, or no question.
    #[must_use]
    pub fn wait(&self, within: Duration) -> Option<f64> {
        let until = Instant::now() + within;
        let mut state = locked(&self.board);
        loop {
            let left = until.saturating_duration_since(Instant::now());
            if state.answer.is_some() || state.question.is_none() || left.is_zero() {
                return state.answer;
            }
            let waited = self.board.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Drop for QuestionServer {
    fn drop(&mut self) {
        self.board.stopped.store(true, Ordering::SeqCst);
        let mut own = self.address;
        if own.ip().is_unspecified() {
            own.set_ip(Ipv4Addr::LOCALHOST.into());
        }
        // Wakes the thread that waits for connections.
        let _ = TcpStream::connect_timeout(&own, WITHIN);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

fn accept(board: &Arc<Board>, listener: &TcpListener) {
    loop {
        let Ok((stream, _)) = listener.accept() else {
            std::thread::sleep(LOOKS);
            continue;
        };
        if board.stopped.load(Ordering::SeqCst) {
            return;
        }
        if board.connections.fetch_add(1, Ordering::SeqCst) >= MOST {
            board.connections.fetch_sub(1, Ordering::SeqCst);
            let _ = stream.set_nonblocking(true);
            let _ = (&stream).write(&response::refusal(request::BUSY));
            continue;
        }
        let own = Arc::clone(board);
        let started = Builder::new().name("question".to_owned()).spawn(move || {
            // Whatever became of the connection: it has ended.
            let _ = serve(&own, stream);
            own.connections.fetch_sub(1, Ordering::SeqCst);
        });
        if started.is_err() {
            board.connections.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

fn serve(board: &Board, mut stream: TcpStream) -> io::Result<()> {
    stream.set_write_timeout(Some(WITHIN))?;
    let asked = match request::read_head(&mut stream, WITHIN)? {
        Ok(None) => return Ok(()),
        Ok(Some(head)) => request::judge(&head.bytes, &board.hosts).map(|asked| (asked, head.rest)),
        Err(refused) => Err(refused),
    };
    let answer = match asked {
        Ok((Request::Socket { key }, rest)) => {
            stream.write_all(&response::switch_to_socket(&key))?;
            return converse(board, stream, rest);
        }
        Ok((Request::Page { host, body }, _)) => response::page(PAGE, &host, body),
        Ok((Request::Icon, _)) => response::no_content(),
        Err(refused) => response::refusal(refused),
    };
    stream.write_all(&answer)?;
    stream.shutdown(Shutdown::Write)?;
    // A connection that is cut with bytes unread loses its answer.
    stream.set_read_timeout(Some(Duration::from_millis(200)))?;
    let mut rest = [0; 1024];
    while stream.read(&mut rest).is_ok_and(|count| count > 0) {}
    Ok(())
}

/// Tells what is shown whenever it changes, and takes answers, until the page goes.
fn converse(board: &Board, stream: TcpStream, rest: Vec<u8>) -> io::Result<()> {
    stream.set_read_timeout(Some(LOOKS))?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(LONGEST))
        .max_frame_size(Some(LONGEST));
    let mut socket = WebSocket::from_partially_read(stream, rest, Role::Server, Some(config));
    let mut shown = None;
    while !board.stopped.load(Ordering::SeqCst) {
        let news = {
            let state = locked(board);
            (shown != Some(state.version)).then(|| {
                shown = Some(state.version);
                let told = match &state.question {
                    Some(question) if state.answer.is_none() => Told::Question {
                        id: state.version,
                        question,
                    },
                    _ => Told::Status {
                        text: &state.status,
                    },
                };
                told.to_json()
            })
        };
        if let Some(text) = news
            && socket.send(Message::Text(text.into())).is_err()
        {
            return Ok(());
        }
        match socket.read() {
            Ok(Message::Text(text)) => take(board, &text),
            Ok(Message::Close(_)) => return Ok(()),
            Ok(_) => {}
            Err(Error::Io(error)) if waits(&error) => {}
            Err(_) => return Ok(()),
        }
    }
    let _ = socket.close(None);
    let _ = socket.flush();
    Ok(())
}

fn waits(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
    )
}

/// The first answer that fits the question that is shown counts; anything else is as if it had not come.
fn take(board: &Board, text: &str) {
    let Ok(Said::Answer { id, value }) = serde_json::from_str(text) else {
        return;
    };
    let mut state = locked(board);
    let open = state.version == id && state.answer.is_none();
    let fits = state
        .question
        .as_ref()
        .is_some_and(|q| q.answering.fits(value));
    if open && fits {
        state.answer = Some(value);
        board.changed.notify_all();
    }
}
