"""`calibrate` and `identify`: what they return and write, and robots drawn from their folders."""

import json

import numpy as np
import pytest
from matplotlib.figure import Figure

import cdpr_drake as cdpr
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.models.robot_draws import ParameterCovariance
from cdpr_drake.models.robot_loader import load_robot
from tests.analyses.fits.logs import MOTION_NOISE, write_motion, write_planar
from tests.analyses.verbs.verb_checks import as_json, one_line, shows_itself
from tests.identification.logs import log as motion_log

UNKNOWN = ("C1.exit_point.x", "C1.exit_point.y")
COUNT = 300

ODDS = 5.0
"""Standard errors that a sample of `COUNT` may be off: one in a million is."""


def read(robot, path):
    return read_measurements(path, [cable.name for cable in robot.cables])


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    """The log, and the calibration in a folder beside it."""
    folder = tmp_path_factory.mktemp("calibrated")
    path = write_planar(folder / "log.csv")
    fit = cdpr.calibrate("planar", path, unknown=UNKNOWN, folder=folder / "out", formats=("svg",))
    return path, fit


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    """The same of an identification."""
    folder = tmp_path_factory.mktemp("identified")
    path = write_motion(folder / "motion.csv", *motion_log(span=4.0, **MOTION_NOISE))
    return path, cdpr.identify("acrobot_large", path, pulleys=False, folder=folder / "out")


def test_a_calibration(planar, calibrated):
    path, fit = calibrated
    moved = fit.model.cables[0].exit_point - planar.cables[0].exit_point
    np.testing.assert_allclose(moved, [0.005, 0.0, 0.0], atol=1e-4)
    shows_itself(fit)
    assert isinstance(fit.plot(), Figure)
    out = path.parent / "out"
    assert fit.folder == out
    assert {path.name for path in out.glob("*.svg")} == {"calibration.svg", "correlation.svg"}
    assert json.loads((out / "results.json").read_text()) == as_json(fit)
    # Python computes a complete one again, and leaves its files.
    again = cdpr.calibrate("planar", path, unknown=UNKNOWN, folder=out, formats=("svg",))
    np.testing.assert_array_equal(again.result.values, fit.result.values)
    assert json.loads((out / "results.json").read_text()) == as_json(fit)


@pytest.mark.parametrize(
    ("options", "words"),
    [({"propose": 0}, "propose: found 0"), ({"sigmas": {"length": 1.0}}, "lengths")],
)
def test_what_only_python_can_ask_is_refused(calibrated, options, words):
    one_line(lambda: cdpr.calibrate("planar", calibrated[0], **options), words)


def test_an_identification_shows_itself(identified):
    assert "mass" in shows_itself(identified[1])


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


@pytest.mark.parametrize(("fit", "first"), [("calibrated", UNKNOWN[0]), ("identified", "mass")])
def test_robots_drawn_from_a_folder_have_its_covariance(request, fit, first):
    folder = request.getfixturevalue(fit)[1].folder
    batch = cdpr.BatchRobots.drawn(folder / "robot.yaml", COUNT, folder, seed=2)
    doubt = ParameterCovariance.of(folder).of_the_robot()
    assert doubt.names[0] == first
    middle = load_robot(str(folder / "robot.yaml"))
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


def test_a_folder_of_something_else_is_refused(tmp_path):
    (tmp_path / "results.json").write_text('{"study": "basin"}')
    with pytest.raises(cdpr.CdprError, match="found no parameters with a covariance"):
        cdpr.BatchRobots.drawn("acrobot_large", 3, tmp_path)
