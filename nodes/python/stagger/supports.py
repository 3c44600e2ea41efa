"""Supports: what the rows of a node's fields are in space, as its manifest describes them.

A support that no node describes is read by convention: `particles` are points at `positions`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .messages import CENTRING


@dataclass(frozen=True)
class Points:
    """Rows that are points at the field `positions` (m, 3 values per row; 3 n values are a path of n points).

    `radii` names the field with the radii of spheres, in m, where there are any.
    """

    positions: str
    radii: str = ""

    def write(self, message: Any) -> None:
        """Puts the description into a message."""
        if not self.positions:
            raise ValueError("a support of points names no field with their positions")
        message.points.positions, message.points.radii = self.positions, self.radii


@dataclass(frozen=True)
class Pairs:
    """Rows that are pairs: the u32 field `indices` holds a row of the support `of` and one of `others`, or of `of` again."""

    indices: str
    of: str
    others: str = ""

    def write(self, message: Any) -> None:
        """Puts the description into a message."""
        if not (self.indices and self.of):
            raise ValueError("a support of pairs does not say of what, and which field holds them")
        message.pairs.indices, message.pairs.of = self.indices, self.of
        message.pairs.others = self.others


@dataclass(frozen=True)
class Grid:
    """Rows that are the values of a regular grid: x runs fastest, then y, then z. It does not move during a run.

    `origin_m` is the corner with the smallest coordinates, of the first cell or the first node; `dims` counts the values
    along each axis; `centring` is "cell" or "node".
    """

    origin_m: Sequence[float]
    spacing_m: Sequence[float]
    dims: Sequence[int]
    centring: str = "cell"

    def __post_init__(self) -> None:
        if any(len(values) != 3 for values in (self.origin_m, self.spacing_m, self.dims)):
            raise ValueError("a grid needs an origin, a spacing and dims of three values each")
        if not all(map(math.isfinite, self.origin_m)):
            raise ValueError(f"the origin of a grid is {self.origin_m} m, but must be finite")
        if not all(math.isfinite(length) and length > 0 for length in self.spacing_m):
            raise ValueError(f"the spacing of a grid is {self.spacing_m} m, but must be positive")
        if any(count < 1 for count in self.dims):
            raise ValueError(f"the dims of a grid are {self.dims}, but must be at least 1")
        if self.centring.upper() not in ("CELL", "NODE"):
            raise ValueError(f"the centring of a grid is {self.centring!r}, but must be cell or node")

    @property
    def rows(self) -> int:
        """Number of values."""
        return math.prod(self.dims)

    def write(self, message: Any) -> None:
        """Puts the description into a message."""
        message.grid.origin_m.extend(self.origin_m)
        message.grid.spacing_m.extend(self.spacing_m)
        message.grid.dims.extend(self.dims)
        message.grid.centring = CENTRING[self.centring.upper()]


@dataclass(frozen=True)
class Global:
    """Rows without a place: one for the whole, or a few."""

    def write(self, message: Any) -> None:
        """Puts the description into a message."""
        getattr(message, "global").SetInParent()


Shape = Points | Pairs | Grid | Global
