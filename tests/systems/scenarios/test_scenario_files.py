"""Scenario files are found, and told apart by their kind."""

from importlib import import_module

import pytest
import yaml

from cdpr_drake.analyses.simulation.tension_control_run import run_tension_scenario
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.analyses.workspaces.stability_defaults import load_bounds
from cdpr_drake.errors import DataFileError, ScenarioError
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.schema.yaml_files import FILE_KINDS
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import (
    KINDS,
    scenario_file,
    scenario_kind,
    scenario_names,
)
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


def test_every_scenario_has_one_kind():
    by_kind = [name for kind in KINDS for name in scenario_names(kind)]
    assert sorted(by_kind) == list(scenario_names())


def test_a_file_without_kind_is_a_visual_servo(tmp_path):
    path = tmp_path / "mine.yaml"
    for content in ("name: x\n", "[1, 2]\n", "a: [1\n", ""):
        path.write_text(content)
        assert scenario_kind(str(path)) == "visual_servo"
    path.write_text("name: x\nkind: tension_control\n")
    assert scenario_kind(str(path)) == "tension_control"


def test_unknown_kind_is_named_with_its_line(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("name: x\nkind: dance\n")
    with pytest.raises(ScenarioError, match=r"mine\.yaml:2: kind: found dance; accepted: one of"):
        scenario_kind(str(path))


def test_unknown_scenario_lists_all_kinds():
    with pytest.raises(ScenarioError, match=r"acrobot_computed_torque.*acrobot_pbvs"):
        scenario_kind("foo")


def test_all_problems_of_a_scenario_are_said_at_once(tmp_path):
    content = yaml.safe_load(scenario_file("acrobot_pbvs").read_text())
    content["robot"] = "acrobat_small"
    content["controller"]["lambda_0"] = -1.0
    del content["title"], content["desired"]
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    with pytest.raises(ScenarioError) as caught:
        load_scenario(str(path))
    assert [problem.split(": ")[1] for problem in caught.value.problems] == [
        "controller.lambda_0", "desired", "robot",
    ]  # fmt: skip


def test_all_that_a_robot_cannot_do_is_said_at_once():
    wrong = [
        "camera.mount=nose",
        "initial_pose.position=[0, 0, 9]",
        "sensors.log=[tension, tension]",
    ]
    with pytest.raises(ScenarioError) as caught:
        load_scenario("acrobot_pbvs", [*wrong, "controller.lambda_infinity=9"])
    assert [problem.split(": ")[1] for problem in caught.value.problems] == [
        "camera.mount", "initial_pose.position", "controller.lambda_infinity", "sensors.log[1]",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("load", "file", "words"),
    [
        (load_scenario, robot_file("planar"), "found a robot; use cdpr_drake.models.load_robot"),
        (load_robot, scenario_file("planar_pbvs"), "found a scenario; use cdpr_drake.systems.load"),
        (load_robot, scenario_file("planar_computed_torque"), "found a scenario; use"),
        (load_bounds, robot_file("planar"), "found a robot; use cdpr_drake.models.load_robot"),
    ],
)
def test_a_file_of_another_kind_is_told_with_its_loader(load, file, words):
    with pytest.raises(DataFileError) as caught:
        load(file if load is load_bounds else str(file))
    assert caught.value.problems[0].startswith(f"{file}: {words}")
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize("what", FILE_KINDS)
def test_the_loader_that_is_told_for_a_kind_of_file_can_be_imported(what):
    module, name = FILE_KINDS[what][1].rsplit(".", 1)
    assert callable(getattr(import_module(module), name))


def test_a_scenario_of_another_kind_is_told_with_what_runs_it():
    torque, servo = load_scenario("planar_computed_torque"), load_scenario("planar_pbvs")
    with pytest.raises(ScenarioError, match=r"found tension_control.*run_tension_scenario"):
        run_scenario(torque)
    with pytest.raises(ScenarioError, match=r"found visual_servo.*run_scenario"):
        run_tension_scenario(servo)
    with pytest.raises(ScenarioError, match="found tension_control, not described by Scenario"):
        load_scenario("planar_computed_torque", schema=Scenario)
