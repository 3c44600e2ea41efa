//! What the walk and the fuzzer found, each with the error that names its cause now: NaN and infinite energies that were booked
//! as results, starts that would have taken hours, silent solvers.

use super::run::{End, scenes};

#[test]
fn what_was_found_names_its_cause() {
    let bases = scenes("tests/extremes/scenes");
    for (scene, key, value, words) in [
        ("averaged", "walls.upper.plane.through", "[0, 0, -1e300]", "particles: the energy `elastic` is inf J"),
        ("conducting", "particles.contact.stiffness", "1e300", "particles: the energy `elastic` is inf J"),
        ("bonded", "particles.bonds.young", "5e-324", "particles: the energy `beams` is NaN J"),
        ("averaged", "materials.grain.density", "1.7e308", "thermal: the energy `heat` is NaN J"),
        (
            "current",
            "walls.source.current",
            "1e300",
            "a `potential`, a `current` or an `electrical-conductivity` is too large",
        ),
        ("motion", "particles.count", "100000", "the packing fraction asked for is 6"),
        ("settled", "particles.radius.mean", "2.5e-14", "would take more than a million steps"),
        ("settled", "particles.contact.damping", "1e14", "use softer contacts or less contact damping"),
        ("bonded", "particles.start.at", "[0, 0, 1e9]", "move the scene nearer to the origin"),
        ("bonded", "particles.start.velocity", "[1e9, 0, 0]", "the solver of `particles` did not converge: "),
        ("melting", "thermal.iterations", "1", "thermal.iterations do not reach thermal.tolerance"),
        ("motion", "coupling.iterations", "1", "`positions` did not converge in 1 iterations, row "),
    ] {
        let base = bases.iter().find(|base| base.name == scene).unwrap();
        match base.run(&vec![(key.into(), value.into())]) {
            End::Stopped { cause } => assert!(cause.contains(words), "{scene} {key} = {value}: {cause}"),
            other => panic!("{scene} {key} = {value}: {other:?}"),
        }
    }
}
