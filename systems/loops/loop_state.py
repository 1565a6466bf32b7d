"""The state of a loop as arrays, so that a run can stop and go on elsewhere, and its clocks.

`Part`, `arrays_of` and `restore_arrays` are the state; `Clock` and `first_time` say when a periodic
event comes, as Drake says it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from cdpr_drake.arrays import Array


class Part(NamedTuple):
    """A part of a state.

    Attributes:
        name: Its name, another one for each part.
        give: Gives it as an array.
        take: Puts such an array in its place.
    """

    name: str
    give: Callable[[], Array]
    take: Callable[[Array], None]


def attribute(name: str, owner: object, field: str) -> Part:
    """An array that an attribute of an object is, and that is replaced when it changes."""
    return Part(name, lambda: getattr(owner, field), lambda values: setattr(owner, field, values))


def entry(name: str, of: dict[str, Array]) -> Part:
    """An array that stands in a dict by the part's name, and is replaced when it changes."""
    return Part(name, lambda: of[name], lambda values: of.update({name: values}))


def held(name: str, array: Array) -> Part:
    """An array that stays the same object, since kernels know where it is."""

    def take(values: Array) -> None:
        array[...] = values

    return Part(name, lambda: array, take)


def arrays_of(parts: list[Part]) -> dict[str, Array]:
    """Copies of what parts give, by their names."""
    return {part.name: np.array(part.give(), float) for part in parts}


def restore_arrays(parts: list[Part], arrays: Mapping[str, Array]) -> None:
    """Gives parts what `arrays_of` made of those of the same loop.

    Raises:
        ValueError: The arrays are those of another loop.
    """
    there = {name: values.shape for name, values in arrays_of(parts).items()}
    if {name: values.shape for name, values in arrays.items()} != there:
        raise ValueError("the state is that of another loop")
    for part in parts:
        part.take(np.array(arrays[part.name]))


def next_time(now: float, period: float) -> float:
    """First multiple of a period after now [s].

    To the last bit that of Drake's LeafSystem, so that events which coincide in a diagram coincide
    in a loop, and steps between events are the same.
    """
    count = math.ceil(now / period)
    later = count * period
    return later if later > now else (count + 1) * period


class Clock:
    """A periodic event, at 0 and at every multiple of its period [s]."""

    def __init__(self, period: float) -> None:
        """With the period."""
        self.period, self.next = period, 0.0

    def strikes(self, now: float) -> bool:
        """Whether the event is due now; if so, the next one is looked for."""
        if self.next != now:
            return False
        self.next = next_time(now, self.period)
        return True


def first_time(clocks: list[Clock], end: float) -> float:
    """When the first of clocks strikes, but not after an end [s]."""
    for clock in clocks:
        if clock.next < end:
            end = clock.next
    return end
