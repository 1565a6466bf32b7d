"""Systematic errors in logs are misfits with their reason; a far start still converges.

`attack` has the whole table; here is a cheap part of it.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from tests.analyses.fits.attack import attacks, clean, hangprinter, outcome, scene

ROWS = 20
"""Of a log that is attacked."""

SAME = 2e-3
"""Distances of exit points by noise of a millimetre in 99 rows [m]."""


@pytest.fixture(scope="module")
def scenes():
    return {name: scene(name, ROWS) for name in ("tracked8", "blind4")}


@pytest.mark.parametrize(
    ("name", "attack", "words"),
    [
        ("blind4", "-roll", "all fits with the sign of roll turned"),
        ("blind4", "-swivel of cable 1", "the sign of the swivel angles of C1 turned"),
        ("blind4", "50 % of rows, mixed, x 1.05", "times what fits the other rows"),
        ("blind4", "30 % of rows, the first, x 1.05", "are 1.049 times what fits the other rows"),
        ("tracked8", "cables 1, 2 swapped", "length of C1 and length of C2 exchanged"),
        ("tracked8", "-pitch of tracker", "readings of tracker, turn y do not fit"),
        ("tracked8", "10 % of rows, mixed, x 1.05", "times what fits the other rows"),
        ("tracked8", "half of all lengths x 1.05", "do not fit"),
        ("tracked8", "cable 1 late by 1", "readings of length of C1 do not fit"),
    ],
)
def test_a_systematic_error_is_a_misfit_with_its_reason(scenes, name, attack, words):
    one = scenes[name]
    said = outcome(one, dict(attacks(one.log))[attack])
    assert said.status == "misfit"
    assert words in said.words


def test_rows_off_are_found_beside_positions_that_are_exact():
    """These have no degree of freedom, and so no scatter of their own."""
    one = hangprinter()
    said = outcome(one, dict(attacks(one.log))["30 % of rows, the first, x 1.05"])
    assert said.status == "misfit"
    assert "motor angles from row " in said.words


def test_an_error_that_moves_poses_little_enlarges_their_deviations(scenes):
    """A cable's factor that offsets follow for the most part: a remark."""
    one = scenes["tracked8"]
    said = outcome(one, dict(attacks(one.log))["cable 3 x 0.97"])
    assert said.status == "converged", said.words
    assert "length of C3 is 0.97" in said.words
    assert said.is_met


@pytest.mark.parametrize("number", [0, 3, 4])
def test_a_clean_log_is_no_misfit_whatever_its_sigmas(number):
    """By `clean`: with 4, 6 and 8 cables, sigmas off by up to 4, and outliers."""
    said = outcome(clean(number)[1])
    assert said.status == "converged", said.words
    assert said.is_met


def test_all_that_is_said_is_in_the_numbers_and_the_figure(scenes):
    one = scenes["tracked8"]
    rows = [2, 8, 16]
    lengths = one.log.lengths.copy()
    lengths[rows] *= 1.05
    found = cdpr.calibrate(one.robot, replace(one.log, lengths=lengths), **one.options)
    group = json.loads(json.dumps(found.as_dict()))["groups"][0]
    assert group["test"] == "row factors"
    assert group["measurement"] == "lengths"
    assert group["rows"] == [row + 1 for row in rows]
    assert group["size"] == pytest.approx(1.05, abs=0.01)
    assert group["misfit"]
    assert found.as_dict()["misfit"][0] == group["words"]
    title = " ".join(found.plot().get_suptitle().split())
    assert "rows 3, 9, 17" in title


def test_offsets_of_some_per_cent_of_the_lengths_are_told_to_be_scales(scenes):
    one = scenes["blind4"]
    longer = replace(one.log, lengths=1.05 * one.log.lengths)
    for log, told in ((longer, True), (one.log, False)):
        remarks = " ".join(cdpr.calibrate(one.robot, log, **one.options).remarks)
        assert ("more likely scales" in remarks) == told


def distances(points):
    """Between all exit points, which no motion of the frame changes [m]."""
    return np.linalg.norm(points[:, :, None] - points[:, None], axis=0)


TRUE_CORNERS = [(-0.9, 2.2), (2.7, 2.6), (-1.1, 0.1), (2.6, -0.3)]
BELIEVED_CORNERS = [(0.0, 2.0), (2.0, 2.0), (0.0, 0.0), (2.0, 0.0)]
"""Top left, top right, bottom left, bottom right of a point mass in a plane, x and y [m]."""


def framed(corners):
    """Maslow 4 with other anchors and no arms at them; it hangs in their middle."""
    robot = load_robot("maslow_4")
    middle = np.append(np.mean(corners, axis=0), robot.home.position[2])
    cables = [
        replace(cable, exit_point=np.append(corner, cable.exit_point[2]))
        for cable, corner in zip(robot.cables, corners, strict=True)
    ]
    home, pulley = replace(robot.home, position=middle), replace(robot.pulley, arm=0.0)
    return replace(robot, cables=cables, pulley=pulley, home=home)


def test_a_frame_believed_far_too_small_ends_in_the_right_anchors():
    """Lengths that no pose of the believed frame has put poses on the lines between its anchors."""
    machine, random = framed(TRUE_CORNERS), np.random.default_rng(0)
    low, high = np.min(TRUE_CORNERS, axis=0), np.max(TRUE_CORNERS, axis=0)
    poses = []
    for _ in range(99):
        place = low + random.uniform(0.02, 0.98, 3)[:2] * (high - low)
        poses.append(pose_from_angles(np.append(place, machine.home.position[2]), np.zeros(3)))
    model = calibration_model(machine)
    lengths = Point(model, Stations.at(poses)).numbers[:, :, 0]
    lengths = lengths + 1e-3 * random.standard_normal(lengths.shape)
    log = Measurements(Path("wide"), len(poses), lengths=lengths)
    found = cdpr.calibrate(framed(BELIEVED_CORNERS), log)
    assert found.result.status == "converged"
    np.testing.assert_allclose(
        distances(found.result.model.cables.p_WA), distances(model.cables.p_WA), atol=SAME
    )
