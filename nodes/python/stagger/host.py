"""The protocol of a node (docs/protocol.md): freezes what it reads, solves trials, publishes, commits what is accepted.

One thread takes the events in the order of their arrival. Where a field or a message is missing the node waits: it will
be asked or told again.
"""

from __future__ import annotations

import contextlib
import os
import queue
import sys
import time
import traceback
from collections.abc import Iterator
from typing import Any, NamedTuple, Protocol

from .fields import Field, Malformed, receive, receive_message
from .frozen_fields import COORDINATOR, FrozenFields, resting, window_of
from .messages import (
    ACCEPT,
    INITIAL,
    MEASURE,
    REJECT,
    SCHEMA_VERSION,
    Directive,
    Envelope,
    FieldMessage,
    Manifest,
    Report,
    Snapshot,
    Version,
)
from .trial import Answer, Fields, NotFinite, Refused, Trials

EARLY_FIELDS = 1000
AHEAD = 2
"""How many steps beyond the last one accepted here a field may be of: one more may have been accepted meanwhile."""
"""Fields kept until the plan that says whose they are; what is left out is sent again with the next plan."""
_RESTORE_S = 30.0
"""How long a node waits for the state it is to go on from."""
_MEASURES = {number: name.removeprefix("MEASURE_").lower() for name, number in MEASURE.items()}


class Identity(NamedTuple):
    """Who a node is: its run, its name, and the hash of the scene it was started with."""

    run: str
    node: str
    scene_hash: int


class End(NamedTuple):
    """How a node ended."""

    completed: bool
    reason: str


class Event(NamedTuple):
    """What a node is told: by the coordinator ("directive"), by a node ("field"), or that it is alone ("gone")."""

    kind: str
    attachment: bytes = b""
    payload: bytes = b""


class _Link(Protocol):
    def publisher(self, key: str) -> Any: ...
    def subscribe(self, key: str, receive: Any) -> None: ...
    def answer(self, key: str, reply: Any) -> None: ...
    def ask(self, key: str, patience_s: float) -> bytes | None: ...
    def announce(self, key: str) -> None: ...
    def watch(self, key: str, gone: Any) -> None: ...


