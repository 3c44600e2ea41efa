//! The particles of a small scene, window by window, as a run takes them.

use stagger_coupling::{Frozen, Physics as _, Reply, Window};
use stagger_physics::particles::Particles;
use stagger_scene::Scene;

/// Times in a row that a window may be asked for again, shorter.
const CUTS: u32 = 60;

/// Solves the particles of `scene`, whose files are `files`, in windows of its `coupling.dt` up to its duration, and shows `look`
/// every reply. A window that does not converge is cut, as the coordinator does.
pub fn follow(scene: &str, files: &[(&str, &str)], sets: &[(&str, &str)], mut look: impl FnMut(f64, &Reply)) -> Reply {
    let read = |path: &str| {
        let file = files.iter().find(|(name, _)| *name == path);
        file.map(|(_, contents)| contents.as_bytes().to_vec()).ok_or_else(|| "no such file".into())
    };
    let sets: Vec<_> = sets.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
    let scene =
        Scene::parse_with_files(scene, "scene.toml", &sets, &read).unwrap_or_else(|problems| panic!("{problems}"));
    let particles = Particles::new(scene.settings::<stagger_physics::particles::Settings>().unwrap().clone()).unwrap();
    let (mut state, mut reply) = particles.initial().unwrap();
    let longest_s = scene.coupling.dt.limit_s;
    let (mut t_s, mut dt_s, mut cuts) = (0.0, longest_s, 0);
    while t_s < scene.duration_s * (1.0 - 1e-9) {
        let window = Window { t_s, dt_s: dt_s.min(scene.duration_s - t_s) };
        let (next, said) = particles.solve(&state, &Frozen::default(), window).unwrap();
        if let Some(reason) = said.not_converged {
            cuts += 1;
            assert!(cuts < CUTS, "{}: {} s", reason.reason, window.dt_s);
            dt_s = window.dt_s * reason.step_factor;
            continue;
        }
        (state, reply) = (next, said);
        t_s += window.dt_s;
        (dt_s, cuts) = (longest_s, 0);
        look(t_s, &reply);
    }
    reply
}

/// The vectors of a field, row by row.
pub fn vectors<'a>(reply: &'a Reply, name: &str) -> &'a [[f64; 3]] {
    reply.fields[name].f64().unwrap().as_chunks::<3>().0
}

/// Length of a vector.
pub fn norm(vector: &[f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// A rectangle of two triangles as ASCII STL, by its corners in their order around it.
pub fn rectangle(corners: [[f64; 3]; 4]) -> String {
    let facet = |indices: [usize; 3]| {
        let vertices: String = indices
            .map(|index| {
                let [x, y, z] = corners[index];
                format!("vertex {x:e} {y:e} {z:e}\n")
            })
            .concat();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    format!("solid\n{}{}endsolid\n", facet([0, 1, 2]), facet([0, 2, 3]))
}
