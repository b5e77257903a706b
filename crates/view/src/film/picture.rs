//! Shapes of a still as SVG: shaded capsules, polygons, lines.

use super::camera::Camera;
use glam::{DVec2, DVec3};
use std::fmt::Write;

/// Red, green, blue in 0..1.
pub(super) type Rgb = [f64; 3];

/// Direction to the light.
const SUN: DVec3 = DVec3::new(0.35, -0.55, 0.85);

/// The SVG of a still: shapes in painting order, and their gradients.
#[derive(Debug)]
pub(super) struct Picture {
    pub(super) camera: Camera,
    pub(super) body: String,
    pub(super) gradients: String,
    /// Prefix that makes gradient names unique across all stills.
    name: String,
    count: usize,
}

impl Picture {
    pub(super) fn new(camera: Camera, name: &str) -> Self {
        Self {
            camera,
            body: String::new(),
            gradients: String::new(),
            name: name.to_owned(),
            count: 0,
        }
    }

    /// A segment with a radius, m: the outline of its two ends, shaded across.
    pub(super) fn capsule(&mut self, from_m: DVec3, to_m: DVec3, radius_m: f64, colour: Rgb) {
        let (Some(a), Some(b)) = (self.camera.see(from_m), self.camera.see(to_m)) else {
            return;
        };
        let (ra, rb) = (radius_m * a.scale_px_per_m, radius_m * b.scale_px_per_m);
        let way = b.at_px - a.at_px;
        let length = way.length();
        let along = if length > 1e-6 {
            way / length
        } else {
            DVec2::X
        };
        let across = along.perp();
        let wide = ra.max(rb);
        let middle = 0.5 * (a.at_px + b.at_px);
        let fill = self.gradient(
            middle - across * wide,
            middle + across * wide,
            across,
            colour,
        );
        let edge = css(colour.map(|c| 0.45 * c));
        let outline = if length <= (ra - rb).abs() + 1e-3 {
            // One end hides the other.
            let (at, r) = if ra >= rb {
                (a.at_px, ra)
            } else {
                (b.at_px, rb)
            };
            let (p, q) = (at - DVec2::X * r, at + DVec2::X * r);
            format!(
                "M{}A{r:.1} {r:.1} 0 0 1 {}A{r:.1} {r:.1} 0 0 1 {}Z",
                xy(p),
                xy(q),
                xy(p)
            )
        } else {
            let cosine = ((ra - rb) / length).clamp(-1.0, 1.0);
            let sine = (1.0 - cosine * cosine).sqrt();
            let (left, right) = (
                along * cosine - across * sine,
                along * cosine + across * sine,
            );
            format!(
                "M{}L{}A{rb:.1} {rb:.1} 0 {} 1 {}L{}A{ra:.1} {ra:.1} 0 {} 1 {}Z",
                xy(a.at_px + left * ra),
                xy(b.at_px + left * rb),
                u8::from(cosine < 0.0),
                xy(b.at_px + right * rb),
                xy(a.at_px + right * ra),
                u8::from(cosine > 0.0),
                xy(a.at_px + left * ra),
            )
        };
        let _ = write!(
            self.body,
            "<path d=\"{outline}\" fill=\"url(#{fill})\" stroke=\"{edge}\" stroke-width=\".6\"/>"
        );
    }

    /// Shading of a round body across its width.
    fn gradient(&mut self, from: DVec2, to: DVec2, across: DVec2, colour: Rgb) -> String {
        let name = format!("{}{}", self.name, self.count);
        self.count += 1;
        let [right, up, eye] = self.camera.axes();
        let _ = write!(
            self.gradients,
            "<linearGradient id=\"{name}\" gradientUnits=\"userSpaceOnUse\" x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\">",
            from.x, from.y, to.x, to.y
        );
        for s in [-0.97, -0.6, -0.2, 0.2, 0.6, 0.97_f64] {
            let side = across * s;
            let normal = right * side.x - up * side.y + eye * (1.0 - s * s).sqrt();
            let _ = write!(
                self.gradients,
                "<stop offset=\"{:.2}\" stop-color=\"{}\"/>",
                0.5 + 0.5 * s,
                css(lit(colour, normal, eye))
            );
        }
        self.gradients.push_str("</linearGradient>");
        name
    }

