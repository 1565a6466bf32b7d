"""Functions in programs of Drake: with a gradient of their own, or one by differences."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue

from cdpr_drake.arrays import Array

DIFFERENCE = 1e-6
"""Step of central differences, of the size of a value: of a smooth function the error of the
derivative is about 1e-10 of it."""

Function = Callable[[Array], object]
"""Of values, shape (k,): one number, or rows, shape (r,)."""


class ProgramFunction(ABC):
    """Numbers with an analytic gradient, as Drake evaluates a cost or a constraint."""

    @abstractmethod
    def rows(self, x: Array) -> tuple[Array, Array]:
        """Numbers, shape (r,), and derivatives, shape (r, n)."""

    def numbers(self, x: Array) -> Array:
        """The numbers alone, shape (r,)."""
        return self.rows(x)[0]

    def __call__(self, x: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
        """Numbers, or numbers with their gradients."""
        if x.dtype != object:
            return self.numbers(np.asarray(x, float))
        values, slopes = self.rows(ExtractValue(x).ravel())
        inner = ExtractGradient(x)
        if not inner.size:
            return np.array([AutoDiffXd(value) for value in values])
        return np.array([AutoDiffXd(v, row @ inner) for v, row in zip(values, slopes, strict=True)])


class ProgramCost(ABC):
    """A cost with an analytic gradient, as Drake evaluates it."""

    @abstractmethod
    def value(self, x: Array) -> tuple[float, Array]:
        """Cost and gradient."""

    def __call__(self, x: npt.NDArray[np.generic]) -> object:
        """A number, or one with its gradient."""
        if x.dtype != object:
            return self.value(np.asarray(x, float))[0]
        cost, gradient = self.value(ExtractValue(x).ravel())
        inner = ExtractGradient(x)
        if not inner.size:
            return AutoDiffXd(cost)
        return AutoDiffXd(cost, gradient @ inner)


def central_differences(function: Function, values: Array, sizes: Array) -> Array:
    """Derivatives of numbers by values, shape (r, k).

    Args:
        function: The numbers.
        values: Where, shape (k,).
        sizes: How large each value is, in its unit, shape (k,): steps are `DIFFERENCE` of it.
    """
    columns = []
    for k, size in enumerate(sizes):
        step = np.zeros(len(values))
        step[k] = DIFFERENCE * size
        more, less = (np.atleast_1d(np.asarray(function(values + s), float)) for s in (step, -step))
        columns.append((more - less) / (2.0 * step[k]))
    return np.array(columns).T


class ValueFunction(ProgramFunction):
    """A function of values that are offset + matrix @ x, by differences in the values."""

    def __init__(
        self, function: Function, matrix: Array, offset: Array, scale: float | Array = 1.0
    ) -> None:
        """Of matrix (k, n) and offset (k,); numbers are multiplied by a scale, each by its own."""
        self._function, self._matrix, self._offset = function, matrix, offset
        self._scale = scale
        self._sizes = np.maximum(np.linalg.norm(matrix, axis=1), 1e-300)

    def numbers(self, x: Array) -> Array:
        """The numbers, shape (r,)."""
        found = np.asarray(self._function(self._offset + self._matrix @ x), float)
        return np.atleast_1d(found).ravel() * self._scale

    def rows(self, x: Array) -> tuple[Array, Array]:
        """Numbers and derivatives."""
        values = self._offset + self._matrix @ x
        slopes = central_differences(self._function, values, self._sizes) @ self._matrix
        return self.numbers(x), (slopes.T * self._scale).T


class ValueCost(ProgramCost):
    """One number of values as a cost, see `ValueFunction`."""

    def __init__(self, function: Function, matrix: Array, offset: Array, scale: float) -> None:
        """As of `ValueFunction`."""
        self._rows: ProgramFunction = ValueFunction(function, matrix, offset, scale)

    def value(self, x: Array) -> tuple[float, Array]:
        """Cost and gradient."""
        values, slopes = self._rows.rows(x)
        return float(values[0]), slopes[0]

    def __call__(self, x: npt.NDArray[np.generic]) -> object:
        """A number, or one with its gradient."""
        if x.dtype != object:
            return float(self._rows.numbers(np.asarray(x, float))[0])
        return super().__call__(x)
