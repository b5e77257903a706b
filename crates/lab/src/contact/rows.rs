//! Estimates of where a reach ends as a file, one row each.

use anyhow::Context;
use glam::{DMat3, DVec3};
use hwall_contact::ContactEstimate;
use hwall_contact::score::{Span, written};
use hwall_hand::LabelledReach;
use hwall_stage::numbers;
use std::path::Path;

/// An estimate at one frame, and how long it took.
#[derive(Debug, Clone, Copy)]
pub struct TimedEstimate {
    /// `None` where the estimator gives none.
    pub estimate: Option<ContactEstimate>,
    /// Time for the frame, µs.
    pub took_us: f64,
}

/// `xx, xy, xz, yy, yz, zz`; empty where there is none.
pub fn covariance_cells(c: Option<DMat3>, write: impl Fn(f64) -> String) -> [String; 6] {
    c.map_or([const { String::new() }; 6], |c| {
        let [x, y, z] = [c.x_axis, c.y_axis, c.z_axis];
        [x.x, x.y, x.z, y.y, y.z, z.z].map(write)
    })
}

/// A CSV with one row an estimate: those at the moments of the tables, and one every 50 ms.
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
        let text = |name: &Option<String>| name.clone().unwrap_or_default();
        let times_s: Vec<f64> = reach.frames.iter().map(|f| f.t_s).collect();
        for index in written(&times_s, Span::of(reach)) {
            let frame = &reach.frames[index];
            let TimedEstimate { estimate, took_us } = estimates[index];
            let left_s = reach.contact_s - frame.t_s;
            let mut cells = vec![
                self.source.clone(),
                method.to_owned(),
                fold.to_string(),
                text(&reach.person),
                text(&reach.trial),
                format!("{:.6}", frame.t_s),
                format!("{:.4}", 1.0 - left_s / reach.duration_s()),
                format!("{left_s:.6}"),
            ];
            // Cells are empty where there is no estimate.
            let metres = |cells: &mut Vec<String>, v: Option<DVec3>| match v {
                Some(v) => cells.extend(v.to_array().map(|x| format!("{x:.6}"))),
                None => cells.extend([const { String::new() }; 3]),
            };
            metres(&mut cells, estimate.map(|e| e.point_m));
            metres(&mut cells, Some(reach.contact_m));
            let covariance_m2 = estimate.and_then(|e| e.covariance_m2);
            cells.extend(covariance_cells(covariance_m2, |v| format!("{v:.4e}")));
            let left = estimate.and_then(|e| e.time_to_contact_s);
            let seconds = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.5}"));
            cells.push(seconds(left.map(|l| l.mean_s)));
            cells.push(seconds(left.and_then(|l| l.sd_s)));
            cells.push(format!("{took_us:.2}"));
            self.out.write_record(&cells)?;
        }
        Ok(())
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.out.flush().context("estimates")
    }
}
