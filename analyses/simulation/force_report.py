"""What a run under forces did: what pushed and touched the platform, as numbers and as a figure."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import line_style, new_figure
from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.arrays import Array
from cdpr_drake.control.force_laws import port_energy
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.palette import DESIRED, ESTIMATED, PLATFORM
from cdpr_drake.systems.controllers.force_tracking import HYBRID, ForceControl
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH

CONTACT, ESTIMATE = "contact_force", "wrench_estimated"


def feels_forces(log: Log) -> bool:
    """Whether something pushed the platform, or a law answered forces."""
    return APPLIED_WRENCH in log or ESTIMATE in log


def true_force(log: Log) -> Array:
    """Force of disturbances and contact on the platform in W, shape (n, 3) [N]."""
    force = np.zeros((len(log["time"]), 3))
    if APPLIED_WRENCH in log:
        force = force + np.asarray(log[APPLIED_WRENCH])[:, 3:]
    if CONTACT in log:
        force = force + np.asarray(log[CONTACT])
    return force


def pressed_force(settings: ForceControl, log: Log) -> Array:
    """Force on what is touched along the axes that press, in T, shape (n, k) [N]."""
    R = rotation_from_angles(np.radians(settings.task_angles_deg)).matrix()
    return np.asarray(-(true_force(log) @ R)[:, settings.pressed()[3:] > 0.0])


def force_summary(settings: ForceControl | None, log: Log) -> dict[str, Any]:
    """What pushed, what the port took in and gave, and how well a force was held.

    Of a force that is pressed with, from when it is within a tenth for the first time.
    """
    found: dict[str, Any] = {"law": "tracking" if settings is None else settings.kind}
    found["largest_force_n"] = float(np.max(np.linalg.norm(true_force(log), axis=1)))
    if APPLIED_WRENCH in log:
        energy = port_energy(np.asarray(log["X_WP"]), np.asarray(log[APPLIED_WRENCH]))
        found["port_energy_j"] = {"end": float(energy[-1]), "least": float(np.min(energy))}
    if settings is not None and settings.kind == HYBRID:
        assert settings.force is not None
        wanted = settings.force[settings.pressed()[3:] > 0.0]
        wrong = pressed_force(settings, log) - wanted
        near = np.all(np.abs(wrong) <= 0.1 * np.linalg.norm(wanted), axis=1)
        found["held_from_s"] = found["held_rms_n"] = None
        if np.any(near):
            first = int(np.argmax(near))
            found["held_from_s"] = float(log["time"][first])
            found["held_rms_n"] = float(np.sqrt(np.mean(np.sum(wrong[first:] ** 2, axis=1))))
    return found


def widen(panel: Axes, least: float) -> None:
    """Shows at least so much of an axis, so that what is nothing looks like that."""
    low, high = panel.get_ylim()
    if high - low < least:
        middle = 0.5 * (low + high)
        panel.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


def force_figure(title: str, settings: ForceControl | None, log: Log) -> Figure:
    """Force on the platform over time, true and estimated, and where it goes."""
    time, true = log["time"], true_force(log)
    figure, panels = new_figure(2, 3, (12.0, 6.4), title)
    pressed = np.zeros(3)
    if settings is not None and settings.kind == HYBRID:
        assert settings.force is not None
        R = rotation_from_angles(np.radians(settings.task_angles_deg)).matrix()
        pressed = R @ (settings.force * settings.pressed()[3:])
    for k, axis in enumerate("xyz"):
        force, place = panels[0, k], panels[1, k]
        force.plot(time, true[:, k], **line_style(PLATFORM), label="on the platform")
        if ESTIMATE in log:
            estimate = np.asarray(log[ESTIMATE])[:, 3 + k]
            force.plot(time, estimate, **line_style(ESTIMATED), label="estimated")
        if pressed[k] != 0.0:
            force.axhline(-pressed[k], **line_style(DESIRED), label="asked for")
        force.set(ylabel=f"force along {axis} [N]")
        widen(force, 0.1)
        where, wanted = (np.asarray(log[name])[:, 4 + k] for name in ("X_WP", "X_WP_desired"))
        place.plot(time, 1e3 * where, **line_style(PLATFORM), label="platform")
        place.plot(time, 1e3 * wanted, **line_style(DESIRED), label="trajectory")
        place.set(xlabel="time [s]", ylabel=f"{axis} [mm]")
        widen(place, 1.0)
    panels[0, int(np.argmax(np.abs(pressed))) if np.any(pressed) else 2].legend(loc="best")
    panels[1, 2].legend(loc="best")
    return figure
