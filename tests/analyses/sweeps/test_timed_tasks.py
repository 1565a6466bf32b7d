"""Sweeps of which some tasks measure times: these come last, one by one, in this process."""

import os

import numpy as np

from cdpr_drake.analyses.sweeps.folder import SweepFolder
from cdpr_drake.analyses.sweeps.sweep import run_sweep


class Where:
    """A task that says which process does it."""

    def __call__(self, start, stop):
        return {"process": np.full(stop - start, os.getpid())}


def test_tasks_that_measure_times_come_last_and_stay_in_this_process(tmp_path):
    tasks = {"timed": (Where(), 2), "shared": (Where(), 3)}
    said = []
    kept = SweepFolder(tmp_path / "s", {"seed": 1})
    result = run_sweep(
        tasks, 1, kept, workers=2, alone=("timed",), on_progress=lambda p: said.append(p.what)
    )
    assert set(result.arrays["timed"]["process"]) == {os.getpid()}
    assert os.getpid() not in result.arrays["shared"]["process"]
    assert said[1:] == ["shared"] * 3 + ["timed"] * 2
    again = run_sweep(tasks, 1, SweepFolder(tmp_path / "s", {"seed": 1}), alone=("timed",))
    assert again.progress.found == 5


def test_a_stop_keeps_what_measures_times_from_being_begun():
    said = []
    result = run_sweep(
        {"timed": (Where(), 2), "shared": (Where(), 3)}, 1, workers=1, alone=("timed",),
        on_progress=said.append, should_stop=lambda: said[-1].done >= 2,
    )  # fmt: skip
    assert (result.arrays, result.progress.done, result.finished) == (None, 2, {})
