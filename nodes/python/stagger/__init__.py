"""Nodes for stagger in Python: one class with ports and `solve` takes the place of a built-in physics.

See `docs/python.md`. What a node's author needs is imported here; the protocol itself is in `host`.
"""

from .fields import Frozen, Port, Revised, Window
from .node import Node, Reply, gained, lost, stored
from .process import run

__all__ = ["Frozen", "Node", "Port", "Reply", "Revised", "Window", "gained", "lost", "run", "stored"]