    /// A flat face, m, shaded by its normal; visible from both sides.
    pub(super) fn face(&mut self, corners_m: &[DVec3], normal: DVec3, colour: Rgb) {
        let points = self.camera.polygon(corners_m);
        if points.len() < 3 {
            return;
        }
        let eye = self.camera.axes()[2];
        let fill = css(lit(colour, normal * normal.dot(eye).signum(), eye));
        let edge = css(colour.map(|c| 0.5 * c));
        let _ = write!(
            self.body,
            "<path d=\"{}\" fill=\"{fill}\" stroke=\"{edge}\" stroke-width=\".8\" stroke-linejoin=\"round\"/>",
            closed(&points)
        );
    }

    /// Polygons, m, as one shape, so that they do not shine through each other.
    pub(super) fn pane<'a>(
        &mut self,
        polygons_m: impl Iterator<Item = &'a [DVec3]>,
        colour: Rgb,
        opacity: f64,
    ) {
        let outline: String = polygons_m
            .map(|corners_m| self.camera.polygon(corners_m))
            .filter(|points| points.len() > 2)
            .map(|points| closed(&wound(points)))
            .collect();
        if !outline.is_empty() {
            let _ = write!(
                self.body,
                "<path d=\"{outline}\" fill=\"{}\" fill-opacity=\"{opacity}\"/>",
                css(colour)
            );
        }
    }

    /// The convex outline of many points, m.
    pub(super) fn outline<'a>(
        &mut self,
        points_m: impl Iterator<Item = &'a DVec3>,
        colour: Rgb,
        opacity: f64,
    ) {
        let seen = points_m.filter_map(|m| self.camera.see(*m));
        let hull = convex_hull(seen.map(|s| s.at_px).collect());
        if hull.len() > 2 {
            let _ = write!(
                self.body,
                "<path d=\"{}\" fill=\"{}\" fill-opacity=\"{opacity}\"/>",
                closed(&hull),
                css(colour)
            );
        }
    }

    /// A line through points, m.
    pub(super) fn line(&mut self, points_m: &[DVec3], colour: Rgb, wide_px: f64, style: &str) {
        let seen: Vec<DVec2> = points_m
            .iter()
            .filter_map(|m| self.camera.see(*m))
            .map(|s| s.at_px)
            .collect();
        // A line with a point behind the eye is left out.
        if seen.len() == points_m.len() && seen.len() > 1 {
            let _ = write!(
                self.body,
                "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{wide_px}\" stroke-linecap=\"round\" stroke-linejoin=\"round\" {style}/>",
                open(&seen),
                css(colour)
            );
        }
    }

    /// A dot, m, of a fixed size on the picture.
    pub(super) fn dot(&mut self, point_m: DVec3, radius_px: f64, colour: Rgb) {
        if let Some(seen) = self.camera.see(point_m) {
            let (x, y) = (seen.at_px.x, seen.at_px.y);
            let _ = write!(
                self.body,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius_px}\" fill=\"{}\"/>",
                css(colour)
            );
        }
    }
}

/// Lighting as on the pages: sky, sun, and a light at the eye.
fn lit(colour: Rgb, normal: DVec3, eye: DVec3) -> Rgb {
    let sun = SUN.normalize_or(DVec3::Z);
    let sky = 0.5 + 0.5 * normal.z;
    let light =
        0.30 + 0.22 * sky + 0.42 * normal.dot(sun).max(0.0) + 0.20 * normal.dot(eye).max(0.0);
    colour.map(|c| c * light)
}

pub(super) fn css(colour: Rgb) -> String {
    let [r, g, b] = colour.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn xy(p: DVec2) -> String {
    format!("{:.1} {:.1}", p.x, p.y)
}

fn open(points: &[DVec2]) -> String {
    let joined: Vec<String> = points.iter().map(|p| xy(*p)).collect();
    format!("M{}", joined.join("L"))
}

fn closed(points: &[DVec2]) -> String {
    open(points) + "Z"
}

/// Gives all polygons the same winding, so that overlaps are filled once.
fn wound(mut points: Vec<DVec2>) -> Vec<DVec2> {
    let area: f64 = (0..points.len())
        .map(|i| points[i].perp_dot(points[(i + 1) % points.len()]))
        .sum();
    if area < 0.0 {
        points.reverse();
    }
    points
}

/// Corners of the convex hull in turn: lower chain, then upper chain. Source: [Andrew 1979].
fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(p - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_grid_is_its_corners() {
        let grid = (0..25).map(|i| DVec2::new(f64::from(i % 5), f64::from(i / 5)));
        let hull = convex_hull(grid.collect());
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];
        assert_eq!(hull, corners.map(|(x, y)| DVec2::new(x, y)));
        assert!(convex_hull(Vec::new()).is_empty());
    }
}
