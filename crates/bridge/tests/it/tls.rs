//! HTTPS: pages and sockets, stored certificates, and faulty clients.

use crate::common::{answer, hand_at, scene, server, until, wait_for};
use glam::DVec3;
use hwall_bridge::{BridgeConfig, BridgeError, BridgeServer, Certificate};
use hwall_testkit::Sampler;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tungstenite::Message;

/// An empty folder of a test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn config(file: &Path) -> BridgeConfig {
    BridgeConfig {
        certificate: Some(Certificate::SelfSigned(file.to_owned())),
        request_s: 0.5,
        ..BridgeConfig::default()
    }
}

type Secured = StreamOwned<ClientConnection, TcpStream>;

/// A client that trusts the certificate in this file, and nothing else, for this name.
fn client(server: &BridgeServer, file: &Path, name: &str) -> Secured {
    let mut roots = RootCertStore::empty();
    let certificate = CertificateDer::from_pem_file(file).expect("a certificate");
    roots.add(certificate).expect("a root");
    let config = ClientConfig::builder_with_provider(Arc::new(rustls_graviola::default_provider()))
        .with_protocol_versions(&[&rustls::version::TLS13])
        .expect("TLS 1.3")
        .with_root_certificates(roots)
        .with_no_client_auth();
    let name = ServerName::try_from(name.to_owned()).expect("a name");
    let connection = ClientConnection::new(Arc::new(config), name).expect("a client");
    let tcp = TcpStream::connect(server.address()).expect("a connection");
    tcp.set_read_timeout(Some(Duration::from_secs(60)))
        .expect("a socket");
    StreamOwned::new(connection, tcp)
}

/// The end of a server's addresses.
fn key(server: &BridgeServer) -> String {
    let url = server.url();
    let (_, key) = url.split_once("/?").expect("a key");
    format!("?{key}")
}

fn page(server: &BridgeServer, stream: Secured) -> String {
    asked(stream, &format!("/{}", key(server)), "")
}

fn asked(mut stream: Secured, path: &str, fields: &str) -> String {
    let request = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n{fields}\r\n");
    stream.write_all(request.as_bytes()).expect("a request");
    let mut text = String::new();
    // Reads to the proper end: a cut connection would be an error.
    stream.read_to_string(&mut text).expect("a whole page");
    text
}

#[test]
fn a_page_and_a_socket_over_tls() {
    let file = folder("tls_page").join("new/bridge.pem");
    let server = server(config(&file));
    assert!(server.url().starts_with("https://127.0.0.1:"));
    let mut bridge = server.connect(&scene());
    for name in ["localhost", "127.0.0.1"] {
        let page = page(&server, client(&server, &file, name));
        assert!(page.starts_with("HTTP/1.1 200") && page.ends_with("</html>\n"));
    }
    let stream = client(&server, &file, "localhost");
    let address = format!("ws://localhost/ws{}", key(&server));
    let (mut socket, _) = tungstenite::client(address, stream).expect("a handshake");
    let mut seq = 0;
    let seen = until("a hand", || {
        seq += 1;
        let text = hand_at(seq, 20.0 * seq as f64, DVec3::splat(0.4));
        socket.send(Message::text(text)).expect("a message");
        std::thread::sleep(Duration::from_millis(5));
        bridge.hands.next_frame(bridge.pacing.wait())
    });
    assert_eq!(seen.palm_m, Some(DVec3::splat(0.4)));
    // Both ways at once, for more than a record of 16 kB.
    let mut bytes = 0;
    while bytes < 60_000 {
        let view = hwall_bridge::view::ViewFrame::new(bridge.pacing.wait(), Default::default());
        bridge.view.send(&view);
        seq += 1;
        let text = hand_at(seq, 20.0 * seq as f64, DVec3::splat(0.4));
        socket.send(Message::text(text)).expect("a message");
        bytes += socket.read().expect("a message").len();
    }
    assert!(server.invitation().contains("fingerprint"));
}

