"""Loops from starts: how each ends, what the verdicts say of its start, and why one fails."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.basin.starts import (
    OPTIONS,
    SEED,
    BasinSetup,
    basin_setup,
    start_poses,
)
from cdpr_drake.analyses.studies.framework.runs import Row
from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.analyses.studies.perturbed_servo import Perturbation, perturbed_scenario
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, DivergedError, InfeasibleTensionError
from cdpr_drake.geometry.poses import pose_error, pose_from_row, pose_row, pose_rows_distance
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.verdict import VERDICTS, judge_all_verdicts, judge_stability
from cdpr_drake.systems.loops.servo_loop import ServoLoop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.workspaces.static_feasibility import statically_feasible

CERTIFIED = "certified"

CONVERGED, VIEW, FRAME, SLACK_CABLES, WAY, ESTIMATE, TIME = ENDS = (
    "converged", "view", "frame", "slack", "way", "estimate", "time",
)  # fmt: skip
"""How loops end: at the goal; without the tag in the image; out of the frame, or where a cable
cannot run; hanging on too few cables; and at the end of their time with all cables taut, of these
such whose way left the workspace of the verdict, whose estimate went farther off than the bounds
have it, and others."""

EXPLAINED = (VIEW, FRAME, SLACK_CABLES, WAY, ESTIMATE)
"""What the criterion does not speak of: it judges one pose, with all cables taut, the object seen,
and errors within the bounds."""

NO_RUN = -1
"""In the place of an end, where there was no loop."""

WAY_POSES = 10
"""Poses of a way that are judged, both ends among them."""

ANGLES_OFF = 1e-9
"""Rounding of angles that are compared with their bound [rad]."""


@dataclass(frozen=True)
class LoopEnd:
    """How a loop ended.

    Attributes:
        outcome: The outcome.
        time: When [s].
        taut: Number of cables that pulled at the last pose of the way.
        errors: True distance [m] and angle [rad] from the goal there.
        way: Poses, rows as `pose_row`, shape (k, 7).
        believed: Estimates of them, shape (k, 7).
    """

    outcome: Outcome
    time: float
    taut: int
    errors: tuple[float, float]
    way: Array
    believed: Array


def close_loop(setup: BasinSetup, X_WP: RigidTransform, perturbation: Perturbation) -> LoopEnd:
    """Runs the servo from a pose [m] with a wrong model until its outcome is known.

    Raises:
        InfeasibleTensionError: The cables do not hold the platform there.
        CableGeometryError: The platform covers an exit point there.
    """
    servo = setup.servo
    loop = ServoLoop(perturbed_scenario(setup.scenario, X_WP, perturbation, servo.X_PC))
    loop.start()
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            loop.advance_to(setup.scenario.duration)
        outcome = Outcome.TIMEOUT if loop.outcome == Outcome.RUNNING else loop.outcome
    except (CableGeometryError, DivergedError):
        outcome = Outcome.DIVERGED
    log = loop.log.read()
    way, taut = log["X_WP"], int(np.sum(log["slack"][-1] == 0.0))
    errors = pose_error(servo.X_CO(pose_from_row(way[-1])), setup.scenario.desired.transform())
    return LoopEnd(outcome, loop.time, taut, errors, way, log["X_WP_estimated"])


def why_it_ended(setup: BasinSetup, end: LoopEnd) -> str:
    """One of `ENDS`, the first that applies."""
    if end.outcome == Outcome.CONVERGED:
        return CONVERGED
    if end.outcome == Outcome.TARGET_LOST:
        return VIEW
    if end.outcome == Outcome.DIVERGED:
        return FRAME
    if end.taut < setup.case.m:
        return SLACK_CABLES
    which = np.linspace(0, len(end.way) - 1, WAY_POSES).round().astype(int)
    judged = judge_stability(setup.case, setup.bounds, end.way[which], CERTIFIED, OPTIONS)
    if not np.all(judged.stable):
        return WAY
    off, turned = pose_rows_distance(end.way, end.believed)
    bounds = setup.bounds
    if np.max(off) > bounds.r_bp or np.max(turned) > bounds.d_theta_bp + ANGLES_OFF:
        return ESTIMATE
    return TIME


@dataclass(frozen=True)
class BasinTask:
    """Points of the sequence of starts under a scheme.

    Attributes:
        scheme: The scheme.
        first: Number of the first point.
    """

    scheme: str
    first: int

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Loops from the points start to stop, behind the first, where there can be one.

        Returns:
            pose, shape (n, 7); held: whether tensions within their bounds hold the platform there;
            seen: of these, whether the tag is in the image; of both, else False: `VERDICTS`, what
            each says of the start; end: place in `ENDS`, else NO_RUN; taut: cables that pull at
            the end; time_s; position_error_m and rotation_error_rad at the end, else NaN.
        """
        setup = basin_setup(self.scheme)
        poses = start_poses(setup.box, self.first + start, self.first + stop)
        rows = np.array([pose_row(X) for X in poses])
        held = statically_feasible(
            setup.statics, rows[:, 4:], np.array([X.rotation().matrix() for X in poses])
        )
        seen = held & np.array([setup.is_seen(X) for X in poses])
        found = {
            "pose": rows, "held": held, "seen": seen,
            **{verdict: np.zeros(len(rows), bool) for verdict in VERDICTS},
            "end": np.full(len(rows), NO_RUN), "taut": np.zeros(len(rows), int),
            **{name: np.full(len(rows), np.nan) for name in NUMBERS},
        }  # fmt: skip
        if np.any(seen):
            judged = judge_all_verdicts(setup.case, setup.bounds, rows[seen], OPTIONS)
            for verdict in VERDICTS:
                found[verdict][seen] = judged[verdict].stable
        for k in np.flatnonzero(seen):
            drawn = draw_perturbations(rows[k], setup.bounds, setup.case.m, 1, SEED)[0]
            try:
                end = close_loop(setup, poses[k], Perturbation.from_vector(drawn))
            except (InfeasibleTensionError, CableGeometryError):
                # Elastic cables do not hold it, or it covers an exit point: `held` knows neither.
                held[k] = seen[k] = False
                continue
            found["end"][k], found["taut"][k] = ENDS.index(why_it_ended(setup, end)), end.taut
            for name, value in zip(NUMBERS, (end.time, *end.errors), strict=True):
                found[name][k] = value
        return found


