"""`cdpr equilibria`: what it prints, what it refuses."""

import json

import pytest
import yaml

from cdpr_drake.cli.app import main
from cdpr_drake.models.robot_loader import robot_text
from tests.messages import printed


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(["equilibria", *arguments])
    out, err = printed(capsys)
    return ended.value.code, out, err


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
    code, out, _ = run(capsys, hung, "--lengths", "3.8,3.8", "--json")
    assert code == 0
    answer = json.loads(out)
    assert answer["evidence"]["complete"]
    assert answer["evidence"]["lost"] == 0
    assert {one["stability"] for one in answer["equilibria"]} >= {"stable", "unstable"}
    lowest = answer["equilibria"][0]
    assert lowest["stability"] == "stable"
    assert lowest["certificate"] == "proven"
    assert lowest["tensions_n"][0] == pytest.approx(lowest["tensions_n"][1])  # a mirror image


def test_all_poses_as_a_table(capsys, hung):
    code, out, _ = run(capsys, hung, "--lengths", "3.8,3.8")
    assert code == 0
    assert "poses of rest, inextensible cables, pulleys ignored: all poses are found for" in out
    assert "no isolated pose is missing" in out


def test_elastic_cables_say_what_may_be_missing(capsys, hung):
    code, out, _ = run(
        capsys, hung, "--lengths", "3.8,3.8", "--cable-model", "elastic", "--searches", "30",
        "--json",
    )  # fmt: skip
    assert code == 0
    answer = json.loads(out)
    assert answer["pulleys"]
    assert not answer["evidence"]["complete"]
    assert answer["evidence"]["searches"] <= 30


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--lengths", "0.5,0.5"], "no pose has them: cables 1 and 2 together are"),
        (["--lengths", "3.8"], "--lengths: found '3.8'"),
        (["--lengths", "3.8,-1"], "--lengths: found -1"),
        (["--lengths", "3.8,nan"], "--lengths"),
        ([], "found neither"),
        (["--lengths", "3,3", "--position", "0,0,1"], "found both"),
        (["--lengths", "3,3", "--taut", "C1"], "--taut: found without --position"),
        (["--position", "0,0,1", "--taut", "C1,C9"], "--taut: 'C9' is unknown"),
        (["--position", "0,0,1"], "accepted: 3 different ones"),
        (["--lengths", "3,3", "--cable-model", "rubber"], "--cable-model: 'rubber'"),
        (["--lengths", "3,3", "--searches", "0"], "--searches: found 0"),
    ],
)
def test_what_is_refused(capsys, hung, words, said):
    code, out, err = run(capsys, hung, *words)
    assert code == 2
    assert not out
    assert said in err
    assert len(err.strip().splitlines()) == 1
    assert len(err) <= 500


def test_no_weight_in_the_plane_is_named(capsys):
    lengths = ",".join(["1.0"] * 4)
    code, _, err = run(capsys, "planar", "--lengths", lengths)
    assert code == 2
    assert "no weight along the motions" in err


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
    code, out, _ = run(capsys, str(path), "--lengths", "2,2", "--json")
    assert code == 0
    found = [one["pose"]["position_m"][2] for one in json.loads(out)["equilibria"]]
    assert found == pytest.approx(heights, abs=1e-9)
