//! Scratch.
use hwall::{Walls, WallsConfig};
use hwall::arrival::*;
use hwall::kinematics::{JointPositions, SrsArm};
use hwall_haptics::*;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::participants;
use hwall_stage::setting::load_scene;
fn env(n: &str, d: f64) -> f64 { std::env::var(n).ok().and_then(|v| v.parse().ok()).unwrap_or(d) }
fn main() -> anyhow::Result<()> {
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    let srs = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let (scene, _) = load_scene(None)?;
    let mut touches = vec![];
    let mut ball = None;
    for seed in [env("SEED", 100.0) as u64] {
        let cast = participants::simulated(&scene, &arm, PersonKind::Plain, 144, seed)?;
        ball = Some(participants::likely_touches(&scene, &arm, &cast));
        for who in &cast { for t in &who.touches {
            if arm.unreachable(t.point_m, t.normal)?.is_none() { if let Some(l) = t.landed_s { touches.push((t.point_m, t.normal, t.contact_s - l - 0.1 - 0.022, t.surface.clone())); } }
        } }
    }
    let limits = MotionLimits::of_arm(&srs, &MotionConfig::default())?;
    let mut config = WallsConfig::default();
    config.touches = ball.clone().unwrap_or_default();
    config.waiting.standoff_m = env("STANDOFF", config.waiting.standoff_m);
    config.waiting.blocked_price_s = env("WBLOCK", config.waiting.blocked_price_s);
    config.waiting.slack_m = env("WSLACK", 0.05);
    config.waiting.budget_s = env("BUDGET", config.waiting.budget_s);
    config.waiting.starts = env("STARTS", 12.0) as usize;
    config.atlas.blocked_price_s = env("BLOCK", config.atlas.blocked_price_s);
    config.waiting.softness_s = env("SOFT", config.waiting.softness_s);
    config.atlas.seam_price_s = env("SEAM", 0.08);
    let began = std::time::Instant::now();
    let mut walls = Walls::of(&scene, &srs, &board, &config)?;
    println!("walls {:.2} s", began.elapsed().as_secs_f64());
    if env("SEARCH", 0.0) > 0.0 {
        let Some(hwall::LikelyTouches::Such(targets)) = &ball else { panic!() };
        let surfaces = Surfaces::from_maps(&walls.maps, config.waiting.clearance.margin_m)?;
        config.waiting.most_targets = env("MOST", 50.0) as usize;
        for starts in [6, 12, 24, 48, 96] {
            config.waiting.starts = starts;
            let began = std::time::Instant::now();
            let found = waiting_posture(&srs, targets, &surfaces, Default::default(), &limits, &config.waiting)?;
            println!("{starts} found in {:.2} s {:.0?} mean {:.3} late {:.2} lateness {:.4} clear {:.2}", began.elapsed().as_secs_f64(), found.q.0.map(f64::to_degrees), found.mean_arrival_s, found.late_share, found.expected_lateness_s, found.clear_share);
        }
        for w in [[15.,83.,57.,95.,-21.,86.,130.], [24.,66.,-113.,-108.,-37.,-82.,-70.], [6.3, 15.8, -17.5, -113.7, -14.7, -41.7, 88.8]] {
            let q = JointPositions::from_deg(w);
            let a = judge_posture(&q, &srs, targets, &surfaces, Default::default(), &limits, &config.waiting)?.posture;
            println!("other mean {:.3} late {:.2} lateness {:.4} clear {:.2} standoff {:.3}", a.mean_arrival_s, a.late_share, a.expected_lateness_s, a.clear_share, a.standoff_m);
        }
        return Ok(());
    }
    if let Ok(w) = std::env::var("W") {
        let v: Vec<f64> = w.split(',').map(|x| x.trim().parse().unwrap()).collect();
        let w = JointPositions::from_deg(v.try_into().unwrap());
        let atlas = Atlas::build(&srs, &walls.maps, Default::default(), &limits, &w, &config.atlas)?;
        walls.waiting = Some(w); walls.atlas = Some(std::sync::Arc::new(atlas));
    }
    let w = walls.waiting.unwrap();
    if env("OPT3", 0.0) > 0.0 {
        let standoff = env("STANDOFF", 0.04);
        let k = env("K", 4.0) as usize;
        let barriers = hwall::barriers_of(&scene)?;
        let mut cand: Vec<Vec<(JointPositions, glam::DVec3)>> = vec![];
        for (p, n, _, _) in &touches {
            let [x, y] = surface_axes(*n).unwrap();
            let mut c = vec![];
            for (u, v) in [(0.,0.),(1.,0.),(-1.,0.),(0.,1.),(0.,-1.)] {
                for roll in QUARTER_TURNS_RAD {
                    let m = *p + x * (u * 0.05) + y * (v * 0.05);
                    let pose = board_pose(m, *n, roll).unwrap();
                    for i in 0..30 {
                        let psi = -std::f64::consts::PI + std::f64::consts::TAU * i as f64 / 30.0;
                        c.extend(srs.solutions(&pose, psi).into_iter().flatten().map(|q| (q, m)));
                    }
                }
            }
            cand.push(c);
        }
        let mut f = Follower::new(std::sync::Arc::new(srs.clone()), FollowerConfig::default(), &JointPositions::default())?.with_board(ApproachConfig::default(), board);
        f.set_barriers(&barriers);
        let mut cost = |w: &JointPositions, list: bool| -> (f64, usize, usize) {
            for (q, l) in w.0.iter().zip(hwall::kinematics::ArmKinematics::limits(&srs)) { if l.distance_rad(*q) < 0.1 || !l.contains(*q) { return (1e9, 0, 0); } }
            f.restart(w, &Default::default()).unwrap();
            f.set_posture(w).unwrap();
            let pen = (f.protrusion_m().unwrap() + standoff).max(0.0) * 1000.0;
            let (mut sum, mut ok, mut okl) = (0.0, 0, 0);
            for (c, (_, n, b, name)) in cand.iter().zip(&touches) {
                let mut order: Vec<(f64, usize)> = c.iter().enumerate().map(|(i, q)| (limits.travel_time_s(w, &q.0), i)).collect();
                order.sort_by(|a, b| a.0.total_cmp(&b.0));
                let least = order[0].0;
                let mut taken: Vec<usize> = vec![];
                let mut best = f64::INFINITY;
                for (t, i) in order {
                    if t >= best || taken.len() >= k { break; }
                    if taken.iter().any(|j| (0..6).all(|k| (c[*j].0[k] - c[i].0[k]).abs() < 0.25)) { continue; }
                    taken.push(i);
                    f.restart(w, &Default::default()).unwrap();
                    f.set_target(&BoardTarget { near: Some(c[i].0), ..BoardTarget::new(c[i].1, *n, 0.0) }).unwrap();
                    f.step(1e-4).unwrap();
                    best = best.min(f.left_s().unwrap() + f64::from(u8::from(f.is_detour())) * 0.05);
                }
                if list { println!("{name} {:.2} least {least:.2} best {best:.2} budget {b:.2}", c[0].1); }
                if best <= *b { ok += 1; }
                if least <= *b { okl += 1; }
                sum += (1.0 + ((best - *b) / 0.06).exp()).ln() * 0.06;
            }
            (sum + pen, ok, okl)
        };
        let mut rng = hwall_testkit::Sampler::new(env("RNG", 7.0) as u64);
        let mut w = w;
        let mut c = cost(&w, false);
        let (mut step, mut fails) = (env("STEP", 0.3), 0);
        for i in 0..env("OPT3", 300.0) as usize {
            let mut n = w;
            for i in 0..7 { if rng.bool() { n[i] += step * rng.uniform(-1.0, 1.0); } }
            let d = cost(&n, false);
            if d.0 < c.0 { w = n; c = d; fails = 0; } else { fails += 1; if fails == 25 { step *= 0.7; fails = 0; } }
            if i % 50 == 0 { eprintln!("{i} {c:?} step {step:.3} {:.1?}", w.0.map(f64::to_degrees)); }
        }
        cost(&w, env("LIST", 0.0) > 0.0);
        println!("OPT3 {c:?} of {} W {:.1?} at {:.2}", touches.len(), w.0.map(f64::to_degrees), hwall::kinematics::ArmKinematics::forward(&srs, &w).position_m());
        return Ok(());
    }
    let atlas = walls.atlas.clone().unwrap();
    let barriers = hwall::barriers_of(&scene)?; if env("BARR",0.0)>0.0 { for b in &barriers { println!("{b:.2?}"); } for f in scene.vertical_facets() { println!("{f:.2?}"); } }
    let mut per = std::collections::BTreeMap::<String, (usize, usize, Vec<f64>)>::new();
    let (mut ts, mut ok, mut prot, mut leasts, mut okl) = (vec![], 0, vec![], vec![], 0);
    for (p, n, b, name) in &touches {
        let approach = ApproachConfig { footprint_m: env("FOOT", 0.1), allowed_m: env("ALLOW", 0.003), ..ApproachConfig::default() };
        let mut motion = MotionConfig::default(); motion.jerk_time_s = env("JERK", 0.02);
        let fc = FollowerConfig { motion, ..FollowerConfig::default() };
        let mut f = Follower::new(std::sync::Arc::new(srs.clone()), fc, &w)?.with_board(approach, board);
        f.set_barriers(&barriers);
        let t = BoardTarget { near: atlas.look_up(*p, *n).map(|e| e.q), slack_m: [env("SLACK", 0.05); 2], ..BoardTarget::new(*p, *n, 0.0) };
        f.set_target(&t)?;
        let goal = f.goal().unwrap();
        let least_s = limits.travel_time_s(&w, &goal);
        let (mut most, mut t_s) = (f64::NEG_INFINITY, 0.0);
        let mut first = String::new();
        while t_s < 4.0 {
            f.step(1e-3)?;
            t_s += 1e-3;
            if first.is_empty() { first = format!("{} by {:?}", f.is_detour(), f.by_way_of().is_some()); }
            most = most.max(f.protrusion_m().unwrap_or(-1.0));
            if f.commanded() == goal { break; }
        }
        if t_s <= *b { ok += 1; }
        let e = per.entry(name.clone()).or_insert((0, 0, vec![])); e.0 += 1; e.1 += usize::from(t_s <= *b); e.2.push(t_s);
        if least_s <= *b { okl += 1; }
        if env("LIST", 0.0) > 0.0 { println!("{} {name} {p:.2} least {least_s:.2} took {t_s:.2} budget {b:.2} protrusion {:.0} mm atlas {:.2?} {first}", if t_s <= *b {"ok  "} else {"LATE"}, 1e3 * most, atlas.look_up(*p, *n).map(|e| (e.arrival_s, e.clear))); }
        ts.push(t_s); prot.push(most); leasts.push(least_s);
    }
    ts.sort_by(f64::total_cmp); leasts.sort_by(f64::total_cmp); prot.sort_by(f64::total_cmp);
    for (name, e) in &mut per { e.2.sort_by(f64::total_cmp); println!("  {name} {} of {} median {:.2}", e.1, e.0, e.2[e.2.len()/2]); }
    let n = ts.len();
    let pose = hwall::kinematics::ArmKinematics::forward(&srs, &w);
    println!("W {:.0?} at {:.2}: took median {:.2} p90 {:.2}; goal least median {:.2} p90 {:.2}; of {n} in time {ok} = {:.1} %, by least {okl} = {:.1} %; protrusion median {:.0} p90 {:.0} max {:.0} mm", w.0.map(f64::to_degrees), pose.position_m(), ts[n/2], ts[9*n/10], leasts[n/2], leasts[9*n/10], 100.0*ok as f64/n as f64, 100.0*okl as f64/n as f64, 1e3*prot[n/2], 1e3*prot[9*n/10], 1e3*prot[n-1]);
    Ok(())
}
