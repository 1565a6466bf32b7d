"""What takes robots of one platform refuses mechanisms, in one sentence with exit code 2."""

import shutil

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

import cdpr_drake as cdpr
from cdpr_drake.cli.app import main
from cdpr_drake.errors import RobotFileError, ScenarioError
from cdpr_drake.models.mechanism_files import TAKEN_BY
from cdpr_drake.models.robot_loader import load_robot, parse_robot, robot_file, robot_text
from cdpr_drake.studio.files import RobotFiles, WorkingFolder
from cdpr_drake.studio.session import Workbench
from cdpr_drake.systems.robots.cable_robot import CableRobot
from tests.messages import printed

NAME = "cable_arm"
SENTENCE = f"a robot with one platform; mechanisms are taken by {TAKEN_BY}"
LENGTHS = [1.0] * 4

ASKED = {
    "find_equilibria": lambda robot: cdpr.find_equilibria(robot, LENGTHS),
    "solve_forward_kinematics": lambda robot: cdpr.solve_forward_kinematics(robot, LENGTHS),
    "solve_inverse_kinematics": cdpr.solve_inverse_kinematics,
    "plot": cdpr.plot,
    "compute_workspace": cdpr.compute_workspace,
    "workspace of two kinds": lambda robot: cdpr.compute_workspace(robot, ["static", "force"]),
    "assess_stability": cdpr.assess_stability,
    "optimize_design": lambda robot: cdpr.optimize_design(robot, goals="wrench-feasible"),
    "plan_path": lambda robot: cdpr.plan_path(robot, [np.eye(4), np.eye(4)]),
    "plan_free_motion": lambda robot: cdpr.plan_free_motion(robot, None, None),
    "plan_proven_motion": lambda robot: cdpr.plan_proven_motion(robot, None, None),
    "reconfigure": lambda robot: cdpr.reconfigure(robot, poses=[None]),
    "import_log": lambda robot: cdpr.import_log("log.csv", robot=robot),
    "replay_log": lambda robot: cdpr.replay_log("log.csv", robot=robot),
    "calibrate": lambda robot: cdpr.calibrate(robot, "log.csv"),
    "identify": lambda robot: cdpr.identify(robot, "log.csv"),
    "identify_swings": lambda robot: cdpr.identify_swings(robot, "log.csv"),
    "export_robot": lambda robot: cdpr.export_robot(robot, "mjcf"),
}
"""Questions of the front door about a robot."""


@pytest.mark.parametrize("question", ASKED)
@pytest.mark.parametrize("given", [NAME, "file", "mechanism"])
def test_questions_refuse_it(question, given):
    what = {"file": str(robot_file(NAME)), "mechanism": cdpr.load_mechanism(NAME)}.get(given, NAME)
    with pytest.raises(RobotFileError) as caught:
        ASKED[question](what)
    assert SENTENCE in str(caught.value)
    assert NAME in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_the_front_door_has_no_other_question_about_a_robot():
    # A verb that is new either takes mechanisms or is refused above.
    verbs = {name for name in dir(cdpr) if name in cdpr.__all__ and name[0].islower()}
    known = {name.split(" ")[0] for name in ASKED} | TAKES | OTHERS
    about_robots = {
        name
        for name in verbs - known
        if "robot" in getattr(getattr(cdpr, name), "__annotations__", {})
    }
    assert about_robots == set()


TAKES = {"solve_static", "solve_tensions", "view", "add_mechanism", "load_robot_or_mechanism"}
OTHERS = {"add_robot", "add_cable_robot", "add_camera", "add_visual_servo"}
"""Builders, which take no names but what `add_robot` or they themselves made; tested below."""


def opened(folder, what):
    """A workbench, with this in the place of a robot."""
    return Workbench(WorkingFolder(folder), str(what))


MINE = "mine.yaml"
USERS = {
    "add_robot": lambda there: cdpr.add_robot(MultibodyPlant(0.0), cdpr.load_mechanism(NAME)),
    "CableRobot": lambda there: CableRobot(cdpr.load_mechanism(NAME)),
    "load_robot": lambda there: load_robot(NAME),
    "robot_text": lambda there: robot_text(NAME),
    "parse_robot": lambda there: parse_robot((there / MINE).read_text(), there / MINE),
    "studio": lambda there: opened(there, NAME),
    "studio of a file": lambda there: opened(there, there / MINE),
    "files of the studio": lambda there: RobotFiles(WorkingFolder(there)).open(MINE),
    "robot of a scenario": lambda there: cdpr.simulate(
        "acrobot_pbvs", [f"robot={there / MINE}", "duration=0.1"]),
    "robot that is believed": lambda there: cdpr.simulate(
        "acrobot_pbvs", [f"perturbations.believed_robot={there / MINE}", "duration=0.1"]),
}  # fmt: skip


@pytest.mark.parametrize("user", USERS)
def test_builders_loaders_and_studio_refuse_it(user, tmp_path):
    shutil.copytree(robot_file(NAME).parent, tmp_path, dirs_exist_ok=True)
    (tmp_path / "mechanism.yaml").rename(tmp_path / MINE)
    with pytest.raises(RobotFileError, match=SENTENCE):
        USERS[user](tmp_path)


def test_a_file_in_the_place_of_a_scenario_is_told():
    with pytest.raises(ScenarioError, match=r"found a mechanism; use .*load_mechanism"):
        cdpr.load_scenario(str(robot_file(NAME)))


COMMANDS = [
    ["equilibria", NAME, "--lengths", "1,1,1,1"],
    ["stability", NAME],
    ["workspace", NAME],
    ["plan", NAME, "--path", "path.csv"],
    ["plan", NAME, "--free", "--from", "0,0,0", "--to", "0,0,1"],
    ["design", NAME, "--goal", "wrench-feasible"],
    ["calibrate", NAME, "log.csv"],
    ["identify", NAME, "log.csv"],
    ["identify-swings", NAME, "log.csv"],
    ["new", "robot", "mine", "--from", NAME],
    ["studio", NAME, "--no-browser"],
    ["simulate", "acrobot_pbvs", "--set", f"robot={NAME}"],
    ["serve", "acrobot_pbvs", "--set", f"robot={NAME}"],
]


@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: "-".join(words[:2]))
def test_commands_refuse_it(words, tmp_path, capsys, monkeypatch):
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
