//! Sound that pushes the particles (Zohdi 2018, ch. 11).

mod advice;
mod interface;
pub mod keys;
mod settings;
mod tradeoff;

use std::{collections::BTreeMap, f64::consts::PI, sync::Arc};

use nalgebra::Vector3;
use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window, math};
use stagger_messages::{Energy, Field, Fields, Measure, Port, Ports};

pub use self::{
    interface::Interface,
    settings::{Settings, SoundBeam},
};
use crate::common::{
    PARTICLES,
    beam::{Beam, Frame, Profile},
    checks::{field, positive, radii, values},
    rays::{Grid, Outcome, POINTS, SHOWN, Strike, facing, paths_m, points_m, spheres, starts, trace},
};

const NODE: &str = "acoustics";

/// Force of a beam of sound on each particle, ray by ray.
///
/// A ray of intensity I that strikes a particle pushes it along the transmitted direction with √(I (1−R) ρ_t c_t) a_r
/// (Zohdi 2018, eq. 11.7), where a_r is the N-th part of the beam's cross-section; it goes on with R I. Beyond the critical
/// angle R is 1, and the model has no push.
///
/// `acoustic_force` is the mean over the window: the share of the window in which the beam is on, exactly, times the force
/// with the geometry at the window's start and the axis at its middle. The geometry's motion within a window is so taken
/// explicitly, first order in Δt: sound is reflected as a whole by most surfaces it meets, over tens of reflections a ray's
/// way depends on the places beyond any tolerance, and no iteration converges on a force of the window's end. Where particles
/// came or went at the window's start, it is the geometry of the window's end. Nothing is traced while the beam is off.
pub struct Acoustics {
    settings: Settings,
    beam: Beam,
    frame: Frame,
    points_m: Vec<[f64; 2]>,
    force: Arc<Port>,
    paths: Arc<Port>,
}

/// What the beam does at one instant while it is on.
struct Push {
    /// Force on each particle, in N.
    forces_n: Vec<f64>,
    /// Share of the beam's power that goes into the particles.
    transmitted: f64,
    /// What becomes of the rest.
    outcome: Outcome,
    /// Where some rays go, in m.
    paths_m: Vec<f64>,
}

impl Acoustics {
    /// Checks the settings and lays out the rays.
    ///
    /// # Errors
    /// A setting is outside its range.
    pub fn new(settings: Settings) -> Result<Self, SolveError> {
        let SoundBeam { intensity_w_m2, radius_m, direction, ref path, starts_s, ends_s, pulses } = settings.beam;
        positive(NODE, "intensity", intensity_w_m2)?;
        let beam = Beam {
            power_w: intensity_w_m2 * PI * radius_m * radius_m,
            profile: Profile::TopHat { radius_m },
            direction,
            path: path.clone(),
            starts_s,
            ends_s,
            pulses,
        };
        beam.check(NODE)?;
        settings.interface.check()?;
        settings.sampling.check(NODE)?;
        Ok(Self {
            frame: Frame::new(direction),
            points_m: points_m(&beam.profile, &settings.sampling),
            force: Arc::new(Port::f64("acoustic_force", "N", PARTICLES, 3, Measure::Magnitude)),
            paths: Arc::new(Port::f64("acoustic_paths", "m", "acoustic-rays", 3 * POINTS as u32, Measure::None)),
            settings: Settings { walls: facing(&settings.walls, direction), ..settings },
            beam,
        })
    }

