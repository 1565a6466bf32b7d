"""The trials of the study as tasks of a sweep: each is kept by itself, any process may do it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdpr_drake.analyses.studies.calibration.servo import MODELS, straightness
from cdpr_drake.analyses.studies.calibration.trials import camera_trial, start_trial, tracker_trial
from cdpr_drake.arrays import Array


def _camera(seed: int) -> Array:
    trial = camera_trial(seed)
    result = trial.result
    return np.array([
        *trial.point_errors(), *trial.normalized_squares(), len(trial.errors()), result.chi_square,
        result.degrees,
    ])  # fmt: skip


def _half(seed: int) -> Array:
    trials = camera_trial(seed), camera_trial(seed, HALF)
    return np.array([square for trial in trials for square in trial.normalized_squares()])


def _tracker(seed: int) -> Array:
    errors, bound = tracker_trial(seed)
    return np.asarray(errors / bound)


def _start(seed: int) -> Array:
    distance, angle, place, turn = start_trial(seed)
    return np.array([distance, np.degrees(angle), place, np.degrees(turn)])


def _servo(seed: int) -> Array:
    found = straightness(camera_trial(seed))
    return np.array([found[name] for name in MODELS])


HALF = 0.5
"""Size of noise and of all that is off in the trials that show what is not linear."""

KINDS: dict[str, Callable[[int], Array]] = {
    "camera": _camera,
    "half": _half,
    "servo": _servo,
    "tracker": _tracker,
    "start": _start,
}
"""What is repeated, by name: numbers of a seed, see `CalibrationStudy`."""


@dataclass(frozen=True)
class TrialTask:
    """Sweep task: one kind of trial with one seed, so that each is kept and shown by itself."""

    kind: str
    seed: int

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Array `rows` of the only item, shape (1, numbers)."""
        return {"rows": KINDS[self.kind](self.seed)[np.newaxis]}

    @property
    def name(self) -> str:
        """Its name among the files of a study."""
        return f"{self.kind}-{self.seed:04d}"
