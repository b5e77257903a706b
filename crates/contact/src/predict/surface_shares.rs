//! Division of a Gaussian contact point among the surfaces of a scene.

use super::belief::EvidenceSource;
use super::gaussian::{Gaussian, spiral};
use super::hand::resting::{SurfacePlace, facing};
use crate::matrices::{Plane, axes_across, square};
use glam::{DMat3, DVec3};
use hwall_scene::{Hit, Scene, SurfaceId};

/// Two hits lie in one plane if the cosine between their normals is at least this.
const SAME_NORMAL_COS: f64 = 0.9999;
/// Largest difference of the offsets of two hits in one plane, m.
const SAME_PLANE_M: f64 = 1e-3;

/// A plane of a surface, and the contact there by one Gaussian.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    pub(super) surface: SurfaceId,
    pub(super) normal: DVec3,
    /// A point of the face that was met, m.
    pub(super) met_m: DVec3,
    /// Log weight of a contact here; only differences between faces matter.
    log_mass: f64,
    /// The weight itself, relative to the heaviest face; set by [`SurfaceShares::compare`].
    pub(super) mass: f64,
    /// Mean and covariance of the contact on the face, m and m².
    pub(super) mean_m: DVec3,
    pub(super) covariance_m2: DMat3,
    pub(super) source: EvidenceSource,
}

impl Face {
    /// A face without a weight yet.
    const fn new(surface: SurfaceId, met_m: DVec3, normal: DVec3, source: EvidenceSource) -> Self {
        Self {
            surface,
            normal,
            met_m,
            log_mass: f64::NEG_INFINITY,
            mass: 0.0,
            mean_m: met_m,
            covariance_m2: DMat3::ZERO,
            source,
        }
    }
}

/// The origin of the search for surfaces.
#[derive(Debug, Clone, Copy)]
pub(super) struct Viewpoint {
    pub(super) origin_m: DVec3,
    /// Direction of motion, for a Gaussian about the hand itself.
    pub(super) heading: Option<DVec3>,
    /// Surfaces further away are ignored, m.
    pub(super) max_distance_m: f64,
}

/// A face that is included even if no ray meets it.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeenFace {
    pub(super) hit: Hit,
    /// Lower bound of its reachable share.
    pub(super) share: f64,
}

/// Divides Gaussians among the faces that straight paths from a point meet first.
///
/// The contact point x has the density N(x; m, C) of the estimate. Every reachable square metre of touchable surface of the same slope is equally
/// likely to be touched: the weight is proportional to the sine of the angle of incidence of the path from the hand, because a hand rarely touches
/// a surface it grazes. The weight of the Gaussian in a plane is known in closed form; rays through regular points of the Gaussian only estimate
/// the reachable share. Ray i through the node zᵢ meets the plane f at xᵢ and has the weight wᵢ = N(xᵢ | f) |dA/dz| / φ(zᵢ), whether or not
/// something is in front. The share is Σ wᵢ over the rays that meet f first, divided by Σ wᵢ over all. So an infinite wall gets its exact weight
/// from any number of rays, and an edge causes an error of about half a ray.
#[derive(Debug, Clone)]
pub(super) struct SurfaceShares {
    /// The first `few` have the same spread as all of them.
    nodes: Vec<Node>,
    few: usize,
    rays: Vec<Ray>,
    faces: Vec<Face>,
}

/// A point of a standard normal distribution in the plane, and its area.
#[derive(Debug, Clone, Copy)]
struct Node {
    at: [f64; 2],
    /// 1 / density.
    area: f64,
}

impl Node {
    fn new([x, y]: [f64; 2]) -> Self {
        let density = (-0.5 * (x * x + y * y)).exp() / std::f64::consts::TAU;
        Self {
            at: [x, y],
            area: 1.0 / density,
        }
    }
}

/// A path from the hand.
#[derive(Debug, Clone, Copy)]
struct Ray {
    direction: DVec3,
    /// Area on a unit sphere about the hand divided by the density of its node; the average over all rays integrates.
    solid_angle: f64,
    /// Index of the face met first, if touchable.
    met: Option<usize>,
}

