"""What a run learnt of its robot's points: numbers, doubts in words, and a figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import line_style, new_figure, spread
from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.identifiability import FRAMES
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import ESTIMATED, IDEAL
from cdpr_drake.sections.adaptation.geometry_learner import (
    ADAPTATION,
    ADAPTATION_PARTS,
    DOUBTED,
    LEARNT,
    LEARNT_SIGMA,
    OPEN_FRAMES,
)

LEARNT_SHARE = 0.7
"""A coordinate is learnt if no more than this share of its first standard deviation is left."""

OPEN_SHARE = 0.9
"""A motion of a frame is open if at least this share of it was not excited."""

LARGE_SCATTER = 2.0
"""Squares of innovations that are this many times too large are a doubt."""

FEW_POSES = 0.05
"""Share of the poses that may be refused, or lack a measurement, without a doubt."""

ROOM = 0.12
"""Room around panels, so that labels of neighbours are apart [inch]."""


def _points(cables: Any) -> Array:
    """Exit points cable by cable, then anchor points, shape (6 m,) [m]."""
    return np.concatenate([cables.p_WA.T.ravel(), cables.p_PB.T.ravel()])


def true_offsets(run: Run) -> Array:
    """Unstrained lengths minus the believed ones at the first sight of the target, shape (m,) [m].

    NaN if the target was never seen.
    """
    log, believed = run.log, run.built.believed
    visible, cables = np.asarray(log["found"])[:, 0] > 0.0, believed.cables
    if not np.any(visible):
        return np.full(cables.count, np.nan)
    # A row holds the values before its instant; at the start the robot rests.
    k = max(int(np.argmax(visible)) - 1, 0)
    strained = 1.0 + np.maximum(log["tensions"][k], 0.0) / cables.stiffness
    lengths = cable_paths(believed.X_WP0, cables).lengths
    return np.asarray(log["unstrained_lengths"][k] - lengths / strained)


def parameter_names(robot: Robot) -> list[str]:
    """Names of the parameters that are learnt, as calibration has them."""
    cables = [cable.name for cable in robot.cables]
    points = ("exit_point", "anchor_point")
    names = [f"{cable}.{point}.{axis}" for point in points for cable in cables for axis in "xyz"]
    return names + [f"{cable}.length_offset" for cable in cables]


def adaptation_numbers(run: Run) -> dict[str, Any]:
    """Parameters at the end, their errors against the truth, and doubts."""
    log, robot, points = run.log, run.robot, 6 * len(run.robot.cables)
    values, sigma = np.asarray(log[LEARNT][-1]), np.asarray(log[LEARNT_SIGMA][-1])
    first = np.asarray(log[LEARNT_SIGMA][0])
    true = np.concatenate([_points(robot.cable_set()), true_offsets(run)])
    errors, before = values - true, _points(run.built.believed.cables) - true[:points]
    parts = dict(zip(ADAPTATION_PARTS, log[ADAPTATION][-1], strict=True))
    names = parameter_names(robot)
    return {
        **{name: int(parts[name]) for name in ADAPTATION_PARTS[:3]},
        "directions": len(names),
        "scatter": float(parts["scatter"]),
        "surprise": float(parts["surprise"]),
        "models_believed": int(parts["models_believed"]),
        "models_rejected": int(parts["models_rejected"]),
        "points_rms_before_m": _rms(before),
        "points_rms_after_m": _rms(errors[:points]),
        "offsets_rms_after_m": _rms(errors[points:]),
        "largest_error_in_sigmas": float(np.max(np.abs(errors) / sigma)),
        "learnt": {
            name: {"value_m": float(value), "sigma_m": float(s)}
            for name, value, s in zip(names, values, sigma, strict=True)
        },
        "not_told": [
            name for name, s, s0 in zip(names, sigma, first, strict=True) if s > LEARNT_SHARE * s0
        ],
        "open_frames": [
            frame
            for frame, share in zip(FRAMES, log[OPEN_FRAMES][-1], strict=True)
            if share >= OPEN_SHARE
        ],
        "doubts": doubts(log, [cable.name for cable in robot.cables]),
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def doubts(log: Mapping[str, Array], cables: Sequence[str]) -> list[str]:
    """Doubts about what was learnt, a sentence each; `cables` are names."""
    parts = dict(zip(ADAPTATION_PARTS, log[ADAPTATION][-1], strict=True))
    dropped, poses = np.asarray(log[DOUBTED][-1]), parts["stations"] + parts["refused"]
    most, sentences = max(FEW_POSES * poses, 1.0), []
    if parts["stations"] == 0.0:
        sentences.append("nothing was learnt: no pose counted")
    if parts["refused"] > most:
        sentences.append(
            f"measurements at {parts['refused']:.0f} of {poses:.0f} poses contradict each other: "
            "these poses do not count"
        )
    for row in np.flatnonzero(dropped > most).tolist():
        corner, axis = divmod(row - len(cables), 2)
        words = f"corner {corner + 1} of the tag in {'uv'[axis]}"
        if row < len(cables):
            words = f"the length of {cables[row]}"
        sentences.append(f"{words} contradicts all else at {dropped[row]:.0f} of {poses:.0f} poses")
    largest = float(np.max(np.asarray(log[ADAPTATION])[:, ADAPTATION_PARTS.index("scatter")]))
    if largest > LARGE_SCATTER:
        sentences.append(
            f"measurements scatter {np.sqrt(largest):.1f} times as much as their standard "
            "deviations say: those of what is learnt were enlarged"
        )
    if parts["surprise"] > 1.0:
        sentences.append(
            "points are farther from what was believed than adaptation.exit_points and "
            "adaptation.anchor_points say"
        )
    if parts["models_rejected"] > 0.0:
        count = f"{parts['models_rejected']:.0f} models"
        sentences.append(f"{count} were rejected by the stability criterion")
    return sentences


def adaptation_figure(run: Run) -> Figure:
    """Errors of points over time with their bands, and the models that the servo was offered.

    Of exit and anchor points, the two coordinates that are known best at the end: error against
    the truth, in a band of three standard deviations.
    """
    log, m, time = run.log, len(run.robot.cables), np.asarray(run.log["time"])
    sigma, names = np.asarray(log[LEARNT_SIGMA]), parameter_names(run.robot)
    errors = np.asarray(log[LEARNT])[:, : 6 * m] - _points(run.robot.cable_set())
    title = run.title("Exit and anchor points learnt on the way, and the truth")
    figure, panels = new_figure(2, 3, (13.0, 7.8), title)
    spread(figure, ROOM)
    for row, words in enumerate(("exit point", "anchor point")):
        best = np.argsort(sigma[-1, 3 * m * row : 3 * m * (row + 1)])[:2] + 3 * m * row
        for panel, k in zip(panels[row, :2], best, strict=True):
            error, band = 1e3 * errors[:, k], 3e3 * sigma[:, k]
            label = "three standard deviations"
            panel.fill_between(time, error - band, error + band, color="0.85", label=label)
            panel.plot(time, 0.0 * time, **line_style(IDEAL), label="truth")
            panel.plot(time, error, **line_style(ESTIMATED), label="learnt")
            panel.set(xlabel="time [s]", ylabel=f"{names[k].replace('_', ' ')}, error [mm]")
            panel.set_title(f"{words}, one of the two told best", fontsize=10)
    panels[0, 0].legend(loc="best")
    for words, part, style in (
        ("exit points", slice(0, 3 * m), "-"), ("anchor points", slice(3 * m, 6 * m), "--")
    ):  # fmt: skip
        rms = 1e3 * np.sqrt(np.mean(errors[:, part] ** 2, axis=1))
        panels[0, 2].plot(time, rms, style, color="0.1", label=words)
    panels[0, 2].set(xlabel="time [s]", ylabel="rms error [mm]", ylim=(0, None))
    panels[0, 2].set_title("all coordinates", fontsize=10)
    panels[0, 2].legend(loc="best")
    counts = dict(zip(ADAPTATION_PARTS, np.asarray(log[ADAPTATION]).T, strict=True))
    panel = panels[1, 2]
    for name, style in (
        ("stations", "-"), ("excited", "--"), ("models_believed", ":"), ("models_rejected", "-."),
    ):  # fmt: skip
        panel.plot(time, counts[name], style, color="0.1", label=name.replace("_", " "))
    panel.set(xlabel="time [s]", ylabel="number [-]")
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22), ncols=2)
    return figure


SUBJECTS = (Subject("adaptation", adaptation_numbers, {"adaptation": adaptation_figure}),)
"""What a run reports of the section."""
