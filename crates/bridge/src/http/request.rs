//! The head of a request: read within limits of time and size, then checked.

use super::host::{host_of, is_allowed_host, is_allowed_origin};
use super::key::Key;
use super::stream::Stream;
use std::io::{self, Read};
use std::time::{Duration, Instant};

/// Longest head of a request, bytes: that of a browser has about one thousand.
pub(crate) const MAX_HEAD_BYTES: usize = 8192;
/// Most header lines.
const MAX_HEADERS: usize = 64;

/// What a request asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Request {
    /// The page; `body` is false for HEAD.
    Page { host: String, body: bool },
    /// The icon that browsers request by themselves.
    Icon,
    /// A WebSocket, with the key to answer. `json`: it requests views as JSON.
    Socket { key: String, json: bool },
}

/// Who may ask a server: by which names besides this machine's own, and with which key.
#[derive(Clone, Copy)]
pub(crate) struct Admission<'a> {
    pub(crate) hosts: &'a [String],
    pub(crate) key: Option<&'a Key>,
}

/// Why a request is rejected: the status and one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Refusal {
    pub(crate) status: &'static str,
    pub(crate) reason: &'static str,
}

const fn refusal(status: &'static str, reason: &'static str) -> Refusal {
    Refusal { status, reason }
}

pub(crate) const TOO_LARGE: Refusal = refusal(
    "431 Request Header Fields Too Large",
    "the head of the request is too large",
);
pub(crate) const TOO_SLOW: Refusal = refusal("408 Request Timeout", "the request came too slowly");
pub(crate) const NOT_ENCRYPTED: Refusal = refusal(
    "400 Bad Request",
    "this server is encrypted: use https://, and wss:// for its WebSocket",
);
pub(crate) const BUSY: Refusal = refusal(
    "503 Service Unavailable",
    "too many connections; try again when some have ended",
);
pub(crate) const CROWDED: Refusal = refusal(
    "429 Too Many Requests",
    "too many connections from your address; close some and try again",
);
const GARBAGE: Refusal = refusal("400 Bad Request", "not an HTTP/1.1 request");
const NO_HOST: Refusal = refusal("400 Bad Request", "one Host is needed");
const FOREIGN_HOST: Refusal = refusal("403 Forbidden", "not a name of this server");
const FOREIGN_ORIGIN: Refusal = refusal("403 Forbidden", "a page of another origin");
const NO_KEY: Refusal = refusal(
    "403 Forbidden",
    "the key is missing or wrong: use the whole address that the bridge printed at its last start, with ?key= at the end",
);
const METHOD: Refusal = refusal("405 Method Not Allowed", "only GET and HEAD");
const BODY: Refusal = refusal("413 Content Too Large", "a request with a body");
const PATH: Refusal = refusal("404 Not Found", "no such page");
const SOCKET: Refusal = refusal("400 Bad Request", "not a WebSocket request of version 13");
const UPGRADE: Refusal = refusal("426 Upgrade Required", "this path is a WebSocket");

/// A received head, and the bytes received after it.
pub(crate) struct Head {
    pub(crate) bytes: Vec<u8>,
    pub(crate) rest: Vec<u8>,
}

/// Reads the head of a request. `Ok(None)`: the connection has ended or is useless, and needs no answer.
pub(crate) fn read_head(
    stream: &mut Stream,
    within: Duration,
) -> io::Result<Result<Option<Head>, Refusal>> {
    let until = Instant::now() + within;
    let mut bytes = Vec::with_capacity(1024);
    let mut chunk = [0; 1024];
    loop {
        let left = until.saturating_duration_since(Instant::now());
        // Browsers open spare connections and may send nothing on them.
        let too_slow = match bytes.is_empty() {
            true => Ok(Ok(None)),
            false => Ok(Err(TOO_SLOW)),
        };
        if left.is_zero() {
            return too_slow;
        }
        let left = left.max(Duration::from_millis(1));
        stream.tcp().set_read_timeout(Some(left))?;
        let count = match stream.read(&mut chunk) {
            Ok(0) => return Ok(Ok(None)),
            Ok(count) => count,
            Err(error) => match error.kind() {
                io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => return too_slow,
                io::ErrorKind::Interrupted => continue,
                _ => return Err(error),
            },
        };
        let searched = bytes.len().saturating_sub(3);
        bytes.extend_from_slice(chunk.get(..count).unwrap_or_default());
        let end = bytes
            .get(searched..)
            .and_then(|tail| tail.windows(4).position(|four| four == b"\r\n\r\n"))
            .map(|at| searched + at + 4);
        match end {
            Some(end) if end <= MAX_HEAD_BYTES => {
                let rest = bytes.split_off(end);
                return Ok(Ok(Some(Head { bytes, rest })));
            }
            None if bytes.len() < MAX_HEAD_BYTES => {}
            _ => return Ok(Err(TOO_LARGE)),
        }
    }
}