/// Number of rays that are cast first. They suffice if all meet one face and the Gaussian is narrower than typical targets: its standard deviation
/// is at most `NARROW_M`, m.
const FEW_RAYS: usize = 7;
const NARROW_M: f64 = 0.02;
/// The first rays also suffice for every hypothesis with less weight than this.
const LITTLE: f64 = 0.1;

/// Lower bound of the sine of the approach angle: a grazed surface is not excluded.
const LEAST_SLOPE: f64 = 0.05;

/// Faces with less weight than this, relative to the heaviest one, are left out.
const NEGLIGIBLE: f64 = 1e-5;

/// Contacts further from the viewpoint than this are discarded, m.
const FARTHEST_M: f64 = 100.0;

const MAX_FACES: usize = 96;

impl SurfaceShares {
    pub(super) fn new(rays: usize) -> Self {
        let rays = rays.max(1);
        let all = spiral(rays);
        let stride = rays.div_ceil(FEW_RAYS);
        let each = |first: bool| {
            let among = move |i: &usize| i.is_multiple_of(stride) == first;
            (0..rays).filter(among)
        };
        let node = |i: usize| Node::new(all[i]);
        Self {
            nodes: each(true).chain(each(false)).map(node).collect(),
            few: each(true).count(),
            rays: Vec::with_capacity(rays),
            faces: Vec::with_capacity(MAX_FACES),
        }
    }

    /// The faces found since the last [`clear`](Self::clear).
    pub(super) fn faces(&self) -> &[Face] {
        &self.faces
    }

    pub(super) fn clear(&mut self) {
        self.faces.clear();
    }

    /// Normalises the weights of the faces and drops negligible ones. Returns whether any is left.
    pub(super) fn compare(&mut self) -> bool {
        let log_masses = self.faces.iter().map(|f| f.log_mass);
        let most = log_masses.fold(f64::NEG_INFINITY, f64::max);
        // Infinity minus infinity is NaN, which is dropped.
        self.faces
            .iter_mut()
            .for_each(|f| f.mass = (f.log_mass - most).exp());
        self.faces.retain(|f| f.mass > NEGLIGIBLE);
        !self.faces.is_empty()
    }

    /// Adds the faces that contain a part of a Gaussian and are met first from a viewpoint. Together they get the weight of the source times the
    /// share of rays that met something, however well the source fits these surfaces. Returns whether there are any.
    pub(super) fn add(
        &mut self,
        scene: &Scene,
        from: &Viewpoint,
        (source, gaussian, weight): (EvidenceSource, &Gaussian, f64),
        seen: Option<SeenFace>,
    ) -> bool {
        let first = self.faces.len();
        self.cast(scene, from, (source, gaussian), first, weight >= LITTLE);
        let seen_index = seen.and_then(|seen| self.face_of(&seen.hit, source, first));
        for index in first..self.faces.len() {
            let is_seen = seen_index == Some(index);
            let least = seen.filter(|_| is_seen).map_or(0.0, |seen| seen.share);
            self.weigh(index, from.origin_m, gaussian, least);
        }
        let met = self.met(seen.map_or(0.0, |seen| seen.share));
        self.scale(first, weight * met)
    }

    /// Scales the faces from `first` on to a total weight. Returns whether they have any.
    fn scale(&mut self, first: usize, weight: f64) -> bool {
        let faces = &mut self.faces[first..];
        let scale = weight.ln() - log_mass(faces);
        if !scale.is_finite() {
            self.faces.truncate(first);
            return false;
        }
        faces.iter_mut().for_each(|face| face.log_mass += scale);
        true
    }

    /// Share of the rays that met something, at least `least`.
    fn met(&self, least: f64) -> f64 {
        let met = self.rays.iter().filter(|ray| ray.met.is_some()).count();
        (met as f64 / self.rays.len().max(1) as f64).max(least)
    }

