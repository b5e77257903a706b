//! scratch
use hwall_lab::feel::{identify, push::*, rig::*, subject::*};
use hwall_haptics::{ObjectConfig, ObjectRenderingConfig};
fn main() -> anyhow::Result<()> {
    let rig = Rig::new()?;
    let freqs = [0.4, 0.9, 1.7, 2.6, 3.7];
    let e = |n: &str| std::env::var(n).ok().and_then(|v| v.parse::<f64>().ok());
    let mut config = ObjectRenderingConfig::default();
    if let Some(f) = e("FILTER") { config.filter_s = f; }
    if let Some(f) = e("HAND") { config.hand_stiffness_n_per_m = f; }
    config.force_delay_s = e("FD"); config.motion_delay_s = e("MD");
    for way in Way::ALL {
        println!("{}", way.name());
        for (kind, k, m, b) in [
            (Kind::Panel, 0.0, 3.0, 10.0), (Kind::Panel, 0.0, 10.0, 20.0), (Kind::Panel, 200.0, 3.0, 10.0), (Kind::Panel, 500.0, 3.0, 20.0), (Kind::Panel, 1000.0, 3.0, 30.0), (Kind::Panel, 2000.0, 5.0, 50.0),
            (Kind::Button, 400.0, 2.0, 10.0), (Kind::Door, 40.0, 2.0, 6.0), (Kind::Door, 0.0, 4.3, 4.0)] {
            let s = made(&rig, kind, "x".into(), ObjectConfig { stiffness: k, damping: b, ..ObjectConfig::new(m) })?;
            let mean_n = if k > 0.0 { 12.0 } else { 0.0 };
            let profile = Profile { mean_n, sines: freqs.iter().enumerate().map(|(i, f)| [e("AMP").unwrap_or(1.5), *f, i as f64 * 1.3]).collect(), until_s: 100.0 };
            let push = Push { way, hand: Hand::Profile(profile), seconds: 8.0, seed: 1, config };
            let t = run(&rig, &s, &push)?;
            let f = identify::identify(&t.samples)?;
            let worst = t.samples.iter().map(|s| (s.position - s.ideal).abs()).fold(0.0, f64::max);
            let arm = t.samples.iter().map(|s| (s.position - s.object).abs()).fold(0.0, f64::max);
            let span = t.samples.iter().map(|s| s.ideal).fold(0.0, f64::max) - t.samples.iter().map(|s| s.ideal).fold(0.0, f64::min);
            let off = t.samples.iter().map(|s| s.off_path_m).fold(0.0, f64::max);
            println!("{kind:?} k {k} {:.1} m {m} {:.3} b {b} {:.2} rest {:.3} | {:.1} % {:.1} % {:.1} % | worst {:.2}e-3 arm {:.2} span {:.1} off {:.2} mm unreach {:?} inertia {:.2}", f.stiffness, f.inertia, f.damping, f.unexplained,
              100.0*(f.stiffness/k-1.0), 100.0*(f.inertia/m-1.0), 100.0*(f.damping/b-1.0), 1e3*worst, 1e3*arm, 1e3*span, 1e3*off, t.unreachable, t.inertia);
        }
    }
    Ok(())
}
