//! Predictions and scores as CSV files.

use crate::contact::rows::{covariance_cells, left_cells, metres, number};
use crate::contact::tables::distance_cells;
use crate::report::cells;
use crate::rooms::scores::summary;
use crate::rooms::setting::{PredictorResult, Setting};
use hwall_contact::score::{Moment, Span, written};
use hwall_stage::numbers;
use std::path::Path;

/// One row a prediction of some contenders: those at the moments of the tables, and one every 50 ms.
///
/// # Errors
/// A file that cannot be written.
pub fn predictions<const N: usize>(
    path: &Path,
    settings: &[Setting],
    names: [&str; N],
) -> anyhow::Result<()> {
    let mut out = numbers::writer(Some(path))?;
    let titles = "room,condition,predictor,touch,t,share,to_contact,surface,true_surface,probability,x,y,z,\
                  true_x,true_y,true_z,var_xx,var_xy,var_xz,var_yy,var_yz,var_zz,left,left_sd,us";
    out.write_record(titles.split(','))?;
    for setting in settings {
        let surface = |id| setting.room.scene.surface(id).name.as_str();
        for PredictorResult { name, touches } in setting.named(names) {
            for (t, touch) in touches.iter().zip(1_u32..) {
                let span = t.span();
                let Span { start_s, contact_s } = span;
                let times_s: Vec<f64> = t.samples.iter().map(|s| s.t_s).collect();
                for index in written(&times_s, span) {
                    let sample = &t.samples[index];
                    let share = (sample.t_s - start_s) / (contact_s - start_s);
                    let mut row = vec![
                        setting.surfaces.to_string(),
                        setting.condition.name.clone(),
                        name.to_owned(),
                        touch.to_string(),
                        format!("{:.6}", sample.t_s),
                        format!("{share:.4}"),
                        format!("{:.6}", contact_s - sample.t_s),
                    ];
                    // Cells are empty where there is no prediction.
                    let first = sample.first;
                    row.push(first.map_or("", |a| surface(a.surface)).to_owned());
                    row.push(surface(t.touch.surface).to_owned());
                    row.push(number(first.map(|_| sample.of_surface), 4));
                    row.extend(metres(first.map(|a| a.point_m), 5));
                    row.extend(metres(Some(t.touch.target_m), 5));
                    row.extend(covariance_cells(first.and_then(|a| a.covariance_m2), 3));
                    row.extend(left_cells(first.and_then(|a| a.time_to_contact_s), 4));
                    row.push(format!("{:.1}", sample.took_us));
                    out.write_record(&row)?;
                }
            }
        }
    }
    out.flush()
}

/// Everything at every moment, one row a predictor and a moment.
///
/// # Errors
/// A file that cannot be written.
pub fn scores(path: &Path, settings: &[Setting]) -> anyhow::Result<()> {
    let mut out = numbers::writer(Some(path))?;
    let titles = "room,condition,predictor,moment,touches,silent,right,median_m,mean_m,mean_x_m,mean_y_m,mean_z_m,\
                  max_x_m,max_y_m,max_z_m,missed,in_90,time_mean_s,time_in_90,\
                  in_50,in_70";
    out.write_record(titles.split(','))?;
    for setting in settings {
        let room = setting.surfaces.to_string();
        for PredictorResult { name, touches } in setting.results() {
            for moment in Moment::all() {
                let s = summary(touches, moment);
                let counts = [s.count(), s.points.silent].map(|n| n.to_string());
                let first = [&*room, &setting.condition.name, name, &moment.name()];
                let mut row = cells(first, counts);
                row.push(number(Some(s.right), 5));
                row.extend(distance_cells(&s.points, 5));
                let within = |k: usize| s.within.map(|within| within[k]);
                let (mean_s, in_90) = (s.points.time_mean_s, s.points.time_interval);
                let others = [Some(s.missed), within(2), mean_s, in_90];
                let others = others.into_iter().chain([within(0), within(1)]);
                row.extend(others.map(|v| number(v, 5)));
                out.write_record(&row)?;
            }
        }
    }
    out.flush()
}
