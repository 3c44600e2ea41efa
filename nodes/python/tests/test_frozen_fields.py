"""What a node freezes, and what it forgets: `solver/coupling/src/frozen_fields_tests.rs` in Python."""

import unittest

import numpy as np

from stagger import Port, Revised
from stagger.fields import Field, Malformed, Received
from stagger.frozen_fields import COORDINATOR, FrozenFields, resting, window_of
from stagger.messages import INITIAL, Directive, Envelope, Version

V = Version
PORT = Port("w", "K", "points", measure="magnitude")


def source(writer, same_iteration, **more):
    node = Directive().plan.nodes.add()
    given = {"field": "w", "writer": writer, "same_iteration": same_iteration, "interpolate": True, **more}
    return node.sources.add(**given)


def put(frozen_fields, sender, version, value=None, same_as=None, port=PORT, revision=0):
    envelope = Envelope(sender=sender)
    version.write(envelope.version)
    field = None
    if value is not None:
        field = Field.new(port, Revised(np.array([value], np.uint32 if port.kind == "u32" else float), revision))
    frozen_fields.store(Received(envelope, "w", field, same_as))


def part(node, committed, **more):
    found = Directive().iterate.parts.add(node=node, **more)
    committed.write(found.committed)
    return found


def iterate(committed, *parts):
    message = Directive().iterate
    committed.write(message.committed)
    message.parts.extend(parts)
    return message


def values(frozen):
    return frozen and (frozen.start["w"].values[0], frozen.end["w"].values[0])


def begun(*sources):
    """Fields that holds 0.0 of each writer at the start."""
    frozen_fields = FrozenFields(sources)
    for one in sources:
        put(frozen_fields, one.writer, INITIAL, 0.0)
    assert frozen_fields.begin()
    return frozen_fields


