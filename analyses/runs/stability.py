"""The stability criterion along a run, with slack cables left out: numbers and a figure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.figures import (
    LEGEND_BESIDE,
    draw_curve,
    line_style,
    new_figure,
    shade,
)
from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.palette import BOUND, DISTANCE, LOST, PLATFORM
from cdpr_drake.systems.cameras.turning_camera import turning_camera
from cdpr_drake.systems.diagrams.servo_models import LoopServo
from cdpr_drake.systems.diagrams.servo_watches import criterion_of, servo_criterion
from cdpr_drake.systems.monitoring.servo_criterion import ServoCriterion
from cdpr_drake.systems.robots.cable_forces import simulated_cables

MOST_ROWS = 2000
"""Rows of a log that are judged; of a longer log, rows at equal distances."""

DEEPEST = -1.5
"""Least margin that is drawn to scale: nearly singular rows make it as low as one likes."""


@dataclass(frozen=True, eq=False)
class Stability:
    """Cables that pull, and whether the servo was stable, along a run.

    Attributes:
        time: Shape (n,) [s].
        taut: Number of cables that pull, shape (n,).
        rank: Rank of the Jacobian with the rows of these cables, shape (n,).
        margin: Smallest eigenvalue of the symmetric part of Pi, shape (n,); zero where the rank is
            less than the freedom, NaN where the features leave a motion free or no cable can run.
        freedom: Degrees of freedom of the platform.
    """

    time: Array
    taut: Array
    rank: Array
    margin: Array
    freedom: int

    def underactuated_time(self) -> float:
        """Time in which the rank is less than the freedom [s]."""
        return float(np.sum(np.diff(self.time) * (self.rank[:-1] < self.freedom)))

    def numbers(self) -> dict[str, Any]:
        """Least margin, least rank, and time without a positive margin, as far as it is known."""
        margins = self.margin[np.isfinite(self.margin)]
        return {
            "least_stability_margin": float(np.min(margins)) if len(margins) else None,
            "least_jacobian_rank": int(np.min(self.rank)),
            "unstable_s": float(np.sum(np.diff(self.time) * (self.margin[:-1] <= 0.0))),
        }


def run_criterion(run: Run) -> ServoCriterion:
    """The stability criterion of a run's servo."""
    built, scenario = run.built, run.scenario
    if not isinstance(built, LoopServo):
        return criterion_of(built, scenario.controller.pulleys)
    model = scenario.cables.model_of(built.robot)
    cables = simulated_cables(scenario.cables.cable_set(built.robot), model)
    return servo_criterion(built, cables, scenario.controller.pulleys)


def turned_criterion(
    criterion: ServoCriterion, rest: RigidTransform, true: RigidTransform, believed: RigidTransform
) -> ServoCriterion:
    """The criterion while a camera is turned, and believed to be turned otherwise.

    The servo uses the image that the camera would take at rest, computed with the encoders. A
    camera at rest takes that image if its mounting has the errors of the encoders.

    Args:
        criterion: Of the camera at rest.
        rest: X_BC of the camera at rest [m].
        true: X_BC where it is [m].
        believed: X_BC where the encoders have it [m].
    """
    off = rest.inverse() @ true @ believed.inverse() @ rest
    sees = criterion.sees
    return replace(
        criterion, camera=criterion.camera @ off,
        sees=lambda X_WP, time: off.inverse() @ sees(X_WP, time),
    )  # fmt: skip


def stability_along(run: Run, threshold: float | None = None) -> Stability:
    """Computes the criterion along a run from its log.

    Args:
        run: A run of a visual servo.
        threshold: Tension from which a cable pulls [N]; None: by the log's "slack".
    """
    log, count = run.log, len(run.log["time"])
    rows = np.unique(np.linspace(0, count - 1, min(count, MOST_ROWS)).astype(int))
    slack = log["slack"][rows] > 0.0 if threshold is None else log["tensions"][rows] < threshold
    criterion, rest, (_, turning) = (
        run_criterion(run), run.built.mounting, turning_camera(run.scenario)
    )  # fmt: skip
    if turning is not None:
        turned, believed = (turning.mountings(rest, log, rows, known) for known in (False, True))
    times, true, estimated = (log[name][rows] for name in ("time", "X_WP", "X_WP_estimated"))
    rank, margin = np.zeros(len(rows)), np.full(len(rows), np.nan)
    for k, time in enumerate(times):
        current = criterion
        if turning is not None:
            current = turned_criterion(criterion, rest.X_BC, turned[k].X_BC, believed[k].X_BC)
        poses = pose_from_row(true[k]), pose_from_row(estimated[k])
        try:
            rank[k], margin[k] = current.at(*poses, ~slack[k], float(time))
        except CableGeometryError:  # of a run that diverged
            continue
    return Stability(times, np.sum(~slack, axis=1).astype(float), rank, margin, criterion.freedom)


def stability_of_run(run: Run) -> Stability | None:
    """Stability along a run by its log, else, with tension management, computed from its poses.

    None otherwise, as to compute it takes longer than many a run.
    """
    names = ("taut_cables", "jacobian_rank", "stability_margin")
    if names[-1] in run.log:
        taut, rank, margin = (run.log[name][:, 0] for name in names)
        return Stability(run.log["time"], taut, rank, margin, run_criterion(run).freedom)
    return stability_along(run) if run.scenario.tension_management is not None else None


def stability_figure(title: str, along: Stability) -> Figure:
    """Number of cables that pull, rank of the Jacobian and margin of the criterion over time; red
    and hatched where the rank is less than the platform's degrees of freedom."""
    figure, axes = new_figure(3, 1, (10.0, 9.0), title)
    lost, label = along.rank < along.freedom, f"holds the platform: {along.freedom}"
    most = max(float(np.max(along.taut)), along.freedom) + 0.5
    for panel, values, words in (
        (axes[0], along.taut, "cables that pull [-]"),
        (axes[1], along.rank, "rank of the Jacobian [-]"),
    ):
        draw_steps(panel, along.time, values, lost)
        panel.axhline(along.freedom, label=label, **line_style(BOUND))
        panel.set(ylabel=words, ylim=(-0.2, most), yticks=range(int(most) + 1))
    draw_curve(axes[2], along.time, np.maximum(along.margin, DEEPEST), DISTANCE, "margin")
    axes[2].axhline(0.0, label="stable above 0", **line_style(BOUND))
    axes[2].set(ylabel="least eigenvalue of sym(Pi) [-]", xlabel="time [s]")
    least = np.nanmin(along.margin, initial=np.inf)
    if least < DEEPEST:
        axes[2].set_title(f"least {least:.2f}, cut off at {DEEPEST:g}", fontsize=9)
    for panel in axes:
        shade(panel, along.time, lost, f"rank below {along.freedom}", LOST)
        panel.set(xlim=(along.time[0], along.time[-1]))
        panel.legend(**LEGEND_BESIDE)
    return figure


def draw_steps(panel: Any, times: Array, values: Array, lost: np.ndarray) -> None:
    """Draws a whole number over time, shape (n,), thick and red where the rank is lost."""
    panel.step(times, values, where="post", **line_style(PLATFORM) | {"marker": ""})
    red = np.where(lost, values, np.nan)
    panel.step(times, red, where="post", color=LOST.color, linewidth=3.0)


def _figure(run: Any) -> Figure:
    title = run.title("Cables that pull, and stability of the servo")
    return stability_figure(title, run.stability)


STABILITY = Subject(
    "", figures={"stability": _figure}, applies=lambda run: run.stability is not None
)
