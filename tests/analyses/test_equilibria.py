"""`find_equilibria` and `cdpr equilibria`: closed forms, evidence, refusals."""

import numpy as np
import pytest
import yaml

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot, robot_text
from tests.analyses.verbs.verb_checks import shows_itself
from tests.cli.commands import answer, told


@pytest.fixture(scope="module")
def hung(tmp_path_factory):
    """CAROCA on two of its cables, which are one above the other's plane: C1 and C5."""
    text = yaml.safe_load(robot_text("caroca"))
    text["name"] = "hung"
    text["cables"] = [text["cables"][0], text["cables"][4]]
    del text["slack_readings"]
    path = tmp_path_factory.mktemp("robots") / "hung.yaml"
    path.write_text(yaml.safe_dump(text))
    return str(path)


def test_all_poses_with_their_proof(capsys, hung):
    result = told(capsys, "equilibria", hung, "--lengths", "3.8,3.8")
    assert result["evidence"]["complete"]
    assert result["evidence"]["lost"] == 0
    assert {rest["stability"] for rest in result["equilibria"]} >= {"stable", "unstable"}
    lowest = result["equilibria"][0]
    assert lowest["stability"] == "stable"
    assert lowest["certificate"] == "proven"
    assert lowest["tensions_n"][0] == pytest.approx(lowest["tensions_n"][1])  # a mirror image
    out = answer(capsys, "equilibria", hung, "--lengths", "3.8,3.8")
    assert "inextensible cables, pulleys ignored: all poses are found for" in out
    assert "no isolated pose is missing" in out


def test_elastic_cables_say_what_may_be_missing(capsys, hung):
    words = ("--lengths", "3.8,3.8", "--cable-model", "elastic", "--searches", "3")
    result = told(capsys, "equilibria", hung, *words)
    assert result["pulleys"]
    assert not result["evidence"]["complete"]
    assert result["evidence"]["searches"] <= 3


SUNK = 3.2 - (4.0 - 1.3**2) ** 0.5 - 0.1
"""Cables of 2 m from 1.5 m to 0.2 m either side, 0.1 m above Po; upside down they cross."""


@pytest.mark.parametrize(
    ("motion", "anchor", "heights"),
    [
        ({"motion": "2T1R", "axis": [0.0, 1.0, 0.0]}, 0.2, [SUNK, 3.3 - (4.0 - 1.7**2) ** 0.5]),
        ({"motion": "3T"}, 0.0, [3.2 - (4.0 - 1.5**2) ** 0.5]),
        ({"motion": "2T", "axis": [0.0, 1.0, 0.0]}, 0.0, [3.2 - (4.0 - 1.5**2) ** 0.5]),
    ],
)
def test_bodies_in_a_plane_and_points(tmp_path, hung, motion, anchor, heights):
    text = yaml.safe_load(robot_text(hung)) | motion
    for cable, side in zip(text["cables"], (1.0, -1.0), strict=True):
        cable["exit_point"] = [1.5 * side, 0.0, 3.2]
        cable["anchor_point"] = [anchor * side, 0.0, 0.1 if anchor else 0.0]
    path = tmp_path / "moved.yaml"
    path.write_text(yaml.safe_dump(text))
    rests = cdpr.find_equilibria(path, [2.0, 2.0]).rests
    assert [rest.X_WP.translation()[2] for rest in rests] == pytest.approx(heights, abs=1e-9)


def test_rests_have_the_lengths_or_the_position():
    robot = load_robot("spider_camera")
    lengths = cable_paths(robot.home.transform(), robot.cable_set(False)).lengths
    result = cdpr.find_equilibria(robot, lengths)
    shows_itself(result)
    for rest, needed in zip(result.rests, result.path_lengths(), strict=True):
        taut = rest.tensions > 0.0
        np.testing.assert_allclose(needed[taut], lengths[taut], atol=1e-9)
        assert np.all(needed <= lengths + 1e-9)
    three = load_robot("grab_three")
    there = cdpr.find_equilibria(three, position=three.home.position)
    shows_itself(there)
    for rest in there.rests:
        np.testing.assert_allclose(rest.X_WP.translation(), three.home.position, atol=1e-12)


def test_a_search_can_be_followed_and_stopped(hung):
    seen = []
    follow = Follow(progress=seen.append, stop=lambda: len(seen) > 1)
    with pytest.raises(cdpr.StoppedError, match="stopped after 2 of 40 searches"):
        cdpr.find_equilibria(hung, [3.8, 3.8], model="elastic", searches=40, follow=follow)
    assert [(now.done, now.total) for now in seen] == [(0, 40), (1, 40)]
