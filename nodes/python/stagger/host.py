"""The protocol of a node (docs/protocol.md): freezes what it reads, solves trials, publishes, commits what is accepted.

One thread takes the events in the order of their arrival. Where a field or a message is missing the node waits: it will
be asked or told again.
"""

from __future__ import annotations

import os
import queue
import sys
import time
import traceback
from typing import Any, NamedTuple, Protocol

import numpy as np

from .fields import Field, Malformed, Received, Window, receive, receive_message
from .mailbox import Mailbox, Sender
from .messages import (
    ACCEPT,
    INITIAL,
    MEASURE,
    SCHEMA_VERSION,
    Directive,
    Envelope,
    FieldMessage,
    Manifest,
    Report,
    Snapshot,
    Version,
)
from .trial import Answer, FrozenFields, NotFinite, Trials

COORDINATOR = "coordinator"
EARLY_FIELDS = 1000
"""Fields kept until the plan that says whose they are; what is left out is sent again with the next plan."""
_RESTORE_S = 5.0
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
        self._sources: list[Any] = []
        self._mailbox = Mailbox()
        # The version the epoch starts from, whether the node holds it, and which sources have sent theirs.
        self._from, self._started, self._ready = INITIAL, False, False
        self._ready_ledger: list[Any] = []
        # What is committed: by the run, by this node, by each source; and by each source when this node's window began.
        self._accepted = self._committed = INITIAL
        self._held: dict[Sender, Version] = {}
        self._window_start: dict[Sender, Version] = {}
        self._current: dict[str, Field] = {}
        # The last iteration asked for, with the nodes whose clock differs; the trial that waits for its fields.
        self._asked: tuple[Version, dict[str, Any]] = (INITIAL, {})
        self._pending: tuple[Any, Any, float] | None = None
        self._checkpoint: tuple[Version, float] | None = None
        # The last answer and the one before it, for whoever missed them.
        self._answered: tuple[Any, Answer] | None = None
        self._before: tuple[Any, Answer] | None = None
        # What readers hold of each field, and the version they know it by; the same whole, for whoever comes late.
        self._sent: dict[str, tuple[Version, Field]] = {}
        self._latest: dict[str, tuple[Any, Field]] = {}
        self._outlets: dict[str, Any] = {}
        self._declare()

    def _key(self, *parts: str) -> str:
        return "/".join(("stagger", self.identity.run, *parts))

    def _declare(self) -> None:
        """Declares the node's keys; its token, which says that it is ready to be asked, comes last."""
        link, node, pid = self._link, self.identity.node, os.getpid()
        ports = self.trials.node
        for port in ports.writes:
            self._outlets[port.field] = link.publisher(self._key("field", node, port.field))
        self._report = link.publisher(self._key("done", node))
        self._snapshots = link.publisher(self._key("snapshot", node))
        manifest = Manifest(run=self.identity.run, schema=SCHEMA_VERSION, node=node, instance=str(pid), pid=pid)
        manifest.program = f"stagger-python {type(ports).__name__}"
        manifest.scene_hash = self.identity.scene_hash
        for port in ports.reads:
            port.write(manifest.ports.reads.add())
        for port in ports.writes:
            port.write(manifest.ports.writes.add())
        put = self.events.put
        link.subscribe(self._key("ctl", "directive"), lambda *message: put(Event("directive", *message)))
        link.watch(self._key("live", COORDINATOR, "*"), lambda: put(Event("gone")))
        for name in sorted({port.field for port in ports.reads}):
            link.subscribe(self._key("field", "*", name), lambda *message: put(Event("field", *message)))
        link.answer(self._key("field", node, "*"), self._newest)
        about = (self._key("meta", node), b"", manifest.SerializeToString())
        link.answer(about[0], lambda: [about])
        link.announce(self._key("live", node, str(pid)))

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
        self._try_checkpoint()
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
        self._store(received)

    def _store(self, received: Received) -> None:
        sender = (received.name, received.envelope.sender)
        writer = any((source.field, source.writer) == sender for source in self._sources)
        accelerated = sender[1] == COORDINATOR and any(s.field == sender[0] and s.accelerated for s in self._sources)
        if not (writer or accelerated):
            self.refused += 1
            return
        version = Version.of(received.envelope.version)
        if self._mailbox.store(received) and writer and version <= self._from:
            self._held[sender] = max(version, self._held.get(sender, version))

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
        if task is None or not self._belongs(envelope) or not current:
            self.refused += 1
            return None
        if directive.HasField("decision") and envelope.epoch == self._epoch:
            self._conclude(directive.decision, envelope)
        if directive.checkpoint:
            self._checkpoint = (self._accepted, directive.decision.t_s)
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
            self._sources = [s for node in plan.nodes if node.node == self.identity.node for s in node.sources]
            # Several writers of one field are summed in the order of their names.
            self._sources.sort(key=lambda source: (source.field, source.writer))
            self._mailbox, self._sent = Mailbox(), {}
            self._held, self._window_start = {}, {}
            self._from = Version.of(getattr(plan, "from"))
            self._started, self._checkpoint = False, None
            early, self._early = self._early, []
            for event in early:
                self._receive_field(event)
            self.trials.set_sources({s.field: (_MEASURES[s.measure], s.reuse_below) for s in self._sources})
        self._pending = self._answered = self._before = None
        if not self._started:
            try:
                self._started = self._restore() if self._from > INITIAL else self._begin()
            except Exception as error:
                self._fail(envelope, error)
                raise
        # The coordinator asks again until all are ready, so that a reader that came late gets the values too.
        if self._started:
            self._publish(envelope, self._committed, self._current, whole=True)
            self._ready = True

    def _begin(self) -> bool:
        self._current, self._ready_ledger = self.trials.initial()
        self._accepted = self._committed = INITIAL
        return True

    def _restore(self) -> bool:
        """Takes the node's snapshot up; false where nobody gives it yet."""
        answer = self._link.ask(self._key("restore", self.identity.node), _RESTORE_S)
        if answer is None:
            return False
        snapshot = Snapshot.FromString(answer)
        received = [receive_message(message) for message in snapshot.fields]
        self._current = {field.name: field.field for field in received if field.field is not None}
        if set(self._current) != set(self._outlets):
            raise Malformed(f"a snapshot of {sorted(self._current)}, but the ports say {sorted(self._outlets)}")
        self.trials.restore(snapshot.state, dict(self._current))
        self._committed, self._accepted = Version.of(snapshot.committed), self._from
        self._ready_ledger = []
        for message in snapshot.frozen:
            field = receive_message(message)
            self._mailbox.store(field)
            self._window_start[field.name, field.envelope.sender] = Version.of(field.envelope.version)
        return True

    def _iterate(self, envelope: Any, iterate: Any) -> None:
        version = Version.of(envelope.version)
        parts = {part.node: part for part in iterate.parts}
        self._asked = (version, parts)
        mine = parts.get(self.identity.node)
        if iterate.again:
            committed = mine.committed if mine else iterate.committed
            self._answer_again(envelope, version, Version.of(committed))
        if mine and mine.rests:
            self._pending = None
        elif self._answered is None or Version.of(self._answered[0].version) != version:
            self._pending = (envelope, iterate, time.monotonic())

    def _conclude(self, decision: Any, envelope: Any) -> None:
        """Commits an accepted version, once."""
        version = Version.of(decision.version)
        if decision.verdict != ACCEPT or version <= self._accepted:
            return
        asked, parts = self._asked
        if asked != version:
            parts = {}
        for field, writer in self._held:
            part = parts.get(writer)
            self._held[field, writer] = Version.of(part.committed) if part and part.rests else version
        mine = parts.get(self.identity.node)
        if not (mine and mine.rests):
            try:
                self._current = self.trials.commit(version)
            except Exception as error:
                self._fail(envelope, error)
                raise
            self._committed, self._window_start = version, dict(self._held)
        self._accepted, self._checkpoint = version, None
        self._mailbox.forget_before(version, {*self._held.items(), *self._window_start.items()})

    # What the node does once everything for it is there.

    def _try_ready(self) -> None:
        """Reports Ready once the value of every field read has come; again whenever the plan is sent again."""
        if not self._ready or any((source.field, source.writer) not in self._held for source in self._sources):
            return
        self._ready = False
        self._window_start = {**self._held, **self._window_start}
        report = Report()
        report.ready.SetInParent()
        report.ready.ledger.extend(self._ready_ledger)
        self._tell(Envelope(), self._from, report)

    def _try_checkpoint(self) -> None:
        """Puts a snapshot once the fields its window began with are there."""
        if self._checkpoint is None:
            return
        version, time_s = self._checkpoint
        frozen = []
        if self._committed != version:
            for sender, at in sorted(self._window_start.items()):
                field = self._mailbox.get(sender, at)
                if field is None:
                    return
                frozen.append(field.message(self._about(sender[1], at)))
        self._checkpoint = None
        snapshot = Snapshot(envelope=self._stamp(Envelope(t_s=time_s), version), state=self.trials.snapshot())
        self._committed.write(snapshot.committed)
        about = self._about(self.identity.node, self._committed)
        snapshot.fields.extend(field.message(about) for _, field in sorted(self._current.items()))
        snapshot.frozen.extend(frozen)
        self._snapshots(None, snapshot.SerializeToString())

    def _try_solve(self) -> None:
        if self._pending is None:
            return
        envelope, iterate, asked = self._pending
        version = Version.of(envelope.version)
        frozen = self._freeze(version, iterate)
        if frozen is None:
            return
        self._pending = None
        mine = self._asked[1].get(self.identity.node)
        window = Window(mine.t_s, mine.dt_s) if mine else Window(envelope.t_s, envelope.dt_s)
        begun = time.monotonic()
        try:
            answer = self.trials.solve(version, window, frozen)
        except Exception as error:  # Whatever the node's author raises is for the coordinator to know.
            if not isinstance(error, NotFinite):  # Which a smaller step may mend.
                traceback.print_exception(error, file=sys.stderr)
            self._fail(envelope, error)
            return
        done = answer.done
        done.solve_s, done.wait_s, done.refused = time.monotonic() - begun, begun - asked, self.refused
        done.fields, done.bytes = self._publish(envelope, version, answer.fields)
        self._tell(envelope, version, Report(done=done))
        self._before, self._answered = self._answered, (envelope, answer)

    def _freeze(self, version: Version, iterate: Any) -> FrozenFields | None:
        """The frozen fields of a trial, once all have arrived."""
        frozen = FrozenFields()
        parts = self._asked[1]
        for source in self._sources:
            sender = (source.field, source.writer)
            part = parts.get(source.writer)
            committed = Version.of(part.committed if part else iterate.committed)
            if part and part.rests:
                at = committed
            elif source.same_iteration:
                at = version
            elif version.iteration <= 1:
                at = committed
            else:
                at = version._replace(iteration=version.iteration - 1)
                if source.accelerated:
                    sender = (source.field, COORDINATOR)
            end = start = self._mailbox.get(sender, at)
            if source.interpolate:
                own = self.identity.node in parts
                begun = self._window_start.get((source.field, source.writer), committed) if own else committed
                start = self._mailbox.get((source.field, source.writer), begun)
            if start is None or end is None:
                return None
            for fields, field in ((frozen.start, start), (frozen.end, end)):
                before = fields.get(source.field)
                fields[source.field] = field if before is None else _sum(before, field)
        return frozen

    def _answer_again(self, asked: Any, version: Version, committed: Version) -> None:
        """Publishes once more, whole, what a trial rests on and what this node answered: somebody lacks it."""
        self._publish(asked, committed, self._current, whole=True)
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

    def _publish(self, about: Any, version: Version, fields: dict[str, Field], whole: bool = False) -> tuple[int, int]:
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
            self._outlets[name](field.header(envelope, known), payload)
            self._latest[name] = (envelope, field)
            self._sent[name] = (version, field)
            count += 1
            size += len(payload)
        return count, size

    def _fail(self, about: Any, error: Exception) -> None:
        report = Report()
        if isinstance(error, NotFinite):
            report.failure.message, report.failure.retry = str(error), True
        else:
            report.failure.message = f"{self.identity.node}: {type(error).__name__}: {error}"
            report.failure.retry = False
        self._tell(about, Version.of(about.version), report)

    def _take_leave(self) -> None:
        report = Report()
        report.farewell.SetInParent()
        report.farewell.fields.extend(field.summary() for _, field in sorted(self._current.items()))
        self._tell(Envelope(), self._committed, report)

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


def _sum(a: Field, b: Field) -> Field:
    if not a.stands_as(b):
        raise Malformed(f"field `{a.port.field}` adds up writers that stand on different rows")
    return Field(a.port, np.add(a.values, b.values).tobytes(), a.revision)