/// Pages, and every kind of WebSocket, including those that stop the arm or hold the switch.
#[test]
fn without_the_key_nobody_gets_in() {
    const UPGRADE: &str = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let file = folder("tls_key").join("bridge.pem");
    let first = key(&server(config(&file)));
    let server = server(config(&file));
    let own = key(&server);
    assert_ne!(first, own, "another start, another key");
    let ask = |path: &str, fields| asked(client(&server, &file, "localhost"), path, fields);
    let short = &own[..own.len() - 1];
    for query in ["", "?key=", "?key=aaaaaaaaaa", &first, short] {
        for (path, fields) in [("/", ""), ("/ws", ""), ("/ws", UPGRADE), ("/", UPGRADE)] {
            let answer = ask(&format!("{path}{query}"), fields);
            let refused = answer.starts_with("HTTP/1.1 403 ") && answer.contains("?key=");
            assert!(refused, "{path}{query}: {answer}");
        }
    }
    let refused = server.counts();
    assert_eq!((refused.refused_requests, refused.pages), (20, 0));
    assert!(ask(&format!("/{own}"), "").starts_with("HTTP/1.1 200 "));
    // The key is in every printed address.
    let invitation = server.invitation();
    let addresses = invitation.matches("https://").count();
    assert!(addresses > 0 && invitation.matches(&own).count() == addresses);
}

#[test]
fn a_certificate_is_kept_and_its_key_is_the_owners_alone() {
    let file = folder("tls_kept").join("bridge.pem");
    drop(server(config(&file)));
    let first = std::fs::read(&file).expect("a certificate");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let permissions = std::fs::metadata(&file).expect("a file").permissions();
        assert_eq!(permissions.mode() & 0o777, 0o600);
    }
    drop(server(config(&file)));
    assert_eq!(first, std::fs::read(&file).expect("a certificate"));
    // As a user's own certificate, from two files.
    let own = Certificate::Own {
        certificates: file.clone(),
        key: file.clone(),
    };
    let server = server(BridgeConfig {
        certificate: Some(own),
        ..BridgeConfig::default()
    });
    assert!(page(&server, client(&server, &file, "localhost")).starts_with("HTTP/1.1 200"));
    assert!(!server.invitation().contains("fingerprint"));
}

fn refused(certificate: Certificate) -> String {
    let started = BridgeServer::start(BridgeConfig {
        listen: ([127, 0, 0, 1], 0).into(),
        certificate: Some(certificate),
        ..BridgeConfig::default()
    });
    match started {
        Err(error @ (BridgeError::File { .. } | BridgeError::Certificate { .. })) => {
            error.to_string()
        }
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("it was taken"),
    }
}

#[test]
fn certificates_and_keys_that_are_none_are_named() {
    let folder = folder("tls_bad");
    let [good, other, bad] = ["good.pem", "other.pem", "bad.pem"].map(|name| folder.join(name));
    drop(server(config(&good)));
    drop(server(config(&other)));
    let own = |certificates: &Path, key: &Path| {
        refused(Certificate::Own {
            certificates: certificates.to_owned(),
            key: key.to_owned(),
        })
    };
    for (certificates, key, named) in [
        (&good, &other, "other.pem: the key does not fit"),
        (&folder.join("none.pem"), &good, "none.pem"),
        (&folder, &good, "tls_bad"),
    ] {
        let said = own(certificates, key);
        assert!(said.contains(named), "{said}");
    }
    let pem = std::fs::read_to_string(&good).expect("a certificate");
    let at = pem.find("-----BEGIN PRIVATE").expect("a key");
    let encrypted = pem.replace("PRIVATE KEY", "ENCRYPTED PRIVATE KEY");
    for (text, expected) in [
        ("", "a certificate in PEM was expected"),
        ("no PEM at all", "a certificate in PEM was expected"),
        (&pem[at..], "a certificate in PEM was expected"),
        (&pem[..at], "an unencrypted private key in PEM was expected"),
        (&encrypted, "an unencrypted private key"),
        (&pem[..pem.len() - 40], "in PEM was expected"),
    ] {
        std::fs::write(&bad, text).expect("a file");
        let said = refused(Certificate::SelfSigned(bad.clone()));
        assert!(said.contains("bad.pem"), "{said}");
        assert!(said.contains(expected), "{said}");
    }
    // Well-formed PEM around random bytes: an error, no panic.
    let mut sampler = Sampler::new(5);
    for _ in 0..300 {
        let mut bytes = pem.clone().into_bytes();
        for _ in 0..=sampler.index(4) {
            let at = sampler.index(bytes.len());
            bytes[at] = b"ABCab09+/=-\n"[sampler.index(12)];
        }
        std::fs::write(&bad, bytes).expect("a file");
        let _ = BridgeServer::start(BridgeConfig {
            listen: ([127, 0, 0, 1], 0).into(),
            ..config(&bad)
        });
    }
}

