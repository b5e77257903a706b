//! The server of the page.

use super::question::{Question, Said, Told};
use crate::error::BridgeError;
use crate::http::key::Key;
use crate::http::request::Admission;
use crate::http::serve;
use crate::http::stream::Stream;
use crate::locked::locked;
use std::io;
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

/// The page; it contacts only its own server.
const PAGE: &str = include_str!("page.html");
/// Most connections at a time.
const MOST: usize = 16;
/// How often a connection checks for something new to send.
const LOOKS: Duration = Duration::from_millis(30);
/// Time limit for a request or an answer.
const WITHIN: Duration = Duration::from_secs(5);
/// Longest message of the page, bytes.
const LONGEST: usize = 1024;

/// Serves a page that shows a status or one question, and takes the first valid answer.
///
/// Every open browser shows the same; the first answer counts. Requests are checked as in [`BridgeServer`](crate::BridgeServer): only this
/// machine's names and allowed names, and a key where others can connect. Dropping the server stops it.
pub struct QuestionServer {
    board: Arc<Board>,
    address: SocketAddr,
    /// The end of its address.
    query: String,
    thread: Option<JoinHandle<()>>,
}

/// The current display, and the answer.
struct Board {
    state: Mutex<State>,
    changed: Condvar,
    stopped: AtomicBool,
}

struct State {
    /// Number of the display and of its question.
    version: u64,
    status: String,
    question: Option<Question>,
    answer: Option<f64>,
}

impl QuestionServer {
    /// Starts to listen; port 0 takes a free one. `hosts`: names of proxies, see [`BridgeConfig::hosts`](crate::BridgeConfig::hosts).
    ///
    /// # Errors
    /// The server cannot listen on the address.
    pub fn start(listen: SocketAddr, hosts: Vec<String>) -> Result<Self, BridgeError> {
        let (listener, address) = serve::listen(listen)?;
        let key = Key::of_server(address, &hosts, false)?;
        let query = key.as_ref().map_or_else(String::new, Key::query);
        let board = Arc::new(Board {
            state: Mutex::new(State {
                version: 0,
                status: "One moment".to_owned(),
                question: None,
                answer: None,
            }),
            changed: Condvar::new(),
            stopped: AtomicBool::new(false),
        });
        let (own, stops) = (Arc::clone(&board), Arc::clone(&board));
        let is_stopped = move || stops.stopped.load(Ordering::SeqCst);
        let serve = move |tcp: TcpStream| {
            let Some(mut stream) = serve::open(tcp, None, WITHIN, &hosts)? else {
                return Ok(());
            };
            let admission = Admission {
                hosts: &hosts,
                key: key.as_ref(),
            };
            match serve::answer(&mut stream, WITHIN, admission, PAGE, |_| {})? {
                Some(rest) => converse(&own, stream, rest),
                None => Ok(()),
            }
        };
        let accept = move || serve::accept(&listener, MOST, "question", is_stopped, || {}, serve);
        let thread = Builder::new().name("questions".to_owned()).spawn(accept)?;
        Ok(Self {
            board,
            address,
            query,
            thread: Some(thread),
        })
    }

    /// The URL to open in a browser on this machine. With a key as [`BridgeServer::url`](crate::BridgeServer::url).
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://{}/{}", serve::reachable(self.address), self.query)
    }

    /// Shows a text without a question; withdraws a question that was shown.
    pub fn tell(&self, text: &str) {
        let mut state = locked(&self.board.state);
        state.version += 1;
        text.clone_into(&mut state.status);
        state.question = None;
        state.answer = None;
    }

    /// Shows a question.
    pub fn ask(&self, question: Question) {
        let mut state = locked(&self.board.state);
        state.version += 1;
        state.question = Some(question);
        state.answer = None;
    }

    /// Waits for the answer to the current question; `None` if none comes in time, or if there is no question.
    #[must_use]
    pub fn wait(&self, within: Duration) -> Option<f64> {
        let until = Instant::now() + within;
        let mut state = locked(&self.board.state);
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
        serve::wake(self.address);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Sends the display whenever it changes, and takes answers, until the page closes.
fn converse(board: &Board, stream: Stream, rest: Vec<u8>) -> io::Result<()> {
    stream.tcp().set_read_timeout(Some(LOOKS))?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(LONGEST))
        .max_frame_size(Some(LONGEST));
    let mut socket = WebSocket::from_partially_read(stream, rest, Role::Server, Some(config));
    let mut shown = None;
    while !board.stopped.load(Ordering::SeqCst) {
        let news = {
            let state = locked(&board.state);
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

/// Takes the first valid answer to the current question; ignores anything else.
fn take(board: &Board, text: &str) {
    let Ok(Said::Answer { id, value }) = serde_json::from_str(text) else {
        return;
    };
    let mut state = locked(&board.state);
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