/// What a head asks for.
pub(crate) fn judge(head: &[u8], admission: Admission<'_>) -> Result<Request, Refusal> {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(head) {
        Ok(httparse::Status::Complete(_)) => {}
        _ => return Err(GARBAGE),
    }
    let (Some(method), Some(path), Some(1)) = (request.method, request.path, request.version)
    else {
        return Err(GARBAGE);
    };
    let fields = Fields(request.headers);
    let host = fields.only("host")?.ok_or(NO_HOST)?;
    if !host_of(host).is_some_and(|name| is_allowed_host(name, admission.hosts)) {
        return Err(FOREIGN_HOST);
    }
    if let Some(origin) = fields.only("origin")?
        && !is_allowed_origin(origin, host)
    {
        return Err(FOREIGN_ORIGIN);
    }
    let has_body = fields.only("transfer-encoding")?.is_some()
        || fields.only("content-length")?.is_some_and(|n| n != "0");
    if has_body {
        return Err(BODY);
    }
    if !matches!(method, "GET" | "HEAD") {
        return Err(METHOD);
    }
    // In the query, only the key and the format of a WebSocket's views matter.
    let (path, query) = path.split_once('?').unwrap_or((path, ""));
    let json = query.split('&').any(|part| part == "format=json");
    let given = query.split('&').find_map(|part| part.strip_prefix("key="));
    let is_in = |key: &Key| given.is_some_and(|given| key.is(given));
    let wants_socket = fields.has_token("upgrade", "websocket");
    match path {
        "/favicon.ico" => Ok(Request::Icon),
        "/" | "/ws" | "/index.html" if !admission.key.is_none_or(is_in) => Err(NO_KEY),
        "/" | "/ws" if wants_socket => socket(method, &fields, json),
        "/ws" => Err(UPGRADE),
        "/" | "/index.html" => Ok(Request::Page {
            host: host.to_owned(),
            body: method == "GET",
        }),
        _ => Err(PATH),
    }
}

fn socket(method: &str, fields: &Fields<'_>, json: bool) -> Result<Request, Refusal> {
    let key = fields.only("sec-websocket-key")?.ok_or(SOCKET)?;
    let is_key = key.len() == 24
        && key.ends_with("==")
        && key
            .bytes()
            .take(22)
            .all(|b| b.is_ascii_alphanumeric() || matches!(b, b'+' | b'/'));
    let is_13 = fields.only("sec-websocket-version")? == Some("13");
    if method != "GET" || !is_key || !is_13 || !fields.has_token("connection", "upgrade") {
        return Err(SOCKET);
    }
    Ok(Request::Socket {
        key: key.to_owned(),
        json,
    })
}

