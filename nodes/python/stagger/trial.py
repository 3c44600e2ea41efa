"""A node's committed state and its current trial, and what the coordinator is told about it."""

from __future__ import annotations

import io
import math
import pickle
import sys
from dataclasses import dataclass, field
from typing import Any

from .convergence import change, relative
from .fields import Field, Frozen, Malformed, Values, Window
from .messages import ENERGY, Energy, Report, Support, Version
from .node import Node, Reply

Fields = dict[str, Field]
_NUMPY = {"_frombuffer", "_reconstruct", "dtype", "ndarray", "scalar"}


class NotFinite(ArithmeticError):
    """A value of a reply or of a frozen field that is not finite: the step may succeed when it is smaller."""


class Refused(RuntimeError):
    """The coordinator asked for what cannot be done."""


@dataclass
class TrialInputs:
    """The fields frozen for one trial, at the window's start and end."""

    start: Fields = field(default_factory=dict)
    end: Fields = field(default_factory=dict)


@dataclass
class Answer:
    """The written fields at the window's end, and a `Done` without times and counts."""

    fields: Fields
    done: Any


@dataclass
class _Trial:
    version: Version
    window: Window
    frozen: TrialInputs
    state: Any
    answer: Answer


class Trials:
    """Solves trials from the last committed state; nothing is kept until `commit`."""

    def __init__(self, name: str, node: Node) -> None:
        self.name = name
        self.node = node
        self._measures: dict[str, tuple[str, float]] = {}
        self._committed: tuple[Any, Fields] | None = None
        self._trial: _Trial | None = None

    def set_sources(self, measures: dict[str, tuple[str, float]]) -> None:
        """How each frozen field is measured, and the relative change below which the last reply is given again."""
        self._measures = measures

    def initial(self) -> tuple[Fields, list[Any]]:
        """The written fields and the energy held at t = 0."""
        state, reply = self.node.initial()
        fields = self._checked(reply)
        self._committed, self._trial = (state, fields), None
        return fields, _ledger(reply)

    def solve(self, version: Version, window: Window, frozen: TrialInputs) -> Answer:
        """One trial; where the frozen fields are those of the trial before, its reply once more."""
        if self._committed is None:
            raise Refused(f"{self.name}: asked for {version} before its start")
        # No physics must see to it itself: a comparison with a value that is not a number would pass it over.
        for instant, fields in (("start", frozen.start), ("end", frozen.end)):
            for name in sorted(fields):
                self._finite(fields[name], f"frozen field `{name}`, at the window's {instant},")
        trial = self._trial
        if trial and (trial.version[:2] != version[:2] or trial.window != window):
            trial = None
        if trial and self._unchanged(trial, frozen):
            done = type(trial.answer.done)()
            done.CopyFrom(trial.answer.done)
            for entry in done.changes:
                entry.change, entry.other_rows = 0.0, False
            done.reused = True
            trial.version = version
            return Answer(trial.answer.fields, done)
        state, committed = self._committed
        state, reply = self.node.solve(state, Frozen(Values(frozen.start), Values(frozen.end)), window)
        fields = self._checked(reply)
        self._fits(fields, frozen)
        done = Report().done
        for name in sorted(fields):
            if fields[name].port.measure != "none":
                done.changes.append(self._change(fields[name], trial, reply))
        done.converged = reply.step_factor is None
        done.step_factor = 1.0 if reply.step_factor is None else reply.step_factor
        done.ledger.extend(_ledger(reply))
        for name, value in reply.figures.items():
            done.figures[name] = value
        for name, support in _supports(fields).items():
            done.rows.add(field=name, support=support)
        answer = Answer(fields, done)
        self._trial = _Trial(version, window, frozen, state, answer)
        return answer

    def commit(self, version: Version) -> Fields:
        """Makes the last trial the state the next ones start from; returns its fields."""
        trial = self._trial
        if trial is None or trial.version != version:
            held = trial.version if trial else "none"
            raise Refused(f"{self.name}: asked to commit {version}, but holds {held}")
        self._committed, self._trial = (trial.state, trial.answer.fields), None
        return trial.answer.fields

    def snapshot(self) -> bytes:
        """The committed state, for `restore`."""
        if self._committed is None:
            raise Refused(f"{self.name}: asked for its state before its start")
        return pickle.dumps(self._committed[0], protocol=5)

    def restore(self, state: bytes, fields: Fields) -> None:
        """Goes on from a state that was committed with these fields."""
        module = type(self.node).__module__
        self._committed, self._trial = (_Unpickler(io.BytesIO(state), module).load(), fields), None

    def _change(self, new: Field, trial: _Trial | None, reply: Reply) -> Any:
        """How far a field moved since the trial before, or in a first one since the window's start."""
        name, committed = new.port.field, self._committed[1][new.port.field]
        start = Field.new(new.port, reply.start[name]) if name in reply.start else committed
        sums = change(new, trial.answer.fields[name] if trial else start, start)
        # At the window's start the rows may be those of this reply already; what others read was committed.
        sums.other_rows = not new.stands_as(trial.answer.fields[name] if trial else committed)
        return sums

    def _unchanged(self, trial: _Trial, frozen: TrialInputs) -> bool:
        for name, new in frozen.end.items():
            old = trial.frozen.end[name]
            if new.same(old):
                continue
            measure, below = self._measures.get(name, ("none", 0.0))
            if below <= 0.0 or not new.stands_as(old):
                return False
            # From other rows there is no increment to compare with.
            if measure == "increment" and not new.stands_as(frozen.start[name]):
                return False
            if relative(change(new, old, frozen.start[name]), measure) >= below:
                return False
        return True

    def _checked(self, reply: Any) -> Fields:
        if not isinstance(reply, Reply):
            raise Malformed(f"{self.name} answered with {type(reply).__name__}, but must return a state and a Reply")
        ports = {port.field: port for port in self.node.writes}
        if set(reply.fields) != set(ports):
            raise Malformed(
                f"{self.name} answered with the fields {sorted(reply.fields)}, but its ports say {sorted(ports)}"
            )
        fields = {name: Field.new(port, reply.fields[name]) for name, port in sorted(ports.items())}
        for name, written in fields.items():
            self._finite(written, f"field `{name}`")
        for name, _, joule, *_ in reply.ledger:
            if not math.isfinite(joule):
                raise NotFinite(f"{self.name}: the energy `{name}` is {joule} J: an input is not physical or its unit is another")
        for name, value in reply.figures.items():
            if math.isnan(value):
                raise NotFinite(f"{self.name}: the figure `{name}` is {value}: an input is not physical")
        return fields

    def _fits(self, fields: Fields, frozen: TrialInputs) -> None:
        """Refuses other numbers of rows than the frozen fields on the same rows have."""
        for name, written in fields.items():
            support, revision = written.port.support, written.revision
            for read in (*frozen.end.values(), *frozen.start.values()):
                if (read.port.support, read.revision) == (support, revision) and read.rows != written.rows:
                    raise Malformed(
                        f"{self.name}: field `{name}` has {written.rows} rows on `{support}`, but there are {read.rows} of them "
                        f"(field `{read.port.field}`, revision {revision}): a row for each is expected"
                    )

    def _finite(self, field: Field, what: str) -> None:
        at = field.first_not_finite()
        if at is not None:
            value, row = field.values.ravel()[at], at // field.port.components
            raise NotFinite(
                f"{self.name}: {what} is {value} in row {row}: the step is too large or an input is not physical"
            )


def _ledger(reply: Reply) -> list[Any]:
    return [
        Energy(name=name, kind=ENERGY[kind], joule=joule, from_nothing=any(rest)) for name, kind, joule, *rest in reply.ledger
    ]


def _supports(fields: Fields) -> dict[str, Any]:
    """The supports of fields, each once, by the first field that stands on it."""
    supports: dict[str, Any] = {}
    for name, written in sorted(fields.items()):
        support = Support(name=written.port.support, count=written.rows, revision=written.revision)
        if support not in supports.values():
            supports[name] = support
    return supports


class _Unpickler(pickle.Unpickler):
    """Reads states: NumPy's arrays and the classes of the node's own module, so that a message cannot run code."""

    def __init__(self, source: io.BytesIO, module: str) -> None:
        super().__init__(source)
        self._module = module

    def find_class(self, module: str, name: str) -> Any:
        if module.split(".")[0] == "numpy" and name in _NUMPY:
            return super().find_class(module, name)
        found = getattr(sys.modules.get(self._module), name, None) if module == self._module else None
        if isinstance(found, type) and found.__module__ == module:
            return found
        raise pickle.UnpicklingError(f"a state holds {module}.{name}, which is no class of {self._module}")
