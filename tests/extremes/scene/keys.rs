//! The numbers of a scene, found by the scene format's own keys, and the values they are driven to.

use stagger_config::{Key, Kind, Range, Section, Value};
use stagger_scene::Scene;

/// The numeric keys of the format: every one that holds a number, by the path of its table and its name.
pub fn numeric() -> Vec<(&'static Section, &'static Key)> {
    let all =
        Scene::reference().tree().into_iter().flat_map(|section| section.keys.iter().map(move |key| (section, *key)));
    all.filter(|(_, key)| holds_numbers(key.kind)).collect()
}

fn holds_numbers(kind: Kind) -> bool {
    match kind {
        Kind::Number(..)
        | Kind::Whole(..)
        | Kind::Vector(_)
        | Kind::Series(..)
        | Kind::Vectors(_)
        | Kind::OverTemperature(..)
        | Kind::Numbers(..)
        | Kind::Wholes(..) => true,
        Kind::Text
        | Kind::File
        | Kind::Texts
        | Kind::Flag
        | Kind::Choice(_)
        | Kind::Table(_)
        | Kind::Named(_)
        | Kind::Scenes => false,
    }
}

/// The key behind a path such as `walls.plate.temperature`.
pub fn find(path: &str) -> Option<(&'static Section, &'static Key)> {
    let mut section = Scene::reference();
    let mut names = path.split('.');
    loop {
        let key = *section.keys.iter().find(|key| Some(key.name) == names.clone().next())?;
        names.next();
        section = match key.kind {
            Kind::Table(inner) => inner,
            Kind::Named(inner) => {
                names.next();
                inner
            }
            _ => return Some((section, key)),
        };
    }
}

/// How a page names a key.
pub fn title(section: &Section, key: &Key) -> String {
    if section.path.is_empty() { key.name.into() } else { format!("{}.{}", section.path, key.name) }
}

/// A number of a scene that can be driven.
pub struct Driven {
    pub value: Value,
    pub section: &'static Section,
    pub key: &'static Key,
}

impl Driven {
    /// The numbers in effect in a scene.
    pub fn of(scene: &Scene) -> Vec<Self> {
        let driven = |value: &Value| {
            let (section, key) = find(&value.path)?;
            holds_numbers(key.kind).then(|| Self { value: value.clone(), section, key })
        };
        scene.effective.iter().filter_map(driven).collect()
    }

    /// Values in the key's range, its ends and extremes, as an override writes them.
    pub fn allowed(&self) -> Vec<String> {
        self.values(true)
    }

    /// Values outside of it.
    pub fn refused(&self) -> Vec<String> {
        self.values(false)
    }

    fn values(&self, allowed: bool) -> Vec<String> {
        let si = &self.value.si;
        let base = si.iter().copied().find(|value| *value != 0.0).unwrap_or(1.0);
        let numbers =
            |range: Range| numbers(range, base).into_iter().filter(move |value| range.contains(*value) == allowed);
        match self.key.kind {
            Kind::Number(_, range) | Kind::Numbers(_, range) => numbers(range).map(shown).collect(),
            Kind::Whole(low, high) | Kind::Wholes(low, high) => whole(low, high, allowed),
            Kind::Vector(_) => {
                // One component, another one each time, and all.
                let one = |(axis, value): (usize, f64)| {
                    vector(std::array::from_fn(|k| if k == axis { value } else { si[k] }))
                };
                let components = (0..3).cycle().zip(numbers(Range::ANY)).map(one);
                components.chain(numbers(Range::ANY).map(|value| vector([value; 3]))).collect()
            }
            Kind::Vectors(_) => {
                let entries = si.as_chunks::<3>().0;
                let list = |entries: Vec<String>| format!("[{}]", entries.join(", "));
                let with = |value: f64| {
                    list(
                        entries
                            .iter()
                            .enumerate()
                            .map(|(k, entry)| vector(if k == 0 { [value; 3] } else { *entry }))
                            .collect(),
                    )
                };
                let mut values: Vec<String> = numbers(Range::ANY).map(with).collect();
                values.extend(allowed.then(|| "[]".to_owned()));
                values
            }
            Kind::Series(_, range) => {
                // The last of a list, and one alone.
                let with = |value: f64| {
                    let mut all: Vec<String> = si.iter().copied().map(shown).collect();
                    if let Some(last) = all.last_mut() {
                        *last = shown(value);
                    }
                    format!("[{}]", all.join(", "))
                };
                let mut values: Vec<String> = numbers(range).flat_map(|value| [shown(value), with(value)]).collect();
                values.extend(allowed.then(|| "[]".to_owned()));
                values
            }
            Kind::OverTemperature(_, range) => numbers(range)
                .flat_map(|value| [shown(value), format!("[[300, {}], [1000, {}]]", shown(base), shown(value))])
                .collect(),
            _ => Vec::new(),
        }
    }
}

/// Ends of a range, numbers just outside, and extremes: those near a scene's own value and those of binary64.
fn numbers(range: Range, base: f64) -> Vec<f64> {
    let mut values =
        vec![0.0, 0.5, 1.0, -1.0, 1e9, 1e-300, 1e300, f64::MAX, f64::from_bits(1), f64::NAN, f64::INFINITY];
    for factor in [1e-9, 1e-3, 1e3, 1e9] {
        values.push(base * factor);
    }
    for end in [range.low, range.high].into_iter().filter(|end| end.is_finite()) {
        values.extend([end, end.next_down(), end.next_up()]);
    }
    if range.low < 0.0 {
        values.extend([-1e300, -f64::MAX, -1e-300, -1e9, -base]);
    }
    let mut kept: Vec<f64> = Vec::new();
    for value in values {
        if kept.iter().all(|other| other.to_bits() != value.to_bits()) {
            kept.push(value);
        }
    }
    kept
}

fn whole(low: u64, high: u64, allowed: bool) -> Vec<String> {
    let mut values: Vec<i128> =
        vec![i128::from(low), i128::from(high), i128::from(low) + 1, i128::from(high) - 1, 5, 1000, 100_000];
    values.extend([i128::from(low) - 1, i128::from(high) + 1]);
    values.sort_unstable();
    values.dedup();
    let inside = |value: &i128| (i128::from(low)..=i128::from(high)).contains(value) == allowed;
    values.into_iter().filter(inside).map(|value| value.to_string()).collect()
}

/// A number as TOML has it.
fn shown(value: f64) -> String {
    if value.is_finite() {
        format!("{value:e}").replace('e', if value == value.trunc() && value.abs() < 10.0 { ".0e" } else { "e" })
    } else {
        value.to_string().to_lowercase()
    }
}

fn vector(components: [f64; 3]) -> String {
    format!("[{}]", components.map(shown).join(", "))
}
