//! A base that drives: its limits, its distance from a person, the poses that serve a wall, its ways.

mod motion;
mod person;
mod places;

use glam::{DVec2, dvec2};
use hwall_arrival::base::{BaseDrive, BaseLimits, BasePose};
use hwall_testkit::Sampler;

const DT_S: f64 = 0.004;

fn start() -> BasePose {
    BasePose {
        at_m: DVec2::ZERO,
        yaw_rad: 0.0,
    }
}

/// A base after some steps along a route, all of them allowed.
fn driven(way: &[DVec2], yaw_rad: f64, steps: usize) -> BaseDrive {
    let mut drive = BaseDrive::new(BaseLimits::default(), start()).unwrap();
    drive.set_route(way, yaw_rad).unwrap();
    for _ in 0..steps {
        drive.step(DT_S, |_, _| true).unwrap();
    }
    drive
}

fn somewhere(sampler: &mut Sampler) -> DVec2 {
    dvec2(sampler.uniform(-4.0, 4.0), sampler.uniform(-4.0, 4.0))
}
