"""Fields as bytes, and how far they move."""

import unittest

import numpy as np

from stagger import Global, Grid, Pairs, Points, Port, Revised
from stagger.convergence import change, relative
from stagger.fields import Field, Malformed, receive, receive_message
from stagger.messages import CENTRING, INITIAL, Envelope, FieldMessage, Manifest

PAIRS = Port("pairs", "1", "contacts", components=2, kind="u32")


def envelope():
    message = Envelope(run="r", sender="n")
    INITIAL.write(message.version)
    return message


class Fields(unittest.TestCase):
    def test_wire_and_message_hold_the_same_values_bit_for_bit(self):
        values = np.array([300.0, 5e-324, -0.0, 1e300])
        # 300 rows: their length takes more than one byte.
        for port, array in (
            (Port("t", "K", "p"), values),
            (PAIRS, np.arange(600, dtype=np.uint32).reshape(-1, 2)),
            (Port("f", "1", "p", kind="u8"), np.zeros(0, np.uint8)),
        ):
            field = Field.new(port, Revised(array, 4))
            wire = receive(FieldMessage.FromString(field.header(envelope())), field.raw)
            record = receive_message(field.message(envelope()))
            for other in (wire.field, record.field):
                self.assertTrue(field.same(other) and other.revision == 4)

    def test_a_payload_that_does_not_fill_its_rows_is_refused(self):
        field = Field.new(PAIRS, np.zeros((3, 2), np.uint32))
        header = FieldMessage.FromString(field.header(envelope()))
        with self.assertRaisesRegex(Malformed, "23 bytes do not fill 3 rows"):
            receive(header, field.raw[:-1])
        header.port.kind = 9
        with self.assertRaisesRegex(Malformed, "no known shape"):
            receive(header, field.raw)

    def test_a_port_that_cannot_be_is_told(self):
        for wrong in ({"kind": "f32"}, {"measure": "size"}, {"components": 0}):
            with self.assertRaisesRegex(ValueError, "port `t`"):
                Port("t", "K", "particles", **wrong)

    def test_arrays_received_cannot_be_changed(self):
        field = Field.new(Port("t", "K", "p"), np.zeros(3))
        with self.assertRaises(ValueError):
            field.values[0] = 1.0

    def test_the_hash_is_that_of_the_rust_nodes(self):
        # xxh3 of no bytes, as the algorithm's authors publish it.
        self.assertEqual(Field.new(Port("t", "K", "p"), np.zeros(0)).summary().hash, 0x2D06800538D394C2)


class Supports(unittest.TestCase):
    def test_a_manifest_says_what_the_rows_are(self):
        ports = Manifest().ports
        shapes = {
            "cells": Grid((0.0, 0.5, 1.0), (0.1, 0.2, 0.3), (4, 3, 2)),
            "marks": Points("places", "sizes"),
            "springs": Pairs("ends", "marks", "walls"),
            "whole": Global(),
        }
        for name, shape in shapes.items():
            shape.write(ports.supports.add(support=name))
        found = {support.support: support for support in ports.FromString(ports.SerializeToString()).supports}
        kinds = {name: support.WhichOneof("shape") for name, support in found.items()}
        self.assertEqual(kinds, {"cells": "grid", "marks": "points", "springs": "pairs", "whole": "global"})
        grid = found["cells"].grid
        self.assertEqual((list(grid.origin_m), list(grid.spacing_m)), ([0.0, 0.5, 1.0], [0.1, 0.2, 0.3]))
        self.assertEqual((list(grid.dims), grid.centring), ([4, 3, 2], CENTRING["CELL"]))
        self.assertEqual((found["marks"].points.positions, found["marks"].points.radii), ("places", "sizes"))
        pairs = found["springs"].pairs
        self.assertEqual((pairs.indices, pairs.of, pairs.others), ("ends", "marks", "walls"))
        self.assertEqual(shapes["cells"].rows, 24)

    def test_a_grid_that_cannot_be_is_told(self):
        sound = {"origin_m": (0, 0, 0), "spacing_m": (1, 1, 1), "dims": (1, 1, 1)}
        for wrong in (
            {"origin_m": (0, 0)},
            {"origin_m": (0, 0, np.inf)},
            {"spacing_m": (1, 0, 1)},
            {"dims": (1, 1, 0)},
            {"centring": "face"},
        ):
            with self.assertRaises(ValueError):
                Grid(**{**sound, **wrong})


class Changes(unittest.TestCase):
    def field(self, measure, values):
        array = np.array(values, float)
        return Field.new(Port("w", "m", "p", array.shape[1] if array.ndim > 1 else 1, measure=measure), array)

    def test_rows_are_measured_by_their_euclidean_norm(self):
        for measure, error in (("increment", 6.0), ("magnitude", 1.0)):
            new = self.field(measure, [[0.0, 1.0], [3.0, 4.0]])
            old = self.field(measure, [[0.0, 0.0], [0.0, 0.0]])
            start = self.field(measure, [[0.0, 0.0], [3.0, 4.0]])
            sums = change(new, old, start)
            # Exact: the norms are 1 and 5.
            self.assertEqual((sums.change, sums.increment + sums.magnitude, sums.worst_row), (6.0, 6.0 / error, 1))
            self.assertEqual(relative(sums, measure), error)

    def test_a_field_at_rest_has_converged_and_one_that_came_back_has_not(self):
        one, two = self.field("increment", [1.0]), self.field("increment", [2.0])
        self.assertEqual(relative(change(one, one, one), "increment"), 0.0)
        self.assertEqual(relative(change(one, two, one), "increment"), np.inf)

    def test_from_other_rows_all_has_changed_and_from_the_own_ones_only_what_moved(self):
        for measure in ("magnitude", "increment"):
            port = Port("w", "m", "p", measure=measure)
            committed = Field.new(port, [3.0, 4.0])
            # One fewer; and one gone for one that came.
            for values in ([3.0], [3.0, 5.0]):
                first = Field.new(port, Revised(np.array(values), 1))
                self.assertEqual(relative(change(first, committed, committed), measure), 1.0)
                self.assertEqual(relative(change(first, first, committed), measure), 0.0)

    def test_eight_lanes_are_summed_as_the_rust_nodes_sum(self):
        # Of 1e16 and thirteen ones, each one that meets the large value is lost; which do is a matter of the order.
        values = [1e16] + [1.0] * 13
        lanes = [sum(values[lane::8]) for lane in range(8)]
        total = 0.0
        for lane in lanes:
            total += lane
        rest = self.field("magnitude", [0.0] * 14)
        self.assertEqual(change(self.field("magnitude", values), rest, rest).magnitude, total)


if __name__ == "__main__":
    unittest.main()
