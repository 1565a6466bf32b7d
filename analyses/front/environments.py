"""Learning environments of a robot: their names, and one made ready to be begun."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

from cdpr_drake.errors import CdprError
from cdpr_drake.schema.typed_yaml import closest

BEGIN, END = "cdpr/", "-v0"
"""Round the name of a task in Gymnasium's list."""


def environment_names() -> list[str]:
    """Names of the environments, as `gymnasium.make` takes them.

    Raises:
        CdprError: Gymnasium is not installed.
    """
    return [f"{BEGIN}{name}{END}" for name in _registered().STEPS]


def make_environment(name: str, count: int | None = None, **options: Any) -> Any:
    """A learning environment: `gymnasium.make`, or `make_vec` for many robots at once.

        envs = cdpr.make_environment("Reach", 256, robot="caroca", action="twist")

    Args:
        name: Reach, Track, VisualServo or PickAndPlace, with or without what Gymnasium's list has
            round it, as in cdpr/Reach-v0.
        count: Number of robots, moved by one compiled call; None: one, alone.
        options: Fields of the task's options, such as robot, action, randomise; render_mode.

    Returns:
        A `gymnasium.Env`, or of many a `gymnasium.vector.VectorEnv`.

    Raises:
        CdprError: Gymnasium is not installed; there is no such environment, or an option is not
            accepted.
    """
    known = environment_names()
    asked = name if name.startswith(BEGIN) else f"{BEGIN}{name}{END}"
    if asked not in known:
        short = [one.removeprefix(BEGIN).removesuffix(END) for one in known]
        raise CdprError(f"environment {name!r} is unknown; {closest(name, short)}")
    if count is not None and count < 1:
        raise CdprError(f"count: found {count}; accepted: 1 or more")
    gymnasium: Any = import_module("gymnasium")
    make: Callable[..., Any] = gymnasium.make if count is None else gymnasium.make_vec
    if count is not None:
        options = {"num_envs": count, **options}
    return make(asked, **options)


def _registered() -> ModuleType:
    """What registers them, once."""
    return import_module("cdpr_drake.gym")
