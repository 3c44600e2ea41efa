"""The fields one node reads, as they come in, and the versions it freezes: `solver/coupling/src/frozen_fields.rs` in Python."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .fields import Field, Malformed, Received, Window
from .messages import INITIAL, Version
from .trial import TrialInputs

COORDINATOR = "coordinator"
"""Who publishes accelerated iterates."""


class FrozenFields:
    """A value is known by its sender, its name and its version.

    At the window's start a node freezes what its sources had committed when it committed itself the last time; at the
    window's end, what its `Source` and the `Iterate` say.
    """

    def __init__(self, sources: Iterable[Any] = ()) -> None:
        # Several writers of one field are added up in the order of their names.
        self._sources = sorted(sources, key=lambda source: (source.field, source.writer))
        self._fields: dict[tuple[str, str], dict[Version, Field]] = {}
        # What each writer had committed when this node committed last, and the same for the trial frozen last.
        self._start: dict[str, Version] = {}
        self._end: dict[str, Version] = {}

    def reads(self, sender: str, field: str) -> bool:
        """Whether the node reads this field of this sender."""
        return any(
            source.field == field and (source.writer == sender or (source.accelerated and sender == COORDINATOR))
            for source in self._sources
        )

    def store(self, received: Received) -> None:
        """Keeps a field, or the values it refers to, under its version.

        A reference to a version that is not here is dropped: the field is then missing, and will be asked for again.
        """
        versions = self._fields.setdefault((received.envelope.sender, received.name), {})
        field = versions.get(received.same_as) if received.field is None else received.field
        if field is not None:
            versions[Version.of(received.envelope.version)] = field

    def get(self, sender: str, field: str, version: Version) -> Field | None:
        """A field of a sender at a version."""
        return self._fields.get((sender, field), {}).get(version)

    def begin(self) -> bool:
        """Begins where a run starts or goes on: each source counts as committed at the version it came with.

        False while one is missing.
        """
        start: dict[str, Version] = {}
        for source in self._sources:
            versions = self._fields.get((source.writer, source.field))
            if not versions:
                return False
            # The oldest: what a node of a slower rate holds from the start of its window comes beside the newest.
            start.setdefault(source.writer, min(versions))
        self._start = start
        return True

    def freeze(self, version: Version, iterate: Any) -> TrialInputs | None:
        """The frozen fields of the trial `version`, or `None` until all have come."""
        frozen, ends = TrialInputs(), {}
        for source in self._sources:
            end = start = self.get(*_end(source, version, iterate))
            if source.interpolate:
                start = self.get(source.writer, source.field, self._start.get(source.writer, INITIAL))
            if start is None or end is None:
                return None
            _add(frozen.start, start)
            _add(frozen.end, end)
            ends[source.writer] = resting(source.writer, iterate) or version
        self._end = ends
        return frozen

    def commit(self) -> None:
        """The node commits the trial it solved last."""
        self._start = dict(self._end)

    def accepted(self, version: Version) -> None:
        """The run accepted `version`: what neither this node nor a later reference can ask for is forgotten."""
        for (sender, _), versions in self._fields.items():
            # What a late writer refers to is its newest version, which may be older than the one accepted.
            keep = {_newest(versions, version), self._start.get(sender)}
            for at in [at for at in versions if at <= version and at not in keep]:
                del versions[at]

    def rejected(self, version: Version) -> None:
        """The attempt of `version` is dropped."""
        for versions in self._fields.values():
            for at in [at for at in versions if at[:2] == version[:2]]:
                del versions[at]

    def older_than(self, version: Version) -> list[tuple[str, Version, Field]]:
        """The fields at the start of this node's window that their writers will not send again after a restart.

        With sender and version: those older than what the writer holds at `version`.
        """
        older = []
        for (sender, _), versions in sorted(self._fields.items()):
            start = self._start.get(sender)
            if start in versions and _newest(versions, version) != start:
                older.append((sender, start, versions[start]))
        return older


def resting(node: str, iterate: Any) -> Version | None:
    """The version at which a node that rests in this iteration is read; `None` where it takes part."""
    part = _part(node, iterate)
    return Version.of(part.committed) if part and part.rests else None


def window_of(node: str, envelope: Any, iterate: Any) -> Window:
    """The window of a node: that of the run, in the envelope, where `iterate` does not name another."""
    clock = _part(node, iterate) or envelope
    return Window(clock.t_s, clock.dt_s)


def _part(node: str, iterate: Any) -> Any:
    return next((part for part in iterate.parts if part.node == node), None)


def _end(source: Any, version: Version, iterate: Any) -> tuple[str, str, Version]:
    """Sender, name and version of a source's iterate at the window's end."""
    sender, at = source.writer, resting(source.writer, iterate)
    if at is None and source.same_iteration:
        at = version
    elif at is None and version.iteration <= 1:
        at = Version.of((_part(source.writer, iterate) or iterate).committed)
    elif at is None:
        at = version._replace(iteration=version.iteration - 1)
        sender = COORDINATOR if source.accelerated else sender
    return sender, source.field, at


def _newest(versions: dict[Version, Field], version: Version) -> Version | None:
    return max((at for at in versions if at <= version), default=None)


def _add(fields: dict[str, Field], field: Field) -> None:
    """Puts a field among others, or adds it to the one of that name that is there."""
    name, other = field.port.field, fields.get(field.port.field)
    if other is None:
        fields[name] = field
        return
    if not other.stands_as(field) or {other.port.kind, field.port.kind} != {"f64"}:
        stand = " and another is ".join(
            f"{one.port.kind} on {one.rows} rows of {one.port.support} (revision {one.revision})"
            for one in (other, field)
        )
        raise Malformed(f"`{name}` is to be added up over its writers, but one is {stand}")
    fields[name] = Field(other.port, np.add(other.values, field.values).tobytes(), other.revision)
