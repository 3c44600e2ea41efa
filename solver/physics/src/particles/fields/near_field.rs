//! Near field between particles, attraction and repulsion by powers of the distance (Zohdi 2018, eq. 6.20).
//!
//! Each pair is computed once and its force added to one particle and subtracted from the other, so momentum is
//! conserved to the rounding of the sums. Rows are cut into strips by their number alone, each strip sums in order into
//! memory of its own, and the strips are added in order: the result does not depend on how many threads share them.

use std::{f64::consts::PI, ops::Range};

use rayon::prelude::*;
use stagger_coupling::{SolveError, math};

use super::{Body, near_list::NearList};
use crate::{
    common::{Vec3, checks::setting},
    particles::settings::{Base, NearFieldSettings},
};

/// Pairs computed side by side: two registers of the smallest instruction set, which hides the latency of one.
pub(super) const LANES: usize = 4;

type Lanes = [f64; LANES];

/// Pairs of a strip where all are summed, and rows of a strip where a list is: enough work to be worth a thread.
const STRIP_PAIRS: usize = 1 << 18;
const STRIP_ROWS: usize = 1 << 10;

/// More strips than this would spend more on adding them up than they gain.
const STRIPS: usize = 16;

/// The near field of a scene.
///
/// A pair at distance d attracts with α1 d^−β1 − α2 d^−β2, along the line of centres; unlike signs turn it about. The
/// law has no bound at d → 0: below a small share of R_i + R_j (the setting `closest`) the force falls in proportion to
/// d instead, so that two particles at the same place feel none of each other.
#[derive(Clone, Copy, Debug)]
pub struct NearField {
    settings: NearFieldSettings,
    powers: Powers,
}

/// Exponents, by how fast their powers are computed.
#[derive(Clone, Copy, Debug)]
enum Powers {
    /// 1 and 2: one root and one division a pair.
    OneTwo,
    /// Whole numbers.
    Whole(u32, u32),
    /// Any.
    Real,
}

