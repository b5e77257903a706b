//! Estimates of the end of a reach as a CSV file, one row each.

use glam::{DMat3, DVec3};
use hwall_contact::score::{Span, written};
use hwall_contact::{ContactEstimate, TimeToContact};
use hwall_hand::LabelledReach;
use hwall_stage::numbers;
use hwall_testkit::cells;
use std::path::Path;

/// An estimate at one frame, and its computing time.
#[derive(Debug, Clone, Copy)]
pub struct TimedEstimate {
    /// `None` if the estimator gives none.
    pub estimate: Option<ContactEstimate>,
    /// Time for the frame, µs.
    pub took_us: f64,
}

/// A cell; empty without a finite number.
pub fn number(value: Option<f64>, decimals: usize) -> String {
    let finite = value.filter(|v| v.is_finite());
    finite.map_or_else(String::new, |v| format!("{v:.decimals$}"))
}

/// `x, y, z`; empty without a point.
pub fn metres(point_m: Option<DVec3>, decimals: usize) -> [String; 3] {
    match point_m {
        Some(v) => v.to_array().map(|x| format!("{x:.decimals$}")),
        None => [const { String::new() }; 3],
    }
}

/// `xx, xy, xz, yy, yz, zz`; empty without a covariance.
pub fn covariance_cells(c: Option<DMat3>, decimals: usize) -> [String; 6] {
    c.map_or([const { String::new() }; 6], |c| {
        let [x, y, z] = [c.x_axis, c.y_axis, c.z_axis];
        [x.x, x.y, x.z, y.y, y.z, z.z].map(|v| format!("{v:.decimals$e}"))
    })
}

/// The remaining time and its standard deviation, s.
pub fn left_cells(left: Option<TimeToContact>, decimals: usize) -> [String; 2] {
    let seconds = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.decimals$}"));
    [left.map(|l| l.mean_s), left.and_then(|l| l.sd_s)].map(seconds)
}

/// A CSV with one row per estimate: at the moments of the tables, and every 50 ms.
pub struct EstimateRows {
    source: String,
    out: numbers::TableWriter,
}

impl EstimateRows {
    /// Writes the header.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: &Path, source: &str) -> anyhow::Result<Self> {
        let mut out = numbers::writer(Some(path))?;
        let names = "source,method,fold,person,trial,t,share,to_contact,x,y,z,true_x,true_y,true_z,\
                     var_xx,var_xy,var_xz,var_yy,var_yz,var_zz,left,left_sd,us";
        out.write_record(names.split(','))?;
        Ok(Self {
            source: source.to_owned(),
            out,
        })
    }

    /// Adds the estimates of one reach, one for each of its frames.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn add(
        &mut self,
        method: &str,
        fold: usize,
        reach: &LabelledReach,
        estimates: &[TimedEstimate],
    ) -> anyhow::Result<()> {
        let [person, trial] = [&reach.person, &reach.trial].map(|n| n.as_deref().unwrap_or(""));
        let first = [&*self.source, method, &fold.to_string(), person, trial];
        let times_s: Vec<f64> = reach.frames.iter().map(|f| f.t_s).collect();
        for index in written(&times_s, Span::of(reach)) {
            let t_s = times_s[index];
            let TimedEstimate { estimate, took_us } = estimates[index];
            let left_s = reach.contact_s - t_s;
            let share = 1.0 - left_s / reach.duration_s();
            let times = [
                format!("{t_s:.6}"),
                format!("{share:.4}"),
                format!("{left_s:.6}"),
            ];
            let mut row = cells(first, times);
            row.extend(metres(estimate.map(|e| e.point_m), 6));
            row.extend(metres(Some(reach.contact_m), 6));
            row.extend(covariance_cells(estimate.and_then(|e| e.covariance_m2), 4));
            row.extend(left_cells(estimate.and_then(|e| e.time_to_contact_s), 5));
            row.push(format!("{took_us:.2}"));
            self.out.write_record(&row)?;
        }
        Ok(())
    }

    /// Flushes.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.out.flush()
    }
}
