"""What a run learnt of its robot's points: numbers, doubts in words, and a figure."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import line_style, new_figure, spread
from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.identifiability import FRAMES
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import ESTIMATED, IDEAL
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.systems.estimators.geometry_learner import (
    ADAPTATION,
    ADAPTATION_PARTS,
    DOUBTED,
    LEARNT,
    LEARNT_SIGMA,
    OPEN_FRAMES,
)

TOLD = 0.7
"""A coordinate is told where no more than this share of its first standard deviation is left."""

OPEN = 0.9
"""A motion of a frame is open where at least this share of it was not excited."""

SCATTERS = 2.0
"""Squares of innovations that are this many times what they should be are a doubt."""

FEW = 0.05
"""Share of poses of which so many may be refused, or have a measurement dropped, without doubt."""


def true_points(robot: Robot) -> Array:
    """Exit points cable by cable, then anchor points, shape (6 m,) [m]."""
    cables = robot.cable_set()
    return np.concatenate([cables.p_WA.T.ravel(), cables.p_PB.T.ravel()])


def true_offsets(log: Log, believed: BelievedRobot) -> Array:
    """By how much unstrained lengths were beyond the believed ones when the target was first seen,
    shape (m,) [m]; NaN where it never was."""
    seen = np.flatnonzero(np.asarray(log["found"])[:, 0] > 0.0)
    cables = believed.cables
    if not len(seen):
        return np.full(cables.count, np.nan)
    # A row holds what stood before its instant; at the start the robot rests.
    k = max(int(seen[0]) - 1, 0)
    strained = 1.0 + np.maximum(log["tensions"][k], 0.0) / cables.stiffness
    lengths = cable_paths(believed.X_WP0, cables).lengths
    return np.asarray(log["unstrained_lengths"][k] - lengths / strained)


def names_of(robot: Robot) -> list[str]:
    """What `learnt` is, number by number, as calibration names parameters."""
    cables = [cable.name for cable in robot.cables]
    points = [
        f"{cable}.{point}.{axis}"
        for point in ("exit_point", "anchor_point")
        for cable in cables
        for axis in "xyz"
    ]
    return points + [f"{cable}.length_offset" for cable in cables]


def adaptation_summary(log: Log, robot: Robot, believed: BelievedRobot) -> dict[str, Any]:
    """What was learnt in the end, beside the truth, and what is doubted.

    Args:
        log: The log.
        robot: The true robot.
        believed: As it was believed at the start.
    """
    m, points = len(robot.cables), 6 * len(robot.cables)
    found, sigma = np.asarray(log[LEARNT][-1]), np.asarray(log[LEARNT_SIGMA][-1])
    first = np.asarray(log[LEARNT_SIGMA][0])
    believed_points = np.concatenate(
        [believed.cables.p_WA.T.ravel(), believed.cables.p_PB.T.ravel()]
    )
    true = np.concatenate([true_points(robot), true_offsets(log, believed)])
    wrong = found - true
    parts = dict(zip(ADAPTATION_PARTS, log[ADAPTATION][-1], strict=True))
    names = names_of(robot)
    return {
        **{name: int(parts[name]) for name in ADAPTATION_PARTS[:3]},
        "directions": 7 * m,
        "scatter": float(parts["scatter"]),
        "surprise": float(parts["surprise"]),
        "models_believed": int(parts["models_believed"]),
        "models_rejected": int(parts["models_rejected"]),
        "points_rms_before_m": _rms(believed_points - true[:points]),
        "points_rms_after_m": _rms(wrong[:points]),
        "offsets_rms_after_m": _rms(wrong[points:]),
        "largest_error_in_sigmas": float(np.max(np.abs(wrong) / sigma)),
        "learnt": {
            name: {"value_m": float(value), "sigma_m": float(s)}
            for name, value, s in zip(names, found, sigma, strict=True)
        },
        "not_told": [
            name for name, s, s0 in zip(names, sigma, first, strict=True) if s > TOLD * s0
        ],
        "open_frames": [
            word for word, share in zip(FRAMES, log[OPEN_FRAMES][-1], strict=True) if share >= OPEN
        ],
        "doubts": doubts(log, [cable.name for cable in robot.cables]),
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def doubts(log: Log, cables: list[str]) -> list[str]:
    """What there is to doubt of what was learnt, a sentence each.

    Args:
        log: The log.
        cables: Their names.
    """
    parts = dict(zip(ADAPTATION_PARTS, log[ADAPTATION][-1], strict=True))
    dropped = np.asarray(log[DOUBTED][-1])
    poses = parts["stations"] + parts["refused"]
    most = max(FEW * poses, 1.0)
    told = []
    if parts["stations"] == 0.0:
        told.append("nothing was learnt: no pose counted")
    if parts["refused"] > most:
        told.append(
            f"measurements at {parts['refused']:.0f} of {poses:.0f} poses contradict each other: "
            "these poses do not count"
        )
    for row in np.flatnonzero(dropped > most):
        corner, axis = divmod(row - len(cables), 2)
        what = (
            f"the length of {cables[row]}" if row < len(cables)
            else f"corner {corner + 1} of the tag in {'uv'[axis]}"
        )  # fmt: skip
        told.append(f"{what} contradicts all else at {dropped[row]:.0f} of {poses:.0f} poses")
    largest = float(np.max(np.asarray(log[ADAPTATION])[:, ADAPTATION_PARTS.index("scatter")]))
    if largest > SCATTERS:
        told.append(
            f"measurements scatter {np.sqrt(largest):.1f} times as much as their standard "
            "deviations say: those of what is learnt were enlarged"
        )
    if parts["surprise"] > 1.0:
        told.append(
            "points are farther from what was believed than adaptation.exit_points and "
            "adaptation.anchor_points say"
        )
    if parts["models_rejected"] > 0.0:
        told.append(
            f"{parts['models_rejected']:.0f} models were rejected by the stability criterion"
        )
    return told


ROOM = 0.12
"""Round panels, so that labels of neighbours are apart [inch]."""


def adaptation_figure(title: str, log: Log, robot: Robot) -> Figure:
    """Errors of points over time with their bands, and what the servo was offered.

    Of exit and anchor points the coordinate of each cable that is told best in the end, beyond the
    truth, in the middle of a band of three standard deviations round zero.
    """
    m, time = len(robot.cables), np.asarray(log["time"])
    found, sigma = np.asarray(log[LEARNT]), np.asarray(log[LEARNT_SIGMA])
    wrong = found[:, : 6 * m] - true_points(robot)
    names = names_of(robot)
    figure, panels = new_figure(2, 3, (13.0, 7.8), title)
    spread(figure, ROOM)
    for row, words in enumerate(("exit point", "anchor point")):
        best = np.argsort(sigma[-1, 3 * m * row : 3 * m * (row + 1)])[:2] + 3 * m * row
        for panel, k in zip(panels[row, :2], best, strict=True):
            band = 3e3 * sigma[:, k]
            panel.fill_between(
                time, 1e3 * wrong[:, k] - band, 1e3 * wrong[:, k] + band, color="0.85",
                label="three standard deviations",
            )  # fmt: skip
            panel.plot(time, 0.0 * time, **line_style(IDEAL), label="truth")
            panel.plot(time, 1e3 * wrong[:, k], **line_style(ESTIMATED), label="learnt")
            panel.set(xlabel="time [s]", ylabel=f"{names[k].replace('_', ' ')}, error [mm]")
            panel.set_title(f"{words}, one of the two told best", fontsize=10)
    panels[0, 0].legend(loc="best")
    parts = {name: np.asarray(log[ADAPTATION])[:, k] for k, name in enumerate(ADAPTATION_PARTS)}
    ranges = {"exit points": slice(0, 3 * m), "anchor points": slice(3 * m, 6 * m)}
    for (words, part), style in zip(ranges.items(), ("-", "--"), strict=True):
        off = 1e3 * np.sqrt(np.mean(wrong[:, part] ** 2, axis=1))
        panels[0, 2].plot(time, off, style, color="0.1", label=words)
    panels[0, 2].set(xlabel="time [s]", ylabel="rms error [mm]", ylim=(0, None))
    panels[0, 2].set_title("all coordinates", fontsize=10)
    panels[0, 2].legend(loc="best")
    panel = panels[1, 2]
    for name, style in (
        ("stations", "-"), ("excited", "--"), ("models_believed", ":"), ("models_rejected", "-."),
    ):  # fmt: skip
        panel.plot(time, parts[name], style, color="0.1", label=name.replace("_", " "))
    panel.set(xlabel="time [s]", ylabel="number [-]")
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22), ncols=2)
    return figure
