"""A node as a process: told by its environment who it is, ended by its parent's end."""

from __future__ import annotations

import os
import stat
import sys
import threading

from . import scene
from .host import Event, Host, Identity
from .link import Link
from .node import Node
from .trial import Trials

_PARENT_GONE_S = 2.0
"""How long a node whose parent is gone may work on before it is ended in the middle of what it does."""
_COORDINATOR_GONE_S = 8.0
"""The same where the coordinator is gone: what was said last is still to leave, over a link that may be slow."""


def run(node_class: type[Node]) -> None:
    """Runs a node of this class until its run ends; the process ends with 0 where the run completed, else with 1."""
    # Before anything that may take its time, and needs to be ended with the run.
    parent = _Parent()
    try:
        node, connect, config = _identity(), _variable("STAGGER_CONNECT"), os.environ.get("STAGGER_ZENOH_CONFIG")
    except (RuntimeError, ValueError) as error:
        sys.exit(f"error: {error}")
    trials = Trials(node.node, node_class())
    link = Link(connect, config)
    host = Host(link, node, trials)
    parent.tell(host)
    link.watch(f"stagger/{node.run}/live/coordinator/*", lambda: _end_within(_COORDINATOR_GONE_S))
    try:
        end = host.run()
    finally:
        # Whatever happened, what was said last must leave.
        link.close()
    if not end.completed:
        sys.exit(f"`{node.node}` ends: {end.reason}")


def _variable(name: str) -> str:
    value = os.environ.get(name)
    if not value:
        raise ValueError(f"{name} is not set: `stagger run SCENE --node NAME=COMMAND` sets it (docs/nodes.md)")
    return value


def _identity() -> Identity:
    given = os.environ.get("STAGGER_SCENE_HASH")
    # Who starts a node by hand does not know the hash; the program does.
    scene_hash = int(given) if given else int(scene.read()["hash"], 16)
    return Identity(_variable("STAGGER_RUN"), _variable("STAGGER_NODE"), scene_hash)


def _end_within(seconds: float) -> None:
    """Ends this process whatever it does then, unless it has ended by itself."""
    ending = threading.Timer(seconds, os._exit, [1])
    ending.daemon = True
    ending.start()


class _Parent:
    """The standard input is a pipe that the kernel closes when the parent ends, however that happens."""

    def __init__(self) -> None:
        self._lock, self._gone = threading.Lock(), False
        self._host: Host | None = None
        # Started by hand, the coordinator's token tells.
        if _is_pipe(0):
            threading.Thread(target=self._watch, name="parent", daemon=True).start()

    def tell(self, host: Host) -> None:
        """Has a host hear of the parent's end, now where it has come."""
        with self._lock:
            self._host = host
            if self._gone:
                host.events.put(Event("gone"))

    def _watch(self) -> None:
        try:
            while os.read(0, 4096):
                pass
        except OSError:
            pass  # As good as its end.
        _end_within(_PARENT_GONE_S)
        with self._lock:
            self._gone = True
            if self._host is not None:
                self._host.events.put(Event("gone"))


def _is_pipe(descriptor: int) -> bool:
    try:
        return stat.S_ISFIFO(os.fstat(descriptor).st_mode)
    except OSError:
        return False  # Closed.