    /// Adds only the face closest to the mean, if no ray meets any.
    pub(super) fn add_closest(
        &mut self,
        scene: &Scene,
        origin_m: DVec3,
        (source, gaussian, weight): (EvidenceSource, &Gaussian, f64),
        radius_m: f64,
    ) {
        let closest = scene.closest_touchable(gaussian.mean_m, radius_m);
        let Some(closest) = closest.ok().flatten() else {
            return;
        };
        let normal = facing(closest.normal, origin_m - closest.point_m);
        let cut = gaussian.in_plane(closest.point_m, normal);
        if self.faces.len() == MAX_FACES {
            return;
        }
        self.faces.push(Face {
            log_mass: weight.ln(),
            covariance_m2: cut.covariance_m2 * cut.widening(),
            ..Face::new(closest.surface, closest.point_m, normal, source)
        });
    }

    /// Adds a single place as a face of its own.
    pub(super) fn add_place(
        &mut self,
        place: &SurfacePlace,
        gaussian: &Gaussian,
        (source, weight): (EvidenceSource, f64),
    ) {
        if self.faces.len() < MAX_FACES {
            let cut = gaussian.in_plane(place.point_m, place.normal);
            self.faces.push(Face {
                log_mass: weight.ln(),
                covariance_m2: cut.covariance_m2,
                ..Face::new(place.surface, place.point_m, place.normal, source)
            });
        }
    }

    /// Casts the rays: all of them if `closely` is set and the first few disagree; otherwise only those few. Appends the faces met after `first`,
    /// each once.
    fn cast(
        &mut self,
        scene: &Scene,
        from: &Viewpoint,
        (source, gaussian): (EvidenceSource, &Gaussian),
        first: usize,
        closely: bool,
    ) {
        let Viewpoint {
            origin_m,
            heading,
            max_distance_m,
        } = *from;
        self.rays.clear();
        let sd_m = gaussian.sd_m();
        let to_mean = gaussian.mean_m - origin_m;
        // Near the end the direction of the mean is noise; the heading is used instead.
        let lead_m = (2.0 * sd_m - to_mean.length()).max(0.0);
        let aim = to_mean + heading.unwrap_or(DVec3::ZERO) * lead_m;
        let Some(axis) = aim.try_normalize().or(heading) else {
            return;
        };
        let distance_m = to_mean.dot(axis).max(sd_m);
        let centre = to_mean - axis * (to_mean.dot(axis) - distance_m);
        let [u, v] = axes_across(axis);
        let Plane { uu, uv, vv } = Plane::of(&gaussian.covariance_m2, [u, v]);
        // Cholesky factor of the covariance across the axis.
        let a = uu.sqrt();
        let b = uv / a;
        let c = (vv - b * b).max(0.0).sqrt();
        for index in 0..self.nodes.len() {
            if index == self.few {
                let one = self.rays[0].met;
                let agreed =
                    one.is_some() && sd_m <= NARROW_M && self.rays.iter().all(|ray| ray.met == one);
                if agreed || !closely {
                    break;
                }
            }
            let Node { at: [x, y], area } = self.nodes[index];
            let through = centre + u * (a * x) + v * (b * x + c * y);
            let length_m = through.length();
            let direction = through / length_m;
            let solid_angle = a * c * area * direction.dot(axis) / (length_m * length_m);
            // The scene rejects only rays that are not finite or have no direction.
            let hit = scene.ray_cast(origin_m, direction).ok().flatten();
            let hit = hit.filter(|hit| {
                hit.distance_m <= max_distance_m && scene.surface(hit.surface).touchable()
            });
            let met = hit.and_then(|hit| self.face_of(&hit, source, first));
            self.rays.push(Ray {
                direction,
                solid_angle,
                met,
            });
        }
    }

