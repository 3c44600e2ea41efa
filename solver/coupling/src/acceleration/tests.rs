//! The accelerators on linear problems with known solutions, and at the limits of their numbers.

// Equal bits are asked for where the same operations ran.
#![allow(clippy::float_cmp)]

use proptest::prelude::*;

use super::*;

const AITKEN: Acceleration = Acceleration::Aitken { relaxation: 0.5 };
const IQN_ILS: Acceleration = Acceleration::IqnIls { relaxation: 0.5, reused_steps: 2, columns: 6, filter: 1e-2 };
const METHODS: [Acceleration; 4] = [Acceleration::None, Acceleration::Constant { relaxation: 0.5 }, AITKEN, IQN_ILS];

fn pairs<'a>(frozen: &'a [Vec<f64>], answered: &'a [Vec<f64>]) -> Vec<Iterates<'a>> {
    frozen.iter().zip(answered).map(|(frozen, answered)| Iterates { frozen, answered }).collect()
}

/// Numbers in [−1, 1) that look random and are the same everywhere.
fn spread(seed: u64) -> impl Iterator<Item = f64> {
    let mut state = seed;
    std::iter::repeat_with(move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 30) - 1.0
    })
}

/// Two coupled fields of three and two rows, mildly nonlinear, in units `unit` apart.
fn map(x: &[Vec<f64>], unit: f64, time: f64) -> Vec<Vec<f64>> {
    let (motion, heat) = (&x[0], &x[1]);
    let first = |i: usize| 1.0 + time + 0.8 * heat[i % 2] / unit - 0.3 * motion[i] * motion[(i + 1) % 3];
    let second = |i: usize| unit * (0.5 - 1.4 * motion[i] + 0.2 * time);
    vec![(0..3).map(first).collect(), (0..2).map(second).collect()]
}

/// Steps of some iterations each, every third of them rejected; every iterate on the way.
fn history(accelerator: &mut Accelerator, unit: f64, mut between: impl FnMut(&mut Accelerator)) -> Vec<Vec<Vec<f64>>> {
    let mut iterates = Vec::new();
    let mut x = vec![vec![0.5, 0.4, 0.3], vec![0.1 * unit, 0.2 * unit]];
    for step in 0..9 {
        for _ in 0..4 {
            let answered = map(&x, unit, 0.01 * f64::from(step));
            x = accelerator.next(&pairs(&x, &answered));
            between(accelerator);
            iterates.push(x.clone());
        }
        match step % 3 {
            2 => accelerator.rejected(),
            _ => {
                let last = map(&x, unit, 0.01 * f64::from(step));
                accelerator.accepted(&pairs(&x, &last));
                x = last;
            }
        }
        between(accelerator);
    }
    iterates
}

#[test]
fn relaxation_takes_a_share_of_the_change() {
    let mut accelerator = Accelerator::new(Acceleration::Constant { relaxation: 0.25 });
    assert_eq!(accelerator.next(&pairs(&[vec![1.0, 2.0]], &[vec![5.0, 2.0]])), [[2.0, 2.0]]);
    let mut plain = Accelerator::new(Acceleration::None);
    assert_eq!(plain.next(&pairs(&[vec![1.0, 2.0]], &[vec![5.0, 0.1]])), [[5.0, 0.1]]);
}

/// For one value the factor is that of the secant through the last two residuals, which a linear map meets at once.
#[test]
fn aitkens_factor_follows_from_two_residuals_and_starts_the_next_step() {
    let step = |accelerator: &mut Accelerator, x: f64, answered: f64| {
        accelerator.next(&pairs(&[vec![x]], &[vec![answered]]))[0][0]
    };
    let mut accelerator = Accelerator::new(AITKEN);
    // x̃ = 4 − 3 x: residuals 4 and −4, ω = 1/4, all exact.
    assert_eq!(step(&mut accelerator, 0.0, 4.0), 2.0);
    assert_eq!(step(&mut accelerator, 2.0, -2.0), 1.0);
    accelerator.accepted(&pairs(&[vec![1.0]], &[vec![1.0]]));
    assert_eq!(step(&mut accelerator, 5.0, -11.0), 1.0);
    // A rejected attempt leaves the factor with which its step began.
    assert_ne!(step(&mut accelerator, 1.0, 0.5), 1.0);
    accelerator.rejected();
    assert_eq!(step(&mut accelerator, 5.0, -11.0), 1.0);
    // x̃ = 1.25 x − 0.25: ω = −4 meets the solution; the next step starts with the first one's size, in its direction.
    let mut accelerator = Accelerator::new(AITKEN);
    assert_eq!(step(&mut accelerator, 9.0, 11.0), 10.0);
    assert_eq!(step(&mut accelerator, 10.0, 12.25), 1.0);
    accelerator.accepted(&pairs(&[vec![1.0]], &[vec![1.0]]));
    assert_eq!(step(&mut accelerator, 9.0, 11.0), 8.0);
}

/// With n + 1 pairs the n differences span everything: the model of a linear map is the map.
#[test]
fn quasi_newton_solves_n_linear_equations_in_n_plus_one_iterations() {
    for n in 1..=20usize {
        for seed in 0..10 {
            let mut numbers = spread(1 + 100 * n as u64 + seed);
            // Entries up to 1: a spectral radius of up to 3, so that the plain iteration diverges.
            let matrix = DVector::from_iterator(n * n, numbers.by_ref().take(n * n))
                .reshape_generic(nalgebra::Dyn(n), nalgebra::Dyn(n));
            let constant = DVector::from_iterator(n, numbers.take(n));
            let method = Acceleration::IqnIls { relaxation: 0.5, reused_steps: 0, columns: 50, filter: 1e-14 };
            let mut accelerator = Accelerator::new(method);
            let mut x = DVector::zeros(n);
            let answer = |x: &DVector<f64>| &matrix * x + &constant;
            for _ in 0..=n {
                let answered = answer(&x);
                let fields = [Iterates { frozen: x.as_slice(), answered: answered.as_slice() }];
                x = DVector::from_vec(accelerator.next(&fields).remove(0));
            }
            let left = (answer(&x) - &x).norm() / (x.norm() + constant.norm());
            // Rounding of 1e-16, enlarged by the conditions of the equations and of the differences that model them:
            // 1e3 each and more in the worst of these two hundred.
            assert!(left < 1e-8, "n = {n}, seed {seed}: {left:e}");
        }
    }
}

