"""What a node's author writes: a class with ports, `initial` and `solve`."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, NamedTuple

from . import scene
from .fields import Frozen, Port, Window
from .supports import Shape


class Energy(NamedTuple):
    """One line of the energy ledger, in J."""

    name: str
    kind: str
    joule: float
    from_nothing: bool = False


def stored(name: str, joule: float, *, from_nothing: bool = False) -> Energy:
    """Energy held at the end of the window, in J.

    `from_nothing` says that it is counted from nothing, as an energy of motion is, and not from a level chosen freely, as
    heat and potentials are: all of it then counts as turned over when the imbalance is measured.
    """
    return Energy(name, "STORED", joule, from_nothing)


def gained(name: str, joule: float) -> Energy:
    """Energy that entered during the window, in J. Another node that loses it gives it the same name."""
    return Energy(name, "GAINED", joule)


def lost(name: str, joule: float) -> Energy:
    """Energy that left during the window, in J."""
    return Energy(name, "LOST", joule)


@dataclass
class Reply:
    """The written fields at the window's end by name, and what happened on the way.

    `figures` are quantities a user should see, by name with unit. `step_factor`, in (0, 1), says that the node's own
    solver did not converge and by what factor the step should shrink. Where rows came or went since the last commit,
    `start` holds written fields at the window's start on the rows of this reply: their change is measured from there.
    """

    fields: Mapping[str, Any]
    ledger: Sequence[Energy] = ()
    figures: Mapping[str, float] = field(default_factory=dict)
    step_factor: float | None = None
    start: Mapping[str, Any] = field(default_factory=dict)


class Node:
    """A physics: a pure function from the frozen fields of a window to its own fields at the window's end.

    `solve` is a trial: the same inputs give the same bits, it changes neither `self` nor `state`, and what it returns
    is kept only where the coordinator commits it. A state is made of numbers, texts, lists, dicts, NumPy arrays and
    classes of the node's own module, so that it can be stored in a checkpoint.
    """

    reads: Sequence[Port] = ()
    writes: Sequence[Port] = ()
    supports: Mapping[str, Shape] = MappingProxyType({})
    """What the rows of the supports are that this node makes, by name; those of other nodes are described by them."""

    @functools.cached_property
    def scene(self) -> dict[str, Any]:
        """The scene with all defaults and material constants, in SI units, as `stagger check --json` tells it."""
        return scene.read()

    def initial(self) -> tuple[Any, Reply]:
        """The state and the written fields at t = 0, with the energy held then."""
        raise NotImplementedError(f"{type(self).__name__} does not say how it starts: it needs a method `initial`")

    def solve(self, state: Any, frozen: Frozen, window: Window) -> tuple[Any, Reply]:
        """The state and the written fields at the window's end, from the state at its start."""
        raise NotImplementedError(f"{type(self).__name__} does not say what it computes: it needs a method `solve`")
