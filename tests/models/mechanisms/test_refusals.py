"""What takes robots of one platform refuses mechanisms, in one sentence with exit code 2."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

import cdpr_drake as cdpr
from cdpr_drake.cli.app import main
from cdpr_drake.errors import RobotFileError, ScenarioError
from cdpr_drake.models.mechanism_files import TAKEN_BY
from cdpr_drake.models.robot_loader import load_robot, parse_robot, robot_file, robot_text
from cdpr_drake.studio.workbench.robot_files import RobotFiles
from cdpr_drake.studio.workbench.session import Workbench
from cdpr_drake.studio.workbench.working_folder import WorkingFolder
from cdpr_drake.systems.robots.cable_robot import CableRobot
from tests.messages import printed

NAME = "cable_arm"
SENTENCE = f"a robot with one platform; mechanisms are taken by {TAKEN_BY}"
LENGTHS = [1.0] * 4

ASKED: dict[str, Callable[[Any], object]] = {
    "solve_static": cdpr.solve_static,
    "solve_tensions": cdpr.solve_tensions,
    "compare_tensions": cdpr.compare_tensions,
    "find_equilibria": lambda robot: cdpr.find_equilibria(robot, LENGTHS),
    "solve_forward_kinematics": lambda robot: cdpr.solve_forward_kinematics(robot, LENGTHS),
    "solve_inverse_kinematics": cdpr.solve_inverse_kinematics,
    "plot": cdpr.plot,
    "compute_workspace": cdpr.compute_workspace,
    "workspace of two kinds": lambda robot: cdpr.compute_workspace(robot, ["static", "force"]),
    "assess_stability": cdpr.assess_stability,
    "optimize_design": lambda robot: cdpr.optimize_design(robot, "wrench-feasible"),
    "plan_path": lambda robot: cdpr.plan_path(robot, [np.eye(4), np.eye(4)]),
    "plan_free_motion": lambda robot: cdpr.plan_free_motion(robot, None, None),
    "plan_proven_motion": lambda robot: cdpr.plan_proven_motion(robot, None, None),
    "reconfigure": lambda robot: cdpr.reconfigure(robot, None, [None]),
    "replay_log": lambda robot: cdpr.replay_log("log.csv", robot),
    "calibrate": lambda robot: cdpr.calibrate(robot, "log.csv"),
    "identify": lambda robot: cdpr.identify(robot, "log.csv"),
    "identify_free_motion": lambda robot: cdpr.identify_free_motion(robot, "log.csv"),
    "export_robot": lambda robot: cdpr.export_robot(robot, "mjcf"),
}
"""Questions of the front door about a robot."""


@pytest.mark.parametrize("question", ASKED)
@pytest.mark.parametrize("given", [NAME, "file", "mechanism"])
def test_questions_refuse_it(question: str, given: str) -> None:
    what = {"file": str(robot_file(NAME)), "mechanism": cdpr.load_mechanism(NAME)}.get(given, NAME)
    with pytest.raises(RobotFileError) as caught:
        ASKED[question](what)
    assert SENTENCE in str(caught.value)
    assert NAME in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_the_front_door_has_no_other_question_about_a_robot() -> None:
    # A verb that is new either takes mechanisms or is refused above.
    verbs = {name for name in dir(cdpr) if name in cdpr.__all__ and name[0].islower()}
    known = {name.split(" ")[0] for name in ASKED} | TAKES | OTHERS
    about_robots = {
        name
        for name in verbs - known
        if "robot" in getattr(getattr(cdpr, name), "__annotations__", {})
    }
    assert about_robots == set()


TAKES = {"hang_mechanism", "solve_mechanism_tensions", "add_mechanism"}
OTHERS = {"add_robot", "add_cable_robot", "add_camera", "add_visual_servo"}
"""Builders, which take no names but what `add_robot` or they themselves made; tested below."""


def test_builders_refuse_it() -> None:
    mechanism: Any = cdpr.load_mechanism(NAME)
    with pytest.raises(RobotFileError, match=SENTENCE):
        cdpr.add_robot(MultibodyPlant(0.0), mechanism)
    with pytest.raises(RobotFileError, match=SENTENCE):
        CableRobot(mechanism)


def test_loaders_refuse_it() -> None:
    path = robot_file(NAME)
    for load in (load_robot, robot_text):
        with pytest.raises(RobotFileError, match=SENTENCE):
            load(NAME)
    with pytest.raises(RobotFileError, match=SENTENCE):
        parse_robot(path.read_text(encoding="utf-8"), path)


def test_the_studio_refuses_it(tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text(robot_file(NAME).read_text(encoding="utf-8"), encoding="utf-8")
    files = RobotFiles(WorkingFolder(tmp_path))
    for open_it in (
        lambda: Workbench(WorkingFolder(tmp_path), NAME),
        lambda: Workbench(WorkingFolder(tmp_path), str(mine)),
        lambda: files.open("mine.yaml"),
    ):
        with pytest.raises(RobotFileError, match=SENTENCE):
            open_it()


def test_a_file_in_the_place_of_another_is_told(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"found a mechanism; use .*load_mechanism"):
        cdpr.load_scenario(str(robot_file(NAME)))


@pytest.mark.parametrize("key", ["robot", "perturbations.believed_robot"])
def test_scenarios_refuse_it(key: str) -> None:
    with pytest.raises(RobotFileError, match=SENTENCE):
        cdpr.simulate("acrobot_pbvs", [f"{key}={robot_file(NAME)}", "duration=0.1"])


COMMANDS = [
    ["equilibria", NAME, "--lengths", "1,1,1,1"],
    ["stability", NAME],
    ["workspace", NAME],
    ["plan", NAME, "--path", "path.csv"],
    ["plan", NAME, "--free", "--from", "0,0,0", "--to", "0,0,1"],
    ["design", NAME, "--goal", "wrench-feasible"],
    ["calibrate", NAME, "log.csv"],
    ["identify", NAME, "log.csv"],
    ["new", "robot", "mine", "--from", NAME],
    ["studio", NAME, "--no-browser"],
    ["simulate", "acrobot_pbvs", "--set", f"robot={NAME}"],
    ["serve", "acrobot_pbvs", "--set", f"robot={NAME}"],
]


@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: "-".join(words[:2]))
def test_commands_refuse_it(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    for name in ("path.csv", "log.csv", "design.yaml"):
        (tmp_path / name).write_text("", encoding="utf-8")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(SystemExit) as ended:
        main(words)
    lines = printed(capsys).err.splitlines()
    refused = [line for line in lines if line.startswith("cdpr: ")]
    assert ended.value.code == 2
    assert len(refused) == 1
    assert refused[0].endswith(SENTENCE)
    assert [line for line in lines if not line.startswith("cdpr")] == []
    assert sorted(tmp_path.iterdir()) == before
