"""The whole state of a diagram as arrays, so that a simulation can stop and go on elsewhere."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array

TIME, CONTINUOUS, DISCRETE = "time", "continuous", "discrete"
"""Names of arrays; groups of discrete state are `discrete0`, `discrete1`, ..."""


def has_arrays_only(context: Context) -> bool:
    """Whether the state of a root context is numbers only: no block has an abstract state."""
    return bool(context.get_state().get_abstract_state().size() == 0)


def state_arrays(context: Context) -> dict[str, Array]:
    """Time, continuous and discrete state of a root context, by `TIME`, `CONTINUOUS`, `DISCRETE`.

    Blocks of this package keep nothing beside it that a later step depends on: random numbers come
    from a seed and the number of the sample, and what blocks hold as attributes is the same all
    the time, or room to compute in. Parameters and fixed inputs are no part of it.

    Raises:
        ValueError: A block has an abstract state.
    """
    if not has_arrays_only(context):
        raise ValueError("a block has an abstract state, which is no array")
    groups = context.get_discrete_state()
    return {
        TIME: np.array([context.get_time()]),
        CONTINUOUS: context.get_continuous_state_vector().CopyToVector(),
        **{
            f"{DISCRETE}{k}": np.array(groups.value(k)) for k in range(groups.num_groups())
        },
    }  # fmt: skip


def restore_state(context: Context, arrays: Mapping[str, Array]) -> None:
    """Puts into a root context what `state_arrays` took out of one of the same diagram.

    Raises:
        ValueError: The arrays are those of another diagram, or not finite.
    """
    there = state_arrays(context)
    shapes = {name: values.shape for name, values in arrays.items()}
    if shapes != {name: values.shape for name, values in there.items()}:
        raise ValueError("the state is that of another diagram")
    context.SetTime(float(arrays[TIME][0]))
    context.SetContinuousState(arrays[CONTINUOUS])
    for k in range(context.get_discrete_state().num_groups()):
        context.SetDiscreteState(k, arrays[f"{DISCRETE}{k}"])
