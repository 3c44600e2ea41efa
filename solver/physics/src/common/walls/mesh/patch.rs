//! How contacts of a sphere with neighbouring faces share its force.
//!
//! A sphere pressed on a plane by δ dips a cap into it. Taken as a bed of independent springs, the cap's point at the distance x
//! from its middle is w = δ − x²/(2R) deep, and a spring per area of F(w)/(2πR), F the force of the contact law, has together
//! exactly the law's energy: ∫ F(w) dA/(2πR) = ∫₀^δ F dw. In a valley the caps of its faces overlap; each point then
//! belongs to the face in which it is deepest. So U = ∫ F(max w) dA/(2πR) is one potential for all angles: one contact where
//! the faces lie in one plane, full contacts where their caps are apart. Its derivative by the distance from one
//! face is F(δ) times the share of the cap, weighted by F′(w), that lies in the face's own part.
//!
//! Caps lie in the plane of their middles x = −R n. Where the faces' normals enclose θ, the middles are 4 R sin(θ/4) apart: equal
//! caps then touch where those on the sphere do. Between two faces the share so depends on both overlaps and on θ alone, and
//! energy is kept; where three or more overlap, each lays out the others in its own plane, which agrees to second order in θ.

use stagger_coupling::math;

use crate::common::{
    quadrature::over_unit_interval,
    walls::{Vec3, shape::across},
};

/// A cap: where the sphere dips into a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cap {
    /// Unit normal of the face, towards the sphere.
    pub normal: Vec3,
    /// Distance of the centre from the face's plane, in m; less than the radius.
    pub distance: f64,
    /// Corners of the triangle from the sphere's centre, in m, where the face counts only over it; `None` where it goes on.
    pub outline: Option<[Vec3; 3]>,
}

/// Shares of a cap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shares {
    /// Of the face's force.
    pub force: f64,
    /// Of its elastic energy.
    pub energy: f64,
}

/// A point in the plane of a cap, in its radii.
type Point = [f64; 2];

/// The points x with x · `towards` ≤ `offset`.
#[derive(Clone, Copy)]
struct Half {
    towards: Point,
    offset: f64,
}

/// What a face keeps beside another.
enum Kept {
    All,
    None,
    Within(Half),
}

/// The plane of a cap.
struct Plane {
    normal: Vec3,
    axes: [Vec3; 2],
    /// Radius of the cap in m.
    radius_m: f64,
}

impl Plane {
    fn new(cap: &Cap, radius: f64) -> Self {
        let radius_m = (2.0 * radius * (radius - cap.distance)).max(0.0).sqrt();
        Self { normal: cap.normal, axes: across(&cap.normal), radius_m }
    }

    fn point(&self, from_centre: &Vec3) -> Point {
        self.axes.map(|axis| axis.dot(from_centre) / self.radius_m)
    }

    /// The part of this plane in which `own` is deeper than `other`. Of two that are equally deep, `first` says who has it.
    fn beside(&self, own: &Cap, other: &Cap, radius: f64, first: bool) -> Kept {
        // |n − n'| = 2 sin(θ/2), |n + n'| = 2 cos(θ/2).
        let (sine, cosine) = (0.5 * (own.normal - other.normal).norm(), 0.5 * (own.normal + other.normal).norm());
        let apart = radius * sine * (8.0 / (1.0 + cosine)).sqrt();
        let across = self.normal * other.normal.dot(&self.normal) - other.normal;
        let length = across.norm();
        if length < 1e-12 {
            // Parallel: the deeper one has all. Opposite: the caps are the sphere's two ends.
            let deeper = own.distance < other.distance || first && own.distance <= other.distance;
            return if cosine < 0.5 || deeper { Kept::All } else { Kept::None };
        }
        let offset_m = 0.5 * apart + radius * (other.distance - own.distance) / apart;
        Kept::Within(Half {
            towards: self.axes.map(|axis| axis.dot(&across) / length),
            offset: offset_m / self.radius_m,
        })
    }
}

