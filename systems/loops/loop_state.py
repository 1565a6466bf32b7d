"""The whole state of a loop as arrays, so that a run can stop and go on elsewhere."""

from __future__ import annotations

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
