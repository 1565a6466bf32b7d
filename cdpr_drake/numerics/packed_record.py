"""Named arrays in one vector of numbers, so that all of them can be one discrete state."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cdpr_drake.arrays import Array


class PackedRecord:
    """Where each of some arrays stands in a vector.

    Attributes:
        size: Numbers in the vector.
    """

    def __init__(self, shapes: Mapping[str, tuple[int, ...]]) -> None:
        """With the arrays' shapes by their names, in the order of the vector."""
        self._shapes = dict(shapes)
        sizes = [int(np.prod(shape)) for shape in self._shapes.values()]
        ends = np.cumsum(sizes)
        self._parts = [slice(int(end) - n, int(end)) for end, n in zip(ends, sizes, strict=True)]
        self.size = int(ends[-1]) if len(ends) else 0

    def views(self, vector: Array) -> dict[str, Array]:
        """The arrays of a vector, shape (size,), by their names; writing to them writes to it."""
        return {
            name: vector[part].reshape(shape)
            for (name, shape), part in zip(self._shapes.items(), self._parts, strict=True)
        }
