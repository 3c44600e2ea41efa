"""The protocol of a node, spoken to it without a network."""

import contextlib
import io
import pickle
import unittest

import numpy as np
from doubles import RUN, Run, V, Warming, temperatures

from stagger import Node, Port, Reply, Revised, Window, stored
from stagger.host import Event
from stagger.messages import INITIAL, FieldMessage, Manifest, Report, Snapshot
from stagger.trial import TrialInputs, Refused, Trials

FIRST, SECOND = V(1, 1, 1), V(2, 1, 1)


class Losing(Node):
    """Loses its first row at the start of the first window; then all values double."""

    writes = [Port("w", "m", "p", measure="increment")]
    tells = True

    def initial(self):
        return np.array([1.0, 2.0, 3.0]), Reply({"w": np.array([1.0, 2.0, 3.0])})

    def solve(self, state, frozen, window):
        left = state[1:]
        start = {"w": Revised(left, 1)} if self.tells else {}
        return 2 * left, Reply({"w": Revised(2 * left, 1)}, start=start)


class Rows(unittest.TestCase):
    def test_rows_that_went_are_told_and_the_change_is_that_of_the_rest(self):
        # From where they stood, 2 and 3, or where that is not told from nothing.
        for tells, moved in ((True, 5.0), (False, 10.0)):
            node = Losing()
            node.tells = tells
            trials = Trials("losing", node)
            trials.initial()
            for iteration, (change, other_rows) in enumerate([(moved, True), (0.0, False)], start=1):
                answer = trials.solve(V(1, 1, iteration), Window(0.0, 1.0), TrialInputs())
                (sums,) = answer.done.changes
                self.assertEqual((sums.change, sums.increment, sums.other_rows), (change, moved, other_rows))


class Handshake(unittest.TestCase):
    def test_the_token_comes_last_and_the_manifest_says_the_ports(self):
        run = Run()
        manifest = Manifest.FromString(run.link.answers[f"stagger/{RUN}/meta/thermal"]()[0][2])
        self.assertEqual(run.link.declared[-1], f"stagger/{RUN}/live/thermal/{manifest.instance}")
        again = Manifest.FromString(Run().link.answers[f"stagger/{RUN}/meta/thermal"]()[0][2])
        self.assertNotEqual(again.instance, manifest.instance, "a process of the same number started later")
        self.assertEqual((manifest.node, manifest.scene_hash, manifest.ports.reads[0].field), ("thermal", 7, "heat"))
        self.assertEqual((manifest.ports.writes[0].unit, manifest.ports.writes[0].components), ("K", 1))

    def test_ready_waits_for_the_fields_read_and_is_told_again_with_every_plan(self):
        run = Run()
        run.plan()
        self.assertEqual(temperatures(run.link.put), [(INITIAL, [300.0, 400.0])])
        self.assertEqual(run.reports(), [])
        run.field(INITIAL, [1.0, 2.0])
        (ready,) = run.reports()
        self.assertEqual((ready.ready.ledger[0].name, ready.envelope.epoch), ("heat", 1))
        run.plan()
        self.assertEqual(temperatures(run.link.put), [(INITIAL, [300.0, 400.0])])
        self.assertEqual([report.WhichOneof("body") for report in run.reports()], ["ready"])

    def test_a_field_that_comes_before_the_plan_counts(self):
        run = Run()
        run.field(INITIAL, [1.0, 2.0])
        run.plan()
        self.assertEqual([report.WhichOneof("body") for report in run.reports()], ["ready"])

    def test_a_reader_that_comes_late_asks_for_the_newest_values(self):
        run = Run().started()
        ((key, attachment, payload),) = run.link.answers[f"stagger/{RUN}/field/thermal/*"]()
        self.assertEqual(key, f"stagger/{RUN}/field/thermal/temperature")
        self.assertEqual(list(np.frombuffer(payload)), [300.0, 400.0])

    def test_the_end_of_the_coordinator_is_the_end(self):
        self.assertFalse(Run().host.take(Event("gone")).completed)

    def test_a_run_may_end_before_a_node_has_heard_of_its_plan(self):
        self.assertTrue(Run().stop(accept=FIRST).completed)


