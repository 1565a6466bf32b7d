"""Exit points on rails: a coordinate is a configuration of the robot, given with its name."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.errors import RobotFileError
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.models.robot_exports import export_omissions
from cdpr_drake.models.robot_loader import load_robot, robot_text
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.models.robots import content_of, robot_of

RAIL = {"axis": [0.0, 0.0, 2.0], "lower": -0.2, "upper": 0.1}


def with_rails(**changes):
    content = content_of()
    content["cables"][0]["rail"] = RAIL | changes
    content["cables"][5]["rail"] = RAIL | {"axis": [1.0, 1.0, 0.0], "at": -0.1}
    return content


@pytest.fixture
def path(tmp_path):
    folder = tmp_path / "some@place"
    folder.mkdir()
    path = folder / "rails.yaml"
    path.write_text(yaml.safe_dump(with_rails(), sort_keys=False))
    return path


def names():
    return [cable["name"] for cable in content_of()["cables"]]


def test_exit_points_are_where_their_rails_say():
    robot, fixed = robot_of(with_rails()), robot_of(content_of())
    shift = robot.cable_set().p_WA - fixed.cable_set().p_WA
    expected = np.zeros((3, 8))
    expected[:2, 5] = -0.1 / np.sqrt(2.0)
    np.testing.assert_allclose(shift, expected, atol=1e-15)


def test_a_point_that_was_found_goes_back_into_the_file():
    robot = robot_of(with_rails())
    found = robot.cable_set().p_WA + 0.01
    for k, cable in enumerate(robot.cables):
        cable.exit_point = cable.base_of(found[:, k])
    np.testing.assert_allclose(robot.cable_set().p_WA, found, atol=1e-15)


def test_a_name_puts_them_elsewhere(path):
    first, sixth = names()[0], names()[5]
    robot = load_robot(f"{path}@{first}=-0.15,{sixth}=0.05")
    fixed = robot_of(content_of()).cable_set()
    shift = robot.cable_set().p_WA - fixed.p_WA
    np.testing.assert_allclose(shift[:, 0], [0.0, 0.0, -0.15], atol=1e-15)
    np.testing.assert_allclose(shift[:2, 5], 0.05 / np.sqrt(2.0), atol=1e-15)
    text = yaml.safe_load(robot_text(f"{path}@{first}=-0.15"))
    assert [text["cables"][k]["rail"]["at"] for k in (0, 5)] == [-0.15, -0.1]
    # The file itself stays.
    np.testing.assert_allclose(load_robot(str(path)).cable_set().p_WA[:, 0], fixed.p_WA[:, 0])


def test_a_scenario_and_what_is_left_of_its_run_have_the_configuration(path, tmp_path):
    words = f"robot={path}@{names()[0]}=-0.15"
    scenario = load_scenario("acrobot_pbvs", ["camera.kind=projected", words])
    robot = load_robot(scenario.robot)
    assert robot.cables[0].rail.at == -0.15
    write_run_inputs(tmp_path, scenario, robot)
    again = load_scenario(str(tmp_path / "scenario.yaml"))
    cables = load_robot(again.robot).cable_set()
    np.testing.assert_array_equal(cables.p_WA, robot.cable_set().p_WA)
    X_WP = robot.home.transform()
    moved = cable_lengths(X_WP, cables.p_WA, cables.p_PB)
    assert abs(moved[0] - cable_lengths(X_WP, *fixed_points())[0]) > 0.05


def fixed_points():
    cables = robot_of(content_of()).cable_set()
    return cables.p_WA, cables.p_PB


@pytest.mark.parametrize(
    ("suffix", "words"),
    [
        ("{0}=0.5", r"cables\[0\]\.rail\.at: found 0\.5; accepted: -0\.2 to 0\.1 \[m\]"),
        ("{1}=0.0", r"found no rail of that cable; accepted: {0}, {5}"),
        ("{0}", r"found '{0}' behind @; accepted: coordinates of exit points on rails"),
        ("{0}=x", r"found '{0}=x' behind @"),
        ("{0}=0,{0}=0.1", r"found '{0}=0\.1' behind @; accepted: .* each cable once"),
    ],
)
def test_what_no_rail_can_do_is_named(path, suffix, words):
    with pytest.raises(RobotFileError, match=words.format(*names())):
        load_robot(f"{path}@{suffix.format(*names())}")


def test_a_robot_without_rails_says_so():
    with pytest.raises(RobotFileError, match=r"accepted: none, since its file gives no cables\[\]"):
        load_robot(f"acrobot_small@{names()[0]}=0.1")


def test_an_export_says_where_exit_points_stand():
    lost = export_omissions(robot_of(with_rails()), "sdf")
    for key in ("axis", "lower", "upper", "at"):
        assert lost[f"cables[].rail.{key}"] == "exit points were written where they stand"
