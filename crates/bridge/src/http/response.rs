//! Answers to requests; each one ends the connection, except for a WebSocket.

use super::request::Refusal;

/// The page, or only its head.
pub(crate) fn page(html: &str, host: &str, body: bool) -> Vec<u8> {
    // No external resources; scripts and styles are within the page. `host` was checked: letters, digits, dots, colons.
    let policy = format!(
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self' ws://{host} wss://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    let mut answer = format!(
        "HTTP/1.1 200 OK\r\nContent-Type: text/html; charset=utf-8\r\nContent-Length: {}\r\nContent-Security-Policy: {policy}\r\nPermissions-Policy: xr-spatial-tracking=(self)\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n",
        html.len()
    )
    .into_bytes();
    if body {
        answer.extend_from_slice(html.as_bytes());
    }
    answer
}

/// Redirects to another address. The redirect is temporary, because the next start may not be encrypted.
pub(crate) fn elsewhere(url: &str) -> Vec<u8> {
    let text = format!("use {url}\n");
    format!(
        "HTTP/1.1 307 Temporary Redirect\r\nLocation: {url}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {}\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n{text}",
        text.len()
    )
    .into_bytes()
}

/// An empty answer.
pub(crate) fn no_content() -> Vec<u8> {
    b"HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n".to_vec()
}

/// The status and one line.
pub(crate) fn refusal(refusal: Refusal) -> Vec<u8> {
    let Refusal { status, reason } = refusal;
    let allow = match status.starts_with("405") {
        true => "Allow: GET, HEAD\r\n",
        false => "",
    };
    format!(
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {}\r\n{allow}X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n{reason}\n",
        reason.len() + 1
    )
    .into_bytes()
}

/// Switches the connection to a WebSocket.
pub(crate) fn switch_to_socket(key: &str) -> Vec<u8> {
    format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {}\r\n\r\n",
        tungstenite::handshake::derive_accept_key(key.as_bytes())
    )
    .into_bytes()
}
