"""The recorded series of a Hangprinter 4 against what its author published of it."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake.analyses.fits.prediction import held_groups
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.errors import CalibrationError
from cdpr_drake.models.robot_loader import load_robot
from tests.analyses.fits.attack import HANGPRINTER as LOG

ROWS = 44
PUBLISHED = 1e-3 * np.array(
    [[16.83, -1584.86, -113.17], [1290.18, 1229.19, -157.45], [-1409.88, 742.61, -151.80],
     [21.85, -0.16, 2343.67]]
)  # fmt: skip
"""M669 of the source, see README.md beside the log [m]."""

PUBLISHED_COST = 1.201390
"""mm^2 a row, of the source."""

ROUGH = np.array(
    [[0.0, -1.62, -0.15], [1.273, 1.273, -0.15], [-1.403, 0.81, -0.15], [0.0, 0.0, 2.35]]
)
"""Anchors by a tape measure, of the source, where the search begins [m]."""

UNKNOWN = ("exit_points", "common_drum_radius", "D.drum_radius", "tracker.[xyz]")
EXACT = {"place": 1e-6}
"""The source takes positions for exact, but for an offset common to all."""

NEAR = 5e-5
"""Anchors equal the published ones, which are rounded to 0.01 mm, within this [m]."""

WRITTEN = 1e-11
"""Logs are written with 12 digits."""

FREE_COST, FREE_MEDIAN = 1.1979, 1.36e-3
"""Without bounds, by least squares of SciPy on the same 176 residuals: cost a row [mm^2], and the
median distance of the nine positions each left out once [m]."""


def believed():
    """The robot before it was calibrated: rough anchors, spools of 75 mm."""
    robot = load_robot("hangprinter_4")
    cables = [
        replace(cable, exit_point=p, drum_radius=None)
        for cable, p in zip(robot.cables, ROUGH, strict=True)
    ]
    return replace(robot, cables=cables, winch=replace(robot.winch, drum_radius=0.0697173))


def read():
    return read_measurements(LOG, "ABCD")


def calibrated(log=LOG, robot=None, **more):
    """A calibration whose motors stood at zero at the origin."""
    how = {"sigmas": EXACT, "zero": RigidTransform(), "keep_outliers": True, **more}
    return cdpr.calibrate(robot or believed(), log, unknown=UNKNOWN, **how)


@pytest.fixture(scope="module")
def bounded():
    return calibrated(bounds={"tracker.[xyz]": 1e-3})


@pytest.fixture(scope="module")
def free():
    return calibrated(hold_out="each")


def test_the_log_that_import_log_writes_has_the_same_numbers(tmp_path):
    """The way that the guide goes: recorder's file, import-log, calibrate."""
    cdpr.import_log(LOG).write(tmp_path / "series.csv")
    direct, imported = read(), read_measurements(tmp_path / "series.csv", "ABCD")
    np.testing.assert_allclose(imported.angles, direct.angles, rtol=WRITTEN)
    np.testing.assert_allclose(imported.points, direct.points, rtol=WRITTEN)


def test_a_log_of_motor_angles_without_a_zero_is_refused_with_what_is_missing():
    with pytest.raises(CalibrationError, match="does not determine") as caught:
        cdpr.calibrate("hangprinter_4", read().only(np.arange(12)))
    assert any(note.endswith("with zero") for note in caught.value.__notes__)


def test_the_published_cost_and_anchors_come_back_under_the_published_bound(bounded):
    result = bounded.result
    assert result.status == "converged"
    assert result.chi_square / ROWS == pytest.approx(PUBLISHED_COST, abs=1e-5)
    np.testing.assert_allclose(result.model.cables.p_WA.T, PUBLISHED, atol=NEAR)
    assert result.at_bounds == {"tracker.x": 1e-3}
    assert "tracker.x is held at its bound, 0.001" in " ".join(bounded.remarks)
    assert bounded.as_dict()["at_bounds"] == {"tracker.x": 1e-3}


def test_spools_at_home_have_the_published_radii(bounded):
    drum = bounded.model.drum()
    at_home = drum.length_per_angle(np.zeros(4)) * drum.gear_ratio * [2.0, 2.0, 2.0, 4.0]
    np.testing.assert_allclose(at_home, [0.076017] * 3 + [0.075657], atol=1e-6)


def test_without_bounds_the_cost_is_lower_and_deviations_are_told(free):
    result = free.result
    assert result.chi_square / ROWS == pytest.approx(FREE_COST, abs=1e-4)
    assert result.at_bounds == {}
    assert result.gauge == result.prior_only == ()
    std = dict(zip(result.names, result.std, strict=True))
    assert 0.010 < std["A.exit_point.y"] < 0.014
    assert 0.012 < std["D.exit_point.z"] < 0.016
    assert result.spread() == pytest.approx(0.988, abs=2e-3)


def test_each_known_position_is_predicted_without_it(free):
    held = free.as_dict()["held_out"]
    assert held["compared_rows"] == list(range(1, 10))
    assert held["each_held_out_once"]
    assert held["fitted_rows"] == []
    assert held["distance_median_m"] == pytest.approx(FREE_MEDIAN, abs=2e-5)
    assert held["angle_rad"] is None
    assert free.held_out.words().startswith(
        "9 rows were not fitted but predicted by a fit on all others"
    )


def test_rows_by_name_are_held_out():
    (rows,) = held_groups("2-4,9", read(), zeroed=True)
    assert rows.tolist() == [1, 2, 3, 8]


def test_motors_whose_sign_is_turned_are_no_fit_and_named():
    log, robot = read(), load_robot("hangprinter_4")
    turned = replace(log, angles=-log.angles)
    words = "176 of 176 motor angles fit with the sign turned"
    with pytest.raises(CalibrationError, match=words):
        calibrated(turned, robot, keep_outliers=False)
    fit = calibrated(turned, robot)
    assert fit.result.status == "misfit"
    assert words in fit.misfit[0]


def test_half_the_readings_of_one_motor_off_are_no_calibration():
    """A third too much in every other row: most of what is dropped is what the search chose."""
    log = read()
    log.angles[1::2, 0] *= 1.3
    assert calibrated(log, keep_outliers=False).result.status == "misfit"


def test_a_motor_that_turns_the_other_way_is_named():
    log = read()
    log.angles[:, 0] *= -1.0
    fit = calibrated(log, bounds={"tracker.[xyz]": 1e-3})
    assert fit.misfit[0] == "all fits with the sign of the motor angles of A turned"
