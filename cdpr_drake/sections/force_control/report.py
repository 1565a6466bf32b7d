"""Forces on the platform in a run of dynamic control: numbers and a figure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import line_style, new_figure
from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.analyses.runs.subjects import CONTACT
from cdpr_drake.arrays import Array
from cdpr_drake.control.force_laws import port_energy
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.palette import DESIRED, ESTIMATED, PLATFORM
from cdpr_drake.sections.force_control.section import HYBRID
from cdpr_drake.sections.wrench_estimation.section import ESTIMATED as WRENCH_ESTIMATED
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL

NEAR_FORCE = 0.1
"""A force is held from the first time that its error is below this share of it."""

LEAST_FORCE, LEAST_MOTION = 0.1, 1.0
"""Least spans of axes of forces [N] and positions [mm]: smaller ones would enlarge rounding."""


def true_force(log: Mapping[str, Array]) -> Array:
    """Force of disturbances and contact on the platform in W, shape (n, 3) [N]."""
    force = np.zeros((len(log["time"]), 3))
    if APPLIED_WRENCH in log:
        force = force + np.asarray(log[APPLIED_WRENCH])[:, 3:]
    return force + np.asarray(log[CONTACT]) if CONTACT in log else force


def force_numbers(run: Run) -> dict[str, Any]:
    """Largest force, energy at the port, and how well a force is held from its first time on."""
    settings, log, force = run.scenario.force_control, run.log, true_force(run.log)
    numbers: dict[str, Any] = {"law": "tracking" if settings is None else settings.kind}
    numbers["largest_force_n"] = float(np.max(np.linalg.norm(force, axis=1)))
    if APPLIED_WRENCH in log:
        energy = port_energy(np.asarray(log["X_WP"]), np.asarray(log[APPLIED_WRENCH]))
        numbers["port_energy_j"] = {"end": float(energy[-1]), "least": float(np.min(energy))}
    if settings is not None and settings.kind == HYBRID:
        pressed = settings.pressed()[3:] > 0.0
        goal = settings.force[pressed]
        errors = np.asarray(-(force @ _task_rotation(settings))[:, pressed]) - goal
        near = np.all(np.abs(errors) <= NEAR_FORCE * np.linalg.norm(goal), axis=1)
        numbers["held_from_s"] = numbers["held_rms_n"] = None
        if np.any(near):
            first = int(np.argmax(near))
            numbers["held_from_s"] = float(log["time"][first])
            numbers["held_rms_n"] = float(np.sqrt(np.mean(np.sum(errors[first:] ** 2, axis=1))))
    return numbers


def _task_rotation(settings: Any) -> Array:
    """R_WT of the frame in which a force is pressed, shape (3, 3)."""
    return np.asarray(rotation_from_angles(np.radians(settings.task_angles_deg)).matrix())


def force_figure(run: Run) -> Figure:
    """Force on the platform over time, true and estimated, and where the platform goes."""
    settings, log, time = run.scenario.force_control, run.log, run.log["time"]
    force, pressed = true_force(log), np.zeros(3)
    if settings is not None and settings.kind == HYBRID:
        pressed = _task_rotation(settings) @ (settings.force * settings.pressed()[3:])
    title = run.title("Forces on the platform, and where it goes")
    figure, panels = new_figure(2, 3, (12.0, 6.4), title)
    for k, axis in enumerate("xyz"):
        above, below = panels[0, k], panels[1, k]
        above.plot(time, force[:, k], **line_style(PLATFORM), label="on the platform")
        if WRENCH_ESTIMATED in log:
            estimate = np.asarray(log[WRENCH_ESTIMATED])[:, 3 + k]
            above.plot(time, estimate, **line_style(ESTIMATED), label="estimated")
        if pressed[k] != 0.0:
            above.axhline(-pressed[k], **line_style(DESIRED), label="asked for")
        above.set(ylabel=f"force along {axis} [N]")
        _widen(above, LEAST_FORCE)
        for name, look, label in (
            ("X_WP", PLATFORM, "platform"), ("X_WP_desired", DESIRED, "trajectory")
        ):  # fmt: skip
            below.plot(time, 1e3 * np.asarray(log[name])[:, 4 + k], **line_style(look), label=label)
        below.set(xlabel="time [s]", ylabel=f"{axis} [mm]")
        _widen(below, LEAST_MOTION)
    panels[0, int(np.argmax(np.abs(pressed))) if np.any(pressed) else 2].legend(loc="best")
    panels[1, 2].legend(loc="best")
    return figure


def _widen(panel: Axes, least: float) -> None:
    low, high = panel.get_ylim()
    if high - low < least:
        middle = 0.5 * (low + high)
        panel.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


FORCES = Subject(
    "forces",
    force_numbers,
    {"forces": force_figure},
    applies=lambda run: run.kind == TENSION_CONTROL,
)
"""Of dynamic control in which something pushes, or a wrench is estimated."""

SUBJECTS = (FORCES,)
"""What a run reports of the section."""
