"""`cdpr new`: scenarios for robots have poses and limits of these; blocks pass their own test."""

import os
import sys
from importlib import import_module
from inspect import signature

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS
from tests.cli.commands import ended, refuse, run
from tests.newcomer import OWN_ROBOT

REFUSED = {
    "grab_four": "4 cables for 6 degrees of freedom",
    "grab_three": "3 cables for 6 degrees of freedom",
    "irma4u": "4 cables for 6 degrees of freedom",
    "gt_graffiti": "found 2T",
    "maslow_4": "found 2T",
    "planar_point": "found 2T",
    "hangprinter_4": "found 3T",
    "spider_camera": "found 3T",
}
"""Robots that no scenario takes, and why."""

ACTIVE_LINES = 50
"""Of a file that one reads at a glance; keys with values, not comments."""


def asked(robot, folder="."):
    return "new", "scenario", "mine", "--robot", robot, "--out", folder


def made(capsys, here, robot):
    """What it says while it writes a scenario for a robot; the file."""
    code, _, said = run(capsys, *asked(robot))
    assert code == 0, said
    return said, here / "mine.yaml"


@pytest.mark.parametrize("name", robot_names())
def test_every_robot_that_ships_gets_a_scenario_or_the_reason_why_not(capsys, here, name):
    if name in REFUSED:
        said = refuse(capsys, *asked(name))
        assert REFUSED[name] in said
        assert "accepted" in said
        assert not any(here.iterdir())
        return
    said, path = made(capsys, here, name)
    scenario, robot = load_scenario(str(path)), load_robot(name)
    text = path.read_text()
    active = [line for line in text.splitlines() if line.strip() and line.strip()[0] != "#"]
    assert len(active) <= ACTIVE_LINES
    assert not any(line.startswith(("title", "source", "assumptions")) for line in active)
    words = " ".join(active)
    others = [other for other in robot_names() if f" {other}" in words and other not in name]
    assert not others
    has_camera = any(mount.parent == "platform" for mount in robot.cameras)
    assert (scenario.kind == "visual_servo") == has_camera
    if not has_camera:
        assert "has no camera on its platform" in said
        assert scenario.distribution.limits.tolist() == list(robot.tension_limits())
        return
    low, high = robot.tension_limits()
    assert low <= scenario.tension_management.threshold[0] < high
    X_WP = scenario.initial_pose.transform()
    tensions = hold_robot(robot, X_WP, robot.cable_set(), "elastic").tensions
    assert np.min(tensions) >= scenario.tension_management.threshold[0] or "slack" in said


def test_a_robot_of_ones_own_arrives_with_taut_cables(capsys, here):
    """The tutorial's own scenario once left cables of other robots slack, and never arrived."""
    (here / "bay.yaml").write_text(OWN_ROBOT.read_text())
    said, path = made(capsys, here, "bay.yaml")
    assert said == ""
    assert "robot: bay.yaml\n" in path.read_text()  # so that the folder can be moved
    quick = ["camera.kind=projected", "integration.engine=compiled", "integration.loop=compiled"]
    told = ServoRun(load_scenario(str(path), quick)).simulate().as_dict()
    assert (told["outcome"], told["message"]) == ("converged", "")
    assert told["slack_cable_seconds"] == 0.0
    low, high = load_robot(here / "bay.yaml").tension_limits()
    assert low <= told["tension_n"]["min"] <= told["tension_n"]["max"] <= high


@pytest.mark.parametrize(
    ("robot", "folder", "named"),
    [("bay", ".", "bay/robot.yaml"), ("bay", "bay", "robot.yaml"),
     ("bay/robot.yaml", "aside", "HERE/bay/robot.yaml"), ("planar", ".", "planar")],
)  # fmt: skip
def test_robots_in_folders_are_found_again_from_anywhere(here, monkeypatch, robot, folder, named):
    (here / "bay").mkdir()
    (here / "bay" / "robot.yaml").write_text(OWN_ROBOT.read_text())
    assert ended(*asked(robot, folder)) == 0
    path = here / folder / "mine.yaml"
    words = path.read_text().partition("\nrobot: ")[2].partition("\n")[0]
    assert words == named.replace("HERE", str(here))
    monkeypatch.chdir("/")
    load_scenario(str(path))


def test_a_camera_that_looks_another_way_has_its_target_there(capsys, here):
    tilted = OWN_ROBOT.read_text().replace("[0.0, 180.0, 0.0]", "[60.0, 120.0, 30.0]")
    (here / "bay.yaml").write_text(tilted)
    _, path = made(capsys, here, "bay.yaml")
    scenario, robot = load_scenario(str(path)), load_robot(here / "bay.yaml")
    X_WC = robot.home.transform() @ robot.cameras[0].pose.transform()
    X_CO = X_WC.inverse() @ scenario.target.pose.transform()
    assert isinstance(X_CO, RigidTransform)
    # To 0.1 mm and 0.01 deg, as it is written.
    np.testing.assert_allclose(X_CO.translation(), scenario.desired.position, atol=2e-4)


def test_a_robot_that_cannot_be_held_is_refused_with_its_bounds(capsys, here):
    weak = OWN_ROBOT.read_text().replace("upper: 350.0", "upper: 5.0")
    (here / "bay.yaml").write_text(weak)
    assert "tensions within 4 to 5 N hold the platform" in refuse(capsys, *asked("bay.yaml"))
    assert os.listdir(here) == ["bay.yaml"]


@pytest.mark.parametrize("kind", ["controller", "estimator", "study"])
def test_a_new_block_passes_its_own_test(kind, here, capsys, monkeypatch):
    code, out, _ = run(capsys, "new", kind, "own_block")
    assert code == 0
    assert out.split() == ["own_block.py", "test_own_block.py"]
    for name in out.split():
        words = (here / name).read_text().lower()
        assert "mine" not in words
        assert "own_block" in words
    monkeypatch.syspath_prepend(here)
    before = dict(ESTIMATORS)
    try:  # here, since a process of its own would import Drake again
        tests = vars(import_module("test_own_block"))
        checks = [tests[name] for name in tests if name.startswith("test_")]
        assert checks
        for check in checks:
            check(**dict.fromkeys(signature(check).parameters, here))
    finally:
        ESTIMATORS.clear()
        ESTIMATORS.update(before)
        for name in ("own_block", "test_own_block"):
            sys.modules.pop(name, None)


def test_nothing_is_overwritten_unless_asked(here, capsys):
    (here / "law.py").write_text("mine")
    assert "law.py" in refuse(capsys, "new", "controller", "law")
    assert os.listdir(here) == ["law.py"]
    assert (here / "law.py").read_text() == "mine"
    assert ended("new", "controller", "law", "--overwrite") == 0
    assert "class Law" in (here / "law.py").read_text()
