"""Figures of sensors that look round draw what is not there, too, without a warning."""

import io

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.simulation.perception_figures import looking_figures
from cdpr_drake.systems.sensors.sensor_settings import (
    DepthSettings,
    InertialSettings,
    OdometrySettings,
    PanTiltSettings,
    RangeSettings,
    SensorSuite,
)
from cdpr_drake.trajectories.pose_trajectory import SteadyMotion
from tests.figure_faults import figure_faults

APART = 0.2
"""Between a label and the next one that belongs to another panel [inch]."""

SUITE = SensorSuite(
    range_sensors=[
        RangeSettings(name="fan", type="hokuyo", beams=5),
        RangeSettings(name="one", type="beam"),
    ],
    imu=InertialSettings(),
    depth=DepthSettings(),
    pan_tilt=PanTiltSettings(),
    odometry=OdometrySettings(),
)


def log_of(rows, value):
    """A log in which all sensors read one value."""
    sizes = {
        "scan_fan": 5, "scan_one": 1, "specific_force": 3, "angular_velocity": 3,
        "imu_biases": 6, "depth_row": 4, "pan_tilt_angles": 2, "pan_tilt_encoders": 2,
    }  # fmt: skip
    log = {name: np.full((rows, size), value) for name, size in sizes.items()}
    pose = np.tile([1.0, 0, 0, 0, 0.1, 0.2, 0.3], (rows, 1))
    return log | {"time": 0.1 * np.arange(rows), "X_WO_odometry": pose}


@pytest.mark.parametrize(("rows", "value"), [(1, np.inf), (700, 1.5), (3, -np.inf)])
def test_all_are_drawn_whatever_is_read(rows, value):
    motion = SteadyMotion(RigidTransform(), np.zeros(3), np.zeros(3))
    log = log_of(rows, value)
    for name in ("specific_force", "angular_velocity", "imu_biases"):
        log[name][:] = 1.0
    for name in ("pan_tilt_angles", "pan_tilt_encoders"):
        log[name][:] = 0.2
    drawn = looking_figures(str, SUITE, log, motion, np.full((3, 4), value))
    assert set(drawn) == {"scan_fan", "scan_one", "imu", "depth", "pan_tilt", "odometry"}
    drawn["depth of a run left behind"] = looking_figures(str, SUITE, log, motion, None)["depth"]
    for name, draw in drawn.items():
        if rows == 1 or name.startswith(("scan", "depth")):  # which have gaps
            draw().savefig(io.BytesIO(), dpi=20)


def test_the_scale_of_colours_is_apart_from_the_panel_beside_it():
    """And so are their labels, as they are drawn into a file."""
    motion = SteadyMotion(RigidTransform(), np.zeros(3), np.zeros(3))
    drawn = looking_figures(str, SUITE, log_of(20, 1.5), motion, np.full((240, 320), 1.5))
    for name in ("depth", "scan_fan"):
        figure = drawn[name]()
        assert figure_faults(figure) == []
        scale = next(axes for axes in figure.axes if axes.get_ylabel() == "distance [m]")
        end, begin = (axes.yaxis.label.get_window_extent() for axes in (scale, figure.axes[1]))
        assert begin.x0 - end.x1 > APART * figure.dpi, name
