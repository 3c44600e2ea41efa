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

_GRACE_S = 2.0
"""How long a node whose parent is gone may work on before it is ended in the middle of its `solve`."""


def run(node_class: type[Node]) -> None:
    """Runs a node of this class until its run ends; the process ends with 0 where the run completed, else with 1."""
    try:
        node, connect, config = _identity(), _variable("STAGGER_CONNECT"), os.environ.get("STAGGER_ZENOH_CONFIG")
    except (RuntimeError, ValueError) as error:
        sys.exit(f"error: {error}")
    trials = Trials(node.node, node_class())
    link = Link(connect, config)
    host = Host(link, node, trials)
    _watch_parent(host)
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


def _watch_parent(host: Host) -> None:
    """The standard input is a pipe that the kernel closes when the parent ends, however that happens."""
    if not stat.S_ISFIFO(os.fstat(0).st_mode):
        return  # Started by hand: the coordinator's token tells.

    def watch() -> None:
        try:
            while os.read(0, 4096):
                pass
        except OSError:
            pass  # As good as its end.
        host.events.put(Event("gone"))
        ending = threading.Timer(_GRACE_S, os._exit, [1])
        ending.daemon = True
        ending.start()

    threading.Thread(target=watch, name="parent", daemon=True).start()
