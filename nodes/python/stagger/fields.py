"""Fields: what one node computes and others read, as NumPy arrays and as bytes.

On the wire a field is two byte strings: its values, raw and little-endian, and a header (`FieldMessage` without them).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import xxhash

from .messages import KIND, MEASURE, FieldMessage, FieldSummary, Version

_TYPES = {"f64": np.dtype("<f8"), "u32": np.dtype("<u4"), "u8": np.dtype("u1")}
_KIND_OF_NUMBER = {KIND[kind.upper()]: kind for kind in _TYPES}
_MEASURE_OF_NUMBER = {number: name.removeprefix("MEASURE_").lower() for name, number in MEASURE.items()}
# Tags of the value arrays in field.proto: number << 3 | 2, a length-delimited field.
_TAGS = {"f64": 13 << 3 | 2, "u32": 14 << 3 | 2, "u8": 15 << 3 | 2}


class Malformed(ValueError):
    """A message that is incomplete, or whose values do not fill the shape it announces."""


class Window(NamedTuple):
    """A window of simulated time [t_s, t_s + dt_s], in s."""

    t_s: float
    dt_s: float


@dataclass(frozen=True)
class Port:
    """A field that a node reads or writes: its name, SI unit ("1" for pure numbers) and the support its rows stand on.

    `measure` says how the convergence of a written field is measured: "magnitude" for temperature and the like,
    "increment" for motion, "none" for what is not tested. A read field with `adds_up` may have several writers.
    One that is `optional` may have none: it is then not among the frozen fields.
    """

    field: str
    unit: str
    support: str
    components: int = 1
    kind: str = "f64"
    measure: str = "none"
    adds_up: bool = False
    optional: bool = False

    def __post_init__(self) -> None:
        if self.kind not in _TYPES:
            raise ValueError(f"port `{self.field}`: the kind is {self.kind!r}, but must be one of {', '.join(_TYPES)}")
        measures = _MEASURE_OF_NUMBER.values()
        if self.measure not in measures:
            expected = ", ".join(measures)
            raise ValueError(f"port `{self.field}`: the measure is {self.measure!r}, but must be one of {expected}")
        if self.components < 1:
            raise ValueError(f"port `{self.field}`: {self.components} values per row, but there must be one at least")

    def write(self, message: Any) -> None:
        """Puts the port into a message."""
        message.field, message.unit, message.support = self.field, self.unit, self.support
        message.components, message.adds_up, message.optional = self.components, self.adds_up, self.optional
        message.kind = KIND[self.kind.upper()]
        message.measure = MEASURE[f"MEASURE_{self.measure.upper()}"]

    @classmethod
    def of(cls, message: Any) -> Port:
        """The port in a message."""
        kind, measure = _KIND_OF_NUMBER.get(message.kind), _MEASURE_OF_NUMBER.get(message.measure)
        if kind is None or measure is None or message.components < 1:
            raise Malformed(f"field `{message.field}` has no known shape")
        shape = (message.components, kind, measure, message.adds_up, message.optional)
        return cls(message.field, message.unit, message.support, *shape)


@dataclass(frozen=True)
class Revised:
    """Values on a support whose rows change: `revision` grows whenever rows appear, vanish or change their meaning."""

    values: Any
    revision: int


@dataclass(frozen=True)
class Field:
    """Values of a port: one row for each item of its support; read-only."""

    port: Port
    raw: bytes
    revision: int = 0
    values: np.ndarray = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        values = np.frombuffer(self.raw, _TYPES[self.port.kind])
        if self.port.components > 1:
            values = values.reshape(-1, self.port.components)
        object.__setattr__(self, "values", values)

    @classmethod
    def new(cls, port: Port, values: Any) -> Field:
        """Values as a node gives them: an array of one row per item, or such an array with its revision."""
        revision = 0
        if isinstance(values, Revised):
            values, revision = values.values, values.revision
        array = np.asarray(values)
        expected = 1 if port.components == 1 else 2
        if array.ndim != expected or (expected == 2 and array.shape[1] != port.components):
            shape = "(rows,)" if expected == 1 else f"(rows, {port.components})"
            raise Malformed(f"field `{port.field}` has the shape {array.shape}, but its port says {shape}")
        if not np.can_cast(array.dtype, _TYPES[port.kind], "same_kind"):
            raise Malformed(f"field `{port.field}` holds {array.dtype} values, but its port says {port.kind}")
        return cls(port, array.astype(_TYPES[port.kind]).tobytes(), revision)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.values)

    def same(self, other: Field) -> bool:
        """Whether it holds the same bits on the same support."""
        return self.stands_as(other) and self.raw == other.raw

    def stands_as(self, other: Field) -> bool:
        """Whether it stands on the same rows."""
        ours, theirs = (self.port.support, self.rows, self.revision), (other.port.support, other.rows, other.revision)
        return ours == theirs

    def first_not_finite(self) -> int | None:
        """Index of the first value that is not finite, counted through all rows."""
        if self.port.kind != "f64":
            return None
        bad = np.flatnonzero(~np.isfinite(self.values))
        return int(bad[0]) if len(bad) else None

    def header(self, envelope: Any, same_as: Version | None = None) -> bytes:
        """Everything but the values; `same_as` names the version whose values they repeat."""
        message = FieldMessage(envelope=envelope)
        self.port.write(message.port)
        message.support.name, message.support.count = self.port.support, self.rows
        message.support.revision = self.revision
        if same_as is not None:
            same_as.write(message.same_as)
        return message.SerializeToString()

    def message(self, envelope: Any) -> Any:
        """Header and values as one message; its packed arrays hold exactly the bytes of the wire."""
        size, length = len(self.raw), b""
        while size > 0x7F:
            length += bytes([size & 0x7F | 0x80])
            size >>= 7
        packed = bytes([_TAGS[self.port.kind]]) + length + bytes([size]) + self.raw
        return FieldMessage.FromString(self.header(envelope) + packed)

    def summary(self) -> Any:
        """Smallest, mean and largest value, and the hash of the bytes."""
        summary = FieldSummary(field=self.port.field, unit=self.port.unit, rows=self.rows)
        summary.hash = xxhash.xxh3_64_intdigest(self.raw)
        if self.values.size:
            flat = self.values.ravel()
            # In their order, one after the other, as every node sums.
            total = float(np.add.accumulate(flat, dtype=np.float64)[-1])
            summary.min, summary.mean, summary.max = float(flat.min()), total / flat.size, float(flat.max())
        return summary


class Received(NamedTuple):
    """A field as it came; `field` is `None` where it only names the version whose values it repeats."""

    envelope: Any
    name: str
    field: Field | None
    same_as: Version | None


def receive(header: Any, raw: bytes) -> Received:
    """A field from its header and its values."""
    if not (header.HasField("envelope") and header.HasField("port") and header.HasField("support")):
        raise Malformed("a field lacks its envelope, its port or its support")
    port = Port.of(header.port)
    if header.HasField("same_as"):
        return Received(header.envelope, port.field, None, Version.of(header.same_as))
    if len(raw) != header.support.count * port.components * _TYPES[port.kind].itemsize:
        raise Malformed(f"field `{port.field}`: {len(raw)} bytes do not fill {header.support.count} rows")
    return Received(header.envelope, port.field, Field(port, raw, header.support.revision), None)


def receive_message(message: Any) -> Received:
    """A field from a message that holds its values."""
    kind = _KIND_OF_NUMBER.get(message.port.kind, "u8")
    values = message.u8 if kind == "u8" else np.array(getattr(message, kind), _TYPES[kind]).tobytes()
    return receive(message, values)


class Values(Mapping[str, np.ndarray]):
    """Arrays by field name; `revision` tells which list of rows one of them stands on."""

    def __init__(self, fields: dict[str, Field]) -> None:
        self.fields = fields

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.fields:
            raise KeyError(f"no port reads `{name}`")
        return self.fields[name].values

    def __iter__(self) -> Iterator[str]:
        return iter(self.fields)

    def __len__(self) -> int:
        return len(self.fields)

    def revision(self, name: str) -> int:
        """Revision of the field's support: two fields fit together only at equal revisions."""
        return self.fields[name].revision


class Frozen(NamedTuple):
    """The other nodes' fields, frozen for one trial: at the window's start and, at their newest iterate, at its end."""

    start: Values
    end: Values
