//! Roughness of one texture over angle and speed.

use super::limits::DeviceLimits;
use super::request::{DesignRequest, MagnitudeScale, RoughnessSource};
use crate::geometry::{ScanAngle, Texture};
use crate::levels::Calibration;
use crate::roughness::{Prediction, Quantity, RoughnessModel};

/// Size of the search grid: the largest step of the angle is 5 degrees.
const ANGLES: usize = 19;
const SPEEDS: usize = 9;

/// A magnitude, and whether it lies within the model's measured range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Felt {
    pub(super) magnitude: f64,
    pub(super) beyond: Option<BeyondRange>,
}

/// A quantity outside a model's range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BeyondRange {
    pub(super) what: Quantity,
    pub(super) at: f64,
    pub(super) range: [f64; 2],
}

/// The magnitude of a texture over angle and speed.
#[derive(Clone, Copy)]
pub(super) enum Response<'a> {
    Model {
        model: &'a dyn RoughnessModel,
        scale: MagnitudeScale,
        texture: Texture,
        finger_mm_per_s: f64,
    },
    Table(&'a Calibration),
}

impl<'a> Response<'a> {
    pub(super) fn of(request: &DesignRequest<'a>, texture: Texture) -> Self {
        match request.source {
            RoughnessSource::Model { model, scale } => Self::Model {
                model,
                scale,
                texture,
                finger_mm_per_s: request.device.finger_mm_per_s,
            },
            RoughnessSource::Table { calibration, .. } => Self::Table(calibration),
        }
    }

    /// `None` without a positive prediction.
    pub(super) fn at(&self, deg: f64, speed_mm_per_s: f64) -> Option<Felt> {
        let scan = ScanAngle::from_deg(deg).ok()?;
        let (magnitude, beyond) = match self {
            Self::Table(table) => (table.magnitude(scan, speed_mm_per_s).ok()?, None),
            Self::Model {
                model,
                scale,
                texture,
                finger_mm_per_s,
            } => {
                let speed = speed_mm_per_s + finger_mm_per_s;
                let predicted = model.predict(texture, scan, speed).ok()?;
                let beyond = match predicted {
                    Prediction::Beyond {
                        what, at, range, ..
                    } => Some(BeyondRange { what, at, range }),
                    _ => None,
                };
                let value = predicted.value()?;
                (scale.gain * value.powf(scale.exponent), beyond)
            }
        };
        let counts = magnitude > 0.0 && magnitude.is_finite();
        counts.then_some(Felt { magnitude, beyond })
    }
}

/// Magnitudes on a grid of angles and speeds.
pub(super) struct Grid {
    pub(super) angles_deg: Vec<f64>,
    pub(super) speeds_mm_per_s: Vec<f64>,
    /// One row per angle.
    pub(super) felt: Vec<Vec<Option<Felt>>>,
}

impl Grid {
    pub(super) fn of(response: &Response<'_>, device: &DeviceLimits) -> Self {
        let (mut angles_deg, mut speeds) = (
            between(device.angle_deg, ANGLES),
            between(device.speed_mm_per_s, SPEEDS),
        );
        if let Response::Table(table) = response {
            // Include the table's own conditions: the table is exact there, and its corners are the extremes.
            let nodes = table.nodes();
            add(
                &mut angles_deg,
                nodes.iter().map(|n| n.scan.deg()),
                device.angle_deg,
            );
            add(
                &mut speeds,
                nodes.iter().map(|n| n.speed_mm_per_s),
                device.speed_mm_per_s,
            );
        }
        let row = |deg: &f64| speeds.iter().map(|v| response.at(*deg, *v)).collect();
        Self {
            felt: angles_deg.iter().map(row).collect(),
            angles_deg,
            speeds_mm_per_s: speeds,
        }
    }
}

fn between([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    if low == high {
        return vec![low];
    }
    let last = (count - 1) as f64;
    let at = |i: usize| low + (high - low) * (i as f64 / last);
    let mut values: Vec<f64> = (0..count).map(at).collect();
    if let Some(end) = values.last_mut() {
        *end = high;
    }
    values
}

fn add(to: &mut Vec<f64>, values: impl Iterator<Item = f64>, [low, high]: [f64; 2]) {
    to.extend(values.filter(|v| (low..=high).contains(v)));
    to.sort_by(f64::total_cmp);
    to.dedup();
}
