//! Share of the kinetic energy that spin can hold.

use crate::{
    common::advice::{Advice, Edit, Effect, Facts, Number, Quantity, Verdict},
    particles::settings::{Friction, Integrator, Settings},
};

/// Share of the kinetic energy of a sphere that rolls: I ω²/(m v² + I ω²) with I = 2/5 m R², ω = v/R.
const ROLLING: f64 = 2.0 / 7.0;

/// Largest coefficient of friction of any contact.
fn friction(settings: &Settings) -> f64 {
    let general = match settings.friction {
        Some(Friction::Regularised { static_coefficient, .. } | Friction::Spring { static_coefficient, .. }) => {
            static_coefficient
        }
        None => return 0.0,
    };
    let of_pairs = settings.pairs.iter().flat_map(|pair| [pair.static_coefficient, pair.dynamic_coefficient]);
    of_pairs.flatten().fold(general, f64::max)
}

/// Spin: E_rot/E_kin after an impact.
///
/// Friction turns a sphere by at most μ times the normal impulse, (1 + e) m v ≤ 2 m v, at the arm R: the share 10 μ² of
/// ½ m v², and not more than rolling holds, 2/7. What spin does to the motion is what it takes from the sliding, at most
/// 2 μ v: without spin the way v t changes by the share 2 μ.
pub static SPIN: Number = Number::of(advise);

fn advise(facts: &Facts<'_>) -> Vec<Advice> {
    let free = |settings: &&Settings| settings.integrator != Integrator::Held && settings.bonds.is_none();
    let Some(settings) = facts.tables.main::<Settings>().filter(free) else { return Vec::new() };
    let coefficient = friction(settings);
    let energy = (10.0 * coefficient * coefficient).min(ROLLING);
    let (share, way_m) = (2.0 * coefficient, facts.bodies.speed_m_s * facts.duration_s);
    let holds = matches!(settings.friction, Some(Friction::Spring { .. }));
    let verdict = match (settings.spin, share <= facts.within) {
        (true, true) => Verdict::Drop,
        (true, false) => Verdict::Keep,
        // In a die or a box there is no slope to hold.
        (false, false) if holds && !facts.bodies.room.confined => Verdict::Add,
        (false, false) => Verdict::Keep,
        (false, true) => Verdict::Suffices,
    };
    let says = match verdict {
        Verdict::Drop => "friction is too little to make particles spin",
        Verdict::Keep if settings.spin => "particles roll, and slopes depend on it",
        Verdict::Keep => {
            "left out as it is: where grains come to rest, and the slope of a heap, would be others with it"
        }
        Verdict::Add => "friction that holds a heap holds it too well where grains cannot roll",
        _ => "without spin: friction is too little for it",
    };
    let meaning = format!("largest share of the kinetic energy that spin can hold, from friction of {coefficient}");
    let mut advice = Advice::new("particles.spin", "spin energy share", energy, &meaning, verdict, says.into());
    match verdict {
        Verdict::Drop => {
            advice.effects = vec![Effect {
                quantity: Quantity::MeanPosition,
                at_most: share * way_m + facts.bodies.scatter_m(),
                share,
            }];
            advice.edits = vec![Edit::set("particles.spin", "false")];
        }
        Verdict::Add => advice.edits = vec![Edit::set("particles.spin", "true")],
        _ => {}
    }
    vec![advice]
}
