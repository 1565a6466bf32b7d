"""Benchmarks of learning environments: many robots at once beside one after the other."""

from __future__ import annotations

import importlib.util
from importlib import import_module
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, processor_seconds

TASKS = ("Reach", "Track", "VisualServo", "PickAndPlace")

ONE_BY_ONE = 8
"""Robots that are stepped one after the other, each an environment of its own."""


def learning_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; none where Gymnasium is not installed."""
    if importlib.util.find_spec("gymnasium") is None:
        return []
    count, steps, repeats = (32, 5, 2) if quick else (256, 50, 5)
    return [_row(task, count, steps, repeats) for task in TASKS]


def _row(task: str, count: int, steps: int, repeats: int) -> TimingRow:
    gymnasium: Any = import_module("gymnasium")
    import_module("cdpr_drake.gym")  # registers them
    name = f"cdpr/{task}-v0"
    many, alone = (
        gymnasium.make_vec(name, number, action="twist", vectorization_mode=mode)
        for number, mode in ((count, "vector_entry_point"), (ONE_BY_ONE, "sync"))
    )
    for envs in (many, alone):
        envs.reset(seed=0)
    works = [lambda: steps_per_second(many, steps), lambda: steps_per_second(alone, steps)]
    at_once, single = interleaved(works, repeats)
    return TimingRow(
        f"cdpr/{task}-v0, {count} robots in one environment", at_once,
        "steps per s of processor time", f"{ONE_BY_ONE} robots one after the other", single,
        at_once / single, ratio_means="times as many steps",
    )  # fmt: skip


def steps_per_second(envs: Any, steps: int) -> float:
    """Steps of robots per second of processor time, with actions of 0."""
    still = np.zeros(envs.action_space.shape, np.float32)

    def go_on() -> None:
        for _ in range(steps):
            envs.step(still)

    return float(steps * envs.num_envs / processor_seconds(go_on))
