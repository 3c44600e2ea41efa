"""The fields a node has received, by name, sender and version."""

from __future__ import annotations

from collections.abc import Collection

from .fields import Field, Received
from .messages import Version

Sender = tuple[str, str]
"""Name of a field, and who sent it: its writer, or the coordinator where it accelerates the field."""


class Mailbox:
    """Received fields from the committed version on."""

    def __init__(self) -> None:
        self._fields: dict[Sender, dict[Version, Field]] = {}

    def store(self, received: Received) -> bool:
        """Keeps a field under its version.

        A reference to a version that is not here is dropped: the field is missing then, and will be asked for again.
        """
        versions = self._fields.setdefault((received.name, received.envelope.sender), {})
        field = received.field if received.same_as is None else versions.get(received.same_as)
        if field is not None:
            versions[Version.of(received.envelope.version)] = field
        return field is not None

    def get(self, sender: Sender, version: Version) -> Field | None:
        """A field at a version."""
        return self._fields.get(sender, {}).get(version)

    def forget_before(self, version: Version, keep: Collection[tuple[Sender, Version]]) -> None:
        """Forgets what is older than an accepted version, but for what is named."""
        for sender, versions in self._fields.items():
            # What a late writer refers to is its newest version, which may be older than the one accepted.
            newest_before = max((at for at in versions if at < version), default=None)
            for at in list(versions):
                if at < version and at != newest_before and (sender, at) not in keep:
                    del versions[at]
