"""Robots put on rails: files, groups, the robot that is written, proofs, the command."""

import json

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake.analyses.design.rails import RailSettings, put_rails
from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.errors import PlanningError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from tests.cli.commands import answer, refuse, told

FIRST = {"cables": ["C1", "C2"], "axis": [0.0, 1.0, 0.0], "lower": -0.3, "upper": 0.3}
SECOND = {"cables": ["C3"], "axis": [0.0, 2.0, 0.0], "lower": -0.3, "upper": 0.3}
RAILS = [RailSettings(**{**rail, "axis": np.array(rail["axis"])}) for rail in (FIRST, SECOND)]
POSES = [RigidTransform([0.15, 0.1, 0.3]), RigidTransform([-0.1, -0.15, 0.3])]
SMALL = {"limits": (1.0, 60.0), "around": 0.005, "turn": 0.5, "boxes": 2000}


def rail_file(folder, **changes):
    path = folder / "rails.yaml"
    path.write_text(yaml.safe_dump({"rails": [{**FIRST, **changes}, SECOND]}))
    return path


def test_a_robot_is_moved_proven_and_drawn():
    moved = cdpr.reconfigure("planar", rails=RAILS, poses=POSES, starts=2, **SMALL)
    after = moved.poses["margin"].min()
    assert after > moved.poses["margin_before"].min() + 0.01
    assert list(moved.rails["cables"]) == ["C1,C2", "C3"]
    shifts = moved.after.exit_points() - load_robot("planar").exit_points()
    np.testing.assert_allclose(shifts[1, 0], shifts[1, 1])
    np.testing.assert_allclose(shifts[1, [0, 2]], moved.solution.coordinates)
    np.testing.assert_array_equal(shifts[[0, 2]], 0.0)
    assert moved.proven
    # Poses of the proven boxes are feasible by the exact check, pose by pose.
    random, case = np.random.default_rng(4), static_case(moved.after, SMALL["limits"])
    for X in moved.task.poses:
        shift = np.append(random.uniform(-0.005, 0.005, (200, 2)), np.zeros((200, 1)), 1)
        psi = random.uniform(-1, 1, 200) * np.radians(0.5)
        c, s, zero, unit = np.cos(psi), np.sin(psi), 0 * psi, 1 + 0 * psi
        R = np.array([[c, -s, zero], [s, c, zero], [zero, zero, unit]]).transpose(2, 0, 1)
        R = R @ X.rotation().matrix()
        assert np.all(statically_feasible(case, X.translation() + shift, R))
    assert "of each: proven" in repr(moved)
    assert len(moved.plot().axes) == 2


def test_the_least_tension_is_below_that_of_the_largest_margin():
    push = SpatialSet(box=np.array([0.0, 0.0, 0.0, 5.0, 2.0, 0.0]))
    margin, tension = (
        cdpr.reconfigure(
            "planar", rails=RAILS, poses=POSES, starts=2, resist=push, goal=goal,
            **SMALL | {"boxes": 5},
        ).poses
        for goal in ("margin", "tension")
    )  # fmt: skip
    assert tension["largest_tension_n"].max() < margin["largest_tension_n"].max() - 1e-3
    assert tension["margin"].min() < margin["margin"].min() - 1e-4


def test_rails_of_the_robots_own_file():
    robot = put_rails(load_robot("planar"), RAILS)
    moved = cdpr.reconfigure(robot, poses=POSES[:1], starts=1, **SMALL)
    assert list(moved.rails["cables"]) == ["C1", "C2", "C3"]  # without groups each moves alone


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rails": None}, r"planar: found no cables\[\].rail"),
        ({"resist": SpatialSet(box=np.array([0.0, 0.0, 0.0, 500.0, 0.0, 0.0]))},
         r"pose \d of 2, .*under the wrench .*500, 0, 0\) N"),
    ],
)  # fmt: skip
def test_what_no_position_can_do_is_named(changes, words):
    arguments = {"rails": RAILS, "poses": POSES, "starts": 1, **SMALL} | changes
    with pytest.raises(PlanningError, match=words):
        cdpr.reconfigure("planar", **arguments)


def test_the_command_writes_a_robot_that_has_the_margin(tmp_path, capsys):
    (tmp_path / "push.yaml").write_text(yaml.safe_dump({"box": [0, 0, 0.05, 2, 2, 0]}))
    (tmp_path / "path.csv").write_text("0.15,0.1,0.3\n-0.1,-0.15,0.3\n")
    words = (
        "reconfigure", "planar", "--rails", rail_file(tmp_path), "--path", tmp_path / "path.csv",
        "--samples", "3", "--resist", tmp_path / "push.yaml", "--limits", "1,60", "--starts", "1",
        "--around", "0.002", "--turn", "0.2", "--boxes", "500",
    )  # fmt: skip
    summary = told(capsys, *words, "--out", tmp_path / "out")
    assert summary == json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["wrenches"] == 8
    assert len(summary["poses"]) == 3
    assert summary["least_margin"] > summary["least_margin_before"]
    assert (tmp_path / "out" / "rails.png").stat().st_size > 10_000
    robot = load_robot(str(tmp_path / "out" / "robot.yaml"))
    assert robot.cables[0].rail.at == pytest.approx(summary["rails"][0]["to_m"])
    said = answer(capsys, *words, "--out", tmp_path / "two", "--goal", "tension")
    assert "least margin of 3 poses under 8 wrenches" in said.replace("\n", " ")


@pytest.mark.parametrize(
    ("changes", "options", "words"),
    [
        ({"cables": ["C9"]}, "", "rails[0].cables: 'C9' is unknown"),
        ({"cables": ["C3"]}, "", "rails[1].cables: found C3 again"),
        ({"cables": []}, "", "rails[0].cables: found none"),
        ({"lower": 0.4}, "", "rails[0]: found axis (0, 1, 0), 0.4 to 0.3 m"),
        ({"axis": [0, 0, 0]}, "", "rails[0]: found axis"),
        ({}, "--rails no.yaml", "no.yaml: there is no such file"),
        ({}, "--poses 0,x,0.3", "--poses: found '0,x,0.3'"),
        ({}, "--goal best", "--goal: found 'best'"),
        ({}, "--starts 0", "--starts: found 0"),
        ({}, "--around 0", "--around: found 0 m"),
    ],
)
def test_bad_input_is_named_and_writes_nothing(
    tmp_path, monkeypatch, capsys, changes, options, words
):
    monkeypatch.chdir(tmp_path)
    rails = rail_file(tmp_path, **changes)
    line = f"reconfigure planar --rails {rails} --poses 0,0,0.3 {options}"
    assert words in refuse(capsys, *line.split())
    assert list(tmp_path.rglob("*.yaml")) == [rails]


def test_poses_are_needed(capsys):
    assert "--poses: found nothing" in refuse(capsys, "reconfigure", "planar")
