"""Many robots from the folders that calibrations and identifications really leave."""

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.models.robot_draws import ParameterCovariance
from tests.analyses.verbs.test_fits import tracked_poses
from tests.identification.logs import log as motion_log

COUNT = 300

ODDS = 5.0
"""Standard errors that a sample of `COUNT` may be off: one in a million is."""


def value(robot, name):
    """A parameter of a robot, read from the fields of its file."""
    owner, _, rest = name.partition(".")
    if name == "mass":
        return robot.platform.mass
    if owner == "center_of_mass":
        return robot.center_of_mass()["xyz".index(rest)]
    if owner == "inertia":
        return robot.platform.inertia[["xx", "yy", "zz", "xy", "xz", "yz"].index(rest)]
    cable = next(cable for cable in robot.cables if cable.name == owner)
    what, axis = rest.split(".")
    return getattr(cable, what)["xyz".index(axis)]


def beside_its_covariance(folder):
    """Robots drawn by the folder alone, held against what its file says."""
    batch = cdpr.BatchRobots.drawn(folder / "robot.yaml", COUNT, folder, seed=2)
    doubt = ParameterCovariance.of(folder).of_the_robot()
    middle = cdpr.load_robot(folder / "robot.yaml")
    expected = np.array([value(middle, name) for name in doubt.names])
    drawn = np.array([[value(robot, name) for name in doubt.names] for robot in batch.robots])
    sigmas = np.sqrt(np.diag(doubt.covariance))
    assert np.all(sigmas > 0.0)
    assert np.all(np.abs(drawn.mean(axis=0) - expected) < ODDS * sigmas / np.sqrt(COUNT))
    spread = drawn.std(axis=0, ddof=1) / sigmas
    assert np.all(np.abs(spread - 1.0) < ODDS / np.sqrt(2.0 * COUNT))
    correlations = np.corrcoef(drawn.T), doubt.covariance / np.outer(sigmas, sigmas)
    assert np.max(np.abs(correlations[0] - correlations[1])) < ODDS / np.sqrt(COUNT)
    before = batch.poses
    batch.step(np.zeros(batch.commands_per_robot), 0.02)
    assert not batch.failed.any()
    assert np.max(np.abs(batch.poses - before)) < 1e-3, "they hang at rest"
    return doubt.names


def test_the_folder_of_a_calibration(tmp_path):
    planar = cdpr.load_robot("planar")
    path = tracked_poses(planar, tmp_path / "log.csv")
    asked = ("C1.exit_point.x", "C1.exit_point.y")
    cdpr.calibrate(planar, path, unknown=asked, folder=tmp_path / "out")
    assert beside_its_covariance(tmp_path / "out") == asked


def test_the_folder_of_an_identification(tmp_path):
    time, poses, tensions = motion_log(span=4.0, tension=0.3, place=1e-4, angle=2e-4)
    header = ["time_s", *(f"X_WP.{name}" for name in ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m"))]
    header += [f"measured_tensions.C{k + 1}_n" for k in range(8)]
    path, rows = tmp_path / "motion.csv", np.column_stack([time, poses, tensions])
    np.savetxt(path, rows, delimiter=",", header=",".join(header), comments="", fmt="%.12g")
    cdpr.identify("acrobot_large", path, pulleys=False, folder=tmp_path / "out")
    assert "mass" in beside_its_covariance(tmp_path / "out")


def test_a_folder_of_something_else_is_refused(tmp_path):
    (tmp_path / "results.json").write_text('{"study": "basin"}')
    with pytest.raises(cdpr.CdprError, match="found no parameters with a covariance"):
        cdpr.BatchRobots.drawn("acrobot_large", 3, tmp_path)
