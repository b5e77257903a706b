//! The page of questions over its own protocol.

use crate::common::{Socket, answer};
use hwall_bridge::{Answering, Question, QuestionServer};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::time::Duration;

fn start() -> (QuestionServer, SocketAddr) {
    let listen = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let server = QuestionServer::start(listen, Vec::new()).unwrap();
    let address = server.url();
    let address = address.trim_start_matches("http://").trim_end_matches('/');
    let address = address.parse().unwrap();
    (server, address)
}

fn reply(page: &mut Socket, id: u64, value: u32) {
    page.text(&format!(r#"{{"type":"answer","id":{id},"value":{value}}}"#));
}

#[test]
fn the_first_answer_that_fits_counts() {
    let (server, address) = start();
    let mut page = Socket::connect(address, "/ws");
    assert_eq!(page.next()["type"], "status");
    server.ask(Question {
        text: "How rough was it?".to_owned(),
        answering: Answering::Scale { points: 7 },
    });
    let asked = page.next();
    assert!(asked["kind"] == "scale" && asked["points"] == 7, "{asked}");
    let id = asked["id"].as_u64().unwrap();
    // There is no answer yet.
    assert_eq!(server.wait(Duration::from_millis(50)), None);
    for wrong in [
        format!(r#"{{"type":"answer","id":{},"value":3}}"#, id + 1),
        format!(r#"{{"type":"answer","id":{id},"value":8}}"#),
        format!(r#"{{"type":"answer","id":{id},"value":2.5}}"#),
        format!(r#"{{"type":"answer","id":{id},"value":1e999}}"#),
        format!(r#"{{"type":"answer","id":{id},"value":3,"more":1}}"#),
        "{".to_owned(),
        "[]".to_owned(),
    ] {
        page.text(&wrong);
    }
    assert_eq!(server.wait(Duration::from_millis(200)), None);
    for value in [5, 6] {
        reply(&mut page, id, value);
    }
    assert_eq!(server.wait(Duration::from_secs(10)), Some(5.0));
    // A page that opens later shows the next question, not the last one.
    server.ask(Question {
        text: "Which was rougher?".to_owned(),
        answering: Answering::Two,
    });
    let mut late = Socket::connect(address, "/ws");
    assert_eq!(late.next()["kind"], "two");
    let id = page.next()["id"].as_u64().unwrap();
    reply(&mut late, id, 2);
    assert_eq!(server.wait(Duration::from_secs(10)), Some(2.0));
    server.tell("Rest");
    assert_eq!(page.next()["text"], "Rest");
    assert_eq!(server.wait(Duration::from_secs(10)), None);
}

#[test]
fn the_page_is_served_to_this_machine_alone() {
    let (server, address) = start();
    let get = |host: &str| {
        let head = format!("GET / HTTP/1.1\r\nHost: {host}\r\n\r\n");
        answer(address, head.as_bytes())
    };
    let page = get("localhost");
    for part in ["HTTP/1.1 200", "Content-Security-Policy", "Go on"] {
        assert!(page.contains(part), "{part}");
    }
    assert!(get("evil.example").starts_with("HTTP/1.1 403"));
    for hostile in [
        "\r\n\r\n",
        "POST / HTTP/1.1\r\nHost: localhost\r\n\r\n",
        "\0\0\0\0\r\n\r\n",
    ] {
        let text = answer(address, hostile.as_bytes());
        assert!(!text.starts_with("HTTP/1.1 200"), "{hostile:?}");
    }
    drop(server);
    assert!(TcpStream::connect(address).is_err());
}

#[test]
fn a_page_that_others_reach_needs_its_key() {
    let listen = SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0));
    let server = QuestionServer::start(listen, Vec::new()).unwrap();
    let url = server.url();
    let (address, query) = url.trim_start_matches("http://").split_once('/').unwrap();
    assert!(query.starts_with("?key="), "{url}");
    let address: SocketAddr = address.parse().unwrap();
    let stream = TcpStream::connect(address).unwrap();
    assert!(tungstenite::client(format!("ws://{address}/ws"), stream).is_err());
    let mut page = Socket::connect(address, &format!("/ws{query}"));
    assert_eq!(page.next()["type"], "status");
}

#[test]
fn answers_fit_their_questions() {
    let scale = Answering::Scale { points: 5 };
    let no_number = [0.0, -1.0, f64::NAN, f64::INFINITY];
    let cases: [(Answering, &[f64], &[f64]); 4] = [
        (Answering::Number, &[0.1, 1e6], &no_number),
        (scale, &[1.0, 5.0], &[0.0, 6.0, 1.5, f64::NAN]),
        (Answering::Two, &[1.0, 2.0], &[0.0, 3.0]),
        (Answering::Continue, &[1.0], &[2.0]),
    ];
    for (answering, good, bad) in cases {
        assert!(good.iter().all(|v| answering.fits(*v)), "{answering:?}");
        assert!(!bad.iter().any(|v| answering.fits(*v)), "{answering:?}");
    }
}
