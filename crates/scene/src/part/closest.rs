//! The closest point of a triangle.

use super::sliver;
use super::triangle::Triangle;
use glam::DVec3;

/// Closest point of the triangle, by the Voronoi region of `p` (Ericson 2005, section 5.1.5).
///
/// Error: a few units in the last place of the distance and of the coordinates, for any shape of the triangle. If its
/// height is below a tenth of its longest side, the weights of the corners are computed in double-double precision.
pub(crate) fn closest_point(p: DVec3, corners: &Triangle) -> DVec3 {
    let &[a, b, c] = corners;
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let (ab2, ac2, bc2) = (
        ab.length_squared(),
        ac.length_squared(),
        bc.length_squared(),
    );
    let longest = ab2.max(ac2).max(bc2);
    let sliver = ab.cross(ac).length_squared() < 0.01 * longest * longest;
    if sliver {
        // The longest side becomes the first one.
        let corners = if ab2 == longest {
            [a, b, c]
        } else if bc2 == longest {
            [b, c, a]
        } else {
            [c, a, b]
        };
        return in_region(p, &corners, sliver::weights, sliver::inside);
    }
    in_region(p, corners, weights, |p, &[a, b, c], [_, wb, wc]| {
        // Computed along the normal, the foot of a point of the plane is exactly that point; the error grows with the distance.
        let normal = ab.cross(ac);
        let off = normal * (normal.dot(p - a) / normal.length_squared());
        if off.length_squared() <= longest {
            p - off
        } else {
            a + (b - a) * wb + (c - a) * wc
        }
    })
}

/// Selects the closest point by the region of `p`; `weights` are the weights of the corners at the foot of `p` in the plane of the
/// triangle.
#[inline(always)]
fn in_region(
    p: DVec3,
    corners: &Triangle,
    weights: impl Fn(DVec3, &Triangle) -> [f64; 3],
    inside: impl Fn(DVec3, &Triangle, [f64; 3]) -> DVec3,
) -> DVec3 {
    let &[a, b, c] = corners;
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let (ap, bp, cp) = (p - a, p - b, p - c);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, e3) = (-ab.dot(bp), bc.dot(bp));
    if d3 <= 0.0 && e3 <= 0.0 {
        return b;
    }
    let (d6, e6) = (-ac.dot(cp), -bc.dot(cp));
    if d6 <= 0.0 && e6 <= 0.0 {
        return c;
    }
    let [wa, wb, wc] = weights(p, corners);
    if wc <= 0.0 && d1 >= 0.0 && d3 >= 0.0 {
        return a + ab * (d1 / (d1 + d3));
    }
    if wb <= 0.0 && d2 >= 0.0 && d6 >= 0.0 {
        return a + ac * (d2 / (d2 + d6));
    }
    if wa <= 0.0 && e3 >= 0.0 && e6 >= 0.0 {
        return b + bc * (e3 / (e3 + e6));
    }
    inside(p, corners, [wa, wb, wc])
}

