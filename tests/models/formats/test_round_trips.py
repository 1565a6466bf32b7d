"""Whatever a robot may say comes back from each format, or is named as lost: all robots, fields."""

import json
import re
from dataclasses import fields
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest

from cdpr_drake import models
from cdpr_drake.cli.app import main
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats import assumptions
from cdpr_drake.formats.robot_exchange import export_robot
from cdpr_drake.formats.robot_exports import EXPORTS, HELD, export_omissions, given_fields
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import Text, settings
from tests.messages import printed
from tests.models.formats.meanings import fields_that_differ, schema_keys
from tests.models.formats.unusual_robots import (
    ALL,
    NAMES,
    UNUSUAL,
    exported,
    made,
    planar_robot,
    robot_with_everything,
    written,
)
from tests.motion.small_robots import MOTIONS, small_robot

pytestmark = pytest.mark.usefixtures("in_this_process")

EXACT = 1e-12
"""Text has all digits; rotations round a few times."""

FIRMWARES = ("klipper", "reprapfirmware", "maslow")  # which know points alone

PROSE = ("title", "assumptions")
"""Fields that are filled with words about the import where a robot says nothing there."""


def formats():
    """Those that can be read here: MJCF is read by MuJoCo."""
    try:
        import mujoco  # noqa: F401
    except ImportError:
        return [format for format in EXPORTS if format != "mjcf"]
    return list(EXPORTS)


def back(robot, files, folder):
    """The robot as it comes back; None where the format refuses it by its motion."""
    try:
        first = written(files(), folder)
    except RobotFileError as problem:
        if f"robot {robot.name}: motion: found {robot.motion}" not in str(problem):
            raise
        return None
    return models.load_robot(str(first))


@pytest.mark.parametrize("name", ALL)
def test_no_field_is_lost_unsaid(name, tmp_path, monkeypatch):
    """And of unusual robots nothing is named that comes back."""
    # Of a home pose that a format has not, others look at the search over 225 poses.
    monkeypatch.setattr(assumptions, "_farthest", lambda *_: (0, 1.0))
    robot = made(name)
    for format in formats():
        again = back(robot, lambda format=format: exported(name, format), tmp_path)
        if again is None:
            assert format != "mjcf" or name == "beam"
            assert robot.motion != "3R3T" or format in FIRMWARES
            continue
        lost, differ = set(export_omissions(robot, format)), fields_that_differ(robot, again)
        assert differ - lost <= {key for key in PROSE if getattr(robot, key) == ""}, format
        if name in UNUSUAL and name != "arms":  # which has values that an import assumes
            assert lost <= differ, format
        if format != "mjcf" and name in ("tilted", "tilted_gravity"):
            # In a turned world all is as that world has it.
            seen = models.turned_robot(robot, models.gravity_turn(robot))
            unsaid = fields_that_differ(seen, again) - set(export_omissions(seen, format))
            assert unsaid <= {key for key in PROSE if getattr(robot, key) == ""}, format
            said = export_omissions(robot, format)["gravity_direction"]
            assert said.startswith("The world was turned")


@pytest.mark.parametrize("name", ["acrobot_large", "caroca"])
def test_the_frame_of_gazebo_lies_in_the_middle_of_the_box(name, tmp_path):
    robot = made(name)
    again = models.load_robot(str(written(exported(name, "gazebo-yaml"), tmp_path)))
    shift = robot.box_center()
    anchors = robot.anchor_points() - shift[:, np.newaxis]
    np.testing.assert_allclose(again.anchor_points(), anchors, atol=EXACT)
    middle = robot.home.transform().multiply(shift)
    np.testing.assert_allclose(again.home.position, middle, atol=EXACT)
    assert again.tension_limits() == robot.tension_limits()


def test_the_robot_with_everything_has_everything():
    """Every key of the schema has a value of its own in one of the robots above."""
    robots = [made(name) for name in UNUSUAL] + [small_robot(name) for name in MOTIONS]
    given = {key for robot in robots for key in given_fields(robot)}
    only_other_shapes = {f"platform.shape.{key}" for key in ("size", "file")}
    whole = {"cables[].rail", "cables[].material"}  # where they are, their fields are
    keys = {key for robot in robots for key in schema_keys(robot)}
    sections = {key for key in keys if any(other.startswith(f"{key}.") for other in keys)}
    lists = {key for key in keys if any(other.startswith(f"{key}[].") for other in keys)}
    assert keys - given - sections - lists <= only_other_shapes | whole


def test_formats_hold_fields_and_the_guide_says_which():
    keys = {key for name in UNUSUAL for key in schema_keys(made(name))}
    for format, held in HELD.items():
        assert held <= keys, format
    assert list(HELD) == list(EXPORTS)
    guide = Path(__file__).parents[3] / "docs" / "guides" / "robots.md"
    lines = [line for line in guide.read_text(encoding="utf-8").splitlines() if line[:1] == "|"]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    head = next(k for k, row in enumerate(rows) if row[0] == "key")
    found = {}
    for row in rows[head + 2 :]:
        for columns, held in zip(rows[head][1:], row[1:], strict=True):
            for format in re.findall(r"`(.+?)`", columns):
                named = re.findall(r"`(.+?)`", row[0]) if held == "yes" else []
                found.setdefault(format, set()).update(named)
    assert found == HELD