class Host:
    """A node and everything it knows of its run."""

    def __init__(self, link: _Link, identity: Identity, trials: Trials) -> None:
        self.identity, self.trials, self._link = identity, trials, link
        self.events: queue.SimpleQueue[Event] = queue.SimpleQueue()
        self.refused = 0
        self._epoch: int | None = None
        self._sequence = 0
        self._early: list[Event] = []
        self._frozen_fields = FrozenFields()
        # The version the epoch starts from, the energy held then, and whether the coordinator waits to hear of it.
        self._from, self._ready_ledger, self._ready = INITIAL, [], False
        # The last version the run accepted; the last one this node committed, with its fields.
        self._accepted = INITIAL
        self._committed: tuple[Version, Fields] = (INITIAL, {})
        # The trial that waits for its fields; the last one that was asked of others only.
        self._pending: tuple[Any, Any, float] | None = None
        self._rested: Version | None = None
        # The last answer and the one before it, for whoever missed them.
        self._answered: tuple[Any, Answer] | None = None
        self._before: tuple[Any, Answer] | None = None
        # What readers hold of each field, and the version they know it by; the same whole, for whoever comes late.
        self._sent: dict[str, tuple[Version, Field]] = {}
        self._latest: dict[str, tuple[Any, Field]] = {}
        self._publishers: dict[str, Any] = {}
        self._declare()

    def _key(self, *parts: str) -> str:
        return "/".join(("stagger", self.identity.run, *parts))

    def _declare(self) -> None:
        """Declares the node's keys; its token, which says that it is ready to be asked, comes last."""
        link, node, pid = self._link, self.identity.node, os.getpid()
        # Numbers of processes come again: the time tells a node from the one it replaces.
        instance = f"{pid}-{time.time_ns()}"
        ports = self.trials.node
        for port in ports.writes:
            self._publishers[port.field] = link.publisher(self._key("field", node, port.field))
        self._report = link.publisher(self._key("done", node))
        self._snapshots = link.publisher(self._key("snapshot", node))
        manifest = Manifest(run=self.identity.run, schema=SCHEMA_VERSION, node=node, instance=instance, pid=pid)
        manifest.program = f"stagger-python {type(ports).__name__}"
        manifest.scene_hash = self.identity.scene_hash
        for port in ports.reads:
            port.write(manifest.ports.reads.add())
        for port in ports.writes:
            port.write(manifest.ports.writes.add())
        for name, shape in sorted(ports.supports.items()):
            shape.write(manifest.ports.supports.add(support=name))
        put = self.events.put
        link.subscribe(self._key("ctl", "directive"), lambda *message: put(Event("directive", *message)))
        link.watch(self._key("live", COORDINATOR, "*"), lambda: put(Event("gone")))
        for name in sorted({port.field for port in ports.reads}):
            link.subscribe(self._key("field", "*", name), lambda *message: put(Event("field", *message)))
        link.answer(self._key("field", node, "*"), self._newest)
        about = (self._key("meta", node), b"", manifest.SerializeToString())
        link.answer(about[0], lambda: [about])
        link.announce(self._key("live", node, instance))

    def _newest(self) -> list[tuple[str, bytes, bytes]]:
        # Called from another thread: the copy of the dictionary is one operation.
        latest = list(self._latest.items())
        key = self._key("field", self.identity.node)
        return [(f"{key}/{name}", field.header(envelope), field.raw) for name, (envelope, field) in latest]

    def run(self) -> End:
        """Takes part in the run until it ends."""
        while True:
            end = self.take(self.events.get())
            if end is not None:
                return end

    def take(self, event: Event) -> End | None:
        """Takes one event, and does what it makes possible."""
        if event.kind == "gone":
            return End(False, "the coordinator is gone")
        if event.kind == "field":
            self._receive_field(event)
        else:
            end = self._receive_directive(event)
            if end is not None:
                return end
        self._try_solve()
        self._try_ready()
        return None

    def _belongs(self, envelope: Any) -> bool:
        ours = envelope.run == self.identity.run and envelope.schema == SCHEMA_VERSION
        return ours and envelope.HasField("version")

    # What comes in.

    def _receive_field(self, event: Event) -> None:
        try:
            header = FieldMessage.FromString(event.attachment)
            envelope = header.envelope
            if not self._belongs(envelope):
                raise Malformed("a field of another run")
            if self._epoch is None or envelope.epoch > self._epoch:
                # Nodes hear of an epoch at different moments.
                if len(self._early) < EARLY_FIELDS:
                    self._early.append(event)
                return
            if envelope.epoch < self._epoch:
                raise Malformed("a field of an older epoch")
            received = receive(header, event.payload)
        except Exception:  # Whatever a stranger sends must not end the node: protobuf has errors of its own.
            self.refused += 1
            return
        if not self._may_be_read(Version.of(envelope.version)) or not self._frozen_fields.reads(envelope.sender, received.name):
            self.refused += 1
            return
        self._frozen_fields.store(received)

    def _may_be_read(self, version: Version) -> bool:
        """Whether a field of that version may be one this node reads: nobody goes beyond the start before all are ready."""
        if self._ready:
            return version <= self._from
        return version.step <= self._accepted.step + AHEAD

    def _newest_version(self) -> Version:
        """The newest version that was accepted, answered, is in work or rests."""
        asked = [self._accepted]
        asked += [Version.of(given[0].version) for given in (self._answered, self._pending) if given is not None]
        asked += [self._rested] if self._rested is not None else []
        return max(asked)

    def _receive_directive(self, event: Event) -> End | None:
        try:
            directive = Directive.FromString(event.payload)
        except Exception:  # As above.
            self.refused += 1
            return None
        envelope, task = directive.envelope, directive.WhichOneof("task")
        # A run may end before this node has heard of its plan.
        new = task == "plan" or (task == "stop" and self._epoch is None)
        current = envelope.epoch == self._epoch or (new and envelope.epoch >= (self._epoch or 0))
        if task is None or not self._belongs(envelope) or envelope.sender != COORDINATOR or not current:
            self.refused += 1
            return None
        if task == "plan" and envelope.epoch == self._epoch and self._newest_version() > self._from:
            # Somebody repeats what was said before: the questions of this epoch have begun.
            self.refused += 1
            return None
        if directive.HasField("decision") and envelope.epoch == self._epoch:
            self._conclude(directive.decision, envelope)
        if directive.checkpoint:
            self._hand_over(envelope)
        if task == "plan":
            self._start(envelope, directive.plan)
        elif task == "iterate":
            self._iterate(envelope, directive.iterate)
        else:
            self._take_leave()
            return End(directive.stop.completed, directive.stop.reason)
        return None

    def _start(self, envelope: Any, plan: Any) -> None:
        if self._epoch != envelope.epoch:
            self._epoch, self._sequence = envelope.epoch, 0
            mine = next((part for part in plan.nodes if part.node == self.identity.node), None)
            if mine is None:
                raise Refused(f"the run has no node `{self.identity.node}`, but {', '.join(plan.order)}")
            self.trials.set_sources({s.field: (_MEASURES[s.measure], s.reuse_below) for s in mine.sources})
            self._frozen_fields = FrozenFields(mine.sources)
            self._from = Version.of(getattr(plan, "from"))
            with self._or_fail(self._about(self.identity.node, self._from)):
                if self._from == INITIAL:
                    fields, self._ready_ledger = self.trials.initial()
                    self._committed = (INITIAL, fields)
                else:
                    self._restore()
            self._accepted, self._ready = self._from, True
            self._pending = self._answered = self._before = self._rested = None
            early, self._early = self._early, []
            for event in early:
                self._receive_field(event)
        # The coordinator asks again until all are ready, so that a reader that came late gets the values too.
        self._publish(envelope, *self._committed, whole=True)
        self._ready = True

    def _restore(self) -> None:
        """Goes on from what the coordinator kept of this node."""
        answer = self._link.ask(self._key("restore", self.identity.node), _RESTORE_S)
        if answer is None:
            raise Refused("the coordinator has no state for it to go on from")
        snapshot = Snapshot.FromString(answer)
        received = [receive_message(message) for message in snapshot.fields]
        fields = {field.name: field.field for field in received if field.field is not None}
        if set(fields) != set(self._publishers):
            raise Malformed(f"a snapshot of {sorted(fields)}, but the ports say {sorted(self._publishers)}")
        for message in snapshot.frozen:
            self._frozen_fields.store(receive_message(message))
        self.trials.restore(snapshot.state, fields)
        self._committed, self._ready_ledger = (Version.of(snapshot.committed), fields), []

    def _iterate(self, envelope: Any, iterate: Any) -> None:
        version = Version.of(envelope.version)
        if version <= self._accepted or version < self._newest_version():
            # It is late, or repeated by somebody: what is over is not solved again.
            self.refused += 1
            return
        if iterate.again:
            self._answer_again(envelope, version)
        if resting(self.identity.node, iterate) is not None:
            self._rested, self._pending = version, None
        elif not self._has_answered(version):
            self._pending = (envelope, iterate, time.monotonic())

    def _has_answered(self, version: Version) -> bool:
        return self._answered is not None and Version.of(self._answered[0].version) == version

    def _conclude(self, decision: Any, envelope: Any) -> None:
        """Commits an accepted version, once, where this node solved it; forgets a rejected attempt."""
        version = Version.of(decision.version)
        if decision.verdict == REJECT:
            self._frozen_fields.rejected(version)
        if decision.verdict != ACCEPT or version <= self._accepted:
            return
        # Not what the last directive says: nodes that rest while others read had solved before.
        if self._has_answered(version):
            with self._or_fail(envelope):
                self._committed = (version, self.trials.commit(version))
            self._frozen_fields.commit()
        elif self._rested != version:
            with self._or_fail(envelope):
                raise Refused(f"asked to commit {version}, which it has not solved")
        self._accepted = version
        self._frozen_fields.accepted(version)

    def _hand_over(self, envelope: Any) -> None:
        """Puts everything it needs to go on from its committed version."""
        version, fields = self._committed
        with self._or_fail(envelope):
            state = self.trials.snapshot()
        # Not counted: the recorder counts gaps in what it records, and a snapshot goes to the coordinator alone.
        snapshot = Snapshot(envelope=self._about(self.identity.node, self._accepted), state=state)
        version.write(snapshot.committed)
        about = self._about(self.identity.node, version)
        snapshot.fields.extend(field.message(about) for _, field in sorted(fields.items()))
        older = self._frozen_fields.older_than(self._accepted)
        snapshot.frozen.extend(field.message(self._about(sender, at)) for sender, at, field in older)
        self._snapshots(None, snapshot.SerializeToString())

    # What the node does once everything for it is there.

    def _try_ready(self) -> None:
        """Reports Ready once a value to start from has come of every field read; again with every plan."""
        if not self._ready or not self._frozen_fields.begin():
            return
        self._ready = False
        report = Report()
        report.ready.SetInParent()
        report.ready.ledger.extend(self._ready_ledger)
        self._tell(Envelope(), self._from, report)

    def _try_solve(self) -> None:
        if self._pending is None:
            return
        envelope, iterate, asked = self._pending
        version = Version.of(envelope.version)
        try:
            frozen = self._frozen_fields.freeze(version, iterate)
            if frozen is None:
                return
            self._pending = None
            window = window_of(self.identity.node, envelope, iterate)
            envelope.t_s, envelope.dt_s = window
            begun = time.monotonic()
            answer = self.trials.solve(version, window, frozen)
        except Exception as error:  # Whatever the node's author raises is for the coordinator to know.
            self._pending = None
            if not isinstance(error, NotFinite):  # Which a smaller step may mend.
                traceback.print_exception(error, file=sys.stderr)
            self._fail(envelope, error)
            return
        done = answer.done
        done.solve_s, done.wait_s, done.refused = time.monotonic() - begun, begun - asked, self.refused
        done.fields, done.bytes = self._publish(envelope, version, answer.fields)
        self._tell(envelope, version, Report(done=done))
        self._before, self._answered = self._answered, (envelope, answer)

    def _answer_again(self, asked: Any, version: Version) -> None:
        """Publishes once more, whole, what a trial rests on and what this node answered: somebody lacks it."""
        self._publish(asked, *self._committed, whole=True)
        for given in (self._before, self._answered):
            if given is None:
                continue
            envelope, answer = given
            at = Version.of(envelope.version)
            if at[:2] == version[:2]:
                self._publish(envelope, at, answer.fields, whole=True)
                if at == version:
                    self._tell(envelope, at, Report(done=answer.done))

    # What goes out.

    def _publish(self, about: Any, version: Version, fields: Fields, whole: bool = False) -> tuple[int, int]:
        """Publishes fields; one whose values readers hold already goes as a reference, unless `whole`."""
        count = size = 0
        for name, field in sorted(fields.items()):
            known = None
            if not whole and name in self._sent:
                at, sent = self._sent[name]
                # A rejected attempt is forgotten by everyone: its values are no reference.
                if (at.step < version.step or at.attempt == version.attempt) and sent.same(field):
                    known = at
            envelope = self._stamp(about, version)
            payload = field.raw if known is None else b""
            self._publishers[name](field.header(envelope, known), payload)
            self._latest[name] = (envelope, field)
            self._sent[name] = (version, field)
            count += 1
            size += len(payload)
        return count, size

    @contextlib.contextmanager
    def _or_fail(self, about: Any) -> Iterator[None]:
        """Tells the coordinator of what ends the node."""
        try:
            yield
        except Exception as error:
            self._fail(about, error)
            raise

    def _fail(self, about: Any, error: Exception) -> None:
        report = Report()
        if isinstance(error, NotFinite):
            report.failure.message, report.failure.retry = str(error), True
        else:
            report.failure.message = f"{self.identity.node}: {type(error).__name__}: {error}"
            report.failure.retry = False
        self._tell(about, Version.of(about.version), report)

    def _take_leave(self) -> None:
        version, fields = self._committed
        report = Report()
        report.final_report.SetInParent()
        report.final_report.fields.extend(field.summary() for _, field in sorted(fields.items()))
        self._tell(Envelope(), version, report)

    def _tell(self, about: Any, version: Version, report: Any) -> None:
        report.envelope.CopyFrom(self._stamp(about, version))
        self._report(None, report.SerializeToString())

    def _stamp(self, about: Any, version: Version) -> Any:
        envelope = self._about(self.identity.node, version)
        envelope.sequence, envelope.t_s, envelope.dt_s = self._sequence, about.t_s, about.dt_s
        self._sequence += 1
        return envelope

    def _about(self, sender: str, version: Version) -> Any:
        """An envelope that is not counted: of a field inside another message."""
        envelope = Envelope(run=self.identity.run, schema=SCHEMA_VERSION, epoch=self._epoch or 0, sender=sender)
        version.write(envelope.version)
        return envelope
