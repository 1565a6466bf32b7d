"""Robots put on rails: files, groups, the robot that is written, proofs, the command."""

import json
import re

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform

from cdpr_drake.analyses.design.rails import RailSettings, put_rails
from cdpr_drake.analyses.design.reconfiguration import reconfigure
from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.cli.app import main
from cdpr_drake.errors import PlanningError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from tests.messages import printed

RAILS = [
    RailSettings(cables=["C1", "C2"], axis=np.array([0.0, 1.0, 0.0]), lower=-0.3, upper=0.3),
    RailSettings(cables=["C3"], axis=np.array([0.0, 2.0, 0.0]), lower=-0.3, upper=0.3),
]
POSES = [RigidTransform([0.15, 0.1, 0.3]), RigidTransform([-0.1, -0.15, 0.3])]
SMALL = {"around": 0.005, "turn": 0.5, "boxes": 2000}


def write(path, content):
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def rail_file(tmp_path, **changes):
    rails = [
        {"cables": r.cables, "axis": r.axis.tolist(), "lower": r.lower, "upper": r.upper}
        for r in RAILS
    ]
    rails[0] |= changes
    return write(tmp_path / "rails.yaml", {"rails": rails})


def test_a_robot_is_moved_proven_and_drawn():
    found = reconfigure(
        "planar", rails=RAILS, poses=POSES, limits=(1.0, 60.0), starts=2, **SMALL
    )  # fmt: skip
    before, after = np.min(found.margins, axis=1)
    assert after > before + 0.01
    assert found.names == ["C1,C2", "C3"]
    robot = found.after
    shifts = robot.exit_points() - load_robot("planar").exit_points()
    np.testing.assert_allclose(shifts[1, 0], shifts[1, 1])
    np.testing.assert_allclose(shifts[1, [0, 2]], found.solution.coordinates)
    np.testing.assert_array_equal(shifts[[0, 2]], 0.0)
    assert found.proven
    # Poses of the proven boxes are feasible by the exact check, pose by pose.
    rng = np.random.default_rng(4)
    case = static_case(robot, (1.0, 60.0))
    for X in found.task.poses:
        p = X.translation() + np.append(rng.uniform(-0.005, 0.005, (200, 2)), np.zeros((200, 1)), 1)
        psi = rng.uniform(-1, 1, 200) * np.radians(0.5)
        c, s, zero, one = np.cos(psi), np.sin(psi), 0 * psi, 1 + 0 * psi
        R = np.array([[c, -s, zero], [s, c, zero], [zero, zero, one]]).transpose(2, 0, 1)
        assert np.all(statically_feasible(case, p, R @ X.rotation().matrix()))
    assert "of each: proven" in repr(found)
    assert len(found.plot().axes) == 2
    tension = reconfigure(
        "planar", rails=RAILS, poses=POSES, limits=(1.0, 60.0), starts=2, goal="tension", **SMALL
    )
    assert np.max(tension.tensions) < np.max(found.tensions) + 1e-3
    assert np.min(tension.margins[1]) <= after + 1e-6


def test_rails_of_the_robots_own_file(tmp_path):
    robot = put_rails(load_robot("planar"), RAILS)
    found = reconfigure(robot, poses=POSES[:1], limits=(1.0, 60.0), starts=1, **SMALL)
    assert found.names == ["C1", "C2", "C3"]  # without groups each moves alone
    with pytest.raises(PlanningError, match=r"planar: found no cables\[\].rail"):
        reconfigure("planar", poses=POSES)


def test_what_no_position_can_do_is_named():
    push = "under the wrench"

    hard = SpatialSet(box=np.array([0.0, 0.0, 0.0, 500.0, 0.0, 0.0]))
    with pytest.raises(PlanningError, match=rf"pose \d of 2, .*{push} .*500, 0, 0\) N"):
        reconfigure("planar", rails=RAILS, poses=POSES, resist=hard, limits=(1.0, 60.0), starts=1)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"cables": ["C9"]}, r"rails\[0\].cables: 'C9' is unknown"),
        ({"cables": ["C3"]}, r"rails\[1\].cables: found C3 again"),
        ({"cables": []}, r"rails\[0\].cables: found none"),
        ({"lower": 0.4}, r"rails\[0\]: found axis \(0, 1, 0\), 0.4 to 0.3 m"),
        ({"axis": [0, 0, 0]}, r"rails\[0\]: found axis"),
    ],
)
def test_wrong_rails_are_named(tmp_path, changes, said):
    with pytest.raises(PlanningError, match=said):
        reconfigure("planar", rails=rail_file(tmp_path, **changes), poses=POSES)


def run(capsys, *words):
    with pytest.raises(SystemExit) as end:
        main(["reconfigure", *words])
    out, err = printed(capsys)
    return end.value.code, out, err


def test_the_command_writes_a_robot_that_has_the_margin(tmp_path, capsys):
    push = write(tmp_path / "push.yaml", {"box": [0, 0, 0.05, 2, 2, 0]})
    path = tmp_path / "path.csv"
    path.write_text("0.15,0.1,0.3\n-0.1,-0.15,0.3\n")
    words = (
        "planar", "--rails", str(rail_file(tmp_path)), "--path", str(path), "--samples", "3",
        "--resist", str(push), "--limits", "1,60", "--starts", "1", "--around", "0.002",
        "--turn", "0.2", "--boxes", "500",
    )  # fmt: skip
    code, out, _ = run(capsys, *words, "--out", str(tmp_path / "out"), "--json")
    assert code == 0
    told = json.loads(out)
    assert told == json.loads((tmp_path / "out" / "summary.json").read_text())
    assert told["wrenches"] == 8
    assert len(told["poses"]) == 3
    assert told["least_margin"] > told["least_margin_before"]
    assert (tmp_path / "out" / "rails.png").stat().st_size > 10_000
    robot = load_robot(str(tmp_path / "out" / "robot.yaml"))
    assert robot.cables[0].rail.at == pytest.approx(told["rails"][0]["to_m"])
    code, out, _ = run(capsys, *words, "--out", str(tmp_path / "two"), "--goal", "tension")
    assert code == 0
    assert "least margin of 3 poses under 8 wrenches" in out.replace("\n", " ")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["planar"], "--poses: found nothing"),
        (["planar", "--poses", "0,0,0.3"], "found no cables"),
        (["planar", "--rails", "no.yaml", "--poses", "0,0,0.3"], "no.yaml: there is no such file"),
        (["planar", "--poses", "0,x,0.3"], "--poses: found '0,x,0.3'"),
        (["planar", "--poses", "0,0,0.3", "--goal", "best"], "--goal: found 'best'"),
        (["planar", "--poses", "0,0,0.3", "--starts", "0"], "--starts: found 0"),
        (["planar", "--poses", "0,0,0.3", "--around", "0"], "--around: found 0 m"),
    ],
)
def test_bad_input_is_named_and_writes_nothing(tmp_path, monkeypatch, capsys, words, said):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, *words)
    assert code == 2
    assert re.search(said, err), err
    assert len(err.strip().splitlines()) == 1
    assert not list(tmp_path.rglob("*.yaml"))
