"""Which cables are on which winch: several may be wound on one, as those of a parallelogram."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array


@dataclass(frozen=True)
class WinchGroups:
    """k winches with m >= k cables on them.

    Attributes:
        of_cable: Index of each cable's winch, counted in the order of their first cables, m of
            them.
    """

    of_cable: tuple[int, ...]

    @staticmethod
    def of_names(names: Sequence[str | None]) -> WinchGroups:
        """Cables whose winches have the same name share one; None: a winch of its own."""
        keys = [("own", i) if name is None else ("named", name) for i, name in enumerate(names)]
        order = list(dict.fromkeys(keys))
        return WinchGroups(tuple(order.index(key) for key in keys))

    @property
    def count(self) -> int:
        """Number of winches k."""
        return max(self.of_cable) + 1

    def are_shared(self) -> bool:
        """Whether any winch has several cables."""
        return self.count < len(self.of_cable)

    def first_cables(self) -> tuple[int, ...]:
        """The first cable on each winch, k of them."""
        return tuple(self.of_cable.index(winch) for winch in range(self.count))

    def leaders(self) -> tuple[int, ...]:
        """For each cable the first one on the same winch, m of them."""
        return tuple(self.of_cable.index(winch) for winch in self.of_cable)

    def sizes(self) -> Array:
        """How many cables are on the winch that each cable is on, shape (m,)."""
        return np.bincount(self.of_cable)[list(self.of_cable)].astype(float)

    def to_cables(self) -> Array:
        """Gives each cable what its winch has, shape (m, k); transposed, it adds up for winches."""
        E = np.zeros((len(self.of_cable), self.count))
        E[np.arange(len(self.of_cable)), list(self.of_cable)] = 1.0
        return E

    def means(self) -> Array:
        """Means over the cables of each winch, shape (k, m): what one velocity serves best."""
        E = self.to_cables()
        return np.asarray(E.T / np.sum(E, axis=0)[:, np.newaxis])
