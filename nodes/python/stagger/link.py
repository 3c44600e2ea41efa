"""The link to the other processes of a run: the only module that knows Zenoh.

A node is a client of the coordinator's hub. Callbacks only enqueue: nothing is put from inside one.
"""

from __future__ import annotations

import json
import queue
import threading
from collections.abc import Callable
from typing import Any

import zenoh
from zenoh import handlers

# As in nodes/src/link.rs: how long a stopped process is taken for alive, and how long a put waits for a slow link.
_SETTINGS = {
    "mode": '"client"',
    "connect/timeout_ms": "10000",
    "connect/exit_on_failure": "true",
    "scouting/multicast/enabled": "false",
    "scouting/gossip/enabled": "false",
    "transport/link/tx/lease": "5000",
    "transport/link/tx/queue/congestion_control/block/wait_before_close": "60000000",
    # What a node puts goes through the socket: shared memory ends with its process, whoever has yet to read it. Zenoh
    # would choose it by itself. What others put there is read all the same.
    "transport/shared_memory/transport_optimization/enabled": "false",
}

Message = tuple[str, bytes, bytes]
"""Key, attachment and payload."""


def _attachment(sample: Any) -> bytes:
    return sample.attachment.to_bytes() if sample.attachment is not None else b""


class Link:
    """A session with the hub."""

    def __init__(self, connect: str, config: str | None = None) -> None:
        settings = zenoh.Config.from_file(config) if config else zenoh.Config()
        settings.insert_json5("connect/endpoints", json.dumps([connect]))
        for key, value in _SETTINGS.items():
            settings.insert_json5(key, value)
        self._session = zenoh.open(settings)
        self._declared: list[Any] = []
        # An answer may be long and waits for its reader; Zenoh's thread, which has to carry it away, must not.
        self._asked: queue.SimpleQueue[tuple[Any, Callable[[], list[Message]]]] = queue.SimpleQueue()
        threading.Thread(target=self._answer, name="answers", daemon=True).start()

    def _answer(self) -> None:
        while True:
            query, reply = self._asked.get()
            with query:
                for key, attachment, payload in reply():
                    try:
                        query.reply(key, payload, attachment=attachment)
                    except zenoh.ZError:
                        break  # A querier that is gone needs no answer.

    def publisher(self, key: str) -> Callable[[bytes | None, bytes], None]:
        """A function that puts an attachment and a payload on a key."""
        publisher = self._session.declare_publisher(
            key,
            congestion_control=zenoh.CongestionControl.BLOCK,
            reliability=zenoh.Reliability.RELIABLE,
            express=True,
        )
        self._declared.append(publisher)

        def put(attachment: bytes | None, payload: bytes) -> None:
            publisher.put(payload, attachment=attachment)

        return put

    def subscribe(self, key: str, receive: Callable[[bytes, bytes], None]) -> None:
        """Has `receive` called with attachment and payload of every message; it may only enqueue."""

        def callback(sample: Any) -> None:
            # What lies in shared memory is copied out at once: its owner may reuse it later.
            receive(_attachment(sample), sample.payload.to_bytes())

        self._declared.append(self._session.declare_subscriber(key, handlers.Callback(callback, indirect=False)))

    def answer(self, key: str, reply: Callable[[], list[Message]]) -> None:
        """Answers every query for a key."""

        def callback(query: Any) -> None:
            self._asked.put((query, reply))

        self._declared.append(self._session.declare_queryable(key, handlers.Callback(callback, indirect=False)))

    def ask(self, key: str, patience_s: float) -> bytes | None:
        """The first answer to a query, if any comes in time."""
        for reply in self._session.get(key, timeout=patience_s):
            if reply.ok is not None:
                return reply.ok.payload.to_bytes()
        return None

    def announce(self, key: str) -> None:
        """Shows a key as alive until this process ends."""
        self._declared.append(self._session.liveliness().declare_token(key))

    def watch(self, key: str, gone: Callable[[], None]) -> None:
        """Has `gone` called when a key under `key` is no longer alive; it may only enqueue."""

        def callback(sample: Any) -> None:
            if sample.kind == zenoh.SampleKind.DELETE:
                gone()

        declare = self._session.liveliness().declare_subscriber
        self._declared.append(declare(key, handlers.Callback(callback, indirect=False), history=True))

    def close(self) -> None:
        """Ends the session after everything put has left."""
        self._session.close()