class Trial(unittest.TestCase):
    def test_a_trial_waits_for_its_fields_and_is_committed_once(self):
        run = Run().started()
        run.iterate(FIRST)
        self.assertEqual(run.told(), [])
        run.field(FIRST, [3.0, 2.0])
        (report,) = run.reports()
        done = report.done
        # The mean of 1 and 3, of 2 and 2, over 1 s.
        self.assertEqual((done.converged, done.figures["window [s]"]), (True, 1.0))
        self.assertEqual((done.fields, done.bytes), (1, 16))
        (change,) = done.changes
        self.assertEqual((change.change, change.magnitude, change.rows, change.worst_row), (4.0, 704.0, 2, 0))
        for _ in range(2):
            run.iterate(SECOND, committed=FIRST, accept=FIRST)
        run.field(SECOND, [3.0, 2.0])
        self.assertEqual(temperatures(run.told()), [(SECOND, [305.0, 404.0])])
        run.iterate(FIRST, again=True)
        self.assertEqual((run.told(), run.host.refused), ([], 1), "it comes too late")
        self.assertTrue(run.stop(accept=SECOND).completed)
        (final,) = run.reports()
        (field,) = final.final_report.fields
        self.assertEqual((field.min, field.mean, field.max), (305.0, 354.5, 404.0))

    def test_a_rejected_attempt_leaves_nothing_behind(self):
        run = Run().started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        run.told()
        again = V(1, 2, 1)
        run.iterate(again, dt_s=0.5)
        run.field(again, [3.0, 2.0])
        self.assertEqual(temperatures(run.told()), [(again, [301.0, 401.0])])
        # The values of the attempt before that: nobody keeps them, so they are no reference.
        third = V(1, 3, 1)
        run.iterate(third, dt_s=0.5)
        run.field(third, [3.0, 2.0])
        told = run.told()
        self.assertEqual(temperatures(told), [(third, [301.0, 401.0])])
        done = Report.FromString(told[-1][2]).done
        self.assertEqual((done.reused, done.changes[0].change), (False, 2.0))

    def test_what_is_forgotten_is_no_reference(self):
        run = Run().started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        again = V(1, 2, 1)
        run.iterate(again, reject=FIRST)
        run.told()
        run.field(again, [0.0, 0.0], same_as=FIRST)
        self.assertEqual(run.told(), [])
        run.field(again, [3.0, 2.0])
        run.iterate(SECOND, committed=again, accept=again)
        run.told()
        run.field(SECOND, [0.0, 0.0], same_as=INITIAL)
        self.assertEqual(run.told(), [])

    def test_a_trial_that_was_given_up_is_not_solved_later(self):
        run = Run().started()
        run.iterate(FIRST)
        run.iterate(V(1, 2, 1), reject=FIRST, parts=({"node": "thermal", "committed": INITIAL, "rests": True},))
        run.field(FIRST, [3.0, 2.0])
        self.assertEqual(run.told(), [])

    def test_what_the_coordinator_said_before_may_be_repeated(self):
        run = Run().started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        second = V(1, 1, 2)
        run.iterate(second)
        run.field(second, [3.5, 2.0])
        run.told()
        # An older question must not displace the answer that is going to be accepted, nor a plan all answers.
        run.iterate(FIRST)
        run.iterate(FIRST, again=True)
        run.plan()
        self.assertEqual((run.told(), run.host.refused), ([], 3))
        run.iterate(SECOND, committed=second, accept=second)
        # One that is in work is not displaced either.
        run.iterate(second, again=True)
        self.assertEqual(run.host.refused, 4)
        run.field(SECOND, [4.0, 2.0])
        (report,) = run.reports()
        self.assertEqual(report.WhichOneof("body"), "done")

    def test_a_field_beyond_what_can_have_been_asked_is_refused(self):
        run = Run()
        run.plan()
        run.told()
        run.field(FIRST, [9.0, 9.0])
        self.assertEqual((run.told(), run.host.refused), ([], 1), "nobody goes beyond the start before all are ready")
        run.field(INITIAL, [1.0, 2.0])
        self.assertEqual(len(run.reports()), 1)
        run.field(V(3, 1, 1), [9.0, 9.0])
        run.field(V(1_000_000_000, 1, 1), [9.0, 9.0])
        self.assertEqual(run.host.refused, 3)

    def test_equal_frozen_fields_give_the_last_reply_again_as_a_reference(self):
        run = Run().started(reuse_below=1e-7, measure=2)
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        run.told()
        # The whole field changed by 1e-9 of itself: less than the share above.
        for iteration, values, same_as in ((2, None, FIRST), (3, [3.0 + 5e-9, 2.0], None)):
            version = V(1, 1, iteration)
            run.iterate(version)
            run.field(version, values or [0.0, 0.0], same_as=same_as)
            told = run.told()
            self.assertEqual(temperatures(told), [(version, V(1, 1, iteration - 1))])
        run.iterate(V(1, 1, 4))
        run.field(V(1, 1, 4), [3.1, 2.0])
        told = run.told()
        self.assertEqual(temperatures(told), [(V(1, 1, 4), [302.05, 402.0])])
        # Measured against the iterate before, to the rounding of 300.
        self.assertAlmostEqual(Report.FromString(told[-1][2]).done.changes[0].change, 0.05, delta=1e-12)

    def test_a_late_writer_may_refer_to_what_it_sent_before_the_accepted_version(self):
        run = Run().started(same_iteration=False)
        run.field(FIRST, [3.0, 2.0])
        run.iterate(FIRST)
        second = V(1, 1, 2)
        run.iterate(second)
        run.iterate(SECOND, committed=second, accept=second)
        run.told()
        run.field(second, [0.0, 0.0], same_as=FIRST)
        # From 302 and 402 K of the second iteration, over 1 s at 3 and 2 K/s.
        self.assertEqual(temperatures(run.told()), [(SECOND, [305.0, 404.0])])

    def test_what_somebody_lacks_is_published_again_whole(self):
        run = Run().started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        first = run.told()
        run.iterate(FIRST, again=True)
        again = run.told()
        self.assertEqual(temperatures(again), [(INITIAL, [300.0, 400.0]), (FIRST, [302.0, 402.0])])
        self.assertEqual(len([topic for topic, _, _ in first + again if topic == "done/thermal"]), 2)
        second = V(1, 1, 2)
        run.iterate(second)
        run.field(second, [5.0, 2.0])
        run.told()
        run.iterate(second, again=True)
        again = run.told()
        values = [(INITIAL, [300.0, 400.0]), (FIRST, [302.0, 402.0]), (second, [303.0, 402.0])]
        self.assertEqual(temperatures(again), values)
        (report,) = [Report.FromString(payload) for topic, _, payload in again if topic == "done/thermal"]
        self.assertEqual(V.of(report.envelope.version), second)

    def test_sequence_numbers_have_no_gap(self):
        run = Run()
        run.plan()
        run.field(INITIAL, [1.0, 2.0])
        run.iterate(FIRST)
        run.field(FIRST, [1.0, 2.0])
        run.iterate(SECOND, committed=FIRST, accept=FIRST, checkpoint=True)
        run.stop()
        kinds = {"field": lambda a, p: FieldMessage.FromString(a), "done": lambda a, p: Report.FromString(p)}
        told = [(topic.split("/")[0], a, p) for topic, a, p in run.told()]
        put = [kinds[kind](a, p).envelope for kind, a, p in told if kind in kinds]
        self.assertEqual([envelope.sequence for envelope in put], list(range(5)))
        # The recorder, which counts gaps, does not see it.
        self.assertEqual([Snapshot.FromString(p).envelope.sequence for kind, _, p in told if kind == "snapshot"], [0])


