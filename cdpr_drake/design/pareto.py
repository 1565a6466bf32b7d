"""Which designs no other one is better than."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array


def undominated(values: Array) -> np.ndarray:
    """Which rows no other row equals or exceeds in everything and exceeds in something.

    Args:
        values: One design a row, larger is better, shape (n, k); rows with NaN never count.

    Returns:
        Shape (n,), bool. Of equal rows the first counts.
    """
    values = np.asarray(values, float)
    good = np.all(np.isfinite(values), axis=1)
    front = good.copy()
    for i in np.flatnonzero(good):
        others = values[good]
        better = np.all(others >= values[i], axis=1) & np.any(others > values[i], axis=1)
        equal = np.all(values[:i] == values[i], axis=1) & good[:i]
        front[i] = not np.any(better) and not np.any(equal)
    return front
