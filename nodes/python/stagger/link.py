"""The link to the other processes of a run: the only module that knows Zenoh.

A node is a client of the coordinator's hub or of a router. Callbacks only enqueue: nothing is put from inside one.
"""

from __future__ import annotations

import json
import os
import queue
import threading
from collections.abc import Callable
from typing import Any

import zenoh
from zenoh import handlers

# As in nodes/runtime/src/link/zenoh_config.rs. What a file may change: how long a stopped process is taken for alive, and how long a put
# waits for a slow link, after which the message is given up: what is lost is asked for again. What a node puts goes
# through the socket: shared memory, which Zenoh would choose by itself, ends with its process, whoever has yet to read it.
# What others put there is read all the same.
_DEFAULTS = {
    "connect/timeout_ms": "10000",
    "connect/exit_on_failure": "true",
    "transport/link/tx/lease": "5000",
    "transport/link/tx/queue/congestion_control/drop/wait_before_drop": "60000000",
    "transport/link/tx/queue/congestion_control/drop/max_wait_before_drop_fragments": "60000000",
    "transport/shared_memory/transport_optimization/enabled": "false",
}
# What it may not: the endpoint is the one given, and nothing is looked for beyond it.
_FIXED = {
    "mode": '"client"',
    "listen/endpoints": "[]",
    "scouting/multicast/enabled": "false",
    "scouting/gossip/enabled": "false",
}

Message = tuple[str, bytes, bytes]
"""Key, attachment and payload."""


def settings(connect: str, file: str | None = None) -> zenoh.Config:
    """The configuration of a node: our defaults, then a file in Zenoh's JSON5, then what is fixed."""
    found, silent = zenoh.Config.from_file(file) if file else zenoh.Config(), zenoh.Config()
    for key, value in _DEFAULTS.items():
        # Zenoh does not tell what a file is silent about from what it sets to Zenoh's own default.
        if found.get_json(key) == silent.get_json(key):
            found.insert_json5(key, value)
    for key, value in {**_FIXED, "connect/endpoints": json.dumps([connect])}.items():
        found.insert_json5(key, value)
    # Certificates and keys are named from the folder of the file, so that a node may be started anywhere.
    for name, path in json.loads(found.get_json("transport/link/tls")).items():
        if file and path and name.endswith(("_certificate", "_private_key")):
            found.insert_json5(f"transport/link/tls/{name}", json.dumps(os.path.join(os.path.dirname(file), path)))
    return found


def check_files(config: zenoh.Config) -> None:
    """Certificates and keys must be there: Zenoh would only say, after ten seconds, that nobody answers."""
    for name, path in json.loads(config.get_json("transport/link/tls")).items():
        if path and name.endswith(("_certificate", "_private_key")) and not os.access(path, os.R_OK):
            raise FileNotFoundError(f"transport/link/tls/{name}: {path} cannot be read")


def _attachment(sample: Any) -> bytes:
    return sample.attachment.to_bytes() if sample.attachment is not None else b""


class Link:
    """A session with the hub."""

    def __init__(self, connect: str, config: str | None = None) -> None:
        found = settings(connect, config)
        check_files(found)
        self._session = zenoh.open(found)
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
            congestion_control=zenoh.CongestionControl.DROP,
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