/// Weights of the corners at the foot of `p`: error about 1e-14 times distance over triangle size, unless the
/// triangle is a sliver.
#[inline(always)]
fn weights(p: DVec3, &[a, b, c]: &Triangle) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (aa, cc, across) = (ab.length_squared(), ac.length_squared(), ab.dot(ac));
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    let per_area = 1.0 / (aa * cc - across * across);
    let wb = (cc * d1 - across * d2) * per_area;
    let wc = (aa * d2 - across * d1) * per_area;
    [1.0 - wb - wc, wb, wc]
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn closest_point_in_every_region() {
        let third = DVec3::new(0.25, 0.25, 0.0);
        for (p, expected) in [
            (DVec3::new(-1.0, -2.0, 3.0), UNIT[0]),
            (DVec3::new(3.0, -1.0, 1.0), UNIT[1]),
            (DVec3::new(-1.0, 3.0, 1.0), UNIT[2]),
            (DVec3::new(0.5, -1.0, 1.0), DVec3::new(0.5, 0.0, 0.0)),
            (DVec3::new(-1.0, 0.5, 1.0), DVec3::new(0.0, 0.5, 0.0)),
            (DVec3::new(1.0, 1.0, 1.0), DVec3::new(0.5, 0.5, 0.0)),
            (third + DVec3::Z, third),
            (third + 1e3 * DVec3::Z, third),
            (third + 1e6 * DVec3::Z, third),
            (third + 1e9 * DVec3::Z, third),
        ] {
            assert!(closest_point(p, &UNIT).distance(expected) < 1e-15, "{p}");
        }
    }

    /// Height over side 1e-9: the formula in plain f64 was off by 1.56 m.
    #[test]
    fn the_closest_point_of_a_sliver() {
        let [a, b, c] = [
            DVec3::new(-1.6880956155671512, 0.1459722553485827, 0.8862793042861439),
            DVec3::new(-2.645763039041052, 0.9699575285696438, 1.7512129275018822),
            DVec3::from([
                -1.5847667854005956,
                0.057067246601219056,
                0.7929561120163846,
            ]),
        ];
        let p = DVec3::new(-2.61143134196986, 0.9404182416544303, 1.7202056713176685);
        let on_side = |a: DVec3, b: DVec3| {
            let t = (p - a).dot(b - a) / a.distance_squared(b);
            a.lerp(b, t.clamp(0.0, 1.0))
        };
        let sides = [on_side(a, b), on_side(b, c), on_side(c, a)];
        let distances = sides.iter().map(|q| p.distance(*q));
        let nearest = distances.fold(f64::MAX, f64::min);
        let orders = [[a, b, c], [b, c, a], [c, a, b]];
        let backwards = orders.map(|[a, b, c]| [c, b, a]);
        for corners in orders.into_iter().chain(backwards) {
            let q = closest_point(p, &corners);
            // Every point inside is within the height of a side.
            assert!(p.distance(q) <= nearest * (1.0 + 1e-12) + 1e-15);
            assert!(sides.iter().any(|s| s.distance(q) < 3e-8), "{q}");
        }
    }

    /// Known feet: a foot plus a multiple of the normal, all exactly representable.
    #[test]
    fn feet_inside_slivers_of_every_height() {
        for exponent in 1..=39 {
            let height = 0.5_f64.powi(exponent);
            let corners = [
                DVec3::ZERO,
                DVec3::new(1.0, 0.0, 0.0),
                DVec3::new(0.75, height, 0.0),
            ];
            for (x, y) in [(0.5, 0.25), (0.75, 0.5), (0.25, 0.125), (0.875, 0.125)] {
                let foot = DVec3::new(x, y * height, 0.0);
                let p = foot + DVec3::new(0.0, 0.0, 2.0);
                for k in 0..3 {
                    let turned = [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
                    let off = closest_point(p, &turned) - foot;
                    assert!(off.x.abs() < 1e-15, "{height:e}: {off}");
                    assert!(off.y.abs() < 1e-14 * height, "{height:e}: {off}");
                }
            }
        }
    }

    /// Otherwise a hand on a wall would be off the wall by rounding, in any direction.
    #[test]
    fn a_point_of_a_plain_triangle_is_its_own_foot() {
        for k in 0..3 {
            let turn = |p: [f64; 3]| DVec3::new(p[k], p[(k + 1) % 3], p[(k + 2) % 3]);
            let corners = [[1.0, 0.3, 0.1], [1.0, 2.9, 0.7], [1.0, 0.2, 1.9]].map(turn);
            for (y, z) in [(0.7, 0.9), (1.1, 0.7), (0.9, 1.3)] {
                let p = turn([1.0, y, z]);
                assert_eq!(closest_point(p, &corners), p);
                let q = closest_point(p + turn([0.1, 0.0, 0.0]), &corners);
                assert!(q.distance(p) < 1e-15);
            }
        }
    }
}
