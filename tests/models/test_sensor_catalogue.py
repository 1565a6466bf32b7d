"""The catalogue of sensors: published values, unknown names."""

import numpy as np
import pytest

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.sensor_catalogue import (
    encoder_names,
    load_encoder,
    load_pose_sensor,
    load_tension_sensor,
    pose_sensor_names,
    tension_sensor_names,
)


def test_published_values():
    vlu850 = load_tension_sensor("vlu850")
    np.testing.assert_array_equal(vlu850.limits, [-25.0, 75.0])
    assert (vlu850.accuracy, vlu850.repeatability) == (0.24, 0.01)
    tractel = load_tension_sensor("tractel")
    assert tractel.accuracy == 0.003 * tractel.limits[1] == 75.0
    c_track = load_pose_sensor("c_track")
    assert (c_track.position_accuracy, c_track.rate_hz) == (1e-4, 80.0)


def test_the_tracker_is_fitted_to_what_is_reported_and_says_so():
    """12 mm at the start and 5 mm at the end of case study I: no comparison, but the fit's own."""
    vive = load_pose_sensor("vive")
    assert "fitted to these two numbers" in " ".join(vive.assumptions.split())
    start = np.hypot(vive.error_per_distance * 0.32, vive.error_per_angle * np.radians(15.6))
    assert start == pytest.approx(0.012, abs=2e-4)
    assert vive.error_per_distance * 0.57 == pytest.approx(0.005, abs=1e-4)


@pytest.mark.parametrize(
    ("names", "load"),
    [
        (tension_sensor_names(), load_tension_sensor),
        (encoder_names(), load_encoder),
        (pose_sensor_names(), load_pose_sensor),
    ],
)
def test_every_file_loads_and_names_itself(names, load):
    assert names
    for name in names:
        model = load(name)
        assert model.name == name
        assert model.source


def test_an_unknown_sensor_is_named():
    with pytest.raises(RobotFileError, match=r"'vlu' is unknown; did you mean vlu850\?"):
        load_tension_sensor("vlu")