@settings
class LaterRobot(Robot):
    """A robot of a schema that has grown."""

    colour: Annotated[Text, "Its colour."] = ""


def test_a_field_that_is_added_later_is_named():
    robot = made("everything")
    values = {field.name: getattr(robot, field.name) for field in fields(robot)}
    for format in EXPORTS:
        assert export_omissions(LaterRobot(**values, colour="red"), format)["colour"]
        assert "colour" not in export_omissions(LaterRobot(**values), format)


def test_the_comparison_sees_what_differs():
    """A check that could not fail would be none."""
    robot, other = robot_with_everything(), robot_with_everything()
    assert fields_that_differ(robot, other) == set()
    other.cables[0].pulley_radius = 0.018
    other.winch.friction.coulomb = 0.011
    other.cables[3].rail.at = 0.06
    other.cables[1].material.diameter = None
    other.platform.shape = None
    shape = ("kind", "radius", "height", "scale", "position", "angles_deg")
    assert fields_that_differ(robot, other) == {
        "cables[].pulley_radius", "winch.friction.coulomb", "cables[].rail.at",
        "cables[].exit_point", "cables[].material.diameter",
        *(f"platform.shape.{key}" for key in shape),
    }  # fmt: skip


@pytest.mark.parametrize("format", ["sdf", "sdf-drake", "urdf", "mjcf", "caspr"])
def test_unusual_names_come_back(format, tmp_path):
    if format not in formats():
        pytest.skip("without MuJoCo")
    again = models.load_robot(str(written(exported("everything", format), tmp_path)))
    assert [cable.name for cable in again.cables][:3] == NAMES[:3]
    assert len({cable.name for cable in again.cables}) == len(NAMES)
    named = export_omissions(made("everything"), format).get("cables[].name", "")
    for before, after in zip(NAMES, again.cables, strict=True):
        assert (f"{before!r} is {after.name}" in named) == (before != after.name)


@pytest.mark.parametrize("format", ["caspr", "wcrfx"])
def test_letters_that_xml_has_not_leave_a_file_that_is_read(format, tmp_path):
    robot = planar_robot()
    robot.title, robot.cables[0].name = "bell \a", "\x1b[31m"
    again = models.load_robot(str(written(export_robot(robot, format), tmp_path)))
    assert again.title == "bell "
    assert {"title", "cables[].name"} <= set(export_omissions(robot, format))


def test_without_pulleys_nothing_is_said_of_them():
    robot = robot_with_everything()
    robot.pulley.radius, robot.pulley.swivel_axis = 0.0, np.array([0.0, 0.0, 1.0])
    robot.tension_bounds.lower = 0.0
    lost = export_omissions(robot, "urdf")
    assert not {"pulley.radius", "pulley.swivel_axis", "tension_bounds.lower"} & set(lost)
    assert "tension_bounds.upper" in lost


def test_formats_that_cannot_hold_a_robot_say_so():
    with pytest.raises(RobotFileError, match="accepted for sdf: 3R3T"):
        export_robot(made("planar"), "sdf")
    with pytest.raises(RobotFileError, match="accepted: sdf, sdf-drake"):
        export_robot(made("planar"), "docx")


def test_links_of_the_same_name_in_a_model_beside_it_are_not_the_frame(tmp_path):
    path = written(exported("acrobot_large", "sdf"), tmp_path)
    beside = '<model name="beside"><link name="frame"/><link name="rod_C1"/></model></model>'
    path.write_text(path.read_text(encoding="utf-8").replace("</model>", beside), encoding="utf-8")
    again = models.load_robot(str(path))
    assert len(again.cables) == 8
    assert "frame: " in again.assumptions


def test_commands_export_and_import(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def cdpr(*arguments):
        with pytest.raises(SystemExit) as ended:
            main(list(arguments))
        return ended.value.code, *printed(capsys)

    lost = export_omissions(made("cogiro"), "gazebo-yaml")
    code, out, err = cdpr("export", "cogiro", "--format", "gazebo-yaml")
    assert (code, out) == (0, "cogiro.yaml\n")
    assert "platform.center_of_mass (the mass was put in the middle of the box)" in err
    assert all(key in err for key in lost)
    code, out, _ = cdpr("export", "cogiro", "--format", "gazebo-yaml", "--overwrite", "--json")
    assert code == 0
    assert json.loads(out)["not_written"] == lost
    code, _, err = cdpr("export", "acrobot_large", "--format", "caspr", "--out", "there")
    assert code == 0, err
    assert (tmp_path / "there" / "acrobot_large_cables.xml").is_file()
    code, out, err = cdpr("import", "there", "--out", "mine", "--name", "mine", "--json")
    assert code == 0, err
    facts = json.loads(out)
    assert (facts["cables"], facts["format"]) == (8, "CASPR XML")
    assert "cable.youngs_modulus" in facts["assumed"]
    kept = (tmp_path / "mine" / "robot.yaml").read_text()
    code, _, err = cdpr("import", "there", "--out", "mine")
    assert code == 2
    assert "--overwrite" in err
    assert (tmp_path / "mine" / "robot.yaml").read_text() == kept
    assert sorted(p.name for p in (tmp_path / "mine").iterdir()) == ["README.md", "robot.yaml"]
