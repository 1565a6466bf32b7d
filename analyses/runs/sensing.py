"""Sensors of a visual servo that estimators read: what they read beyond the truth."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    LEGEND_BESIDE,
    curves,
    draw_curve,
    new_figure,
    panels,
)
from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.analyses.visualization.cable_figures import draw_cables
from cdpr_drake.arrays import Array
from cdpr_drake.palette import DISTANCE
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS

PERIOD_TOLERANCE = 1e-6
"""Share of a period by which a row may miss the instant of a reading."""

DEGREES = 180.0 / np.pi

READINGS = {
    "tension": (1.0, "tension, reading - true [N]"),
    "encoder": (1e6, "length, reading - true [um]"),
    "tracker": (1e3, "tracker, from truth [mm]"),
    "metrology": (1e3, "metrology, from truth [mm]"),
}
"""By sensor: factor to the unit of the axis, label."""


def reading_times(times: Array, rate: float | None) -> Array:
    """Times of the last readings before the rows [s]; without a rate readings are continuous."""
    if rate is None:
        return times
    return np.maximum(np.ceil(times * rate - PERIOD_TOLERANCE) - 1.0, 0.0) / rate


def reading_figure(run: Run) -> Figure:
    """Readings of the logged sensors minus the truth, which is interpolated between rows."""
    log, settings, times = run.log, run.scenario.sensors, run.log["time"]
    title, count = run.title("What the sensors read beyond the truth"), len(settings.log)
    figure, axes = panels(count, 1, (10.0, 3.0 * count + 0.5), title)
    for panel, sensor in zip(axes, settings.log, strict=True):
        (scale, label), kind = READINGS[sensor], SENSORS[sensor]
        true, values, is_pose = log[kind.truth], log[kind.reading], kind.truth == "X_WP"
        if is_pose:
            true, values = true[:, 4:], values[:, 4:]
        instants = reading_times(times, settings.rate(sensor))
        errors = values - np.column_stack([np.interp(instants, times, row) for row in true.T])
        if is_pose:
            draw_curve(panel, times, np.linalg.norm(errors, axis=1), DISTANCE, scale=scale)
            panel.set(ylim=(0.0, None))
        else:
            draw_cables(panel, run.robot, times, errors, scale)
            panel.legend(**LEGEND_BESIDE)
        panel.set(xlabel="time [s]", ylabel=label)
    return figure


def imu_figure(run: Run) -> Figure:
    """Specific force, angular velocity, and the biases in them."""
    log = run.log
    figure, axes = new_figure(2, 2, (13.0, 7.5), run.title("What the inertial sensor reads"))
    for panel, values, scale, label in (
        (axes[0, 0], log["specific_force"], 1.0, "specific force [m/s$^2$]"),
        (axes[1, 0], log["angular_velocity"], DEGREES, "angular velocity [deg/s]"),
        (axes[0, 1], log["imu_biases"][:, :3], 1.0, "bias, accelerometers [m/s$^2$]"),
        (axes[1, 1], log["imu_biases"][:, 3:], DEGREES, "bias, gyroscopes [deg/s]"),
    ):
        curves(panel, log["time"], values, "xyz", scale=scale)
        panel.set(xlabel="time [s]", ylabel=label)
        panel.legend(loc="best", ncols=3)
    return figure


def has_sensor(name: str) -> Callable[[Run], bool]:
    """True for runs with a sensor of this key of the section `sensors`."""
    return lambda run: getattr(run.scenario.sensors, name) not in (None, [], ())


SENSING = (
    Subject("", figures={"readings": reading_figure}, applies=has_sensor("log")),
    Subject("", figures={"imu": imu_figure}, applies=has_sensor("imu")),
)
