"""A link that keeps what is put, a coordinator's side of the protocol, and a node small enough to compute by hand."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from stagger import Node, Port, Reply, stored
from stagger.fields import Field
from stagger.host import End, Event, Host, Identity
from stagger.messages import (
    ACCEPT,
    INITIAL,
    REJECT,
    SCHEMA_VERSION,
    Directive,
    Envelope,
    FieldMessage,
    Report,
    Version,
)
from stagger.trial import Trials

RUN = "run-1"
HEAT = Port("heat", "K/s", "particles")
V = Version


class Warming(Node):
    """T' = heat, by its mean over the window: T += dt (start + end) / 2."""

    reads = [HEAT]
    writes = [Port("temperature", "K", "particles", measure="magnitude")]

    def initial(self) -> tuple[Any, Reply]:
        start = np.array([300.0, 400.0])
        return start, Reply({"temperature": start}, ledger=[stored("heat", 0.0)])

    def solve(self, state: Any, frozen: Any, window: Any) -> tuple[Any, Reply]:
        state = state + window.dt_s * (frozen.start["heat"] + frozen.end["heat"]) / 2
        return state, Reply({"temperature": state}, figures={"window [s]": window.dt_s})


class Link:
    """Keeps what is put, as (key behind the run, attachment, payload)."""

    def __init__(self) -> None:
        self.put: list[tuple[str, bytes, bytes]] = []
        self.answers: dict[str, Any] = {}
        self.restore: bytes | None = None
        self.declared: list[str] = []

    def publisher(self, key: str) -> Any:
        topic = key.removeprefix(f"stagger/{RUN}/")
        return lambda attachment, payload: self.put.append((topic, attachment or b"", payload))

    def subscribe(self, key: str, receive: Any) -> None:
        self.declared.append(key)

    def answer(self, key: str, reply: Any) -> None:
        self.answers[key] = reply

    def ask(self, key: str, patience_s: float) -> bytes | None:
        assert key == f"stagger/{RUN}/restore/thermal"
        return self.restore

    def announce(self, key: str) -> None:
        self.declared.append(key)

    def watch(self, key: str, gone: Any) -> None:
        self.declared.append(key)


class Run:
    """The coordinator and the writer of `heat`, speaking to a host."""

    def __init__(self, node: Node | None = None) -> None:
        self.link = Link()
        self.host = Host(self.link, Identity(RUN, "thermal", 7), Trials("thermal", node or Warming()))
        self.epoch, self.schema, self.run = 1, SCHEMA_VERSION, RUN

    def envelope(self, version: Version, sender: str = "coordinator", **more: Any) -> Any:
        envelope = Envelope(run=self.run, schema=self.schema, epoch=self.epoch, sender=sender, **more)
        version.write(envelope.version)
        return envelope

    def told(self) -> list[tuple[str, bytes, bytes]]:
        """What was put since the last time."""
        told, self.link.put = self.link.put, []
        return told

    def reports(self) -> list[Any]:
        return [Report.FromString(payload) for topic, _, payload in self.told() if topic == "done/thermal"]

    def field(self, version: Version, values: Any, sender: str = "optics", same_as: Version | None = None) -> None:
        field = Field.new(dataclasses.replace(HEAT, measure="magnitude"), np.array(values, float))
        header = field.header(self.envelope(version, sender), same_as)
        self.host.take(Event("field", header, b"" if same_as else field.raw))

    def plan(self, start: Version = INITIAL, writers: tuple[str, ...] = ("optics",), **source: Any) -> None:
        directive = Directive(envelope=self.envelope(start))
        start.write(getattr(directive.plan, "from"))
        directive.plan.order.extend([*writers, "thermal"])
        node = directive.plan.nodes.add(node="thermal")
        for writer in writers:
            node.sources.add(field="heat", writer=writer, **{"interpolate": True, "same_iteration": True, **source})
        self.host.take(Event("directive", b"", directive.SerializeToString()))

    def iterate(
        self,
        version: Version,
        committed: Version = INITIAL,
        dt_s: float = 1.0,
        accept: Version | None = None,
        reject: Version | None = None,
        parts: tuple[dict[str, Any], ...] = (),
        again: bool = False,
        checkpoint: bool = False,
        sender: str = "coordinator",
    ) -> None:
        directive = Directive(envelope=self.envelope(version, sender, dt_s=dt_s), checkpoint=checkpoint)
        directive.iterate.again = again
        committed.write(directive.iterate.committed)
        for part in parts:
            clock = {name: value for name, value in part.items() if name != "committed"}
            part["committed"].write(directive.iterate.parts.add(**clock).committed)
        for verdict, decided in ((ACCEPT, accept), (REJECT, reject)):
            if decided:
                directive.decision.verdict = verdict
                decided.write(directive.decision.version)
        self.host.take(Event("directive", b"", directive.SerializeToString()))

    def stop(self, accept: Version | None = None) -> End | None:
        directive = Directive(envelope=self.envelope(accept or INITIAL))
        directive.stop.completed = True
        if accept:
            directive.decision.verdict = ACCEPT
            accept.write(directive.decision.version)
        return self.host.take(Event("directive", b"", directive.SerializeToString()))

    def started(self, **source: Any) -> Run:
        """After the handshake, in which the writer of `heat` gave 1 and 2 W."""
        self.plan(**source)
        self.field(INITIAL, [1.0, 2.0])
        assert [report.WhichOneof("body") for report in self.reports()] == ["ready"]
        return self


def temperatures(told: list[tuple[str, bytes, bytes]]) -> list[tuple[Version, Any, list[float] | Version]]:
    """Version and values, or the version they repeat, of every `temperature` put."""
    found = []
    for topic, attachment, payload in told:
        if topic == "field/thermal/temperature":
            header = FieldMessage.FromString(attachment)
            values = list(np.frombuffer(payload)) if not header.HasField("same_as") else Version.of(header.same_as)
            found.append((Version.of(header.envelope.version), values))
    return found
