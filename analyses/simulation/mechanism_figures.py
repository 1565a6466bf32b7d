"""Figures and replay of a run of a mechanism: positions wanted and reached, errors, tensions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RotationMatrix
from pydrake.multibody.tree import QuaternionFloatingJoint

from cdpr_drake.analyses.frame.figures import (
    curves,
    draw_curve,
    figure_writers,
    new_figure,
    shade,
    styled,
)
from cdpr_drake.analyses.frame.figures import panels as figure_panels
from cdpr_drake.analyses.frame.thinning import by_pieces
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.simulation.mechanism_run import (
    MechanismRun,
    first_commanded,
    mechanism_geometry,
)
from cdpr_drake.analyses.visualization.cable_figures import cable_figure
from cdpr_drake.analyses.visualization.mechanism_replay import write_mechanism_replay
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.palette import Look
from cdpr_drake.systems.diagrams.mechanism_control import part_name
from cdpr_drake.systems.scenarios.mechanism_motion import moving_joints
from cdpr_drake.systems.scenarios.mechanism_scenario import COMPUTED_TORQUE

COLUMNS, MOST_PANELS = 3, 24
"""Panels side by side, and how many a figure of positions has at most."""


def _title(run: MechanismRun, words: str) -> str:
    """What the figure shows, and below what the run was."""
    scenario, control = run.scenario, run.scenario.control
    how = "on winches"
    if control.kind == COMPUTED_TORQUE:
        how = f"computed torque, tensions by the {control.method.replace('_', ' ')}"
    lines = words, scenario.title, f"({scenario.name}, {mechanism_geometry(run)}, {how})"
    return "\n".join(line for line in lines if line)


WANTED = Look("#b8b8b8")
"""Wide and pale: what is reached is drawn on it."""


@dataclass(frozen=True)
class _Panel:
    """Some coordinates of a joint or free body.

    Attributes:
        name: Of the joint or body.
        label: Words and unit of the axis.
        curves: Names of the curves; empty words for one alone.
        values: Gives them, shape (n, k), of positions of the plant, shape (n, nq).
    """

    name: str
    label: str
    curves: tuple[str, ...]
    values: Callable[[Array], Array]


def _panels(run: MechanismRun) -> list[_Panel]:
    found = []
    for joint in moving_joints(run.follower.plant):
        name, start = part_name(run.follower.plant, joint), joint.position_start()
        if isinstance(joint, QuaternionFloatingJoint):
            found.append(_Panel(name, "origin [m]", ("x", "y", "z"), _columns(start + 4, 3)))
            angles = _angles_of(start)
            found.append(_Panel(name, "angles [deg]", ("phi", "theta", "psi"), angles))
            continue
        turns = [joint.position_suffix(k).startswith("q") for k in range(joint.num_positions())]
        for turning, label, scale in (
            (True, "angle [deg]", np.degrees(1.0)),
            (False, "position [m]", 1.0),
        ):
            columns = [start + k for k, one in enumerate(turns) if one == turning]
            if columns:
                suffixes = tuple(joint.position_suffix(c - start) for c in columns)
                words = suffixes if len(columns) > 1 else ("",)
                found.append(_Panel(name, label, words, _scaled(columns, scale)))
    return found


def _columns(start: int, count: int) -> Callable[[Array], Array]:
    return lambda q: np.asarray(q[:, start : start + count])


def _scaled(columns: list[int], scale: float) -> Callable[[Array], Array]:
    return lambda q: scale * np.asarray(q)[:, columns]


def _angles_of(start: int) -> Callable[[Array], Array]:
    """Angles phi, theta, psi of a quaternion [deg]."""

    def angles(q: Array) -> Array:
        wxyz = np.asarray(q)[:, start : start + 4]
        R = (RotationMatrix(Quaternion(row / np.linalg.norm(row))) for row in wxyz)
        return np.degrees([angles_from_rotation(each) for each in R])

    return angles


def position_figure(run: MechanismRun) -> Figure:
    """Positions of joints and free bodies, wanted and reached."""
    every = _panels(run)
    panels, log = every[:MOST_PANELS], run.log
    rows, columns = -(-len(panels) // COLUMNS), min(COLUMNS, len(panels))
    words = "Positions of joints and free bodies"
    if len(panels) < len(every):
        words += f": the first {len(panels)} of {len(every)}"
    size = (4.6 * columns + 1.0, 2.7 * rows + 1.4)
    figure, axes = figure_panels(len(panels), COLUMNS, size, _title(run, words), share_x=True)
    with styled():
        for each, panel in zip(axes, panels, strict=True):
            _draw_panel(each, panel, log)
        for each in axes[-columns:]:
            each.set_xlabel("time [s]")
            each.tick_params(labelbottom=True)
    return figure


def _draw_panel(axes: Any, panel: _Panel, log: Any) -> None:
    reached = by_pieces(panel.values, log["positions"])
    wanted = by_pieces(panel.values, log["wanted_positions"])
    count = len(panel.curves)
    for k in range(count):  # below what is reached, which nearly always covers it
        label = "wanted" if k == count - 1 else None
        draw_curve(axes, log["time"], wanted[:, k], WANTED, label, linewidth=6.0)
    curves(axes, log["time"], reached, [f"{name} reached".strip() for name in panel.curves])
    axes.set_title(panel.name, fontsize=11)
    axes.set_ylabel(panel.label)
    axes.margins(x=0.01)
    axes.legend(loc="best", fontsize=8)


def mechanism_error_figure(run: MechanismRun) -> Figure:
    """Distance and angle of every joint and free body from where it should be, over time."""
    log, follower = run.log, run.follower
    parts = follower.parts()
    names = list(parts)

    def errors(rows: Array) -> tuple[Array, Array]:
        found = follower.part_errors(rows).values()
        return np.column_stack([e[0] for e in found]), np.column_stack([e[1] for e in found])

    both = by_pieces(errors, log["way_off"])
    wanted = [
        (values, which, words, scale)
        for which, (values, words, scale) in enumerate(
            ((both[0], "distance [mm]", 1e3), (both[1], "angle [deg]", np.degrees(1.0)))
        )
        if any(parts[name][which] for name in names)
    ]
    title = _title(run, "Joints and free bodies against their wanted positions")
    figure, axes = new_figure(1, len(wanted), (6.0 * len(wanted) + 3.0, 5.0), title)
    for one, (values, which, words, scale) in zip(np.atleast_1d(axes), wanted, strict=True):
        shown = [k for k, name in enumerate(names) if parts[name][which]]
        labels = [names[k] for k in shown]
        curves(one, log["time"], values[:, shown], labels, numbers=shown, scale=scale)
        one.set(xlabel="time [s]", ylabel=words)
        _shade_missed(one, run)
        one.margins(x=0.01)
        one.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    return figure


def _shade_missed(axes: Any, run: MechanismRun) -> None:
    """Times in which no tensions were what computed torque asked for."""
    log = run.log
    if "feasible" in log:
        missed = np.asarray(log["feasible"][1:, 0]) == 0.0
        if np.any(missed):
            shade(axes, log["time"][1:], missed, "no tensions\nwithin the limits")


def tension_figure(run: MechanismRun) -> Figure:
    """Tensions with the limits that were asked for, from the first control step on."""
    first = first_commanded(run)
    shown = {name: run.log[name][first:] for name in ("time", "tensions", "slack")}
    return cable_figure(
        _title(run, "Tensions of the cables"), run.follower.mechanism, shown, "tensions",
        "tension [N]", bounds=run.follower.limits,
    )  # fmt: skip


def motor_figure(run: MechanismRun) -> Figure:
    """Forces and moments of the motors of joints over time."""
    log, follower = run.log, run.follower
    rows, names, turns = follower.motors(), follower.velocity_names(), follower.turns()
    groups = [
        (words, [k for k, row in enumerate(rows) if turns[row] == turning])
        for turning, words in ((False, "force [N]"), (True, "moment [N m]"))
    ]
    groups = [each for each in groups if each[1]]
    title = _title(run, "What the motors of joints do")
    figure, axes = new_figure(1, len(groups), (6.0 * len(groups) + 3.0, 5.0), title)
    first = first_commanded(run)
    for one, (words, shown) in zip(np.atleast_1d(axes), groups, strict=True):
        labels = [names[rows[k]] for k in shown]
        forces = log["motor_forces"][first:, shown]
        curves(one, log["time"][first:], forces, labels, numbers=shown)
        one.set(xlabel="time [s]", ylabel=words)
        one.margins(x=0.01)
        one.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    return figure


def mechanism_pictures(run: MechanismRun, formats: Sequence[str] = DEFAULT_FORMATS) -> Pictures:
    """What draws figures and replay of a run, by the names of their files."""
    log, mechanism = run.log, run.follower.mechanism
    drawn: dict[str, Callable[[], Figure]] = {
        "error": lambda: mechanism_error_figure(run),
        "positions": lambda: position_figure(run),
        "tensions": lambda: tension_figure(run),
        "cable_lengths": lambda: cable_figure(
            _title(run, "Lengths of the cables"), mechanism, log, "lengths", "cable length [m]"
        ),
    }
    if len(run.follower.motors()):
        drawn["motor_forces"] = lambda: motor_figure(run)
    pictures: Pictures = dict(figure_writers(drawn, formats))
    pictures["replay.html"] = lambda path: write_mechanism_replay(
        path, mechanism, log, limits=run.follower.limits, title=run.scenario.title
    )
    return pictures