/// Header fields by name.
struct Fields<'a>(&'a [httparse::Header<'a>]);

impl<'a> Fields<'a> {
    fn all(&self, name: &'static str) -> impl Iterator<Item = &'a [u8]> {
        self.0
            .iter()
            .filter(move |field| field.name.eq_ignore_ascii_case(name))
            .map(|field| field.value)
    }

    /// The value of a field that may occur at most once, as text.
    fn only(&self, name: &'static str) -> Result<Option<&'a str>, Refusal> {
        let mut values = self.all(name);
        match (values.next(), values.next()) {
            (None, _) => Ok(None),
            (Some(value), None) => match std::str::from_utf8(value) {
                Ok(text) => Ok(Some(text.trim())),
                Err(_) => Err(GARBAGE),
            },
            _ => Err(GARBAGE),
        }
    }

    fn has_token(&self, name: &'static str, token: &str) -> bool {
        self.all(name)
            .filter_map(|value| std::str::from_utf8(value).ok())
            .flat_map(|value| value.split(','))
            .any(|part| part.trim().eq_ignore_ascii_case(token))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::Sampler;

    fn asked(text: &str) -> Result<Request, Refusal> {
        with_key(text, None)
    }

    fn with_key(text: &str, key: Option<&Key>) -> Result<Request, Refusal> {
        let hosts = &["lab.example".to_owned()];
        judge(text.as_bytes(), Admission { hosts, key })
    }

    const SOCKET_HEAD: &str = "GET /ws HTTP/1.1\r\nHost: localhost:8080\r\nOrigin: http://localhost:8080\r\nConnection: keep-alive, Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";

    #[test]
    fn pages_and_sockets_are_found() {
        let page = asked("GET /?origin=1,0,0,0 HTTP/1.1\r\nHost: 127.0.0.1:8080\r\n\r\n");
        assert!(matches!(page, Ok(Request::Page { body: true, .. })));
        let named = asked("HEAD / HTTP/1.1\r\nHost: lab.example\r\n\r\n");
        assert!(matches!(named, Ok(Request::Page { body: false, .. })));
        assert!(matches!(asked(SOCKET_HEAD), Ok(Request::Socket { .. })));
    }

    #[test]
    fn pages_and_sockets_need_the_key() {
        let key = Key::random().expect("a key");
        let page = |path: &str| format!("GET {path} HTTP/1.1\r\nHost: lab.example\r\n\r\n");
        let socket = |path: &str| SOCKET_HEAD.replace("/ws", path);
        let other = Key::random().expect("a key");
        for query in ["", "?", "?key", "?key=", "?format=json", &other.query()] {
            let paths = ["/", "/index.html", "/ws"].map(|path| format!("{path}{query}"));
            for head in [page(&paths[0]), page(&paths[1]), socket(&paths[2])] {
                assert_eq!(with_key(&head, Some(&key)), Err(NO_KEY), "{head}");
                assert!(with_key(&head, None).is_ok(), "{head}");
            }
        }
        let own = key.query();
        for query in [own.clone(), format!("{own}&format=json")] {
            for head in [page(&format!("/{query}")), socket(&format!("/ws{query}"))] {
                let asked = with_key(&head, Some(&key)).expect("a request");
                assert!(!format!("{asked:?}").contains(&own), "for logs");
            }
        }
        let icon = with_key(&page("/favicon.ico"), Some(&key));
        assert_eq!(icon, Ok(Request::Icon));
    }

    #[test]
    fn only_fixed_paths_are_served() {
        for path in [
            "/../etc/passwd",
            "/..%2f..%2fetc/passwd",
            "//etc/passwd",
            "/index.html/..",
            "/./",
            "/ws/../",
            "http://localhost/",
            "*",
        ] {
            let head = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n");
            assert_eq!(asked(&head), Err(PATH), "{path}");
        }
    }

    #[test]
    fn foreign_names_and_origins_are_refused() {
        // A foreign name that points to this machine.
        let rebound = SOCKET_HEAD.replace("localhost:8080", "evil.example:8080");
        assert_eq!(asked(&rebound), Err(FOREIGN_HOST));
        let foreign = SOCKET_HEAD.replace("http://localhost", "https://evil.example");
        assert_eq!(asked(&foreign), Err(FOREIGN_ORIGIN));
        let none = SOCKET_HEAD.replace("http://localhost:8080", "null");
        assert_eq!(asked(&none), Err(FOREIGN_ORIGIN));
        let twice = SOCKET_HEAD.replace("Host: ", "Host: localhost\r\nHost: ");
        assert_eq!(asked(&twice), Err(GARBAGE));
    }

    #[test]
    fn what_is_no_request_is_refused() {
        let get = |fields: &str| format!("GET / HTTP/1.1\r\nHost: localhost\r\n{fields}\r\n");
        for (head, expected) in [
            ("\r\n\r\n".to_owned(), GARBAGE),
            ("GET / HTTP/1.1\r\n\r\n".to_owned(), NO_HOST),
            (get("").replace("1.1", "1.0"), GARBAGE),
            (get("").replace("GET", "POST"), METHOD),
            (get("").replace("/ ", "/ws "), UPGRADE),
            (get("Content-Length: 5\r\n"), BODY),
            (get("Transfer-Encoding: chunked\r\n"), BODY),
        ] {
            assert_eq!(asked(&head), Err(expected), "{head}");
        }
        for (from, to) in [
            ("Version: 13", "Version: 8"),
            ("dGhl", "d Hl"),
            ("nonce", "x"),
            ("keep-alive, Upgrade", "keep-alive"),
            ("bXBsZ", ""),
        ] {
            let head = SOCKET_HEAD.replace(from, to);
            assert!(head == SOCKET_HEAD || asked(&head).is_err(), "{from}");
        }
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let mut sampler = Sampler::new(3);
        for _ in 0..50_000 {
            let mut bytes = SOCKET_HEAD.as_bytes().to_vec();
            for _ in 0..=sampler.index(5) {
                let at = sampler.index(bytes.len());
                bytes[at] = sampler.index(256) as u8;
            }
            let hosts = &[];
            let _ = judge(&bytes, Admission { hosts, key: None });
        }
    }
}
