"""Runs that start beside the Gazebo thesis' path, or whose forces act a tenth of the time.

What was fixed before is told in docs/theory/reproduction.md, "Tensions of 54 to 1224 N".
"""

from __future__ import annotations

from itertools import product

import numpy as np

from cdpr_drake.analyses.studies.tension_methods.experiments import (
    THESIS_DURATION,
    THESIS_ROBOT,
    UNCHECKED,
    printed_ends,
    thesis_path,
)
from cdpr_drake.analyses.studies.tension_methods.start_trial import NOTHING, STATIC, StartTrial
from cdpr_drake.analyses.studies.tension_methods.trial import Applied
from cdpr_drake.arrays import Array
from cdpr_drake.control.force_balance import FORCE, WRENCH
from cdpr_drake.models.robot_loader import load_robot

START_ERROR, ONE_STEP = "start_error", "one_step"
"""Names of the experiments."""

START_EXPERIMENTS = {
    START_ERROR: "The thesis' path, from a start beside it, towards the place of launch.",
    ONE_STEP: "Forces that act for 1 ms of 10 ms, as the public code sets them; three rows.",
}
"""What they are, by name."""

ERRORS = (0.3, 0.4, 0.5, 0.6)
"""Start errors, from printed tensions over gains [m]."""

LAUNCH, ON_PATH = "launch", "path"
"""Starts that leave nothing to choose: where the robot is launched, and where the path starts."""

RATES = (1000.0, 100.0)
"""A step of Gazebo, and the publisher of the public code [Hz]."""

GAINS = (100.0, 800.0, 1200.0)
"""Gains Kp at which largest tensions are printed [1/s^2]."""

PRINTED = {
    "linear_program": (54.0, 456.0, 1224.0),
    "quadratic_program": (32.0, 110.0, 342.0),
    "pseudo_inverse": (117.0, 117.0, 117.0),
    "closed_form": (267.0, 385.0, 517.0),
}
"""Largest tension by method at these gains [N]. Source: Gazebo thesis 6.4.1 to 6.4.4."""

QUICK_ERROR, QUICK_TIME = 0.5, 1.0
"""What the short form shows [m, s]."""


def error_name(error: float) -> str:
    """Words for a start that is so far from the path's [m]."""
    return f"{error:g} m"


STARTS = (*map(error_name, ERRORS), LAUNCH)
"""Where the platform starts in the experiment `START_ERROR`."""


def start_trials(quick: bool) -> list[StartTrial]:
    """All runs of both experiments, or a few short ones."""
    combinations = [
        (start, rate, balance) for start in STARTS for rate in RATES for balance in (WRENCH, FORCE)
    ]
    pulses = [(start, between) for start in (ON_PATH, LAUNCH) for between in (NOTHING, STATIC)]
    gains: tuple[float, ...] = GAINS
    if quick:
        combinations = [(error_name(QUICK_ERROR), RATES[-1], one) for one in (WRENCH, FORCE)]
        pulses, gains = [(ON_PATH, NOTHING)], GAINS[:1]
    places = {method: _Places(path_of(method)) for method in PRINTED}  # once: they ask the robot
    return [
        _trial(
            START_ERROR, method, gain, *combination,
            between="", quick=quick, places=places[method],
        )
        for combination in combinations
        for method, gain in product(PRINTED, gains)
    ] + [
        _trial(
            ONE_STEP, method, gain, start, RATES[-1],
            balance=FORCE, between=between, quick=quick, places=places[method],
        )
        for start, between in pulses
        for method, gain in product(PRINTED, gains)
    ]  # fmt: skip


class _Places:
    """Where runs of a method start.

    Attributes:
        path: Start and end of the path of Po, shape (3,) each [m].
    """

    def __init__(self, path: tuple[Array, Array]) -> None:
        self.path = path
        self._launch = np.array(load_robot(THESIS_ROBOT).home.position, float)

    def of(self, start: str) -> Array:
        """Where Po starts, shape (3,) [m]."""
        if start == LAUNCH:
            return self._launch.copy()
        error = 0.0 if start == ON_PATH else ERRORS[STARTS.index(start)]
        begins = self.path[0]
        way = self._launch - begins
        return np.asarray(begins + error * way / np.linalg.norm(way))


def path_of(method: str) -> tuple[Array, Array]:
    """Start and end of the path of Po that a method follows, shape (3,) each [m]."""
    if method in UNCHECKED:
        return printed_ends()
    moved = thesis_path()
    return moved.start, moved.end


def _trial(
    experiment: str, method: str, gain: float, start: str, rate: float, balance: str,
    *, between: str, quick: bool, places: _Places,
) -> StartTrial:  # fmt: skip
    return StartTrial(
        experiment=experiment,
        robot=THESIS_ROBOT,
        path=(places.path[0].copy(), places.path[1].copy()),
        leg=THESIS_DURATION,
        method=method,
        gain=gain,
        applied=Applied.PUSHED if method in UNCHECKED else Applied.HELD,
        balance=balance,
        rate=rate,
        start=start,
        position=places.of(start),
        duration=QUICK_TIME if quick else THESIS_DURATION,
        between=between,
    )