/// The shares of all caps of a sphere of this `radius` under a force ∝ δ^(`power` − 1).
pub(super) fn shares(caps: &[Cap], radius: f64, power: f64) -> Vec<Shares> {
    let of = |(k, cap): (usize, &Cap)| {
        let plane = Plane::new(cap, radius);
        let outline = |corners: &[Vec3; 3]| counter_clockwise(corners.map(|corner| plane.point(&corner)));
        let own_outline = |corners: &[Vec3; 3]| {
            // Between two faces the cut lies on the far side of their edge, by less than the overlap times θ.
            let standing = caps.iter().filter(|other| other.outline.is_none());
            let beyond = standing.map(|other| (cap.normal - other.normal) * (radius - other.distance)).sum::<Vec3>();
            outline(&corners.map(|corner| corner + beyond))
        };
        let mut part = cap.outline.as_ref().map_or_else(
            // Beyond the cap.
            || vec![[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]],
            own_outline,
        );
        for (j, other) in caps.iter().enumerate().filter(|(j, other)| *j != k && other.outline.is_none()) {
            match plane.beside(cap, other, radius, cap.outline.is_none() && k < j) {
                Kept::All => {}
                Kept::None => return Shares { force: 0.0, energy: 0.0 },
                Kept::Within(half) => part = clipped(&part, half),
            }
        }
        let weigh = |part: &[Point]| [power - 1.0, power].map(|exponent| weight(part, exponent));
        let mut shares = weigh(&part);
        if cap.outline.is_none() {
            // Triangles ahead of this plane have what lies over them, as far as they are deeper.
            for other in caps {
                let Some(corners) = &other.outline else { continue };
                let taken = match plane.beside(cap, other, radius, true) {
                    Kept::All => continue,
                    Kept::None => part.clone(),
                    Kept::Within(Half { towards, offset }) => {
                        clipped(&part, Half { towards: towards.map(|component| -component), offset: -offset })
                    }
                };
                let over = outline(corners);
                let taken = sides(&over).fold(taken, |taken, side| clipped(&taken, side));
                for (share, taken) in shares.iter_mut().zip(weigh(&taken)) {
                    *share -= taken;
                }
            }
        }
        let [force, energy] = shares.map(|share| share.clamp(0.0, 1.0));
        Shares { force, energy }
    };
    caps.iter().enumerate().map(of).collect()
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn counter_clockwise([a, b, c]: [Point; 3]) -> Vec<Point> {
    if cross(minus(b, a), minus(c, a)) < 0.0 { vec![a, c, b] } else { vec![a, b, c] }
}

/// The sides of a polygon that goes counter-clockwise; none of length zero.
fn sides(polygon: &[Point]) -> impl Iterator<Item = Half> + '_ {
    edges(polygon).filter_map(|[a, b]| {
        let along = minus(b, a);
        let length = dot(along, along).sqrt();
        let towards = [along[1] / length, -along[0] / length];
        (length > 0.0).then(|| Half { towards, offset: dot(towards, a) })
    })
}

fn edges(polygon: &[Point]) -> impl Iterator<Item = [Point; 2]> + '_ {
    (0..polygon.len()).map(|k| [polygon[k], polygon[(k + 1) % polygon.len()]])
}

/// A convex polygon's part within a half-plane (Sutherland & Hodgman 1974).
fn clipped(polygon: &[Point], half: Half) -> Vec<Point> {
    let outside = |point: Point| dot(point, half.towards) - half.offset;
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for [a, b] in edges(polygon) {
        let (from, to) = (outside(a), outside(b));
        if from <= 0.0 {
            kept.push(a);
        }
        if (from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0) {
            let share = from / (from - to);
            kept.push([a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]);
        }
    }
    kept
}

/// Share of the unit disc within a polygon that goes counter-clockwise, its density ∝ (1 − r²)^(e − 1), e the `exponent`.
///
/// As seen from the middle, a side takes (1 − G(ρ(φ))) dφ/(2π), G(ρ) = (1 − ρ²)^e the share beyond ρ.
fn weight(polygon: &[Point], exponent: f64) -> f64 {
    let share: f64 = edges(polygon).map(|[a, b]| seen(a, b, exponent)).sum();
    share / std::f64::consts::TAU
}

