//! The loop's side of a bridge: its cost, and what is delivered.

use crate::common::{Socket, hand_at, scene, server, session, wait_for};
use hwall::Surroundings;
use hwall::glam::DVec3;
use hwall::haptics::Arm;
use hwall::haptics::body::{ArmBody, BodyRegion};
use hwall_bridge::BridgeConfig;
use hwall_bridge::view::{ViewFrame, ViewPart, ViewState};
use hwall_sim::ServoArm;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tungstenite::Message;

/// Far from the arm.
const HEAD_M: DVec3 = DVec3::new(2.5, 0.5, 1.0);
const BYSTANDER_M: DVec3 = DVec3::new(2.5, -1.5, 1.0);

/// The parts of a view in the supervisor's order: the links and the board, then the person.
fn check_parts(parts: &[&ViewPart], body: &ArmBody, frame: &ViewFrame) {
    for (part, own) in parts.iter().zip(body.at(&frame.q).all()) {
        assert!(part.region.is_none());
        assert!(part.capsule.from_m.distance(own.from_m) < 1e-5, "{part:?}");
    }
    let heads = parts.iter().filter(|p| p.region == Some(BodyRegion::Head));
    let heads_m: Vec<DVec3> = heads.map(|p| p.capsule.from_m).collect();
    let are_there = match heads_m[..] {
        [head_m, other_m] => head_m.distance(HEAD_M) < 1e-5 && other_m.distance(BYSTANDER_M) < 1e-5,
        _ => false,
    };
    assert!(are_there || parts.is_empty(), "{parts:?}");
}

#[test]
fn a_cycle_allocates_nothing_and_views_and_events_get_through() {
    let server = server(BridgeConfig::default());
    let (mut session, mut arm) = session();
    let mut bridge = server.connect(&scene());
    let mut socket = Socket::open(&server);
    wait_for("the client", || server.counts().clients == 1);
    let supervisor = session.control().supervisor().expect("a supervisor");
    let body = supervisor.separation().body().clone();
    let is_over = Arc::new(AtomicBool::new(false));
    let is_enough = Arc::clone(&is_over);
    let client = std::thread::spawn(move || {
        let period = Some(Duration::from_millis(13));
        (socket.0.get_ref().set_read_timeout(period)).expect("a socket");
        let (mut views, mut found, mut with_parts) = (0, false, [0, 0]);
        for n in 0_u32.. {
            let t_s = f64::from(n) / 72.0;
            // It reaches every 3 s: on a busy machine the arm may hold during a reach.
            let place = DVec3::new(1.1 - 0.2 * (t_s % 3.0).min(1.0), 0.0, 0.5);
            let hand = hand_at(u64::from(n) + 1, 1e3 * t_s, place);
            let [head, bystander] =
                [HEAD_M, BYSTANDER_M].map(|m| format!("{},{},{}", m.x, m.y, m.z));
            let head = format!(r#""head":[{head},0,0,0,1],"bystanders":[[{bystander}]]"#);
            socket.text(&hand.replace(r#""head":null"#, &head));
            if n == 36 {
                socket.text(r#"{"type":"parts"}"#);
            }
            // The time between two samples is spent reading.
            let sent = Instant::now();
            while sent.elapsed() < Duration::from_millis(13) {
                match socket.0.read() {
                    Ok(Message::Binary(bytes)) => {
                        let (frame, _) = ViewFrame::decode(&bytes).expect("a view");
                        let parts: Vec<_> = frame.parts.iter().flatten().collect();
                        with_parts[usize::from(!parts.is_empty())] += 1;
                        check_parts(&parts, &body, &frame);
                        views +=
                            usize::from(!frame.hand.is_lost() && frame.state != ViewState::Holding);
                    }
                    Ok(Message::Text(text)) => found |= text.contains(r#""kind":"found""#),
                    _ => {}
                }
            }
            if views > 5 && found && with_parts[1] > 5 {
                assert!(with_parts[0] > 5, "nobody asked before");
                break;
            }
        }
        is_enough.store(true, Ordering::Relaxed);
    });
    let (mut allocated, mut cycles) = (0, 0);
    // On a busy machine samples come late, and the arm holds.
    while cycles < 1500 || (!is_over.load(Ordering::Relaxed) && cycles < 60_000) {
        let counted = allocation_counter::measure(|| {
            let now_s = bridge.next_cycle(&mut arm).expect("a cycle");
            let now_s = now_s.expect("no end");
            while let Some(frame) = Surroundings::<ServoArm>::next_frame(&mut bridge, now_s) {
                session.frame(&frame);
            }
            let state = arm.state().expect("a state");
            let command = session.step(now_s, &state);
            arm.command(command).expect("taken");
            bridge.show(&mut session, &state);
        });
        allocated += counted.count_total;
        cycles += 1;
        // Planning may allocate: it runs after the command, or on another thread.
        session.plan();
        arm.advance(1e-3).expect("a period");
    }
    assert_eq!(allocated, 0, "allocations in {cycles} cycles");
    assert!(is_over.load(Ordering::Relaxed), "views and the event");
    client.join().expect("the client got what it waited for");
    let counts = server.counts();
    // At 1 kHz a view is due in every 17th cycle at most.
    assert!(counts.views_sent <= cycles / 16 + 2, "{counts:?}");
    assert_eq!(counts.cycles, cycles);
}

#[test]
fn the_policy_is_explained_while_a_page_asks() {
    let server = server(BridgeConfig::default());
    let (mut session, mut arm) = session();
    let mut bridge = server.connect(&scene());
    session.perception_mut().explain_to(&bridge.explanations);
    let mut socket = Socket::open(&server);
    wait_for("the client", || server.counts().clients == 1);
    let mut cycle = |n: u64| {
        if n.is_multiple_of(14) {
            let place = DVec3::new(1.0 - 1e-4 * n as f64, 0.0, 0.5);
            socket.text(&hand_at(n + 1, n as f64, place));
        }
        if n == 700 {
            socket.text(r#"{"type":"explain"}"#);
        }
        let now_s = bridge.next_cycle(&mut arm).expect("a cycle");
        while let Some(frame) =
            Surroundings::<ServoArm>::next_frame(&mut bridge, now_s.expect("no end"))
        {
            session.frame(&frame);
        }
        bridge.explanations.take().is_some()
    };
    assert!((0..700).all(|n| !cycle(n)), "nobody asked");
    assert!((700..3000).any(cycle), "no explanation");
}

#[test]
fn a_client_that_reads_nothing_slows_nobody_down() {
    let server = server(BridgeConfig {
        view_period_s: 1e-3,
        ..BridgeConfig::default()
    });
    let (session, mut arm) = session();
    let mut bridge = server.connect(&scene());
    let _deaf = Socket::open(&server);
    wait_for("the client", || server.counts().clients == 1);
    let state = arm.state().expect("a state");
    let view = bridge.view_of(&session, &state);
    // It answers no ping, so it gets nothing more after half a second.
    let mut dropped = 0;
    while dropped <= 50 {
        let t_s = bridge.pacing.wait();
        assert!(t_s < 60.0, "views are dropped, sooner or later");
        bridge.view.send(&ViewFrame { t_s, ..view });
        dropped = server.counts().views_dropped;
    }
}