class Faults(unittest.TestCase):
    def test_foreign_old_and_malformed_messages_are_refused_and_counted(self):
        run = Run().started()
        for name, value in (("run", "other"), ("schema", 1), ("epoch", 0)):
            right = getattr(run, name)
            setattr(run, name, value)
            run.field(FIRST, [9.0, 9.0])
            run.iterate(FIRST)
            setattr(run, name, right)
        run.field(FIRST, [9.0, 9.0], sender="stranger")
        run.iterate(FIRST, sender="stranger")
        for kind in ("field", "directive"):
            run.host.take(Event(kind, b"\xff\xff", b"\xff\xff"))
        run.field(FIRST, [3.0, 2.0], same_as=V(1, 1, 9))
        self.assertEqual(run.told(), [])
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        (report,) = run.reports()
        self.assertEqual(report.done.refused, 10)

    def test_a_value_that_is_not_finite_asks_for_a_smaller_step(self):
        class Hot(Warming):
            writes = [Port("temperature", "K", "particles", components=2)]

            def initial(self):
                return None, Reply({"temperature": np.zeros((2, 2))})

            def solve(self, state, frozen, window):
                return state, Reply({"temperature": np.array([[300.0, 300.0], [300.0, np.nan]])})

        run = Run(Hot()).started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        (report,) = run.reports()
        self.assertTrue(report.failure.retry)
        self.assertIn("thermal: field `temperature` is nan in row 1", report.failure.message)

    def test_an_energy_or_a_figure_that_is_no_number_asks_for_a_smaller_step_too(self):
        for wrong, words in (
            ({"ledger": [stored("heat", np.inf)]}, "the energy `heat` is inf J"),
            ({"figures": {"flux": np.nan}}, "the figure `flux` is nan"),
        ):

            class Wrong(Warming):
                def solve(self, state, frozen, window, wrong=wrong):
                    return state, Reply({"temperature": state}, **wrong)

            run = Run(Wrong()).started()
            run.iterate(FIRST)
            run.field(FIRST, [3.0, 2.0])
            (report,) = run.reports()
            self.assertTrue(report.failure.retry)
            self.assertIn(words, report.failure.message)

    def test_other_rows_than_were_read_are_refused_and_the_own_ones_are_told(self):
        for rows in (1, 3):

            class Wrong(Warming):
                def solve(self, state, frozen, window, rows=rows):
                    return state, Reply({"temperature": np.full(rows, 300.0)})

            run = Run(Wrong()).started()
            run.iterate(FIRST)
            with contextlib.redirect_stderr(io.StringIO()):
                run.field(FIRST, [3.0, 2.0])
            (report,) = run.reports()
            self.assertFalse(report.failure.retry)
            words = f"field `temperature` has {rows} rows on `particles`, but there are 2 of them (field `heat`, revision 0)"
            self.assertIn(words, report.failure.message)
        run = Run().started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        (told,) = run.reports()[0].done.rows
        self.assertEqual((told.field, told.support.name, told.support.count), ("temperature", "particles", 2))

    def test_a_frozen_value_that_is_not_finite_does_so_before_anything_is_solved(self):
        class Blind(Warming):
            def solve(self, state, frozen, window):
                return state, Reply({"temperature": state})

        for instant, at in (("start", INITIAL), ("end", FIRST)):
            run = Run(Blind())
            run.plan()
            for version in (INITIAL, FIRST):
                run.field(version, [3.0, np.nan if version == at else 2.0])
            run.iterate(FIRST)
            *_, report = run.reports()
            self.assertTrue(report.failure.retry)
            words = f"frozen field `heat`, at the window's {instant}, is nan in row 1"
            self.assertIn(words, report.failure.message)

    def test_an_exception_is_told_and_the_node_goes_on(self):
        class Broken(Warming):
            def solve(self, state, frozen, window):
                return state, Reply({"temperature": frozen.end["colour"]})

        run = Run(Broken()).started()
        run.iterate(FIRST)
        with contextlib.redirect_stderr(io.StringIO()) as said:
            run.field(FIRST, [3.0, 2.0])
        (report,) = run.reports()
        self.assertFalse(report.failure.retry)
        self.assertIn("thermal: KeyError: 'no port reads `colour`'", report.failure.message)
        self.assertIn("in solve", said.getvalue())
        self.assertTrue(run.stop().completed)

    def test_a_reply_that_does_not_fit_the_ports_is_told(self):
        for fields, words in (
            ({}, "its ports say ['temperature']"),
            ({"temperature": np.zeros((2, 3))}, "has the shape (2, 3), but its port says (rows,)"),
            ({"temperature": np.zeros(2, complex)}, "holds complex128 values"),
        ):

            class Wrong(Warming):
                def solve(self, state, frozen, window, fields=fields):
                    return state, Reply(fields)

            run = Run(Wrong()).started()
            run.iterate(FIRST)
            with contextlib.redirect_stderr(io.StringIO()):
                run.field(FIRST, [3.0, 2.0])
            self.assertIn(words, run.reports()[0].failure.message)


