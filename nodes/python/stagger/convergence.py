"""How far a field moved (Zohdi 2018, section 6.4), summed as the Rust nodes sum: the same bits decide alike."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .fields import Field
from .messages import Change

_LANES = 8


def change(new: Field, previous: Field, start: Field) -> Any:
    """Sums over rows of the changes from the iterate before and from the value at the window's start (eq. 6.48).

    From a value on other rows there is no distance, and the value itself counts.
    """
    sums = Change(field=new.port.field, rows=new.rows)
    sums.change, sums.worst_row = _distance(new.values, _on_rows_of(new, previous))
    if new.port.measure == "increment":
        sums.increment, _ = _distance(new.values, _on_rows_of(new, start))
    elif new.port.measure == "magnitude":
        sums.magnitude, _ = _distance(new.values, None)
    return sums


def _on_rows_of(field: Field, other: Field) -> np.ndarray | None:
    return other.values if other.stands_as(field) and other.values.shape == field.values.shape else None


def relative(sums: Any, measure: str) -> float:
    """The relative change: 0 for a field that did not move, infinite for one that moved back to where it began."""
    if measure == "none" or sums.change == 0.0:
        return 0.0
    denominator = sums.increment if measure == "increment" else sums.magnitude
    return sums.change / denominator if denominator else math.inf


def _distance(a: np.ndarray, b: np.ndarray | None) -> tuple[float, int]:
    """Sum over rows of the norm of a − b (of a where there is no b), and the row where it is largest."""
    difference = a if b is None else a - b
    if difference.ndim == 1:
        difference = difference[:, np.newaxis]
    # Column after column: NumPy's own sums would change their order with the number of components.
    squares = difference[:, 0] * difference[:, 0]
    for column in range(1, difference.shape[1]):
        squares = squares + difference[:, column] * difference[:, column]
    norms = np.sqrt(squares)
    if not len(norms):
        return 0.0, 0
    padded = np.zeros(-(-len(norms) // _LANES) * _LANES)
    padded[: len(norms)] = norms
    # Accumulated, not reduced: row upon row whatever NumPy does to sum faster.
    lanes = np.add.accumulate(padded.reshape(-1, _LANES), axis=0)[-1]
    total = 0.0
    for lane in lanes:
        total += float(lane)
    return total, int(np.argmax(norms))
