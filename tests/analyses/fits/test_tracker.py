"""Trackers whose frame nobody measured, tags measured only so well, and poses that come next."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.fits.calibration import calibration_fit, fit_robot
from cdpr_drake.analyses.fits.prediction import next_poses
from cdpr_drake.analyses.fits.robots import calibration_model, rest_poses
from cdpr_drake.analyses.fits.tags import TagPlace, read_tags
from cdpr_drake.analyses.planning.path_files import read_path
from cdpr_drake.calibration.guesses import with_tags
from cdpr_drake.calibration.measurements import (
    simulated_corners,
    simulated_lengths,
    simulated_poses,
)
from cdpr_drake.calibration.parameters import model_difference, parameter_layout
from cdpr_drake.calibration.pose_design import expected_std
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.poses import place_error, pose_error, pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.vision.apriltags import TagTarget
from tests.analyses.fits.logs import ROBOT, SIGMAS, poses, recorded, tracked_fit

EXACT = calibration_model(ROBOT)
FAR = pose_from_angles(np.array([1.5, -0.7, 0.4]), np.radians([20.0, -35.0, 110.0]))
"""The tracker's frame in W: a camera at the wall."""
MARKER = pose_from_angles(np.array([0.05, -0.02, 0.06]), np.radians([5.0, 170.0, -60.0]))
MOST_SIGMAS = 5.0
"""An error of a hundred normal ones is above once in twenty thousand times; seeds are fixed."""


def errors(result, true, *groups):
    """By how many standard deviations parameters of these groups are off."""
    names = parameter_layout(true).names
    free = [any(group in name.split(".") for group in groups) for name in names]
    return np.abs(model_difference(result.model, true)[free]) / result.std


@pytest.mark.parametrize("more", [{}, {"X_PM": MARKER}])
def test_a_tracker_on_the_wall_is_found(more):
    true, unknown = replace(EXACT, X_WK=FAR, **more), ("tracker", "marker")[: 1 + len(more)]
    result = tracked_fit(unknown, recorded(true)).result
    assert result.status == "converged"
    assert result.gauge == result.prior_only == result.outliers == ()
    assert len(result.names) == 6 * len(unknown)
    assert np.max(errors(result, true, *unknown)) < MOST_SIGMAS
    assert pose_error(result.model.X_WK, FAR)[0] < 1e-3


def test_exit_points_and_the_trackers_frame_cannot_both_be_told():
    log = recorded(replace(EXACT, X_WK=FAR))
    calibration = tracked_fit(("exit_points", "tracker"), log, {"exit_points": 0.01})
    words = "translation of the world frame along "
    assert calibration.result.gauge[-3:] == (words + "x", words + "y", words + "z")
    said = calibration_fit(calibration).as_dict()
    assert "the tracker belong to the log" in said["remarks"][-1]
    assert len(said["tracker_X_WK"]) == 7


def test_drum_and_pulley_radii_come_back_by_a_tracker_of_unknown_frame():
    scale = 1.0 + 0.01 * np.random.default_rng(3).standard_normal(8)
    cables = replace(EXACT.cables, pulley_radius=EXACT.cables.pulley_radius + 5e-4)
    true = replace(EXACT, X_WK=FAR, length_scale=scale, cables=cables)
    unknown = ("length_scales", "pulley_radii", "tracker")
    result = tracked_fit(unknown, recorded(true)).result
    assert result.gauge == ()
    off = errors(result, true, "length_scale", "pulley_radius", "tracker")
    assert np.max(off) < MOST_SIGMAS
    assert np.max(result.std[:8]) < 2e-3  # of 1 % that drums are off


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
    targets = {tag: TagTarget(tag, 0.06) for tag in places}
    pinhole = load_camera("ids_kowa").pinhole(640, 480)
    uv = simulated_corners(true, poses(), targets, pinhole, 0.2, np.random.default_rng(2))
    corners = {tag: uv[:, k] for k, tag in enumerate(targets)}
    log = replace(recorded(true), poses=None, corners=corners)

    def fitted(third):
        """With this place of tag 3."""
        more = {"tags": tags | {3: third}, "image_size": (640, 480)}
        return tracked_fit(("camera",), log, **more).result

    measured = fitted(tags[3])
    assert {name.split(".")[0] for name in measured.names} == {"camera", "tag3", "tag5"}
    # Seen from poses that cables tell to 0.1 mm, its own 2 mm hardly matter; they do say more.
    alone = fitted(TagPlace(0.06))
    mine = [name.startswith("tag3") for name in measured.names]
    assert np.all(measured.std[mine] <= alone.std[mine] * (1.0 + 1e-9))
    assert np.any(measured.std[mine] < alone.std[mine])
    # Known to a micrometre, it is where it was measured.
    held = fitted(tags[3]._replace(sigma_place=1e-6, sigma_turn=1e-6))
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


# Poses that are proposed after a calibration.

NEXT = 5
PREDICTED = 0.03
"""Standard deviations are told where the robot was believed to be, millimetres away."""


@pytest.fixture(scope="module")
def first():
    """A calibration from few poses."""
    return tracked_fit(("exit_points",), recorded(EXACT, count=6))


@pytest.fixture(scope="module")
def proposed(first):
    return next_poses(first.setup, first.result, NEXT)


def std_after(first, poses, seed):
    """Standard deviations of a calibration of the log with rows for further poses."""
    log, random = first.setup.task.log, np.random.default_rng(seed)
    readings = simulated_lengths(EXACT, poses, log.lengths[0], SIGMAS.lengths, random)
    tracked = simulated_poses(poses, SIGMAS.turn, SIGMAS.place, random)
    log = replace(
        log, count=log.count + len(poses), lengths=np.vstack([log.lengths, readings]),
        poses=[*log.poses, *tracked],
    )  # fmt: skip
    return fit_robot(replace(first.setup.task, log=log)).result.std


def test_next_poses_give_what_is_expected_of_them(first, proposed):
    std = std_after(first, proposed.poses, 7)
    np.testing.assert_allclose(std, proposed.std_then, rtol=PREDICTED)
    assert np.all(proposed.std_then < proposed.std_now)
    np.testing.assert_array_equal(proposed.std_now, first.result.std)


def test_next_poses_tell_more_than_poses_at_random(first, proposed):
    others = [rest_poses(ROBOT, NEXT, np.random.default_rng(k))[0] for k in (11, 12, 13)]
    volumes = [np.prod(std_after(first, poses, 8)) for poses in (proposed.poses, *others)]
    assert volumes[0] < min(volumes[1:])


def test_what_the_log_tells_counts_in_the_choice(first, proposed):
    nothing = replace(first.result, information=np.zeros_like(first.result.information))
    others = next_poses(first.setup, nothing, NEXT).poses
    assert max(place_error(X, Y) for X, Y in zip(proposed.poses, others, strict=True)) > 0.01


def test_the_file_of_next_poses_is_a_path(proposed, tmp_path):
    (tmp_path / "next_poses.csv").write_text(proposed.text())
    path = read_path(tmp_path / proposed.as_dict()["file"])
    assert len(path.poses) == NEXT
    for X, Y in zip(path.poses, proposed.poses, strict=True):
        assert max(pose_error(X, Y)) < 1e-7
    assert len(proposed.as_dict()["std_then"]) == 24
    assert len(proposed.table().rows) == 1


def test_nothing_is_expected_of_what_nothing_tells():
    information = np.diag([4.0, 0.0])
    np.testing.assert_allclose(expected_std(information, np.array([0.01, 0.01])), [0.005, 0.0])