#[test]
fn plain_http_is_told_to_use_https() {
    let file = folder("tls_plain").join("bridge.pem");
    let server = server(config(&file));
    let own = key(&server);
    let ask = |request: &str| answer(server.address(), request.as_bytes());
    let get = |query: &str| {
        ask(&format!(
            "GET /{query} HTTP/1.1\r\nHost: localhost:8443\r\n\r\n"
        ))
    };
    let told = get("");
    assert!(told.starts_with("HTTP/1.1 307"), "{told}");
    assert!(told.contains("Location: https://localhost:8443/\r\n"));
    // The answer does not repeat a key that crossed the network unencrypted.
    let told = get(&own);
    assert!(told.contains("Location: https://localhost:8443/\r\n"));
    assert!(!told.contains("key"), "{told}");
    for request in [
        "GET /ws HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n\r\n",
        "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n",
        "hello\r\n\r\n",
        "\r\n\r\n\r\n",
    ] {
        let told = ask(request);
        assert!(told.starts_with("HTTP/1.1 400"), "{request}: {told}");
        assert!(told.contains("https://") && !told.contains("evil"));
    }
    wait_for("the count", || server.counts().failed_handshakes == 6);
}

#[test]
fn a_stalled_handshake_blocks_nobody_and_ends() {
    let file = folder("tls_stalled").join("bridge.pem");
    let server = server(config(&file));
    let stalled: Vec<TcpStream> = (0..20_usize)
        .map(|count| {
            let mut stream = TcpStream::connect(server.address()).expect("a connection");
            // Nothing, or the beginning of an unfinished record.
            let begins = [22, 3, 1, 2, 0, 1];
            stream.write_all(&begins[..count % 7]).expect("a beginning");
            stream
        })
        .collect();
    assert!(page(&server, client(&server, &file, "localhost")).starts_with("HTTP/1.1 200"));
    let began = Instant::now();
    for mut stream in stalled {
        let mut rest = Vec::new();
        let _ = stream.read_to_end(&mut rest);
    }
    assert!(began.elapsed() < Duration::from_secs(60), "they were ended");
    // An endless record in single bytes: the time limit of the request still applies.
    let mut slow = TcpStream::connect(server.address()).expect("a connection");
    let mut count: usize = 0;
    wait_for("its end", || {
        count += 1;
        std::thread::sleep(Duration::from_millis(10));
        let byte = [22, 3, 1, 64, 0].get(count - 1).copied().unwrap_or(7);
        slow.write_all(&[byte]).is_err()
    });
}

#[test]
fn no_bytes_of_a_handshake_end_the_server() {
    let file = folder("tls_bytes").join("bridge.pem");
    let server = server(config(&file));
    let mut sampler = Sampler::new(11);
    for _ in 0..100 {
        let length = sampler.index(600);
        let mut bytes: Vec<u8> = (0..length).map(|_| sampler.index(256) as u8).collect();
        for (byte, begins) in bytes.iter_mut().zip([22, 3, 1, 1]) {
            *byte = begins;
        }
        let mut stream = TcpStream::connect(server.address()).expect("a connection");
        let _ = stream.write_all(&bytes);
    }
    // At most half of the connections are from one address.
    wait_for("room", || {
        let counts = server.counts();
        counts.failed_handshakes + counts.refused_requests == 100
    });
    assert!(page(&server, client(&server, &file, "localhost")).starts_with("HTTP/1.1 200"));
}
