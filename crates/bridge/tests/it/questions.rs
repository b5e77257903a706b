//! The page of questions over its own protocol.

use hwall_bridge::{Answering, Question, QuestionServer};
use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::time::Duration;
use tungstenite::{Message, WebSocket};

type Socket = WebSocket<TcpStream>;

fn start() -> (QuestionServer, SocketAddr) {
    let listen = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let server = QuestionServer::start(listen, Vec::new()).unwrap();
    let address = server.url();
    let address = address.trim_start_matches("http://").trim_end_matches('/');
    let address = address.parse().unwrap();
    (server, address)
}

fn connect(address: SocketAddr) -> Socket {
    let stream = TcpStream::connect(address).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    let (socket, _) = tungstenite::client(format!("ws://{address}/ws"), stream).unwrap();
    socket
}

fn next(socket: &mut Socket) -> serde_json::Value {
    loop {
        if let Message::Text(text) = socket.read().unwrap() {
            return serde_json::from_str(&text).unwrap();
        }
    }
}

fn say(socket: &mut Socket, text: String) {
    socket.send(Message::Text(text.into())).unwrap();
}

fn answer(socket: &mut Socket, id: u64, value: u32) {
    say(
        socket,
        format!(r#"{{"type":"answer","id":{id},"value":{value}}}"#),
    );
}

#[test]
fn the_first_answer_that_fits_counts() {
    let (server, address) = start();
    let mut page = connect(address);
    assert_eq!(next(&mut page)["type"], "status");
    server.ask(Question {
        text: "How rough was it?".to_owned(),
        answering: Answering::Scale { points: 7 },
    });
    let asked = next(&mut page);
    assert_eq!(
        (&asked["kind"], &asked["points"]),
        (&"scale".into(), &7.into())
    );
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
        say(&mut page, wrong);
    }
    assert_eq!(server.wait(Duration::from_millis(200)), None);
    for value in [5, 6] {
        answer(&mut page, id, value);
    }
    assert_eq!(server.wait(Duration::from_secs(10)), Some(5.0));
    // A page that opens later shows the next question, not the last one.
    server.ask(Question {
        text: "Which was rougher?".to_owned(),
        answering: Answering::Two,
    });
    let mut late = connect(address);
    assert_eq!(next(&mut late)["kind"], "two");
    let id = next(&mut page)["id"].as_u64().unwrap();
    answer(&mut late, id, 2);
    assert_eq!(server.wait(Duration::from_secs(10)), Some(2.0));
    server.tell("Rest");
    assert_eq!(next(&mut page)["text"], "Rest");
    assert_eq!(server.wait(Duration::from_secs(10)), None);
}

#[test]
fn the_page_is_served_to_this_machine_alone() {
    let (server, address) = start();
    let get = |host: &str| {
        let mut stream = TcpStream::connect(address).unwrap();
        stream
            .write_all(format!("GET / HTTP/1.1\r\nHost: {host}\r\n\r\n").as_bytes())
            .unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        text
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
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(hostile.as_bytes()).unwrap();
        let mut text = String::new();
        let _ = stream.read_to_string(&mut text);
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
    let asks = |path: String| {
        let stream = TcpStream::connect(address).unwrap();
        tungstenite::client(format!("ws://{address}/ws{path}"), stream).ok()
    };
    assert!(asks(String::new()).is_none());
    let (mut page, _) = asks(query.to_owned()).unwrap();
    assert_eq!(next(&mut page)["type"], "status");
}

#[test]
fn answers_fit_their_questions() {
    let scale = Answering::Scale { points: 5 };
    let cases: [(Answering, &[f64], &[f64]); 4] = [
        (
            Answering::Number,
            &[0.1, 1e6],
            &[0.0, -1.0, f64::NAN, f64::INFINITY],
        ),
        (scale, &[1.0, 5.0], &[0.0, 6.0, 1.5, f64::NAN]),
        (Answering::Two, &[1.0, 2.0], &[0.0, 3.0]),
        (Answering::Continue, &[1.0], &[2.0]),
    ];
    for (answering, good, bad) in cases {
        assert!(good.iter().all(|v| answering.fits(*v)), "{answering:?}");
        assert!(!bad.iter().any(|v| answering.fits(*v)), "{answering:?}");
    }
}
