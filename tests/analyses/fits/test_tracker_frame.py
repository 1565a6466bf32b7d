"""A tracker whose frame nobody measured, and tags that were measured only so well."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.fits.calibration import calibration_fit, fit_robot
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.analyses.fits.tags import TagPlace, read_tags
from cdpr_drake.calibration.guesses import with_tags
from cdpr_drake.calibration.measurements import simulated_corners
from cdpr_drake.calibration.parameters import model_difference, parameter_layout
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.vision.apriltags import TagTarget
from tests.analyses.fits.logs import ROBOT, poses, recorded, task

FAR = pose_from_angles(np.array([1.5, -0.7, 0.4]), np.radians([20.0, -35.0, 110.0]))
"""The tracker's frame in W: a camera at the wall."""
MARKER = pose_from_angles(np.array([0.05, -0.02, 0.06]), np.radians([5.0, 170.0, -60.0]))
MOST_SIGMAS = 5.0
"""An error of a hundred normal ones is above once in twenty thousand times; seeds are fixed."""


@pytest.mark.parametrize(
    ("unknown", "marker"), [(("tracker",), False), (("tracker", "marker"), True)]
)
def test_a_tracker_on_the_wall_is_found(unknown, marker):
    true = replace(calibration_model(ROBOT), X_WK=FAR)
    if marker:
        true = replace(true, X_PM=MARKER)
    found = fit_robot(task(unknown, recorded(true))).result
    assert found.status == "converged"
    assert found.gauge == found.prior_only == found.outliers == ()
    assert len(found.names) == 6 * len(unknown)
    assert np.max(errors(found, true, *unknown)) < MOST_SIGMAS
    assert pose_error(found.model.X_WK, FAR)[0] < 1e-3


def errors(found, true, *groups):
    """By how many standard deviations parameters of these groups are off."""
    free = [any(group in name for group in groups) for name in parameter_layout(true).names]
    return np.abs(model_difference(found.model, true)[free]) / found.std


def test_exit_points_and_the_trackers_frame_cannot_both_be_told():
    true = replace(calibration_model(ROBOT), X_WK=FAR)
    calibration = fit_robot(task(("exit_points", "tracker"), recorded(true), {"exit_points": 0.01}))
    words = "translation of the world frame along "
    assert calibration.result.gauge[-3:] == (words + "x", words + "y", words + "z")
    said = calibration_fit(calibration).as_dict()
    assert "the tracker belong to the log" in said["remarks"][-1]
    assert len(said["tracker_X_WK"]) == 7


def test_drum_and_pulley_radii_come_back_by_a_tracker_of_unknown_frame():
    exact = calibration_model(ROBOT)
    scale = 1.0 + 0.01 * np.random.default_rng(3).standard_normal(8)
    radius = exact.cables.pulley_radius + 5e-4
    cables = replace(exact.cables, pulley_radius=radius)
    true = replace(exact, X_WK=FAR, length_scale=scale, cables=cables)
    unknown = ("length_scales", "pulley_radii", "tracker")
    found = fit_robot(task(unknown, recorded(true))).result
    assert found.gauge == ()
    off = errors(found, true, "length_scale", "pulley_radius", "tracker")
    assert np.max(off) < MOST_SIGMAS
    assert np.max(found.std[:8]) < 2e-3  # of 1 % that drums are off


TAG_TABLE = """tag,size_mm,x_m,y_m,z_m,phi_deg,theta_deg,psi_deg,sigma_mm,sigma_deg
3,60,-0.15,-0.1,0,0,0,0,2,0.5
4,60,0.15,0.1,0,0,0,0,,
5,60,,,,,,,,
"""


def test_tags_that_were_measured_so_well_pull_as_much(tmp_path):
    file = tmp_path / "tags.csv"
    file.write_text(TAG_TABLE)
    tags = read_tags(file)
    assert tags[3][2:] == pytest.approx((2e-3, np.radians(0.5)))
    assert tags[4][2:] == (0.0, 0.0)
    assert tags[5] == TagPlace(0.06)
    places = {tag: tags[tag].X_WT for tag in (3, 4)}
    places[5] = pose_from_angles(np.array([0.15, -0.1, 0.0]), np.zeros(3))
    true = with_tags(calibration_model(ROBOT, "onboard"), places)
    log = replace(recorded(true), poses=None)
    targets = {tag: TagTarget(tag, 0.06) for tag in places}
    pinhole = load_camera("ids_kowa").pinhole(640, 480)
    uv = simulated_corners(true, poses(), targets, pinhole, 0.2, np.random.default_rng(2))
    log = replace(log, corners={tag: uv[:, k] for k, tag in enumerate(targets)})

    def fitted(tags):
        return fit_robot(task(("camera",), log, tags=tags, image_size=(640, 480))).result

    found = fitted(tags)
    assert {name.split(".")[0] for name in found.names} == {"camera", "tag3", "tag5"}
    # Seen from poses that cables tell to 0.1 mm, its own 2 mm hardly matter; they do say more.
    alone = tags | {3: TagPlace(0.06)}
    sure = fitted(alone)
    mine = [name.startswith("tag3") for name in found.names]
    assert np.all(found.std[mine] <= sure.std[mine] * (1.0 + 1e-9))
    assert np.any(found.std[mine] < sure.std[mine])
    # Known to a micrometre, it is where it was measured.
    exact = tags | {3: tags[3]._replace(sigma_place=1e-6, sigma_turn=1e-6)}
    held = fitted(exact)
    assert pose_error(held.model.tags[3], places[3])[0] < 5e-6


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("3,60,0,0,0,0,0,0,2,", "found 0.002 m and 0 rad"),
        ("3,60,0,0,0,0,0,0,-2,1", "found -0.002 m"),
        ("3,60,,,,,,,2,1", "without a place"),
        ("3,60,0,0,0,0,0,0,,\n3,60,0,0,0,0,0,0,,", "found tag 3 twice"),
    ],
)
def test_deviations_that_cannot_be_are_named(tmp_path, row, words):
    file = tmp_path / "tags.csv"
    file.write_text(TAG_TABLE.splitlines()[0] + "\n" + row + "\n")
    with pytest.raises(CalibrationError, match=words) as problem:
        read_tags(file)
    assert str(problem.value).startswith(f"{file}:")
