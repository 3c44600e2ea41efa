//! `[presets.NAME]` and the key `preset` that chooses one.

use crate::Scene;

const SCENE: &str = "duration = 1\n[particles]\ncount = 1\nradius = 1e-5\nstart = { box = [1e-3, 1e-3, 1e-3] }\n\
    [coupling]\ndt = { start = 1e-6, limit = 2e-5 }\ntolerance = { positions = 1e-6 }\n\
    [presets.draft]\ncoupling = { iterations = 4, dt.limit = 4e-5 }\nparticles.gravity = [0, 0, 0]\n\
    [presets.fine.coupling]\ndt = 1e-7\n";

fn parse(overrides: &[(&str, &str)]) -> Result<Scene, String> {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
    Scene::parse(SCENE, "a.toml", &overrides).map_err(|problems| problems.to_string())
}

#[test]
fn a_preset_goes_over_the_scene_and_overrides_over_both() {
    let standard = parse(&[]).unwrap();
    assert_eq!((standard.coupling.dt.limit_s, standard.coupling.iterations), (2e-5, 8));
    assert_eq!(standard.presets, ["standard", "draft", "fine"]);
    let draft = parse(&[("coupling.iterations", "5"), ("preset", "draft")]).unwrap();
    assert_eq!((draft.coupling.dt.start_s, draft.coupling.dt.limit_s), (1e-6, 4e-5));
    assert_eq!((draft.coupling.iterations, draft.coupling.tolerance["positions"]), (5, 1e-6));
    assert_eq!(draft.settings::<stagger_physics::particles::Settings>().unwrap().gravity_m_s2, [0.0; 3]);
    // A value in the place of a table is what the scene would be with it.
    assert_eq!(parse(&[("preset", "fine")]).unwrap().coupling.dt.limit_s, 1e-7);
    assert_ne!(standard.hash, draft.hash);
}

#[test]
fn mistakes_in_presets_name_their_line() {
    let unknown = parse(&[("preset", "drat")]).unwrap_err();
    assert!(
        unknown.contains("--set preset: no preset is called \"drat\"\n  hint: did you mean \"draft\"?"),
        "{unknown}"
    );
    let nested = SCENE.replace("coupling = {", "preset = \"fine\"\ncoupling = {");
    let nested = Scene::parse(&nested, "a.toml", &[]).unwrap_err().to_string();
    assert!(nested.contains("a.toml:10: presets.draft.preset: a preset cannot hold or choose presets"), "{nested}");
    // What a preset sets is checked where it applies, and its line is told.
    let wrong = SCENE.replace("iterations = 4", "iterations = 0");
    assert!(Scene::parse(&wrong, "a.toml", &[]).is_ok());
    let chosen = [("preset".to_owned(), "draft".to_owned())];
    let wrong = Scene::parse(&wrong, "a.toml", &chosen).unwrap_err().to_string();
    assert!(wrong.contains("a.toml:10: coupling.iterations"), "{wrong}");
}
