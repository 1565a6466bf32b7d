"""The motions of the study as tasks of a sweep: each is kept by itself, any process may do it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.analyses.studies.planning.paths import PathSpec, run_path
from cdpr_drake.analyses.studies.planning.predictions import track_quintic
from cdpr_drake.analyses.studies.planning.swings import CASES, run_swing
from cdpr_drake.arrays import Array

WORDS = "words"
"""Name of what is told of a motion, as JSON, among its curves."""


@dataclass(frozen=True)
class PathMotion:
    """Sweep task: the fastest motion along a path, tracked, and the convex program."""

    spec: PathSpec
    stations: int
    intervals: int

    @property
    def name(self) -> str:
        """Its name among the files of a study."""
        return f"path {self.spec.name}"

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """What was found of the only item."""
        result, curves = run_path(self.spec, self.stations, self.intervals)
        told = result.as_dict()
        del told["difference"]
        return _packed(told, curves)


@dataclass(frozen=True)
class SwingMotion:
    """Sweep task: a motion from rest to rest, by its number in `CASES`."""

    number: int

    @property
    def name(self) -> str:
        """Its name among the files of a study."""
        return f"swing {self.number}"

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """What was found of the only item."""
        return _packed(run_swing(CASES[self.number]).as_dict())


@dataclass(frozen=True)
class TrackMotion:
    """Sweep task: a quintic motion tracked, with so many steps ahead."""

    duration: float
    steps: int

    @property
    def name(self) -> str:
        """Its name among the files of a study."""
        return f"quintic in {self.duration:g} s, {self.steps} steps ahead"

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """What was found of the only item."""
        return _packed(track_quintic(self.duration, self.steps).as_dict())


def words_of(arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """What a task told of its motion."""
    told: dict[str, Any] = json.loads(arrays[WORDS].tobytes())
    return told


def curves_of(arrays: dict[str, np.ndarray]) -> dict[str, Array]:
    """The curves of a motion, by name."""
    return {name: values[0] for name, values in arrays.items() if name != WORDS}


def _packed(told: dict[str, Any], curves: dict[str, Array] | None = None) -> dict[str, np.ndarray]:
    words = np.frombuffer(json.dumps(told).encode(), np.uint8)
    rows = {name: values[np.newaxis] for name, values in (curves or {}).items()}
    return {WORDS: words[np.newaxis], **rows}
