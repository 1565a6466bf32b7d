"""`cdpr equilibria`: what it prints."""

import pytest
import yaml

from cdpr_drake.models.robot_loader import robot_text
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


def test_all_poses_as_json(capsys, hung):
    found = told(capsys, "equilibria", hung, "--lengths", "3.8,3.8")
    assert found["evidence"]["complete"]
    assert found["evidence"]["lost"] == 0
    assert {one["stability"] for one in found["equilibria"]} >= {"stable", "unstable"}
    lowest = found["equilibria"][0]
    assert lowest["stability"] == "stable"
    assert lowest["certificate"] == "proven"
    assert lowest["tensions_n"][0] == pytest.approx(lowest["tensions_n"][1])  # a mirror image


def test_all_poses_as_a_table(capsys, hung):
    out = answer(capsys, "equilibria", hung, "--lengths", "3.8,3.8")
    assert "poses of rest, inextensible cables, pulleys ignored: all poses are found for" in out
    assert "no isolated pose is missing" in out


def test_elastic_cables_say_what_may_be_missing(capsys, hung):
    words = ("--lengths", "3.8,3.8", "--cable-model", "elastic", "--searches", "3")
    found = told(capsys, "equilibria", hung, *words)
    assert found["pulleys"]
    assert not found["evidence"]["complete"]
    assert found["evidence"]["searches"] <= 3


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
def test_bodies_in_a_plane_and_points(capsys, tmp_path, hung, motion, anchor, heights):
    text = yaml.safe_load(robot_text(hung)) | motion
    for cable, side in zip(text["cables"], (1.0, -1.0), strict=True):
        cable["exit_point"] = [1.5 * side, 0.0, 3.2]
        cable["anchor_point"] = [anchor * side, 0.0, 0.1 if anchor else 0.0]
    path = tmp_path / "moved.yaml"
    path.write_text(yaml.safe_dump(text))
    rests = told(capsys, "equilibria", path, "--lengths", "2,2")["equilibria"]
    found = [one["pose"]["position_m"][2] for one in rests]
    assert found == pytest.approx(heights, abs=1e-9)
