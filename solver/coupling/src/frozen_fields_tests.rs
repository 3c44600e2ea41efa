//! What a node freezes, and what it forgets.

use super::*;
use stagger_messages::{Measure, Part};

fn source(writer: &str, same_iteration: bool) -> Source {
    Source {
        field: "w".into(),
        writer: writer.into(),
        same_iteration,
        interpolate: true,
        measure: Measure::Magnitude.into(),
        ..Source::default()
    }
}

fn field(value: f64) -> Field {
    let port = Arc::new(Port::f64("w", "K", "points", 1, Measure::Magnitude));
    Field::new(&port, 0, vec![value]).unwrap()
}

const fn version(step: u64, attempt: u32, iteration: u32) -> Version {
    Version { step, attempt, iteration }
}

fn iterate(committed: Version, parts: Vec<Part>) -> Iterate {
    Iterate { committed: Some(committed), again: false, parts }
}

fn values(frozen: Option<Frozen>) -> Option<(f64, f64)> {
    frozen.map(|frozen| (frozen.start["w"].f64().unwrap()[0], frozen.end["w"].f64().unwrap()[0]))
}

/// Fields that holds 0.0 of each writer at the start.
fn begun(sources: Vec<Source>) -> FrozenFields {
    let mut frozen_fields = FrozenFields::new(sources.clone());
    for source in sources {
        frozen_fields.insert(&source.writer, Version::INITIAL, field(0.0));
    }
    assert!(frozen_fields.begin());
    frozen_fields
}

#[test]
fn a_reference_finds_its_values_and_a_broken_one_stays_missing() {
    let mut frozen_fields = begun(vec![source("a", true)]);
    frozen_fields.insert("a", Version::first(1), field(300.0));
    frozen_fields.refer("a", "w", Version::first(2), Version::first(1));
    frozen_fields.accepted(Version::first(2));
    frozen_fields.refer("a", "w", Version::first(3), Version::first(2));
    frozen_fields.refer("a", "w", Version::first(5), Version::first(4));
    assert_eq!(frozen_fields.get("a", "w", Version::first(3)).unwrap().f64().unwrap(), [300.0]);
    assert!(frozen_fields.get("a", "w", Version::first(5)).is_none());
}

#[test]
fn the_iterate_before_is_the_writers_or_the_coordinators_where_it_is_accelerated() {
    for (accelerated, expected) in [(false, 1.0), (true, 9.0)] {
        let mut frozen_fields = begun(vec![Source { accelerated, ..source("a", false) }]);
        let iterate = iterate(Version::INITIAL, Vec::new());
        assert_eq!(values(frozen_fields.freeze(version(1, 1, 1), &iterate).unwrap()), Some((0.0, 0.0)));
        frozen_fields.insert("a", version(1, 1, 1), field(1.0));
        assert_eq!(frozen_fields.reads(COORDINATOR, "w"), accelerated);
        frozen_fields.insert(COORDINATOR, version(1, 1, 1), field(9.0));
        assert_eq!(values(frozen_fields.freeze(version(1, 1, 2), &iterate).unwrap()), Some((0.0, expected)));
    }
}

#[test]
fn a_slow_node_freezes_the_start_of_its_own_window_and_a_fast_one_what_a_resting_node_holds() {
    let mut slow = begun(vec![source("fast", true)]);
    let mut fast = begun(vec![source("slow", false)]);
    // Step 1: the slow node rests.
    let rests = Part { node: "slow".into(), rests: true, committed: Some(Version::INITIAL), ..Part::default() };
    let one = iterate(Version::INITIAL, vec![rests]);
    assert_eq!(values(fast.freeze(version(1, 1, 1), &one).unwrap()), Some((0.0, 0.0)));
    slow.insert("fast", version(1, 1, 1), field(1.0));
    fast.commit();
    fast.accepted(version(1, 1, 1));
    slow.accepted(version(1, 1, 1));
    // Step 2: it solves the window from the start of step 1.
    let part = Part { node: "slow".into(), committed: Some(Version::INITIAL), ..Part::default() };
    let two = iterate(version(1, 1, 1), vec![part]);
    slow.insert("fast", version(2, 1, 1), field(2.0));
    assert_eq!(values(slow.freeze(version(2, 1, 1), &two).unwrap()), Some((0.0, 2.0)));
    assert_eq!(values(fast.freeze(version(2, 1, 1), &two).unwrap()), Some((0.0, 0.0)));
    // What only this node still holds is part of its snapshot.
    assert_eq!(slow.older_than(version(1, 1, 1)).len(), 1);
    slow.commit();
    slow.accepted(version(2, 1, 1));
    assert!(slow.older_than(version(2, 1, 1)).is_empty());
}

#[test]
fn fields_of_several_writers_add_up_on_equal_supports_only() {
    let mut frozen_fields = begun(vec![source("a", true), source("b", true)]);
    let iterate = iterate(Version::INITIAL, Vec::new());
    frozen_fields.insert("a", version(1, 1, 1), field(1.0));
    assert_eq!(values(frozen_fields.freeze(version(1, 1, 1), &iterate).unwrap()), None);
    frozen_fields.insert("b", version(1, 1, 1), field(2.0));
    assert_eq!(values(frozen_fields.freeze(version(1, 1, 1), &iterate).unwrap()), Some((0.0, 3.0)));
    let mut other = field(2.0);
    other.support.revision = 1;
    frozen_fields.insert("b", version(1, 1, 1), other);
    assert!(frozen_fields.freeze(version(1, 1, 1), &iterate).unwrap_err().to_string().contains("added up"));
}

#[test]
fn a_dropped_attempt_leaves_what_was_committed() {
    let mut frozen_fields = begun(vec![source("a", true)]);
    frozen_fields.insert("a", version(1, 1, 1), field(1.0));
    frozen_fields.rejected(version(1, 1, 1));
    assert!(frozen_fields.get("a", "w", version(1, 1, 1)).is_none());
    assert!(frozen_fields.get("a", "w", Version::INITIAL).is_some());
}
