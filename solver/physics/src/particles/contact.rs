//! What a contact does, whichever laws its forces follow.

use super::{
    hertz::Hertz,
    lanes::{Real, Triple},
    linear::Linear,
    monograph_bond::MonographBond,
    overlap::Overlap,
    pair_table::PairLaw,
    rolling::resist,
    settings::ContactLaw,
};
use stagger_coupling::math;

/// Stiffness over the modulus, and area of a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch<R> {
    /// Elastic force over overlap and modulus: in m where the modulus is a pressure, 1 where it is N/m.
    pub secant: R,
    /// Contact area A in m².
    pub area_m2: R,
}

impl Touch<f64> {
    /// The part of a contact that has this share of its patch.
    pub fn shared(self, share: f64) -> Self {
        Self { secant: self.secant * share, area_m2: self.area_m2 * share }
    }
}

/// A law of the normal force: elastic force = modulus · secant(δ) · δ.
///
/// Kernels are compiled for each law; [`Law`] is the same at run time.
pub(super) trait Normal: Copy + Send + Sync {
    /// q of the force ∝ δ^{q−1} that the law tends to at small overlap.
    fn power(self) -> f64;

    /// Modulus of two particles in contact. That of a particle at a rigid wall is its own.
    fn pair_modulus<R: Real>(self, modulus_i: R, modulus_j: R) -> R;

    /// Two particles at centre distance d with overlap δ > 0.
    fn pair<R: Real>(self, overlap: R, distance: R, radius_i: R, radius_j: R) -> Touch<R>;

    /// A particle that overlaps a wall by δ > 0.
    fn wall<R: Real>(self, overlap: R, radius: R) -> Touch<R>;
}

/// Law of the normal force.
#[derive(Clone, Copy, Debug)]
pub(super) enum Law {
    Overlap(Overlap),
    Hertz(Hertz),
    Linear(Linear),
}

impl From<ContactLaw> for Law {
    fn from(law: ContactLaw) -> Self {
        match law {
            ContactLaw::Overlap { exponent, .. } => Self::Overlap(Overlap::new(exponent)),
            ContactLaw::Hertz { .. } => Self::Hertz(Hertz),
            ContactLaw::Linear { .. } => Self::Linear(Linear),
        }
    }
}

/// Calls a method of the law that is held.
macro_rules! of_law {
    ($law:expr, $held:ident => $call:expr) => {
        match $law {
            Law::Overlap($held) => $call,
            Law::Hertz($held) => $call,
            Law::Linear($held) => $call,
        }
    };
}

impl Normal for Law {
    fn power(self) -> f64 {
        of_law!(self, law => law.power())
    }

    fn pair_modulus<R: Real>(self, modulus_i: R, modulus_j: R) -> R {
        of_law!(self, law => law.pair_modulus(modulus_i, modulus_j))
    }

    fn pair<R: Real>(self, overlap: R, distance: R, radius_i: R, radius_j: R) -> Touch<R> {
        of_law!(self, law => law.pair(overlap, distance, radius_i, radius_j))
    }

    fn wall<R: Real>(self, overlap: R, radius: R) -> Touch<R> {
        of_law!(self, law => law.wall(overlap, radius))
    }
}

impl Law {
    /// Elastic energy of two particles over their modulus: in m³, or m² where the modulus is N/m.
    pub fn pair_energy(self, overlap: f64, radius_i: f64, radius_j: f64) -> f64 {
        match self {
            Self::Overlap(law) => law.pair_energy(overlap, radius_i, radius_j),
            Self::Hertz(_) => Hertz::pair_energy(overlap, radius_i, radius_j),
            Self::Linear(_) => 0.5 * overlap * overlap,
        }
    }

    /// Elastic energy of a particle at a wall over its modulus, likewise.
    pub fn wall_energy(self, overlap: f64, radius: f64) -> f64 {
        match self {
            Self::Overlap(law) => law.wall_energy(overlap, radius),
            Self::Hertz(_) => Hertz::wall_energy(overlap, radius),
            Self::Linear(_) => 0.5 * overlap * overlap,
        }
    }

    /// c and q of the force c E* δ^{q−1} that the law tends to at small overlap, for two particles.
    pub fn small_pair(self, radius_i: f64, radius_j: f64) -> (f64, f64) {
        self.small(reduced(radius_i, radius_j), radius_i + radius_j)
    }

    /// The same for a particle at a wall.
    pub fn small_wall(self, radius: f64) -> (f64, f64) {
        self.small(radius, radius)
    }

    fn small(self, reduced_radius: f64, length: f64) -> (f64, f64) {
        let c = match self {
            // A → 2π R* δ.
            Self::Overlap(law) => std::f64::consts::TAU * reduced_radius / math::powf(length, law.exponent()),
            Self::Hertz(_) => 4.0 / 3.0 * reduced_radius.sqrt(),
            Self::Linear(_) => 1.0,
        };
        (c, self.power())
    }
}