NUMBERS = ("time_s", "position_error_m", "rotation_error_rad")


def reduce(case: Case, arrays: Mapping[str, np.ndarray]) -> Row:
    """Counts of a block of points.

    Returns:
        points, held, seen; of loops: runs, `VERDICTS`, `ENDS`; `ENDS` of those from certified
        starts with `certified_` before; failures: of these such that did not converge, a dict
        each. Of each loop `pose`, shape (n, 7), `end`, place in `ENDS`, and verdicts with `is_`
        before, shape (n,).
    """
    ran = arrays["end"] != NO_RUN
    ends = np.array(ENDS)[arrays["end"][ran]]
    certified = arrays[CERTIFIED][ran]
    row: dict[str, Any] = {
        "points": len(ran), "runs": int(np.sum(ran)),
        **{name: int(np.sum(arrays[name])) for name in ("held", "seen")},
    }  # fmt: skip
    row |= {verdict: int(np.sum(arrays[verdict][ran])) for verdict in VERDICTS}
    row |= {end: int(np.sum(ends == end)) for end in ENDS}
    row |= {f"{CERTIFIED}_{end}": int(np.sum(certified & (ends == end))) for end in ENDS}
    row["failures"] = [
        {
            "pose": arrays["pose"][ran][k].tolist(), "end": str(ends[k]),
            "taut": int(arrays["taut"][ran][k]),
            **{name: float(arrays[name][ran][k]) for name in NUMBERS},
        }
        for k in np.flatnonzero(certified & (ends != CONVERGED))
    ]  # fmt: skip
    row |= {"pose": arrays["pose"][ran], "end": arrays["end"][ran]}
    return row | {f"is_{verdict}": arrays[verdict][ran] for verdict in VERDICTS}