impl NearField {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`SolveError::Start`] names the setting that is out of its range.
    pub fn new(settings: NearFieldSettings) -> Result<Self, SolveError> {
        let not_negative = |value: f64| value.is_finite() && value >= 0.0;
        let check = |what: &str, value, fits, expected| {
            setting("particles", &format!("the near field's {what}"), value, fits, expected)
        };
        let exponents = [settings.attraction_exponent, settings.repulsion_exponent];
        for (what, value) in [("attraction", settings.attraction), ("repulsion", settings.repulsion)] {
            check(what, value, not_negative(value), "finite and not negative")?;
        }
        for value in exponents {
            check("exponent", value, value > 0.0 && value <= 16.0, "above 0 and at most 16")?;
        }
        if let Some(cutoff_m) = settings.cutoff_m {
            check("cut-off", cutoff_m, cutoff_m > 0.0 && cutoff_m.is_finite(), "positive and finite")?;
        }
        check("skin", settings.skin, not_negative(settings.skin), "finite and not negative")?;
        check("closest", settings.closest, settings.closest > 0.0 && settings.closest <= 1.0, "above 0 and at most 1")?;
        settings.presence.check("near field")?;
        let powers = match exponents {
            [attraction, repulsion] if attraction.fract() == 0.0 && repulsion.fract() == 0.0 => {
                match (attraction as u32, repulsion as u32) {
                    (1, 2) => Powers::OneTwo,
                    (attraction, repulsion) => Powers::Whole(attraction, repulsion),
                }
            }
            _ => Powers::Real,
        };
        Ok(Self { settings, powers })
    }

    /// Strength b c of a particle: mass, surface, volume or charge with its sign; `id` is the particle's number.
    #[must_use]
    pub fn source(&self, body: Body, id: u64) -> f64 {
        let base = match self.settings.base {
            Base::Mass => body.mass_kg,
            Base::Area => 4.0 * PI * body.radius_m * body.radius_m,
            Base::Volume => body.volume_m3(),
            Base::Charge => body.charge_c,
        };
        if self.settings.alternating && id % 2 == 1 { -base } else { base }
    }

    /// The pairs within the cut-off and its skin; `None` where all pairs are summed.
    #[must_use]
    pub fn list(&self, positions: &[Vec3]) -> Option<NearList> {
        let cutoff_m = self.settings.cutoff_m?;
        NearList::build(positions, cutoff_m * (1.0 + self.settings.skin))
    }

    /// Whether no particle has moved half the skin since the list was built.
    #[must_use]
    pub fn holds(&self, list: &NearList, positions: &[Vec3]) -> bool {
        list.holds(positions, self.settings.cutoff_m.unwrap_or(0.0) * self.settings.skin)
    }

    /// Adds the near field at the time `t_s` to `forces`, in N.
    ///
    /// `sources` are the strengths b c of the particles. With a list that [holds](Self::holds) the result is that
    /// without one to rounding, and the same bits whenever the list was built.
    pub fn add(
        &self,
        t_s: f64,
        list: Option<&NearList>,
        positions: &[Vec3],
        sources: &[f64],
        radii: &[f64],
        forces: &mut [Vec3],
    ) {
        if !self.settings.presence.is_on(t_s) || positions.is_empty() {
            return;
        }
        let NearFieldSettings { attraction, attraction_exponent, repulsion, repulsion_exponent, .. } = self.settings;
        let bodies = self.bodies(positions, sources, radii);
        let alpha = [attraction, repulsion];
        let partials = match self.powers {
            Powers::OneTwo => self.sum(&OneTwo(alpha), list, &bodies),
            Powers::Whole(first, second) => self.sum(&Whole(alpha, [first, second]), list, &bodies),
            Powers::Real => self.sum(&Real(alpha, [attraction_exponent, repulsion_exponent]), list, &bodies),
        };
        for Partial { first, x, y, z } in &partials {
            for (force, ((x, y), z)) in forces[*first..].iter_mut().zip(x.iter().zip(y).zip(z)) {
                *force += Vec3::new(*x, *y, *z);
            }
        }
    }

    /// Energy of the near field at the time `t_s` in J, zero at the cut-off.
    ///
    /// Without a cut-off its zero is where the powers of the distance have theirs: infinitely far for an exponent above
    /// 1, nowhere for one below, and at 1 m for an exponent of 1, whose energy is a logarithm.
    #[must_use]
    pub fn potential_j(
        &self,
        t_s: f64,
        list: Option<&NearList>,
        positions: &[Vec3],
        sources: &[f64],
        radii: &[f64],
    ) -> f64 {
        if !self.settings.presence.is_on(t_s) {
            return 0.0;
        }
        let cutoff_m = self.settings.cutoff_m.unwrap_or(f64::INFINITY);
        let zero = self.settings.cutoff_m.map_or(0.0, |cutoff_m| self.antiderivative(cutoff_m));
        let pair = |i: usize, j: usize| {
            let distance_m = (positions[j] - positions[i]).norm();
            if distance_m > cutoff_m || !self.settings.presence.reaches(&positions[j]) {
                return 0.0;
            }
            let closest_m = self.settings.closest * (radii[i] + radii[j]);
            let outside_m = distance_m.max(closest_m);
            // The force is linear in the distance below `closest`.
            let inside = 0.5 * self.force(outside_m) * (distance_m * distance_m / outside_m - outside_m);
            sources[i] * sources[j] * (self.antiderivative(outside_m) + inside - zero)
        };
        (0..positions.len())
            .filter(|&i| self.settings.presence.reaches(&positions[i]))
            .map(|i| match list {
                Some(list) => list.row(i).iter().map(|&j| pair(i, j as usize)).sum::<f64>(),
                None => (i + 1..positions.len()).map(|j| pair(i, j)).sum(),
            })
            .sum()
    }

    /// Upper bound of the stiffness of a pair in N/m, |b_i b_j| (α1 β1 d^(−β1−1) + α2 β2 d^(−β2−1)).
    ///
    /// A substep resolves the pair where it is short against √(m*/k) at the smallest distance that occurs, that is in
    /// contact, with m* the reduced mass.
    #[must_use]
    pub fn stiffness_n_m(&self, distance_m: f64, source_i: f64, source_j: f64) -> f64 {
        let NearFieldSettings { attraction, attraction_exponent, repulsion, repulsion_exponent, .. } = self.settings;
        let slope = |alpha: f64, beta: f64| alpha * beta * math::powf(distance_m, -beta - 1.0);
        (source_i * source_j).abs() * (slope(attraction, attraction_exponent) + slope(repulsion, repulsion_exponent))
    }

    /// α1 d^−β1 − α2 d^−β2 per unit of both strengths.
    fn force(&self, distance_m: f64) -> f64 {
        let NearFieldSettings { attraction, attraction_exponent, repulsion, repulsion_exponent, .. } = self.settings;
        attraction * math::powf(distance_m, -attraction_exponent)
            - repulsion * math::powf(distance_m, -repulsion_exponent)
    }

    /// An antiderivative of [`Self::force`].
    fn antiderivative(&self, distance_m: f64) -> f64 {
        let power = |beta: f64| {
            let raised = 1.0 - beta;
            if raised == 0.0 { math::ln(distance_m) } else { math::powf(distance_m, raised) / raised }
        };
        self.settings.attraction * power(self.settings.attraction_exponent)
            - self.settings.repulsion * power(self.settings.repulsion_exponent)
    }

    /// Particles as the kernel reads them. One outside the field's region has no strength; nor have those past the end.
    fn bodies(&self, positions: &[Vec3], sources: &[f64], radii: &[f64]) -> Bodies {
        let padded = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..positions.len()).map(value).chain([0.0; LANES]).collect()
        };
        let presence = &self.settings.presence;
        Bodies {
            count: positions.len(),
            x: padded(&|i| positions[i].x),
            y: padded(&|i| positions[i].y),
            z: padded(&|i| positions[i].z),
            source: padded(&|i| if presence.reaches(&positions[i]) { sources[i] } else { 0.0 }),
            closest_m: padded(&|i| self.settings.closest * radii[i]),
        }
    }

    fn sum<L: Law>(&self, law: &L, list: Option<&NearList>, bodies: &Bodies) -> Vec<Partial> {
        let limit = self.settings.cutoff_m.map_or(f64::INFINITY, |cutoff_m| cutoff_m * cutoff_m);
        let strips = match list {
            Some(_) => listed_strips(bodies.count),
            None => full_strips(bodies.count),
        };
        let strip = |rows: Range<usize>| match list {
            Some(list) => bodies.listed(law, list, limit, rows),
            None => bodies.full(law, limit, rows),
        };
        if strips.len() > 1 {
            strips.into_par_iter().map(strip).collect()
        } else {
            strips.into_iter().map(strip).collect()
        }
    }
}