class Schedule(unittest.TestCase):
    """Acceleration, rates, checkpoints, restart: version 2 of the schemas."""

    def test_an_accelerated_field_comes_from_the_coordinator_from_the_second_iteration_on(self):
        run = Run().started(same_iteration=False, accelerated=True)
        run.iterate(FIRST)
        self.assertEqual(temperatures(run.told()), [(FIRST, [301.0, 402.0])])
        second = V(1, 1, 2)
        run.iterate(second)
        run.field(FIRST, [9.0, 9.0])
        self.assertEqual(run.told(), [])
        run.field(FIRST, [3.0, 4.0], sender="coordinator")
        # The window's start stays the writer's committed value.
        self.assertEqual(temperatures(run.told()), [(second, [302.0, 403.0])])

    def test_a_writer_that_rests_is_read_at_its_own_version(self):
        run = Run().started()
        run.iterate(FIRST, parts=({"node": "optics", "rests": True, "committed": INITIAL},))
        self.assertEqual(temperatures(run.told()), [(FIRST, [301.0, 402.0])])
        run.iterate(
            SECOND, committed=FIRST, accept=FIRST, parts=({"node": "optics", "rests": True, "committed": INITIAL},)
        )
        self.assertEqual(temperatures(run.told()), [(SECOND, [302.0, 404.0])])
        # It solves again: the window's start is what it committed last.
        third = V(3, 1, 1)
        run.iterate(third, committed=SECOND, accept=SECOND, parts=({"node": "optics", "committed": INITIAL},))
        run.field(third, [3.0, 2.0])
        self.assertEqual(temperatures(run.told()), [(third, [304.0, 406.0])])

    def test_nodes_that_rest_while_others_read_commit_what_they_answered(self):
        run = Run().started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        run.told()
        # The newest directive of this version has it rest: it has converged, and others read it.
        run.iterate(FIRST, parts=({"node": "thermal", "rests": True, "committed": FIRST},))
        self.assertEqual(run.told(), [])
        run.iterate(SECOND, committed=FIRST, accept=FIRST)
        run.field(SECOND, [3.0, 2.0])
        self.assertEqual(temperatures(run.told()), [(SECOND, [305.0, 404.0])])

    def test_a_node_that_only_reads_solves_when_the_others_have_converged(self):
        run = Run().started()
        mine = {"node": "thermal", "committed": INITIAL, "dt_s": 1.0, "rests": True}
        run.iterate(FIRST, parts=(mine,))
        run.field(FIRST, [100.0, 100.0])
        run.iterate(V(1, 1, 2), parts=(mine,))
        run.field(V(1, 1, 2), [3.0, 2.0])
        self.assertEqual(run.told(), [])
        run.iterate(V(1, 1, 2), parts=({"node": "optics", "rests": True, "committed": V(1, 1, 2)},))
        # Read at that version for the window's end; its start is what was committed before.
        self.assertEqual(temperatures(run.told()), [(V(1, 1, 2), [302.0, 402.0])])
        turn = {"node": "optics", "rests": True, "committed": SECOND, "t_s": 1.0, "dt_s": 1.0}
        run.iterate(SECOND, committed=V(1, 1, 2), accept=V(1, 1, 2), parts=({**mine, "t_s": 1.0},))
        run.field(SECOND, [5.0, 4.0])
        run.iterate(SECOND, committed=V(1, 1, 2), parts=(turn,))
        self.assertEqual(temperatures(run.told()), [(SECOND, [306.0, 405.0])])

    def test_it_commits_only_what_it_has_solved_or_rested_in(self):
        run = Run().started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        run.told()
        with self.assertRaisesRegex(Refused, "asked to commit step 1, attempt 1, iteration 2, which it has not solved"):
            run.iterate(SECOND, accept=V(1, 1, 2))
        (report,) = run.reports()
        self.assertFalse(report.failure.retry)
        self.assertIn("has not solved", report.failure.message)

    def test_what_it_publishes_carries_its_own_window(self):
        run = Run().started()
        run.iterate(FIRST, parts=({"node": "thermal", "committed": INITIAL, "t_s": 0.25, "dt_s": 2.5},))
        run.field(FIRST, [1.0, 2.0])
        told = run.told()
        envelopes = [FieldMessage.FromString(told[0][1]).envelope, Report.FromString(told[1][2]).envelope]
        self.assertEqual([(at.t_s, at.dt_s) for at in envelopes], [(0.25, 2.5)] * 2)

    def test_a_field_of_several_writers_is_added_up(self):
        run = Run()
        run.plan(writers=("optics", "lamp"))
        run.field(INITIAL, [1.0, 2.0])
        self.assertEqual(run.reports(), [])
        run.field(INITIAL, [10.0, 20.0], sender="lamp")
        self.assertEqual([report.WhichOneof("body") for report in run.reports()], ["ready"])
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 2.0])
        self.assertEqual(run.told(), [])
        run.field(FIRST, [30.0, 20.0], sender="lamp")
        self.assertEqual(temperatures(run.told()), [(FIRST, [322.0, 422.0])])
        run.iterate(SECOND, committed=FIRST, accept=FIRST)
        run.field(SECOND, [3.0, 2.0])
        with contextlib.redirect_stderr(io.StringIO()):
            run.field(SECOND, [3.0], sender="lamp")
        (report,) = run.reports()
        self.assertFalse(report.failure.retry)
        self.assertIn("`heat` is to be added up over its writers, but one is", report.failure.message)
        run.field(SECOND, [3.0], sender="lamp")
        self.assertEqual(run.told(), [], "it was told once")

    def test_what_a_resting_writer_committed_outlives_an_attempt_in_which_it_solved(self):
        run = Run().started()
        resting = {"node": "optics", "rests": True, "committed": INITIAL}
        run.iterate(FIRST, parts=({"node": "optics", "committed": INITIAL},))
        run.field(FIRST, [9.0, 9.0])
        second = V(1, 2, 1)
        run.iterate(second, reject=FIRST, parts=(resting,))
        run.told()
        run.iterate(SECOND, committed=second, accept=second, parts=(resting,))
        self.assertEqual(temperatures(run.told()), [(SECOND, [302.0, 404.0])])

    def test_a_node_of_its_own_rate_rests_and_then_solves_from_its_own_commit(self):
        run = Run().started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 4.0])
        run.told()
        mine = {"node": "thermal", "committed": FIRST, "t_s": 1.0, "dt_s": 2.0}
        run.iterate(SECOND, committed=FIRST, accept=FIRST, parts=({**mine, "rests": True},))
        run.field(SECOND, [100.0, 100.0])
        self.assertEqual(run.told(), [])
        third = V(3, 1, 1)
        run.iterate(third, committed=SECOND, accept=SECOND, parts=(mine,))
        run.field(third, [5.0, 4.0])
        # From 302 and 403 K over 2 s, between what optics held when this node committed last and what it gives now.
        told = run.told()
        self.assertEqual(temperatures(told), [(third, [310.0, 411.0])])
        run.iterate(third, committed=SECOND, parts=(mine,), again=True)
        self.assertEqual(temperatures(run.told()), [(FIRST, [302.0, 403.0]), (third, [310.0, 411.0])])

    def snapshot(self, run):
        (message,) = [payload for topic, _, payload in run.told() if topic == "snapshot/thermal"]
        return Snapshot.FromString(message)

    def test_a_split_run_goes_on_as_the_unbroken_one(self):
        run = Run().started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 4.0])
        run.told()
        run.iterate(SECOND, committed=FIRST, accept=FIRST, checkpoint=True)
        snapshot = self.snapshot(run)
        self.assertEqual((V.of(snapshot.envelope.version), V.of(snapshot.committed)), (FIRST, FIRST))
        self.assertEqual((list(snapshot.fields[0].f64), len(snapshot.frozen)), ([302.0, 403.0], 0))
        run.field(SECOND, [1 / 3, 4.0])
        unbroken = temperatures(run.told())

        # In another process, and in the same one under a new epoch.
        for later in (Run(), run):
            later.epoch = 2
            later.link.restore = snapshot.SerializeToString()
            later.plan(start=FIRST)
            self.assertEqual(temperatures(later.link.put), [(FIRST, [302.0, 403.0])])
            later.field(FIRST, [3.0, 4.0])
            (ready,) = later.reports()
            self.assertEqual((ready.WhichOneof("body"), V.of(ready.envelope.version)), ("ready", FIRST))
            self.assertEqual(ready.envelope.sequence, 1)
            # The decision that was told before is told again.
            later.iterate(SECOND, committed=FIRST, accept=FIRST)
            self.assertEqual(later.told(), [], "values of an epoch before")
            later.field(SECOND, [1 / 3, 4.0])
            self.assertEqual(temperatures(later.told()), unbroken)
            later.epoch = 1
            later.iterate(SECOND, committed=FIRST, again=True)
            self.assertEqual(later.told(), [], "an older epoch is refused")

    def test_a_resting_node_takes_the_start_of_its_window_into_its_snapshot(self):
        run = Run().started()
        mine = {"node": "thermal", "committed": INITIAL, "t_s": 0.0, "dt_s": 2.0}
        run.iterate(FIRST, parts=({**mine, "rests": True},))
        run.field(FIRST, [100.0, 100.0])
        run.iterate(SECOND, committed=FIRST, accept=FIRST, parts=(mine,), checkpoint=True)
        snapshot = self.snapshot(run)
        self.assertEqual((V.of(snapshot.envelope.version), V.of(snapshot.committed)), (FIRST, INITIAL))
        held, other = snapshot.fields[0].envelope, snapshot.frozen[0].envelope
        self.assertEqual((held.sender, V.of(held.version)), ("thermal", INITIAL))
        self.assertEqual((other.sender, V.of(other.version)), ("optics", INITIAL))
        self.assertEqual(list(snapshot.frozen[0].f64), [1.0, 2.0])
        later = Run()
        later.epoch, later.link.restore = 2, snapshot.SerializeToString()
        later.plan(start=FIRST)
        later.field(FIRST, [100.0, 100.0])
        self.assertEqual(temperatures(later.link.put), [(INITIAL, [300.0, 400.0])])
        self.assertEqual([report.WhichOneof("body") for report in later.reports()], ["ready"])
        later.iterate(SECOND, committed=FIRST, parts=(mine,))
        later.field(SECOND, [3.0, 4.0])
        self.assertEqual(temperatures(later.told()), [(SECOND, [304.0, 406.0])])

    def test_a_node_without_a_snapshot_to_go_on_from_says_so(self):
        run = Run()
        with self.assertRaises(Refused):
            run.plan(start=FIRST)
        (report,) = run.reports()
        self.assertEqual(V.of(report.envelope.version), FIRST)
        self.assertIn("no state for it to go on from", report.failure.message)

    def test_a_node_that_the_run_does_not_know_of_ends(self):
        stranger = Run()
        stranger.host.identity = stranger.host.identity._replace(node="watch")
        with self.assertRaisesRegex(Refused, "the run has no node `watch`, but optics, thermal"):
            stranger.plan()
        self.assertEqual(stranger.told(), [])

    def test_a_state_that_would_run_code_is_refused(self):
        class Stranger:
            def __reduce__(self):
                return print, ("owned",)

        run = Run().started()
        run.iterate(FIRST)
        run.field(FIRST, [3.0, 4.0])
        run.iterate(SECOND, committed=FIRST, accept=FIRST, checkpoint=True)
        snapshot = self.snapshot(run)
        snapshot.state = pickle.dumps(Stranger())
        later = Run()
        later.epoch, later.link.restore = 2, snapshot.SerializeToString()
        with self.assertRaisesRegex(pickle.UnpicklingError, "builtins.print"):
            later.plan(start=FIRST)


if __name__ == "__main__":
    unittest.main()
