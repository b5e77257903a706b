use hwall::kinematics::{JointPositions, SrsArm};
use hwall_haptics::*;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::run::closed_loop::Hand;
use hwall_stage::setting::{Setting, SettingOptions};
use hwall_geometry as _;
fn least(arm: &SrsArm, limits: &MotionLimits, from: &JointPositions, p: glam::DVec3, n: glam::DVec3, slack: f64) -> f64 {
    let [x, y] = surface_axes(n).unwrap();
    let mut best = f64::INFINITY;
    let offs: Vec<(f64, f64)> = if slack > 0.0 { vec![(0.,0.),(1.,0.),(-1.,0.),(0.,1.),(0.,-1.),(0.7,0.7),(0.7,-0.7),(-0.7,0.7),(-0.7,-0.7)] } else { vec![(0.,0.)] };
    for (u, v) in offs {
        for roll in QUARTER_TURNS_RAD {
            let pose = board_pose(p + x * (u * slack) + y * (v * slack), n, roll).unwrap();
            for i in 0..72 {
                let psi = -std::f64::consts::PI + std::f64::consts::TAU * i as f64 / 72.0;
                for q in arm.solutions(&pose, psi).into_iter().flatten() {
                    best = best.min(limits.travel_time_s(from, &q));
                }
            }
        }
    }
    best
}
fn main() -> anyhow::Result<()> {
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    let srs = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let mut touches = vec![];
    for seed in 1..=10 {
        let s = Setting::new(&arm, &SettingOptions { scene: None, hand: None, y_up: true, rigid_hand: false, auto: false, base: None, hand_origin: None, touches: 12, seed })?;
        let Hand::Simulated(seq, _) = &s.hand else { panic!() };
        for (t, tr) in s.touches.iter().zip(seq.touches()) {
            if arm.unreachable(t.point_m, t.normal)?.is_none() { touches.push((t.point_m, t.normal, t.contact_s - tr.look_s - 0.06 - 0.1 - 0.022, t.surface.clone())); }
        }
    }
    if let Ok(standoff) = std::env::var("OPT") {
        let standoff: f64 = standoff.parse()?;
        let limits = MotionLimits::of_arm(&srs, &MotionConfig::default())?;
        let mut cand: Vec<Vec<JointPositions>> = vec![];
        for (p, n, _, _) in &touches {
            let [x, y] = surface_axes(*n).unwrap();
            let mut c = vec![];
            for (u, v) in [(0.,0.),(1.,0.),(-1.,0.),(0.,1.),(0.,-1.)] {
                for roll in QUARTER_TURNS_RAD {
                    let pose = board_pose(*p + x * (u * 0.06) + y * (v * 0.06), *n, roll).unwrap();
                    for i in 0..30 {
                        let psi = -std::f64::consts::PI + std::f64::consts::TAU * i as f64 / 30.0;
                        c.extend(srs.solutions(&pose, psi).into_iter().flatten());
                    }
                }
            }
            cand.push(c);
        }
        let cost = |w: &JointPositions| -> (f64, usize) {
            for (q, l) in w.0.iter().zip(hwall::kinematics::ArmKinematics::limits(&srs)) { if l.distance_rad(*q) < 0.1 { return (1e9, 0); } }
            let pose = hwall::kinematics::ArmKinematics::forward(&srs, w);
            let mut front = f64::NEG_INFINITY;
            for (a, b) in [(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)] {
                let c = pose.transform_point(glam::DVec3::new(a, b, 0.0));
                front = front.max(c.x - 0.62).max(c.dot(glam::DVec3::new(0.8, 0.6, 0.0)) - 0.616);
            }
            let pen = (front + standoff).max(0.0) * 1000.0;
            let mut sum = 0.0; let mut ok = 0;
            for (c, (_, _, b, _)) in cand.iter().zip(&touches) {
                let t = c.iter().map(|q| limits.travel_time_s(w, q)).fold(f64::INFINITY, f64::min);
                if t <= *b { ok += 1; }
                sum += (1.0 + ((t - 0.62) / 0.06).exp()).ln() * 0.06;
            }
            (sum + pen, ok)
        };
        let mut rng = hwall_testkit::Sampler::new(7);
        for start in [[-6.0,18.0,0.0,-100.0,-13.0,-29.0,101.0],[-6.0,10.0,0.0,-110.0,-13.0,-32.0,11.0],[-40.,40.,40.,-100.,-20.,-60.,50.],[-3.,20.,0.,-95.,70.,0.,10.],[3.0,28.0,83.0,-110.0,38.0,-59.0,12.0]] {
            let mut w = JointPositions::from_deg(start);
            let mut c = cost(&w);
            let mut step = 0.3;
            for k in 0..500 {
                let mut n = w;
                for i in 0..7 { if rng.bool() { n[i] += step * rng.uniform(-1.0, 1.0); } }
                let d = cost(&n);
                if d.0 < c.0 { w = n; c = d; } else if k % 40 == 39 { step *= 0.75; }
            }
            println!("standoff {standoff}: {:?} cost {:.3} in time {} at {:.3}", w.0.map(|q| (q.to_degrees()*10.0).round()/10.0), c.0, c.1, hwall::kinematics::ArmKinematics::forward(&srs, &w).position_m());
        }
        return Ok(());
    }
    if let Ok(w) = std::env::var("ROUTE") {
        let scene = { let s = Setting::new(&arm, &SettingOptions { scene: None, hand: None, y_up: true, rigid_hand: false, auto: false, base: None, hand_origin: None, touches: 12, seed: 1 })?; s.scene };
        let v: Vec<f64> = w.split(',').map(|x| x.parse().unwrap()).collect();
        let w = JointPositions::from_deg(v.try_into().unwrap());
        let maps = hwall::maps_of(&scene, &srs)?;
        let limits = MotionLimits::of_arm(&srs, &MotionConfig::default())?;
        let mut config = hwall::arrival::AtlasConfig::default();
        if let Ok(b) = std::env::var("BLOCK") { config.blocked_price_s = b.parse()?; }
        let atlas = hwall::arrival::Atlas::build(&srs, &maps, Default::default(), &limits, &w, &config)?;
        let barriers = hwall::barriers_of(&scene)?;
        let (mut ts, mut ok, mut prot, mut leasts) = (vec![], 0, vec![], vec![]);
        for (p, n, b, name) in &touches {
            let mut f = Follower::new(std::sync::Arc::new(srs.clone()), FollowerConfig::default(), &w)?.with_board(ApproachConfig::default(), board);
            f.set_barriers(&barriers);
            let t = BoardTarget { near: atlas.look_up(*p, *n).map(|e| e.q), slack_m: [0.05; 2], ..BoardTarget::new(*p, *n, 0.0) };
            f.set_target(&t)?;
            let goal = f.goal().unwrap();
            let least_s = limits.travel_time_s(&w, &goal);
            let mut most = f64::NEG_INFINITY;
            let mut t_s = 0.0;
            let (mut bends, mut first) = (0, String::new());
            let _ = &mut bends;
            while t_s < 4.0 {
                f.step(1e-3)?;
                t_s += 1e-3;
                if first.is_empty() { first = format!("{} by {:?}", f.is_detour(), f.by_way_of().is_some()); }
                let pose = f.commanded_pose();
                for barrier in &barriers { most = most.max(barrier.protrusion_m(&board, &pose).unwrap_or(-1.0)); }
                if f.commanded() == goal { break; }
            }
            if t_s <= *b { ok += 1; }
            println!("{name} {p:.2} least {least_s:.2} took {t_s:.2} budget {b:.2} protrusion {:.0} mm atlas {:?} {first}", 1e3 * most, atlas.look_up(*p, *n).map(|e| (e.arrival_s, e.clear)));
            ts.push(t_s); prot.push(most); leasts.push(least_s);
        }
        ts.sort_by(f64::total_cmp); leasts.sort_by(f64::total_cmp); prot.sort_by(f64::total_cmp);
        println!("took median {:.2} p90 {:.2}; goal least median {:.2} p90 {:.2}; in time {ok}; protrusion median {:.0} p90 {:.0} mm", ts[50], ts[90], leasts[50], leasts[90], 1e3*prot[50], 1e3*prot[90]);
        return Ok(());
    }
    if let Ok(standoff) = std::env::var("OPT2") {
        let standoff: f64 = standoff.parse()?;
        let scene = { let s = Setting::new(&arm, &SettingOptions { scene: None, hand: None, y_up: true, rigid_hand: false, auto: false, base: None, hand_origin: None, touches: 12, seed: 1 })?; s.scene };
        let barriers = hwall::barriers_of(&scene)?;
        let limits = MotionLimits::of_arm(&srs, &MotionConfig::default())?;
        let mut cand: Vec<Vec<JointPositions>> = vec![];
        for (p, n, _, _) in &touches {
            let [x, y] = surface_axes(*n).unwrap();
            let mut c = vec![];
            for (u, v) in [(0.,0.),(1.,0.),(-1.,0.),(0.,1.),(0.,-1.)] {
                for roll in QUARTER_TURNS_RAD {
                    let pose = board_pose(*p + x * (u * 0.05) + y * (v * 0.05), *n, roll).unwrap();
                    for i in 0..30 {
                        let psi = -std::f64::consts::PI + std::f64::consts::TAU * i as f64 / 30.0;
                        c.extend(srs.solutions(&pose, psi).into_iter().flatten());
                    }
                }
            }
            cand.push(c);
        }
        let mut f = Follower::new(std::sync::Arc::new(srs.clone()), FollowerConfig::default(), &JointPositions::default())?.with_board(ApproachConfig::default(), board);
        f.set_barriers(&barriers);
        let mut cost = |w: &JointPositions, all: bool| -> (f64, usize, usize) {
            for (q, l) in w.0.iter().zip(hwall::kinematics::ArmKinematics::limits(&srs)) { if l.distance_rad(*q) < 0.1 { return (1e9, 0, 0); } }
            let pose = hwall::kinematics::ArmKinematics::forward(&srs, w);
            let mut front = f64::NEG_INFINITY;
            for (a, b) in [(0.1, 0.1), (0.1, -0.1), (-0.1, 0.1), (-0.1, -0.1)] {
                let c = pose.transform_point(glam::DVec3::new(a, b, 0.0));
                front = front.max(c.x - 0.62).max(c.dot(glam::DVec3::new(0.8, 0.6, 0.0)) - 0.616);
            }
            let pen = (front + standoff).max(0.0) * 1000.0;
            if pen > 20.0 { return (pen + 1e3, 0, 0); }
            let mut sum = 0.0; let mut ok = 0; let mut ok0 = 0;
            for (k, (c, (p, n, b, _))) in cand.iter().zip(&touches).enumerate() {
                if !all && k % 2 == 1 { continue; }
                let mut top: Vec<(f64, &JointPositions)> = vec![];
                for q in c {
                    let t = limits.travel_time_s(w, q);
                    if let Some(slot) = top.iter_mut().find(|(_, o)| o.max_abs_difference(q) < 0.35) { if t < slot.0 { *slot = (t, q); } continue; }
                    if top.len() < 6 { top.push((t, q)); top.sort_by(|a, b| a.0.total_cmp(&b.0)); }
                    else if t < top[5].0 { top[5] = (t, q); top.sort_by(|a, b| a.0.total_cmp(&b.0)); }
                }
                let mut best = f64::INFINITY;
                for (t, q) in &top {
                    if *t >= best { break; }
                    f.restart(w, &Default::default()).unwrap();
                    let gp = hwall::kinematics::ArmKinematics::forward(&srs, q).position_m();
                    f.set_target(&BoardTarget { near: Some(**q), ..BoardTarget::new(gp, *n, 0.0) }).unwrap();
                    let Some(g) = f.goal() else { continue };
                    if g.max_abs_difference(q) > 0.3 { let _ = p; }
                    f.step(1e-3).unwrap();
                    let left = f.left_s().unwrap() + if f.is_detour() { 0.1 } else { 0.0 };
                    best = best.min(left);
                }
                if top[0].0 <= *b { ok0 += 1; }
                if best <= *b { ok += 1; }
                sum += (1.0 + ((best - 0.62) / 0.06).exp()).ln() * 0.06;
            }
            (sum + pen, ok, ok0)
        };
        let mut rng = hwall_testkit::Sampler::new(9);
        let starts = [[-22.9,29.4,-13.4,-101.2,-43.6,-49.6,82.5],[-6.0,14.0,0.0,-105.0,-13.0,-30.0,11.0],[-30.,40.,10.,-100.,-40.,-50.,50.],[-10.,30.,10.,-95.,30.,-30.,10.],[51.0, 46.0, 87.0, 107.0, -33.0, 46.0, 78.0]];
        let only: usize = std::env::var("START").unwrap().parse()?;
        let mut w = JointPositions::from_deg(starts[only]);
        let mut c = cost(&w, false);
        let mut step = 0.3;
        println!("start cost {:.3} {:?}", c.0, cost(&w, true));
        for k in 0..400 {
            let mut n = w;
            for i in 0..7 { if rng.bool() { n[i] += step * rng.uniform(-1.0, 1.0); } }
            let d = cost(&n, false);
            if d.0 < c.0 { w = n; c = d; } else if k % 30 == 29 { step *= 0.75; }
        }
        println!("standoff {standoff}: {:?} cost {:.3} all {:?} at {:.3}", w.0.map(|q| (q.to_degrees()*10.0).round()/10.0), c.0, cost(&w, true), hwall::kinematics::ArmKinematics::forward(&srs, &w).position_m());
        return Ok(());
    }
    let postures: Vec<JointPositions> = std::env::args().skip(1).map(|a| { let v: Vec<f64> = a.split(',').map(|x| x.parse().unwrap()).collect(); JointPositions::from_deg(v.try_into().unwrap()) }).collect();
    for w in &postures {
        println!("{:?} at {:.3}", w.0.map(|q| q.to_degrees().round()), hwall::kinematics::ArmKinematics::forward(&srs, w).position_m());
        for (name, config) in [("drake j.02", MotionConfig::default()), ("drake j.001", MotionConfig { jerk_time_s: 0.001, ..Default::default() }), ("10 j.001", MotionConfig { jerk_time_s: 0.001, acceleration_rad_per_s2: [10.0; 7], ..Default::default() })] {
            let limits = MotionLimits::of_arm(&srs, &config)?;
            for slack in [0.0, 0.06] {
                let mut t: Vec<f64> = vec![]; let mut ok = 0;
                for (p, n, budget, _) in &touches { let x = least(&srs, &limits, w, *p, *n, slack); if x <= *budget { ok += 1; } t.push(x); }
                t.sort_by(f64::total_cmp);
                println!("  {name:12} slack {slack}: median {:.2} p90 {:.2} in time {ok} of {}", t[t.len()/2], t[t.len()*9/10], t.len());
            }
        }
    }
    let mut b: Vec<f64> = touches.iter().map(|t| t.2).collect(); b.sort_by(f64::total_cmp);
    println!("budget p5 {:.2} p10 {:.2} median {:.2}", b[5], b[10], b[50]);
    for (p, n, b, s) in touches.iter().take(20) { println!("{s} {p:.2} {n:.2} {b:.2}"); }
    Ok(())
}