    /// The face of a hit among those from `first` on; added if new.
    fn face_of(&mut self, hit: &Hit, source: EvidenceSource, first: usize) -> Option<usize> {
        let known = self.faces[first..].iter().position(|face| {
            face.surface == hit.surface
                && face.normal.dot(hit.normal) >= SAME_NORMAL_COS
                && (face.met_m - hit.point_m).dot(face.normal).abs() <= SAME_PLANE_M
        });
        if let Some(known) = known {
            return Some(first + known);
        }
        // Bounded, so that no step allocates; only rubble has more planes.
        (self.faces.len() < MAX_FACES).then(|| {
            let face = Face::new(hit.surface, hit.point_m, hit.normal, source);
            self.faces.push(face);
            self.faces.len() - 1
        })
    }

    /// Weight and moments of one face.
    fn weigh(&mut self, index: usize, origin_m: DVec3, gaussian: &Gaussian, least_share: f64) {
        let face = self.faces[index];
        let cut = gaussian.in_plane(face.met_m, face.normal);
        if cut.log_density < f64::MIN_POSITIVE.ln() {
            // The Gaussian has no weight there.
            return;
        }
        let (mut all, mut met) = (Moments::ZERO, Moments::ZERO);
        let mut blocked = false;
        let ray_share = 1.0 / self.rays.len() as f64;
        for ray in &self.rays {
            let slope = ray.direction.dot(face.normal);
            let distance_m = (face.met_m - origin_m).dot(face.normal) / slope;
            // The ray is parallel to the plane or points away from it.
            if !(distance_m > 0.0 && distance_m.is_finite()) {
                continue;
            }
            let off = ray.direction * distance_m - (cut.mean_m - origin_m);
            let weight = cut.density_per_m2(gaussian, cut.mean_m + off)
                * ray.solid_angle
                * ray_share
                * distance_m
                * distance_m
                / slope.abs();
            all.add(weight, off);
            if ray.met == Some(index) {
                met.add(weight, off);
            } else {
                blocked = true;
            }
        }
        // The weights sum to 1 if the rays cover the part in the plane.
        let share = (met.weight / all.weight.max(0.5)).min(1.0);
        let face = &mut self.faces[index];
        let approach = (face.met_m - origin_m).normalize_or_zero();
        let slope = approach.dot(face.normal).abs().max(LEAST_SLOPE);
        face.log_mass = cut.log_density + share.max(least_share).ln() + slope.ln();
        let widening = cut.widening();
        if blocked && met.weight > 1e-9 {
            // Few rays estimate the spread poorly, so each represents a part of the whole.
            face.mean_m = cut.mean_m + met.mean() - all.mean();
            face.covariance_m2 =
                (met.covariance() + cut.covariance_m2 * (1.0 / met.effective())) * widening;
        } else {
            face.mean_m = cut.mean_m;
            face.covariance_m2 = cut.covariance_m2 * widening;
        }
        let is_near = face.mean_m.distance(origin_m) <= FARTHEST_M;
        if !is_near || Gaussian::new(face.mean_m, face.covariance_m2).is_none() {
            // The viewpoint is extremely far away.
            face.log_mass = f64::NEG_INFINITY;
        }
    }
}

/// Log total weight of some faces, before normalisation.
fn log_mass(faces: &[Face]) -> f64 {
    let most = faces
        .iter()
        .map(|f| f.log_mass)
        .fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = faces.iter().map(|f| (f.log_mass - most).exp()).sum();
    most + sum.ln()
}

/// Sums of weighted points.
#[derive(Debug, Clone, Copy)]
struct Moments {
    weight: f64,
    first: DVec3,
    second: DMat3,
    weight_squared: f64,
}

impl Moments {
    const ZERO: Self = Self {
        weight: 0.0,
        first: DVec3::ZERO,
        second: DMat3::ZERO,
        weight_squared: 0.0,
    };

    fn add(&mut self, weight: f64, x: DVec3) {
        self.weight += weight;
        self.weight_squared += weight * weight;
        self.first += x * weight;
        self.second += square(x) * weight;
    }

    /// Effective number of equally weighted points.
    fn effective(&self) -> f64 {
        self.weight * self.weight / self.weight_squared
    }

    fn mean(&self) -> DVec3 {
        self.first / self.weight
    }

    fn covariance(&self) -> DMat3 {
        self.second * (1.0 / self.weight) - square(self.mean())
    }
}
