use super::{Vec3, contact::Meeting, pair_table::PairLaw};

/// Moment in N m on particle i against rolling and torsion: μ a ‖Ψ^n‖ against the relative rolling (Zohdi 2018, eq. 6.18),
/// and the same with its own coefficient against the relative spin about n; a is the contact radius.
///
/// Neither is larger than what would stop the relative motion within the step: a rolling that has come to rest stays so.
#[inline]
pub(super) fn resist(law: &PairLaw, meeting: &Meeting, elastic_n: f64, step_s: f64) -> Vec3 {
    let lever_n_m = (meeting.touch.area_m2 / std::f64::consts::PI).sqrt() * elastic_n;
    let twisting = meeting.normal * meeting.turning.dot(&meeting.normal);
    let against = |turning: &Vec3, coefficient: f64| {
        let speed = turning.norm();
        if speed <= 0.0 || coefficient <= 0.0 {
            return Vec3::zeros();
        }
        let stopping_n_m = if step_s > 0.0 { meeting.reduced_inertia * speed / step_s } else { 0.0 };
        turning * ((coefficient * lever_n_m).min(stopping_n_m) / speed)
    };
    against(&(meeting.turning - twisting), law.rolling) + against(&twisting, law.torsion)
}