class FrozenFieldsTest(unittest.TestCase):
    def test_a_start_waits_for_every_source(self):
        frozen_fields = FrozenFields([source("a", True), source("b", True)])
        put(frozen_fields, "a", INITIAL, 0.0)
        self.assertFalse(frozen_fields.begin())
        put(frozen_fields, "b", INITIAL, same_as=V(9, 9, 9))
        self.assertFalse(frozen_fields.begin())
        put(frozen_fields, "b", INITIAL, 0.0)
        self.assertTrue(frozen_fields.begin())

    def test_a_trial_waits_for_the_start_of_its_window_too(self):
        frozen_fields = FrozenFields([source("a", True)])
        put(frozen_fields, "a", V(1, 1, 1), 1.0)
        self.assertIsNone(frozen_fields.freeze(V(1, 1, 1), iterate(INITIAL)))

    def test_a_reference_finds_its_values_and_a_broken_one_stays_missing(self):
        frozen_fields = begun(source("a", True))
        put(frozen_fields, "a", V(1, 1, 1), 300.0)
        put(frozen_fields, "a", V(2, 1, 1), same_as=V(1, 1, 1))
        frozen_fields.accepted(V(2, 1, 1))
        put(frozen_fields, "a", V(3, 1, 1), same_as=V(2, 1, 1))
        put(frozen_fields, "a", V(5, 1, 1), same_as=V(4, 1, 1))
        self.assertEqual(list(frozen_fields.get("a", "w", V(3, 1, 1)).values), [300.0])
        self.assertIsNone(frozen_fields.get("a", "w", V(5, 1, 1)))

    def test_the_iterate_before_is_the_writers_or_the_coordinators_where_it_is_accelerated(self):
        for accelerated, expected in ((False, 1.0), (True, 9.0)):
            frozen_fields = begun(source("a", False, accelerated=accelerated))
            asked = iterate(INITIAL)
            self.assertEqual(values(frozen_fields.freeze(V(1, 1, 1), asked)), (0.0, 0.0))
            put(frozen_fields, "a", V(1, 1, 1), 1.0)
            self.assertEqual(frozen_fields.reads(COORDINATOR, "w"), accelerated)
            self.assertFalse(frozen_fields.reads("a", "v") or frozen_fields.reads("b", "w"))
            put(frozen_fields, COORDINATOR, V(1, 1, 1), 9.0)
            self.assertEqual(values(frozen_fields.freeze(V(1, 1, 2), asked)), (0.0, expected))
            self.assertEqual([sender for sender, _, _ in frozen_fields.older_than(V(1, 1, 1))], ["a"])

    def test_the_first_iterate_is_what_the_writer_committed_by_its_own_clock_or_the_runs(self):
        frozen_fields = begun(source("a", False))
        put(frozen_fields, "a", V(1, 1, 1), 1.0)
        self.assertEqual(values(frozen_fields.freeze(V(2, 1, 1), iterate(V(1, 1, 1)))), (0.0, 1.0))
        asked = iterate(V(1, 1, 1), part("a", INITIAL))
        self.assertEqual(values(frozen_fields.freeze(V(2, 1, 1), asked)), (0.0, 0.0))

    def test_a_field_held_over_the_window_is_the_same_at_its_start(self):
        frozen_fields = begun(source("a", True, interpolate=False))
        put(frozen_fields, "a", V(1, 1, 1), 1.0)
        self.assertEqual(values(frozen_fields.freeze(V(1, 1, 1), iterate(INITIAL))), (1.0, 1.0))

    def test_a_slow_node_freezes_the_start_of_its_own_window_and_a_fast_one_what_a_resting_node_holds(self):
        slow, fast = begun(source("fast", True)), begun(source("slow", False))
        # Step 1: the slow node rests.
        one = iterate(INITIAL, part("slow", INITIAL, rests=True))
        self.assertEqual(values(fast.freeze(V(1, 1, 1), one)), (0.0, 0.0))
        put(slow, "fast", V(1, 1, 1), 1.0)
        fast.commit()
        fast.accepted(V(1, 1, 1))
        slow.accepted(V(1, 1, 1))
        # Step 2: it solves the window from the start of step 1.
        two = iterate(V(1, 1, 1), part("slow", INITIAL))
        put(slow, "fast", V(2, 1, 1), 2.0)
        self.assertEqual(values(slow.freeze(V(2, 1, 1), two)), (0.0, 2.0))
        self.assertEqual(values(fast.freeze(V(2, 1, 1), two)), (0.0, 0.0))
        # What only this node still holds is part of its snapshot.
        ((sender, at, field),) = slow.older_than(V(1, 1, 1))
        self.assertEqual((sender, at, list(field.values)), ("fast", INITIAL, [0.0]))
        slow.commit()
        slow.accepted(V(2, 1, 1))
        put(slow, "fast", V(3, 1, 1), 3.0)
        self.assertEqual(slow.older_than(V(2, 1, 1)), [])

    def test_the_start_is_what_was_committed_however_a_reading_turn_names_what_rests(self):
        frozen_fields = begun(source("a", False))
        put(frozen_fields, "a", V(1, 1, 1), 1.0)
        put(frozen_fields, "a", V(1, 1, 2), 2.0)
        # The others have converged at iteration 2 and rest there.
        turn = iterate(INITIAL, part("a", V(1, 1, 2), rests=True))
        self.assertEqual(values(frozen_fields.freeze(V(1, 1, 2), turn)), (0.0, 2.0))
        frozen_fields.commit()
        put(frozen_fields, "a", V(2, 1, 1), 3.0)
        turn = iterate(V(1, 1, 2), part("a", V(2, 1, 1), rests=True))
        self.assertEqual(values(frozen_fields.freeze(V(2, 1, 1), turn)), (2.0, 3.0))

    def test_fields_of_several_writers_add_up_on_equal_supports_only(self):
        # Told in any order, summed in that of their names: 1e16 − 1e16 + 1 is not 1e16 + 1 − 1e16.
        frozen_fields = begun(source("c", True), source("b", True), source("a", True))
        asked = iterate(INITIAL)
        put(frozen_fields, "c", V(1, 1, 1), 1.0)
        put(frozen_fields, "a", V(1, 1, 1), 1e16)
        self.assertIsNone(frozen_fields.freeze(V(1, 1, 1), asked))
        put(frozen_fields, "b", V(1, 1, 1), -1e16)
        self.assertEqual(values(frozen_fields.freeze(V(1, 1, 1), asked)), (0.0, 1.0))
        put(frozen_fields, "b", V(1, 1, 1), 2.0, revision=1)
        with self.assertRaisesRegex(Malformed, r"`w` is to be added up .* and another is f64 on 1 rows .*revision 1"):
            frozen_fields.freeze(V(1, 1, 1), asked)
        for writer in "abc":
            put(frozen_fields, writer, V(1, 1, 1), 2, port=Port("w", "K", "points", kind="u32"))
        with self.assertRaisesRegex(Malformed, "added up over its writers, but one is u32"):
            frozen_fields.freeze(V(1, 1, 1), asked)

    def test_a_dropped_attempt_leaves_what_was_committed(self):
        frozen_fields = begun(source("a", True))
        put(frozen_fields, "a", V(1, 1, 1), 1.0)
        put(frozen_fields, "a", V(1, 2, 1), 2.0)
        frozen_fields.rejected(V(1, 1, 3))
        self.assertIsNone(frozen_fields.get("a", "w", V(1, 1, 1)))
        self.assertIsNotNone(frozen_fields.get("a", "w", INITIAL))
        self.assertIsNotNone(frozen_fields.get("a", "w", V(1, 2, 1)))

    def test_what_nobody_can_ask_for_is_forgotten(self):
        frozen_fields = begun(source("a", True))
        for step in (1, 2, 3, 4):
            put(frozen_fields, "a", V(step, 1, 1), float(step))
        frozen_fields.accepted(V(3, 1, 1))
        held = [step for step in range(5) if frozen_fields.get("a", "w", V(step, 1, 1) if step else INITIAL)]
        # The start of this node's window, the newest accepted, and what is to come.
        self.assertEqual(held, [0, 3, 4])

    def test_a_slower_node_goes_on_from_the_older_of_two_versions(self):
        frozen_fields = FrozenFields([source("a", True)])
        put(frozen_fields, "a", V(2, 1, 1), 2.0)
        put(frozen_fields, "a", V(1, 1, 1), 1.0)
        self.assertTrue(frozen_fields.begin())
        put(frozen_fields, "a", V(3, 1, 1), 3.0)
        self.assertEqual(values(frozen_fields.freeze(V(3, 1, 1), iterate(V(2, 1, 1)))), (1.0, 3.0))

    def test_clocks(self):
        envelope = Envelope(t_s=3.0, dt_s=1.0)
        slow = part("slow", V(1, 1, 1), t_s=1.0, dt_s=3.0, rests=True)
        self.assertEqual(window_of("slow", envelope, iterate(INITIAL, slow)), (1.0, 3.0))
        self.assertEqual(window_of("fast", envelope, iterate(INITIAL, slow)), (3.0, 1.0))
        self.assertEqual(resting("slow", iterate(INITIAL, slow)), V(1, 1, 1))
        self.assertIsNone(resting("slow", iterate(INITIAL, part("slow", INITIAL))))
        self.assertIsNone(resting("fast", iterate(INITIAL, slow)))


if __name__ == "__main__":
    unittest.main()
