"""Figures of a run's motors and sensors, where it has any."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    LEGEND_BESIDE,
    draw_curve,
    line_style,
    new_figure,
    panels,
    shade,
)
from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.analyses.visualization.cable_figures import draw_cables
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import BOUND, DISTANCE
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS, SensorSettings

PERIOD_TOLERANCE = 1e-6
"""Share of a period by which a row may miss the instant of a reading."""


def motor_figure(title: str, robot: Robot, log: Log) -> Figure:
    """Torques of the motors, and what friction takes of them."""
    figure, axes = new_figure(2, 1, (10.0, 7.5), title)
    labels = ("motor torque [N m]", "friction torque [N m]")
    for each, quantity, label in zip(
        axes, ("applied_torques", "friction_torques"), labels, strict=True
    ):
        draw_cables(each, robot, log["time"], log[quantity])
        each.set(xlabel="time [s]", ylabel=label)
    law = robot.winch_law()
    for sign, name in ((-1.0, None), (1.0, f"static friction\n{law.friction.static:g} N m")):
        axes[1].axhline(sign * law.friction.static, label=name, **line_style(BOUND))
    for each in axes:
        each.legend(**LEGEND_BESIDE)
    return figure


def tension_loop_figure(title: str, robot: Robot, log: Log, limits: tuple[float, float]) -> Figure:
    """Wanted tensions between their limits [N], and what the true ones are beyond them.

    Shaded is when no tensions within the limits gave the wanted wrench.
    """
    figure, axes = new_figure(2, 1, (10.0, 7.5), title)
    times, wanted = log["time"][1:], log["wanted_tensions"][1:]  # before the first step: zeros
    draw_cables(axes[0], robot, times, wanted)
    draw_cables(axes[1], robot, times, log["tensions"][1:] - wanted)
    low, high = limits
    axes[0].axhline(low, label=f"lower limit {low:g} N", **line_style(BOUND))
    if high <= 1.5 * float(np.max(wanted, initial=0.0)):
        axes[0].axhline(high, label=f"upper limit {high:g} N", **line_style(BOUND))
    labels = ("wanted tension [N]", "true - wanted tension [N]")
    for each, label in zip(axes, labels, strict=True):
        shade(each, times, log["relaxed"][1:, 0] > 0.0, "wrench infeasible")
        each.set(xlabel="time [s]", ylabel=label)
        each.legend(**LEGEND_BESIDE)
    return figure


READING_PANELS = {
    "tension": ("tensions", 1.0, "tension, reading - true [N]"),
    "encoder": ("unstrained_lengths", 1e6, "length, reading - true [um]"),
    "tracker": ("X_WP", 1e3, "tracker, from truth [mm]"),
    "metrology": ("X_WP", 1e3, "metrology, from truth [mm]"),
}
"""By sensor: what is true in the log, factor to the unit of the axis, label."""


def reading_errors(log: Log, settings: SensorSettings, sensor: str) -> tuple[Array, Array]:
    """What a logged sensor read beyond the truth at the time when it read.

    A row of the log shows the last reading before it; between rows the truth is interpolated.

    Returns:
        Times of the rows, shape (n,) [s], and errors in the log's units: shape (n, m), or, of
        poses, of positions in W, shape (n, 3) [m].
    """
    times, rate = log["time"], settings.rate(sensor)
    read = times
    if rate is not None:
        read = np.maximum(np.ceil(times * rate - PERIOD_TOLERANCE) - 1.0, 0.0) / rate
    true, shown = log[READING_PANELS[sensor][0]], log[SENSORS[sensor].reading]
    if SENSORS[sensor].reading.startswith("X_"):
        true, shown = true[:, 4:], shown[:, 4:]
    then = np.column_stack([np.interp(read, times, column) for column in true.T])
    return times, shown - then


def reading_figure(title: str, robot: Robot, log: Log, settings: SensorSettings) -> Figure:
    """What the logged sensors read beyond the truth at the time when they read."""
    count = len(settings.log)
    figure, axes = panels(count, 1, (10.0, 3.0 * count + 0.5), title)
    for each, sensor in zip(axes, settings.log, strict=True):
        times, error = reading_errors(log, settings, sensor)
        _, scale, label = READING_PANELS[sensor]
        if SENSORS[sensor].reading.startswith("X_"):
            draw_curve(each, times, np.linalg.norm(error, axis=1), DISTANCE, scale=scale)
            each.set(ylim=(0.0, None))
        else:
            draw_cables(each, robot, times, error, scale)
            each.legend(**LEGEND_BESIDE)
        each.set(xlabel="time [s]", ylabel=label)
    return figure
