//! A base that drives: its limits, its distance from a person, the poses that serve a wall, its ways.

mod motion;
mod person;
mod places;

use glam::{DVec2, dvec2};
use hwall_arrival::base::BasePose;
use hwall_testkit::Sampler;

const DT_S: f64 = 0.004;

fn start() -> BasePose {
    BasePose {
        at_m: DVec2::ZERO,
        yaw_rad: 0.0,
    }
}

fn somewhere(sampler: &mut Sampler) -> DVec2 {
    dvec2(sampler.uniform(-4.0, 4.0), sampler.uniform(-4.0, 4.0))
}