/// Rows cut so that each strip of the upper triangle holds about as many pairs as the others.
fn full_strips(count: usize) -> Vec<Range<usize>> {
    let pairs = count * (count - 1) / 2;
    let strips = (pairs / STRIP_PAIRS).clamp(1, STRIPS);
    let mut cuts = vec![0];
    let mut before = 0;
    for row in 0..count {
        before += count - 1 - row;
        if cuts.len() < strips && before >= pairs * cuts.len() / strips {
            cuts.push(row + 1);
        }
    }
    cuts.push(count);
    cuts.windows(2).map(|cut| cut[0]..cut[1]).collect()
}

/// Rows cut into strips of equal numbers: a list built at another time must not change the order of the sums.
fn listed_strips(count: usize) -> Vec<Range<usize>> {
    let strips = (count / STRIP_ROWS).clamp(1, STRIPS);
    (0..strips).map(|strip| count * strip / strips..count * (strip + 1) / strips).collect()
}

/// Particles as structure of arrays, with [`LANES`] entries of no strength past the end.
struct Bodies {
    count: usize,
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    source: Vec<f64>,
    /// Share of the closest distance.
    closest_m: Vec<f64>,
}

/// Forces of one strip on the particles from `first` on.
struct Partial {
    first: usize,
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

impl Partial {
    fn new(first: usize, end: usize) -> Self {
        let none = || vec![0.0; end - first];
        Self { first, x: none(), y: none(), z: none() }
    }
}

/// The particle of a row, in every lane.
#[derive(Clone, Copy)]
struct One {
    x: Lanes,
    y: Lanes,
    z: Lanes,
    source: Lanes,
    closest_m: Lanes,
}

impl Bodies {
    fn one(&self, i: usize) -> One {
        let of = |values: &[f64]| [values[i]; LANES];
        let Self { x, y, z, source, closest_m, .. } = self;
        One { x: of(x), y: of(y), z: of(z), source: of(source), closest_m: of(closest_m) }
    }

