"""A scenario that is made for a robot: its poses, target and limits are those of that robot."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.cli.app import main
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.messages import printed
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


def made(capsys, folder, robot):
    """What `cdpr new scenario` writes for a robot, and what it says of it."""
    words = ["new", "scenario", "mine", "--robot", str(robot), "--out", str(folder)]
    code, said = ran(capsys, words)
    return code, said, folder / "mine.yaml"


def ran(capsys, words):
    """Exit code and stderr of a command."""
    with pytest.raises(SystemExit) as ended:
        main(words)
    return ended.value.code, printed(capsys).err


@pytest.mark.parametrize("name", robot_names())
def test_every_robot_that_ships_gets_a_scenario_or_the_reason_why_not(capsys, tmp_path, name):
    code, said, path = made(capsys, tmp_path, name)
    if name in REFUSED:
        assert (code, path.exists()) == (2, False)
        assert REFUSED[name] in said
        assert "accepted" in said
        return
    assert code == 0, said
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
    tensions = hold_robot(
        robot, scenario.initial_pose.transform(), robot.cable_set(), "elastic"
    ).tensions
    assert np.min(tensions) >= scenario.tension_management.threshold[0] or "slack" in said


def test_a_robot_of_ones_own_arrives_with_taut_cables(capsys, tmp_path):
    """The tutorial's own scenario once left cables of other robots slack, and never arrived."""
    (tmp_path / "bay.yaml").write_text(OWN_ROBOT.read_text())
    code, said, path = made(capsys, tmp_path, tmp_path / "bay.yaml")
    assert (code, said) == (0, "")
    assert "robot: bay.yaml\n" in path.read_text()  # so that the folder can be moved
    quick = ["camera.kind=projected", "integration.engine=compiled", "integration.loop=compiled"]
    told = summarize(run_scenario(load_scenario(str(path), quick)))
    assert (told["outcome"], told["message"]) == ("converged", "")
    assert told["slack_cable_seconds"] == 0.0
    low, high = load_robot(tmp_path / "bay.yaml").tension_limits()
    assert low <= told["tension_n"]["min"] <= told["tension_n"]["max"] <= high


def test_robots_in_folders_are_found_again_from_anywhere(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bay").mkdir()
    (tmp_path / "bay" / "robot.yaml").write_text(OWN_ROBOT.read_text())
    found = {}
    for robot, folder in (
        ("bay", "."),
        ("bay", "bay"),
        ("bay/robot.yaml", "aside"),
        ("planar", "."),
    ):
        code, said, path = made(capsys, tmp_path / folder, robot)
        assert code == 0, said
        found[robot, folder] = path.read_text().partition("\nrobot: ")[2].partition("\n")[0]
        with monkeypatch.context() as elsewhere:
            elsewhere.chdir("/")
            load_scenario(str(path))
        path.unlink()
    whole = str(tmp_path / "bay" / "robot.yaml")
    assert list(found.values()) == ["bay/robot.yaml", "robot.yaml", whole, "planar"]


def test_a_camera_that_looks_another_way_has_its_target_there(capsys, tmp_path):
    tilted = OWN_ROBOT.read_text().replace("[0.0, 180.0, 0.0]", "[60.0, 120.0, 30.0]")
    (tmp_path / "bay.yaml").write_text(tilted)
    code, said, path = made(capsys, tmp_path, tmp_path / "bay.yaml")
    assert code == 0, said
    scenario, robot = load_scenario(str(path)), load_robot(tmp_path / "bay.yaml")
    X_WC = robot.home.transform() @ robot.cameras[0].pose.transform()
    X_CO = X_WC.inverse() @ scenario.target.pose.transform()
    assert isinstance(X_CO, RigidTransform)
    # To 0.1 mm and 0.01 deg, as it is written.
    np.testing.assert_allclose(X_CO.translation(), scenario.desired.position, atol=2e-4)


def test_a_robot_that_cannot_be_held_is_refused_with_its_bounds(capsys, tmp_path):
    weak = OWN_ROBOT.read_text().replace("upper: 350.0", "upper: 5.0")
    (tmp_path / "bay.yaml").write_text(weak)
    code, said, path = made(capsys, tmp_path, tmp_path / "bay.yaml")
    assert (code, path.exists()) == (2, False)
    assert "tensions within 4 to 5 N hold the platform" in said


@pytest.mark.parametrize(
    "more", [("robot",), ("controller",), ("scenario", "--from", "acrobot_pbvs")]
)
def test_a_robot_is_accepted_for_a_scenario_alone(capsys, tmp_path, more):
    kind, *rest = more
    words = ["new", kind, "mine", "--robot", "caroca", "--out", str(tmp_path), *rest]
    code, said = ran(capsys, words)
    assert code == 2
    assert "accepted: with scenario, alone" in said


def test_a_robot_that_is_not_there_is_refused(capsys, tmp_path):
    code, said, _ = made(capsys, tmp_path, "acrobot_smal")
    assert code == 2
    assert "did you mean acrobot_small" in said
