"""Nodes for stagger in Python: one class with ports and `solve` takes the place of a built-in physics.

See `docs/python.md`. What a node's author needs is imported here; the protocol itself is in `host`.
"""

from .fields import Frozen, Port, Revised, Window
from .node import Node, Reply, gained, lost, stored
from .process import run
from .supports import Global, Grid, Pairs, Points

__all__ = [
    "Frozen",
    "Global",
    "Grid",
    "Node",
    "Pairs",
    "Points",
    "Port",
    "Reply",
    "Revised",
    "Window",
    "gained",
    "lost",
    "run",
    "stored",
]
