//! Advice on whole scenes.

use super::super::{
    advice::{Verdict, advise},
    *,
};

/// The verdict on a key, with why.
fn verdict(scene: &Scene, about: &str) -> (Verdict, String) {
    let advice = advise(scene, 0.01).unwrap();
    let found = advice.into_iter().find(|own| own.about == about);
    found.map(|own| (own.verdict, own.says)).unwrap_or_else(|| panic!("nothing about {about}"))
}

#[test]
fn surroundings_that_a_scene_has_not_are_not_kept() {
    let text = include_str!("../../../../scenes/deposition-laser.toml");
    let without = Scene::parse(text, "x.toml", &[]).unwrap();
    // What black particles would radiate is little; the bound of it is not.
    let (left_out, says) = verdict(&without, "thermal.ambient");
    assert!(left_out == Verdict::Suffices && says.starts_with("left out as it is"), "{left_out:?}: {says}");
    let set = ("thermal.ambient".to_owned(), "{ emissivity = 0.8 }".to_owned());
    let with = Scene::parse(text, "x.toml", &[set]).unwrap();
    assert_eq!(verdict(&with, "thermal.ambient").0, Verdict::Keep);
}

#[test]
fn what_light_and_sound_share_is_told_once() {
    let text = "duration = 1e-3\n[particles]\ncount = 1\nradius = 1e-5\nstart = { box = [1e-3, 1e-3, 1e-3] }\n\
        [optics]\nabsorption = 1e4\npower = 1\nprofile = { radius = 1e-4 }\n\
        path = { kind = \"sweep\", from = [0, 0, 0], to = [1e-3, 0, 0], speed = 10 }\n\
        [acoustics]\nintensity = 1\nradius = 1e-4\npath = { kind = \"sweep\", from = [0, 0, 0], to = [1e-3, 0, 0], speed = 10 }\n\
        sound-speed = 4500\n\
        [coupling]\ndt = 1e-5";
    let scene = Scene::parse(text, "x.toml", &[]).unwrap_or_else(|problems| panic!("{problems}"));
    let advice = advise(&scene, 0.01).unwrap();
    let spots = advice.iter().filter(|own| own.number == "way of the spot over its radius").count();
    assert_eq!(spots, 1);
    // A laser without anybody who takes its heat comes first.
    assert!(advice[0].verdict == Verdict::Add && advice[0].number == "readers of the heat", "{:?}", advice[0]);
}