#[test]
fn a_stored_accelerator_goes_on_with_the_same_bits() {
    for method in METHODS {
        let unbroken = history(&mut Accelerator::new(method), 1.0, |_| {});
        let mut stored = 0;
        let broken = history(&mut Accelerator::new(method), 1.0, |accelerator| {
            let bytes = postcard::to_stdvec(accelerator).unwrap();
            *accelerator = postcard::from_bytes(&bytes).unwrap();
            stored += 1;
        });
        assert_eq!((unbroken, stored), (broken, 45), "{method:?}");
    }
}

/// A unit of a power of two changes no mantissa, so that every iterate must be the same to the last bit.
#[test]
fn the_unit_of_a_field_does_not_matter() {
    for method in METHODS {
        let unit = 2f64.powi(-40);
        let plain = history(&mut Accelerator::new(method), 1.0, |_| {});
        let mut scaled = history(&mut Accelerator::new(method), unit, |_| {});
        for fields in &mut scaled {
            fields[1].iter_mut().for_each(|value| *value /= unit);
        }
        assert_eq!(plain, scaled, "{method:?}");
    }
}

#[test]
fn a_rejected_attempt_leaves_no_trace() {
    for method in METHODS {
        let mut accelerator = Accelerator::new(method);
        history(&mut accelerator, 1.0, |_| {});
        let mut untouched = accelerator.clone();
        for (x, answered) in [(0.1, 0.7), (0.3, -0.4), (0.2, 0.9)] {
            accelerator.next(&pairs(&[vec![x; 3], vec![x; 2]], &[vec![answered; 3], vec![answered * x; 2]]));
        }
        accelerator.rejected();
        assert_eq!(history(&mut accelerator, 1.0, |_| {}), history(&mut untouched, 1.0, |_| {}), "{method:?}");
    }
}

#[test]
fn accepted_steps_teach_the_next_one() {
    let mut accelerator = Accelerator::new(IQN_ILS);
    let solve = |accelerator: &mut Accelerator, time: f64| {
        let mut x = vec![vec![0.5; 3], vec![0.2; 2]];
        for iteration in 1..50 {
            let answered = map(&x, 1.0, time);
            let residual = Pair::new(&pairs(&x, &answered)).residual.norm();
            if residual < 1e-10 {
                accelerator.accepted(&pairs(&x, &answered));
                return iteration;
            }
            x = accelerator.next(&pairs(&x, &answered));
        }
        50
    };
    let counts: Vec<u32> = (0..4).map(|step| solve(&mut accelerator, 0.01 * f64::from(step))).collect();
    assert!(counts[0] < 15 && counts[1..].iter().all(|count| *count + 2 <= counts[0]), "{counts:?}");
    let Rule::IqnIls(rule) = &accelerator.rule else { panic!("{:?}", accelerator.rule) };
    // As the settings say.
    assert!(rule.columns_of_steps().len() <= 2, "{:?}", rule.columns_of_steps());
    assert!((1..=6).contains(&rule.columns_of_steps().iter().sum::<usize>()), "{:?}", rule.columns_of_steps());
}

#[test]
fn particles_that_come_or_go_make_it_forget() {
    for method in METHODS {
        let mut accelerator = Accelerator::new(method);
        history(&mut accelerator, 1.0, |_| {});
        // Frozen before a particle went, answered after.
        let grown = accelerator.next(&pairs(&[vec![1.0; 3], vec![1.0; 2]], &[vec![2.0; 2], vec![2.0; 2]]));
        assert_eq!(grown, [[2.0; 2], [2.0; 2]]);
        accelerator.accepted(&pairs(&[vec![1.0; 3], vec![1.0; 2]], &[vec![2.0; 2], vec![2.0; 2]]));
        let now = (vec![vec![1.0, 2.0], vec![3.0, 4.0]], vec![vec![2.0, 2.0], vec![2.0, 2.0]]);
        let fresh = Accelerator::new(method).next(&pairs(&now.0, &now.1));
        assert_eq!(accelerator.next(&pairs(&now.0, &now.1)), fresh, "{method:?}");
    }
}

proptest! {
    #[test]
    fn whatever_the_iterates_the_next_is_finite(
        method in prop::sample::select(METHODS.to_vec()),
        steps in prop::collection::vec(
            (prop::collection::vec(any::<f64>().prop_filter("finite", |value| value.is_finite()), 8), 0..5u8, 1..4usize),
            1..20,
        ),
    ) {
        let mut accelerator = Accelerator::new(method);
        for (values, end, length) in steps {
            let (frozen, answered) = values.split_at(4);
            let split = |values: &[f64]| vec![values[..length].to_vec(), values[length..].to_vec()];
            let (frozen, answered) = (split(frozen), split(answered));
            let next = accelerator.next(&pairs(&frozen, &answered));
            prop_assert!(next.iter().flatten().all(|value| value.is_finite()));
            match end {
                0 => accelerator.rejected(),
                1 => accelerator.accepted(&pairs(&frozen, &answered)),
                _ => {}
            }
        }
    }
}