/// a b/(a + b) of two positive numbers: reduced mass, reduced radius, and the like.
#[inline(always)]
pub(super) fn reduced<R: Real>(a: R, b: R) -> R {
    a * b / (a + b)
}

/// A tangential law: the force on a particle whose partner slides past it.
///
/// Kernels are compiled for each law.
pub(super) trait Tangential: Copy + Send + Sync {
    /// Whether it has a force at all.
    const ACTS: bool;
    /// Whether a contact remembers a spring.
    const REMEMBERS: bool;

    /// Tangential force on i in N, where its partner's contact point slides past its own, and the spring that is left.
    ///
    /// `spring` is the contact's tangential displacement in m, which the law turns into the plane of contact and advances.
    fn force<R: Real>(self, law: &PairLaw<R>, slip: &Slip<R>, spring: Triple<R>) -> (Triple<R>, Triple<R>);
}

/// What a tangential law sees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slip<R> {
    /// Velocity of the partner's contact point past that of i, normal to n, in m/s.
    pub velocity: Triple<R>,
    /// n.
    pub normal: Triple<R>,
    /// A in m².
    pub area_m2: R,
    /// Elastic normal force, in N.
    pub elastic_n: R,
    /// Elastic and damping force together, in N; not negative.
    pub pressing_n: R,
    /// Elastic force over overlap, in N/m.
    pub secant_n_m: R,
    /// √(m* secant), in kg/s.
    pub impedance_kg_s: R,
    /// Δt in s.
    pub step_s: R,
}

/// The arms at which tangential forces turn two bodies, from their centres along the line between them, in m.
///
/// The contact point lies in the plane of the lens that the spheres share, at L_i = ½(d + (R_i² − R_j²)/d) from the centre of
/// i (Zohdi 2018, eqs. 6.52–6.57) and at d − L_i from that of j: opposite forces there have no moment together, and angular
/// momentum is kept. A sphere whose centre lies beyond the plane is turned at no arm. With `by_radius` the arms are the radii,
/// the monograph's choice (eqs. 6.11–6.15), which makes angular momentum at δ/d of what friction transfers.
#[inline(always)]
pub(super) fn pair_arms<R: Real>(by_radius: bool, distance: R, radius_i: R, radius_j: R) -> [R; 2] {
    if by_radius {
        return [radius_i, radius_j];
    }
    let zero = distance.all(0.0);
    let apart = distance.most(distance.all(SAME_PLACE_M));
    let lens = distance.all(0.5) * (distance + (radius_i - radius_j) * ((radius_i + radius_j) / apart));
    let arm = lens.most(zero).least(distance);
    [arm, distance - arm]
}

/// The arm of a particle whose centre is at the signed `distance` from a wall, likewise.
#[inline(always)]
pub(super) fn wall_arm(by_radius: bool, distance: f64, radius: f64) -> f64 {
    if by_radius { radius } else { distance }
}

/// What all contacts of a scene have in common beside their laws.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Whether spin moves the contact point.
    pub spin: bool,
    /// Whether friction's arms are the radii, the monograph's choice, and not those to the contact point.
    pub arms_by_radius: bool,
    /// Whether some pair resists rolling or torsion.
    pub rolls: bool,
    /// The monograph's bond.
    pub bond: Option<MonographBond>,
    /// q of the force ∝ δ^{q−1} that the law tends to at small overlap.
    pub power: f64,
}

/// Distance in m at and below which two particles are at the same place: its square is hardly a number any more.
pub(super) const SAME_PLACE_M: f64 = 1e-150;

/// Two bodies that touch; quantities are of the partner relative to i.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting<R> {
    /// n, from i to its partner.
    pub normal: Triple<R>,
    /// δ in m.
    pub overlap: R,
    /// Overlap δ over overlap strain E, in m.
    pub length: R,
    /// Stiffness and area, both of them the contact's own share of its patch.
    pub touch: Touch<R>,
    /// Area of the whole patch in m².
    pub patch_m2: R,
    /// Pa, or N/m for the linear law.
    pub modulus: R,
    /// m* in kg.
    pub reduced_mass: R,
    /// v_j − v_i in m/s.
    pub velocity: Triple<R>,
    /// L_i ω_i + L_j ω_j in m/s, with the arms L of [`pair_arms`].
    pub rolling: Triple<R>,
    /// ω_j − ω_i in rad/s.
    pub turning: Triple<R>,
    /// Reduced moment of inertia, in kg m².
    pub reduced_inertia: R,
    /// Tangential spring, in m.
    pub spring: Triple<R>,
    /// Δt in s.
    pub step_s: R,
    /// As [`super::rolling::stopping_share`].
    pub stopping_share: R,
    /// Δt in s of a rule that sees a contact begin and end between two of its evaluations; 0 for others.
    pub touch_s: R,
}

