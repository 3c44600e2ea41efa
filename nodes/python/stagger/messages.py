"""The messages of `messages/proto` as classes, built from the descriptors the Rust crate compiles (`descriptors.bin`).

A test of that crate says when the file is stale, and renews it with STAGGER_BLESS=1.
"""

from __future__ import annotations

from importlib import resources
from typing import Any, NamedTuple

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

SCHEMA_VERSION = 2
"""Version of the schemas; a message with another one is refused."""

_pool = descriptor_pool.DescriptorPool()
_files = descriptor_pb2.FileDescriptorSet.FromString(
    resources.files(__package__).joinpath("descriptors.bin").read_bytes()
)
for _file in _files.file:
    _pool.AddSerializedFile(_file.SerializeToString())


def _message(name: str) -> Any:
    return message_factory.GetMessageClass(_pool.FindMessageTypeByName(f"stagger.v1.{name}"))


def _numbers(name: str) -> dict[str, int]:
    return {value.name: value.number for value in _pool.FindEnumTypeByName(f"stagger.v1.{name}").values}


Change, Directive, Energy, Envelope = map(_message, ("Change", "Directive", "Energy", "Envelope"))
FieldMessage, FieldSummary, Manifest = map(_message, ("FieldMessage", "FieldSummary", "Manifest"))
Report, Snapshot, Support = map(_message, ("Report", "Snapshot", "Support"))

KIND = _numbers("ValueKind")
MEASURE = _numbers("Measure")
CENTRING = _numbers("Centring")
ENERGY = _numbers("Energy.Kind")
ACCEPT, REJECT = (_numbers("Verdict")[f"VERDICT_{verdict}"] for verdict in ("ACCEPT", "REJECT"))


class Version(NamedTuple):
    """Which trial something belongs to; (0, 0, 0) is the initial state. Ordered as the run goes on."""

    step: int
    attempt: int
    iteration: int

    @classmethod
    def of(cls, message: Any) -> Version:
        """The version in a message."""
        return cls(message.step, message.attempt, message.iteration)

    def write(self, message: Any) -> None:
        """Puts the version into a message, where even (0, 0, 0) is then present."""
        message.SetInParent()
        message.step, message.attempt, message.iteration = self

    def __str__(self) -> str:
        return f"step {self.step}, attempt {self.attempt}, iteration {self.iteration}"


INITIAL = Version(0, 0, 0)