    /// Pairs of `rows` with all particles behind them.
    fn full<L: Law>(&self, law: &L, limit: f64, rows: Range<usize>) -> Partial {
        let first = rows.start;
        let mut partial = Partial::new(first, self.count + LANES);
        for i in rows {
            let one = self.one(i);
            let others = i + 1..i + 1 + (self.count - i - 1).next_multiple_of(LANES);
            let of = |values| lanes(values, &others);
            let (x, y, z, source, closest_m) =
                (of(&self.x), of(&self.y), of(&self.z), of(&self.source), of(&self.closest_m));
            let targets = others.start - first..others.end - first;
            let (on_x, on_y, on_z) = (
                lanes_mut(&mut partial.x, &targets),
                lanes_mut(&mut partial.y, &targets),
                lanes_mut(&mut partial.z, &targets),
            );
            let (mut sum_x, mut sum_y, mut sum_z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
            for k in 0..x.len().min(on_x.len()) {
                let force = attract(law, limit, one, [&x[k], &y[k], &z[k], &source[k], &closest_m[k]]);
                on_x[k] = each(|lane| on_x[k][lane] - force[0][lane]);
                on_y[k] = each(|lane| on_y[k][lane] - force[1][lane]);
                on_z[k] = each(|lane| on_z[k][lane] - force[2][lane]);
                sum_x = each(|lane| sum_x[lane] + force[0][lane]);
                sum_y = each(|lane| sum_y[lane] + force[1][lane]);
                sum_z = each(|lane| sum_z[lane] + force[2][lane]);
            }
            partial.x[i - first] += sum_x.iter().sum::<f64>();
            partial.y[i - first] += sum_y.iter().sum::<f64>();
            partial.z[i - first] += sum_z.iter().sum::<f64>();
        }
        partial
    }

    /// Listed pairs of `rows`.
    fn listed<L: Law>(&self, law: &L, list: &NearList, limit: f64, rows: Range<usize>) -> Partial {
        let first = rows.start;
        let last = rows.clone().filter_map(|i| list.row(i).last()).max().map_or(0, |&last| last as usize);
        let mut partial = Partial::new(first, rows.end.max(last + 1));
        for i in rows {
            let one = self.one(i);
            // One sum in the order of the rows: pairs beyond the cut-off add zero, so it does not matter which of them
            // the list holds.
            let mut sum = [0.0; 3];
            for others in list.row(i).chunks(LANES) {
                let at: [usize; LANES] =
                    std::array::from_fn(|lane| others.get(lane).map_or(self.count, |&j| j as usize));
                let [x, y, z, source, closest_m] =
                    [&self.x, &self.y, &self.z, &self.source, &self.closest_m].map(|values| at.map(|j| values[j]));
                let [x, y, z] = attract(law, limit, one, [&x, &y, &z, &source, &closest_m]);
                for lane in 0..others.len() {
                    let target = at[lane] - first;
                    partial.x[target] -= x[lane];
                    partial.y[target] -= y[lane];
                    partial.z[target] -= z[lane];
                    sum[0] += x[lane];
                    sum[1] += y[lane];
                    sum[2] += z[lane];
                }
            }
            partial.x[i - first] += sum[0];
            partial.y[i - first] += sum[1];
            partial.z[i - first] += sum[2];
        }
        partial
    }
}

fn lanes<'a>(values: &'a [f64], at: &Range<usize>) -> &'a [Lanes] {
    values[at.clone()].as_chunks().0
}