/// Force, moments and dissipation of one contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response<R> {
    /// Force on particle i, in N; the partner feels the opposite.
    pub force: Triple<R>,
    /// n × tangential force, in N: the moment on either particle is this times its arm.
    pub couple: Triple<R>,
    /// Moment against rolling and torsion on particle i, in N m; the partner feels the opposite.
    pub resistance: Triple<R>,
    /// The tangential spring that is left, in m.
    pub spring: Triple<R>,
    /// Power lost to normal damping, in W.
    pub damping_w: R,
    /// Power that goes into the tangential force, in W: lost to friction, or held in its spring.
    pub friction_w: R,
    /// Power lost to rolling and torsion, in W.
    pub rolling_w: R,
    /// Elastic force over overlap and reduced mass, in 1/s².
    pub rate_1_s2: R,
}

impl Surface {
    /// The contact of a particle i with a partner.
    ///
    /// Normal damping is c_cd A (v_nj − v_ni) (Zohdi 2018, eq. 6.10) plus, where a restitution is set, ζ√(2q) √(m* F/δ)
    /// times the same velocity, which gives every impact speed that restitution (Antypov & Elliott 2011 for Hertz).
    /// `rolling` is L_i ω_i + L_j ω_j: the contact points move at v ± ω × (L n), so their relative velocity is that of the
    /// centres less `rolling` × n.
    #[inline(always)]
    pub fn respond<R: Real, T: Tangential>(
        &self,
        tangential: T,
        law: &PairLaw<R>,
        meeting: &Meeting<R>,
    ) -> Response<R> {
        let Meeting { normal, touch, velocity, .. } = *meeting;
        let zero = meeting.overlap.all(0.0);
        let secant_n_m = meeting.modulus * touch.secant;
        let elastic_n = secant_n_m * meeting.overlap;
        let opening = velocity.dot(normal);
        let impedance_kg_s = if law.has_impedance {
            let whole_kg_s = (meeting.reduced_mass * secant_n_m).sqrt();
            whole_kg_s * self.touch_share(meeting, law.restitution * whole_kg_s, opening)
        } else {
            zero
        };
        let damping_n = (law.damping_n_s_m3 * touch.area_m2 + law.restitution * impedance_kg_s) * opening;
        let nothing = Triple::zero(zero);
        let mut response = Response {
            force: normal * (damping_n - elastic_n),
            couple: nothing,
            resistance: nothing,
            spring: meeting.spring,
            damping_w: damping_n * opening,
            friction_w: zero,
            rolling_w: zero,
            rate_1_s2: secant_n_m / meeting.reduced_mass,
        };
        if T::ACTS || self.bond.is_some() {
            let mut sliding = velocity - normal * opening;
            if self.spin {
                sliding = sliding - meeting.rolling.cross(normal);
            }
            let slip = Slip {
                velocity: sliding,
                normal,
                area_m2: touch.area_m2,
                elastic_n,
                pressing_n: (elastic_n - damping_n).most(zero),
                secant_n_m,
                impedance_kg_s,
                step_s: meeting.step_s,
            };
            let (mut along, spring) = tangential.force(law, &slip, meeting.spring);
            response.spring = spring;
            if let Some(bond) = &self.bond {
                let (attraction_n, shear) = bond.force(meeting.overlap / meeting.length, &slip);
                response.force += normal * attraction_n;
                along += shear;
            }
            response.force += along;
            response.couple = normal.cross(along);
            response.friction_w = along.dot(sliding);
        }
        if self.rolls {
            response.resistance = resist(law, meeting, elastic_n);
            response.rolling_w = response.resistance.dot(meeting.turning);
        }
        response
    }

    /// What share of the damping acts at an evaluation next to where a contact begins or ends; 1 at all others.
    ///
    /// Damping that gives a restitution begins and ends with a jump (linear law) or nearly so. An evaluation at an overlap of x
    /// speeds times Δt stands for a whole step, where the contact has lasted x steps before the first one, or lasts so long
    /// after the last: that made an error of first order, with a sign that hung on the phase of first touch. The weights a x up to
    /// x = 1, and from there down to 1 at x = 2, a = ½ + 2/q, give the first two evaluations together the impulse of a force that
    /// grows as the damping does, δ^{(q−2)/2}; and where touch begins they are continuous. Δt c/(2 m*) takes what the velocity
    /// predicted there does not know: that the damping c has begun to act since the evaluation before.
    #[inline(always)]
    fn touch_share<R: Real>(&self, meeting: &Meeting<R>, damping_kg_s: R, opening: R) -> R {
        let (zero, one) = (opening.all(0.0), opening.all(1.0));
        let way = opening.most(-opening) * meeting.touch_s;
        // Nothing moves, or the rule is another: the overlap is any number of ways.
        let ways = meeting.overlap / way.most(zero.all(f64::MIN_POSITIVE));
        let most = 0.5 + 2.0 / self.power;
        let share = (ways * one.all(most)).least((one.all(1.0 - most) * (ways - one) + one.all(most)).most(one));
        let unknown = (one.all(2.0) - ways).least(one).most(zero);
        let lag = damping_kg_s * share * meeting.touch_s / (meeting.reduced_mass + meeting.reduced_mass);
        share / (one + lag * unknown)
    }
}
