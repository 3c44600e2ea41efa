//! Several numbers of a scene at once, anywhere in their ranges: those of the extremes' scenes, and of the scenes users start
//! from. What fails is shrunk to the fewest numbers. `STAGGER_CASES` sets how many are tried, and others each time.

use std::sync::LazyLock;

use proptest::{
    collection::vec,
    prelude::*,
    sample::Index,
    test_runner::{Config, RngAlgorithm, TestRng, TestRunner},
};

use super::{
    keys::Driven,
    run::{Base, Sets, scenes},
    verdict::judge,
};

/// Cases in the gate.
const CASES: u32 = 400;

/// A scene with the numbers that can be driven in it: their paths and values.
struct Space {
    base: Base,
    /// What makes a scene for users small enough.
    small: Sets,
    numbers: Vec<(String, Vec<String>)>,
}

static SPACES: LazyLock<Vec<Space>> = LazyLock::new(|| {
    let own = scenes("tests/extremes/scenes").into_iter().filter(|base| base.name != "settled");
    let own = own.map(|base| space(base, Sets::new()));
    let shipped = scenes("scenes").into_iter().map(|base| {
        let fewer = |count: &str| vec![("particles.count".to_owned(), count.to_owned())];
        let small = match base.name.as_str() {
            "acoustic-pulse" => [fewer("12"), vec![("acoustics.rays.count".into(), "200".into())]].concat(),
            "pile" => Sets::new(),
            "plate-track" => vec![("grids.plate.cell".to_owned(), "40e-6".to_owned())],
            // Settling takes minutes where damping or stiffness ask for a million substeps in each of its many steps.
            "laser-rays" => {
                let region = "{ box = [\"0.2 mm\", \"0.2 mm\", \"0.2 mm\"] }";
                [fewer("12"), vec![("particles.start".into(), region.into())]].concat()
            }
            "electric-deposition" => [fewer("10"), vec![("particles.groups.coarse.count".into(), "3".into())]].concat(),
            "mixed-powder" => [fewer("20"), vec![("particles.groups.coarse.count".into(), "5".into())]].concat(),
            _ => fewer("12"),
        };
        space(base, small)
    });
    own.chain(shipped).collect()
});

fn space(base: Base, small: Sets) -> Space {
    let scene = base.parse(&small).unwrap_or_else(|problems| panic!("{problems}"));
    let driven = Driven::of(&scene).into_iter();
    // A number that the short form stands for is no key of its own that could be set.
    let numbers = driven.map(|driven| (driven.value.path.clone(), driven.allowed()));
    let settable = |(path, values): &(String, Vec<String>)| {
        let set = vec![(path.clone(), values[0].clone())];
        base.parse(&set).err().is_none_or(|problems| !problems.to_string().contains("is a plain value in the scene"))
    };
    let numbers = numbers.filter(settable).collect();
    Space { base, small, numbers }
}

#[test]
fn numbers_together_end_well_or_say_why() {
    let asked = std::env::var("STAGGER_CASES").ok().and_then(|text| text.parse().ok());
    let cases = asked.unwrap_or(CASES);
    let config = Config { cases, failure_persistence: None, max_shrink_iters: 200, ..Config::default() };
    let driven = (any::<Index>(), vec((any::<Index>(), any::<Index>()), 2..7));
    // The gate tries the same cases each time; who asks for a number of them tries others each time.
    let mut runner = match asked {
        Some(_) => TestRunner::new(config),
        None => TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha)),
    };
    runner
        .run(&driven, |(scene, driven)| {
            let space = scene.get(&SPACES);
            let mut sets = space.small.clone();
            for (number, value) in &driven {
                let (path, values) = number.get(&space.numbers);
                sets.push((path.clone(), value.get(values).clone()));
            }
            judge(&space.base, &sets).map_err(|what| {
                let sets: Vec<String> = sets.iter().map(|(path, value)| format!("--set '{path}={value}'")).collect();
                TestCaseError::fail(format!("{} {}: {what}", space.base.name, sets.join(" ")))
            })?;
            Ok(())
        })
        .unwrap_or_else(|error| panic!("{error}"));
}
