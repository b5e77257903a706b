//! scratch
use hwall_lab::feel::{rig::Rig, stability, study};
fn main() -> anyhow::Result<()> {
    if std::env::args().nth(1).is_some() {
        let rig = Rig::new()?;
        for b in stability::bounds(&rig, 1)? {
            println!(
                "{} k {} mass {:.3} share {:.3}",
                b.way.name(),
                b.stiffness_n_per_m,
                b.mass_kg,
                b.share
            );
        }
        for b in stability::light(&rig, 1)? {
            println!(
                "{} k {} rendered {:.3} swing {:.3} mm",
                b.way.name(),
                b.stiffness_n_per_m,
                b.rendered_kg,
                1e3 * b.swing_m
            );
        }
        return Ok(());
    }
    let r = study::study(&study::Request { seed: 1 }, |_| {})?;
    for r in r.rows.iter().chain(r.causes.iter().map(|r| &r.1)) {
        let (k, m, b) = (r.asked.stiffness, r.inertia, r.asked.damping);
        println!(
            "{:20} {:?} k {k} m {:.2} ({m:.2}) b {b} | {:.1} {:.1} % {:.1} % {:.1} % rest {:.3} off {:.2} mm held {:.2} mm least {:.4}",
            r.way.name(),
            r.kind,
            r.asked.inertia,
            r.felt.stiffness,
            100.0 * (r.felt.stiffness / k - 1.0),
            100.0 * (r.felt.inertia / m - 1.0),
            100.0 * (r.felt.damping / b - 1.0),
            r.felt.unexplained,
            1e3 * r.off_path_m,
            1e3 * r.held_m,
            r.least_given_j
        );
    }
    for (n, t) in r.costs {
        println!("{n} {:.0} {:.0}", t.median_ns, t.p99_ns);
    }
    Ok(())
}
