//! A base that drives: its limits, its distance from a person, the poses that serve a wall, its ways.

mod motion;
mod person;
mod places;

use glam::{DVec2, dvec2};
use hwall_arrival::base::{BaseDrive, BaseLimits, BasePose};
use hwall_testkit::Sampler;
use std::f64::consts::PI;

const DT_S: f64 = 0.004;

const fn standing(at_m: DVec2, yaw_rad: f64) -> BasePose {
    BasePose { at_m, yaw_rad }
}

/// A base at rest.
fn at_rest() -> BaseDrive {
    BaseDrive::new(BaseLimits::default(), standing(DVec2::ZERO, 0.0)).unwrap()
}

/// A base after some steps along a route, all of them allowed.
fn driven(way: &[DVec2], yaw_rad: f64, steps: usize) -> BaseDrive {
    let mut drive = at_rest();
    drive.set_route(way, yaw_rad).unwrap();
    for _ in 0..steps {
        drive.step(DT_S, |_, _| true).unwrap();
    }
    drive
}

fn somewhere(sampler: &mut Sampler) -> DVec2 {
    dvec2(sampler.uniform(-4.0, 4.0), sampler.uniform(-4.0, 4.0))
}

/// A new route, to anywhere.
fn send_somewhere(drive: &mut BaseDrive, sampler: &mut Sampler) {
    let way = [somewhere(sampler)];
    drive.set_route(&way, sampler.uniform(-PI, PI)).unwrap();
}