/// ∫ (1 − G) dφ along a side from `a` to `b`.
///
/// At the distance h from the middle and with y along the side, dφ = h dy/(h² + y²), and G = (c² − y²)^e within the
/// chord |y| < c = √(1 − h²). G(0) and its y² are integrated in closed form; the rest has no trace left of the peak at
/// y = 0 and is done by eight Gauss points on each side of it, with y = c sin α.
fn seen(a: Point, b: Point, exponent: f64) -> f64 {
    let along = minus(b, a);
    let length = dot(along, along).sqrt();
    if length <= 0.0 {
        return 0.0;
    }
    let angle = math::atan2(cross(a, b), dot(a, b));
    let (h, from, to) = (cross(a, b) / length, dot(a, along) / length, dot(b, along) / length);
    let c = (1.0 - h * h).max(0.0).sqrt();
    let (from, to) = (from.max(-c), to.min(c));
    if h == 0.0 {
        // Seen edge on; one that passes through the middle has nothing beyond it either, as G(0) = 1.
        return 0.0;
    }
    if from >= to {
        return angle;
    }
    let within = math::atan2(h * (to - from), h * h + from * to);
    let power = math::powf(c, 2.0 * exponent);
    // −e c^(2e−2) y² of the expansion; ∫ y² h/(h² + y²) dy = h (y₂ − y₁) − h² Δφ.
    let second = -exponent * math::powf(c, 2.0 * exponent - 2.0) * (h * (to - from) - h * h * within);
    let rest = |alpha: f64| {
        let (sine, cosine) = (math::sin(alpha), math::cos(alpha));
        let square = sine * sine;
        let beyond = math::powf(cosine.max(0.0), 2.0 * exponent) - 1.0 + exponent * square;
        power * beyond * h * c * cosine / (h * h + c * c * square)
    };
    let [from, to] = [from, to].map(|y| math::asin((y / c).clamp(-1.0, 1.0)));
    let piece = |from: f64, to: f64| {
        let length = to - from;
        if length > 0.0 { length * over_unit_interval(|share| rest(from + share * length)) } else { 0.0 }
    };
    let rest = piece(from, to.min(0.0)) + piece(from.max(0.0), to);
    angle - (power * within + second + rest)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;

    /// Beyond the disc on three sides.
    fn half_plane(offset: f64) -> Vec<Point> {
        vec![[-2.0, -2.0], [offset, -2.0], [offset, 2.0], [-2.0, 2.0]]
    }

    #[test]
    fn a_half_plane_weighs_as_in_closed_form() {
        for step in -21..=21 {
            let t = f64::from(step) / 20.0;
            let inside = t.clamp(-1.0, 1.0);
            // ∫ √(1 − x²) dx, ∫ (1 − x²) dx and ∫ (1 − x²)^{3/2} dx over their whole.
            let root = (1.0 - inside * inside).sqrt();
            let linear = 0.5 + (inside * root + math::asin(inside)) / PI;
            let hertz = 0.5 + (3.0 * inside - inside * inside * inside) / 4.0;
            let cubic = 0.5 + (inside * root * (5.0 - 2.0 * inside * inside) + 3.0 * math::asin(inside)) / (3.0 * PI);
            for (exponent, exact) in [(1.0, linear), (1.5, hertz), (2.0, cubic)] {
                let found = weight(&half_plane(t), exponent);
                // Eight Gauss points on each side.
                assert!((found - exact).abs() < 1e-6, "{t}, {exponent}: {found} {exact}");
            }
        }
    }

    proptest! {
        #[test]
        fn parts_of_a_polygon_weigh_as_the_whole(
            points in [-1.5f64..1.5, -1.5f64..1.5, -1.5f64..1.5, -1.5f64..1.5, -1.5f64..1.5, -1.5f64..1.5],
            angle in 0.0f64..std::f64::consts::TAU, offset in -1.0f64..1.0, exponent in 1.0f64..4.0,
        ) {
            let [a, b, c, d, e, f] = points;
            let triangle = counter_clockwise([[a, b], [c, d], [e, f]]);
            let towards = [math::cos(angle), math::sin(angle)];
            let one = clipped(&triangle, Half { towards, offset });
            let other = clipped(&triangle, Half { towards: [-towards[0], -towards[1]], offset: -offset });
            let [whole, one, other] = [&triangle, &one, &other].map(|part| weight(part, exponent));
            // Eight Gauss points on either side of the nearest point.
            prop_assert!((one + other - whole).abs() < 5e-6, "{one} {other} {whole}");
            prop_assert!(whole > -1e-6 && whole < 1.0 + 1e-6);
        }
    }

    /// A valley of two faces that rise at `angle`/2 on both sides of the y axis, seen from a centre.
    fn valley(angle: f64, [x, z]: [f64; 2]) -> [Cap; 2] {
        [1.0, -1.0].map(|side| {
            let (sine, cosine) = math::sin_cos(0.5 * angle);
            let normal = Vec3::new(side * sine, 0.0, cosine);
            Cap { normal, distance: normal.dot(&Vec3::new(x, 0.0, z)), outline: None }
        })
    }

    /// Σ energy over F's constant: δ^q/q of each.
    fn energy(caps: &[Cap], power: f64) -> f64 {
        let shares = shares(caps, 1.0, power);
        caps.iter().zip(shares).map(|(cap, own)| own.energy * math::powf(1.0 - cap.distance, power) / power).sum()
    }

    #[test]
    fn the_force_is_the_energy_s_derivative_in_every_valley() {
        for power in [2.0, 2.5, 4.0] {
            for angle in [1e-3, 0.02, 0.1, 0.3, 0.6] {
                for x in [0.0, 1e-3, 0.02, 0.06] {
                    let z = 0.99;
                    let caps = valley(angle, [x, z]);
                    let shares = shares(&caps, 1.0, power);
                    for (axis, direction) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
                        let h = 1e-5;
                        let at = |sign: f64| {
                            energy(&valley(angle, [x + sign * h * direction[0], z + sign * h * direction[1]]), power)
                        };
                        let slope = -(at(1.0) - at(-1.0)) / (2.0 * h);
                        let force: f64 = caps
                            .iter()
                            .zip(&shares)
                            .map(|(cap, own)| {
                                own.force
                                    * math::powf((1.0 - cap.distance).max(0.0), power - 1.0)
                                    * cap.normal[2 * axis]
                            })
                            .sum();
                        let whole = math::powf(1.0 - z, power - 1.0);
                        // Of the differences: h² over the overlap's, 1e-6.
                        assert!(
                            (slope - force).abs() < 1e-4 * whole,
                            "{power} {angle} {x} {axis}: {slope:e} {force:e}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn one_plane_has_one_contact_and_a_corner_two() {
        for power in [2.0, 2.5, 4.0] {
            let sum = |angle: f64, x: f64| -> f64 {
                // The middle stays 0.01 deep in both faces.
                let place = [x, 0.99 / math::cos(0.5 * angle)];
                shares(&valley(angle, place), 1.0, power).iter().map(|own| own.force).sum()
            };
            for angle in [1e-12, 1e-9, 1e-7, 1e-5] {
                for x in [0.0, 1e-9, 1e-3, 0.1] {
                    // Of what two faces are apart: angle over the cap's radius, 0.14.
                    assert!((sum(angle, x) - 1.0).abs() < 1e-8 + 10.0 * angle, "{angle:e} {x}: {}", sum(angle, x));
                }
            }
            let corner = [Vec3::x(), Vec3::z()].map(|normal| Cap { normal, distance: 0.9, outline: None });
            assert_eq!(shares(&corner, 1.0, power), [Shares { force: 1.0, energy: 1.0 }; 2]);
            // A sweep without a jump, over eight decades and up to where the caps part.
            let mut before = sum(1e-8, 0.0);
            for step in 1..=800 {
                let now = sum(1e-8 * math::powf(10.0, f64::from(step) / 100.0), 0.0);
                assert!((before - 1e-9..before + 0.05).contains(&now), "{step}: {before} {now}");
                before = now;
            }
            assert!((before - 2.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_faces_of_a_flat_pit_share_one_contact() {
        // Three, and seven, faces that rise by a thousandth all around; a sphere over their corner, and beside it.
        for faces in [3, 7] {
            for place in [[0.0, 0.0], [0.02, 0.01], [-0.05, 0.08]] {
                let caps: Vec<Cap> = (0..faces)
                    .map(|face| {
                        let angle = std::f64::consts::TAU * f64::from(face) / f64::from(faces);
                        let normal = Vec3::new(-1e-6 * math::cos(angle), -1e-6 * math::sin(angle), 1.0).normalize();
                        let centre = Vec3::new(place[0], place[1], 0.99);
                        Cap { normal, distance: normal.dot(&centre), outline: None }
                    })
                    .collect();
                for power in [2.0, 2.5] {
                    let sum: f64 = shares(&caps, 1.0, power).iter().map(|own| own.force).sum();
                    assert!((sum - 1.0).abs() < 1e-4, "{faces} {place:?} {power}: {sum}");
                }
            }
        }
    }

    #[test]
    fn a_triangle_ahead_takes_what_lies_over_it() {
        // A plane, and a face that rises from the line x = 0.05 on; the sphere's foot is on the plane.
        let plane = Cap { normal: Vec3::z(), distance: 0.99, outline: None };
        let angle: f64 = 0.1;
        let normal = Vec3::new(-math::sin(angle), 0.0, math::cos(angle));
        let edge = Vec3::new(0.05, 0.0, -0.99);
        let up = Vec3::new(math::cos(angle), 0.0, math::sin(angle));
        let distance = -normal.dot(&edge);
        let corners = |far: f64| [edge - Vec3::y() * 9.0, edge + Vec3::y() * 9.0, edge + up * far];
        let with = |outline| shares(&[plane, Cap { normal, distance, outline }], 1.0, 2.0);
        let [whole, over] = [with(None), with(Some(corners(1e3)))];
        for (whole, over) in whole.iter().zip(&over) {
            // The outline ends at y = ± 9 at the edge and narrows far away.
            assert!((whole.force - over.force).abs() < 1e-3, "{whole:?} {over:?}");
        }
        let small = with(Some(corners(0.02)));
        assert!(small[1].force < over[1].force && small[0].force > over[0].force, "{small:?} {over:?}");
    }
}