    /// What the beam does at one instant while it is on.
    fn push(&self, fields: &Fields, t_s: f64) -> Result<Push, SolveError> {
        let Settings { interface, sampling, walls, .. } = &self.settings;
        let radii_m = radii(NODE, fields)?;
        let positions_m = values(NODE, fields, "positions", radii_m.len(), "`radii`")?;
        let grid = Grid::new(spheres(positions_m, radii_m));
        let rays = starts(&self.frame, self.beam.spot_m(t_s), &self.points_m, &grid);
        let share = 1.0 / rays.len() as f64;
        let area_m2 = PI * math::powi(self.settings.beam.radius_m, 2) * share;
        let impedance = interface.impedance_pa_s_m();
        let surface = |strike: &Strike| {
            let reflected = interface.reflectance(strike.cosine);
            let taken = strike.power * (1.0 - reflected);
            let pressure_pa = (self.settings.beam.intensity_w_m2 * taken * impedance).sqrt();
            let along = interface.transmitted(&strike.direction, &strike.normal, strike.cosine);
            let force_n = along.map_or_else(Vector3::zeros, |along| along * (pressure_pa * area_m2));
            (reflected, (force_n, taken))
        };
        let (mut forces_n, mut transmitted) = (vec![0.0; 3 * radii_m.len()], 0.0);
        let outcome = trace(&grid, &rays, sampling.limits, walls, surface, |particle, (force_n, taken)| {
            let at = 3 * particle as usize;
            for (sum, component) in forces_n[at..at + 3].iter_mut().zip(force_n.iter()) {
                *sum += component;
            }
            transmitted += taken * share;
        });
        let paths_m = paths_m(&grid, &rays, sampling.limits, |strike| interface.reflectance(strike.cosine));
        Ok(Push { forces_n, transmitted, outcome, paths_m })
    }

    /// `forces_n` belong to the particles of `revision`.
    fn fields(
        &self,
        forces_n: Vec<f64>,
        revision: u64,
        paths_m: Option<Vec<f64>>,
        t_s: f64,
    ) -> Result<Fields, SolveError> {
        // Without sound all of them are the point on the axis.
        let paths_m = paths_m.unwrap_or_else(|| self.beam.spot_m(t_s).as_slice().repeat(SHOWN * POINTS));
        let written = [Field::new(&self.force, revision, forces_n)?, Field::new(&self.paths, 0, paths_m)?];
        Ok(written.into_iter().map(|field| (field.name().to_owned(), field)).collect())
    }
}

impl Physics for Acoustics {
    type State = ();

    fn ports(&self) -> Ports {
        crate::Settings::ports(&self.settings)
    }

    fn initial(&self) -> Result<((), Reply), SolveError> {
        let fields = self.fields(vec![0.0; 3 * self.settings.count], 0, None, 0.0)?;
        Ok(((), Reply { fields, ..Reply::default() }))
    }

    fn solve(&self, (): &(), frozen: &Frozen, window: Window) -> Result<((), Reply), SolveError> {
        let middle_s = window.t_s + 0.5 * window.dt_s;
        let mean_power_w = self.beam.mean_power_w(window);
        let radii = field(&frozen.end, "radii")?;
        let revision = radii.support.revision;
        let sound_j = mean_power_w * window.dt_s;
        let mut ledger = vec![Energy::gained("sound", sound_j)];
        let mut figures = BTreeMap::from([("rays".to_owned(), self.points_m.len() as f64)]);
        let fields = if mean_power_w > 0.0 {
            let same_rows = field(&frozen.start, "radii")?.support == radii.support;
            let push = self.push(if same_rows { &frozen.start } else { &frozen.end }, middle_s)?;
            let Push { transmitted, outcome, .. } = push;
            let lost = |name: &str, share: f64| Energy::lost(name, sound_j * share);
            ledger.extend([
                lost("transmitted", transmitted),
                lost("passed", outcome.passed),
                lost("escaped", outcome.escaped),
                lost("residual", outcome.residual),
            ]);
            figures.insert("reflections".to_owned(), outcome.strikes as f64);
            let on = mean_power_w / self.beam.power_w;
            let forces_n = push.forces_n.iter().map(|force_n| on * force_n).collect();
            self.fields(forces_n, revision, Some(push.paths_m), middle_s)?
        } else {
            self.fields(vec![0.0; 3 * radii.rows()], revision, None, middle_s)?
        };
        Ok(((), Reply { fields, ledger, figures, ..Reply::default() }))
    }
}