fn lanes_mut<'a>(values: &'a mut [f64], at: &Range<usize>) -> &'a mut [Lanes] {
    values[at.clone()].as_chunks_mut().0
}

/// Components of the force on `one` towards others: x, y, z, strength and share of the closest distance of each.
#[inline(always)]
fn attract<L: Law>(law: &L, limit: f64, one: One, others: [&Lanes; 5]) -> [Lanes; 3] {
    let [x, y, z, source, closest_m] = others;
    let to_x = each(|lane| x[lane] - one.x[lane]);
    let to_y = each(|lane| y[lane] - one.y[lane]);
    let to_z = each(|lane| z[lane] - one.z[lane]);
    let squared = each(|lane| to_x[lane] * to_x[lane] + to_y[lane] * to_y[lane] + to_z[lane] * to_z[lane]);
    let closest = each(|lane| one.closest_m[lane] + closest_m[lane]);
    let closest = closest.map(|closest| closest * closest);
    // One instruction; `f64::max` would take care of NaN, which `to` carries into the force in any case.
    let guarded = each(|lane| if squared[lane] > closest[lane] { squared[lane] } else { closest[lane] });
    let factor = law.over_distance(&guarded);
    let factor = each(|lane| factor[lane] * (one.source[lane] * source[lane]));
    let factor = each(|lane| if squared[lane] > limit { 0.0 } else { factor[lane] });
    [to_x, to_y, to_z].map(|to| each(|lane| factor[lane] * to[lane]))
}

/// One value a lane, written so that the compiler makes vector instructions of it.
#[inline(always)]
fn each(value: impl FnMut(usize) -> f64) -> Lanes {
    std::array::from_fn(value)
}

/// (α1 d^−β1 − α2 d^−β2)/d as a function of d².
trait Law: Sync {
    fn over_distance(&self, squared: &Lanes) -> Lanes;
}

/// Prefactors for the exponents 1 and 2.
struct OneTwo([f64; 2]);

impl Law for OneTwo {
    #[inline(always)]
    fn over_distance(&self, squared: &Lanes) -> Lanes {
        squared.map(|squared| {
            let distance = squared.sqrt();
            (self.0[0] * distance - self.0[1]) / (squared * distance)
        })
    }
}

/// Prefactors and whole exponents.
struct Whole([f64; 2], [u32; 2]);

impl Law for Whole {
    #[inline(always)]
    fn over_distance(&self, squared: &Lanes) -> Lanes {
        let inverse = squared.map(|squared| 1.0 / squared.sqrt());
        let Self([attraction, repulsion], exponents) = self;
        // By products: the library's integer power may round differently on another machine.
        let [first, second] = exponents.map(|exponent| {
            let mut power = inverse;
            for _ in 0..exponent {
                power = each(|lane| power[lane] * inverse[lane]);
            }
            power
        });
        each(|lane| attraction * first[lane] - repulsion * second[lane])
    }
}

/// Prefactors and exponents.
struct Real([f64; 2], [f64; 2]);

impl Law for Real {
    #[inline(always)]
    fn over_distance(&self, squared: &Lanes) -> Lanes {
        let Self([attraction, repulsion], [first, second]) = self;
        squared.map(|squared| {
            attraction * math::powf(squared, -0.5 * (first + 1.0))
                - repulsion * math::powf(squared, -0.5 * (second + 1.0))
        })
    }
}

#[cfg(test)]
#[path = "near_field_tests.rs"]
mod tests;
