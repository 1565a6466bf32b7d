"""Whatever a robot file may say comes back from a format of another tool, or is named as lost."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake import models
from cdpr_drake.cli.app import main
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.robot_exchange import export_robot
from cdpr_drake.models.robot_exports import EXPORTS, HELD, export_omissions
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.fields import text
from tests.messages import printed
from tests.models.formats.meanings import fields_that_differ, meaning, same, schema_keys
from tests.models.formats.unusual_robots import NAMES, UNUSUAL, planar_robot, robot_with_everything
from tests.motion.small_robots import MOTIONS, small_robot

PROSE = ("title", "assumptions")
"""Fields that are filled with words about the import where a robot says nothing there."""

AT_HOME = "home"
"""Named where a robot is not at rest at home, which is no field."""


@cache
def made(name):
    """The robot of a name; nobody changes it."""
    if name in UNUSUAL:
        return UNUSUAL[name]()
    return small_robot(name) if name in MOTIONS else models.load_robot(name)


def through(robot, format, folder):
    """The robot as it comes back; None where the format refuses it by its motion."""
    try:
        files = export_robot(robot, format)
    except RobotFileError as problem:
        words = str(problem)
        assert f"robot {robot.name}: motion: found {robot.motion}" in words
        return None
    for name, content in files.items():
        (folder / name).write_text(content, encoding="utf-8")
    return models.load_robot(str(folder / next(iter(files))))


@pytest.fixture(scope="module")
def back(tmp_path_factory):
    """What comes back of a robot by name from a format: several tests ask for the same."""

    @cache
    def again(name, format):
        return through(made(name), format, tmp_path_factory.mktemp(format))

    return again


def formats():
    """Those that can be read here: MJCF is read by MuJoCo."""
    try:
        import mujoco  # noqa: F401
    except ImportError:
        return [format for format in EXPORTS if format != "mjcf"]
    return list(EXPORTS)


@pytest.mark.parametrize("name", [*UNUSUAL, *MOTIONS, *models.robot_names()])
def test_no_field_is_lost_unsaid(name, back):
    robot = made(name)
    for format in formats():
        again = back(name, format)
        if again is None:
            continue
        unsaid = fields_that_differ(robot, again) - set(export_omissions(robot, format))
        assert unsaid <= {key for key in PROSE if getattr(robot, key) == ""}, format


@pytest.mark.parametrize("name", ["tilted", "tilted_gravity"])
def test_in_a_turned_world_all_is_as_that_world_has_it(name, back):
    robot = made(name)
    seen = models.turned_robot(robot, models.gravity_turn(robot))
    for format in formats():
        if format == "mjcf":  # which has gravity in any direction
            continue
        again = back(name, format)
        if again is None:
            continue
        unsaid = fields_that_differ(seen, again) - set(export_omissions(seen, format))
        assert unsaid <= {key for key in PROSE if getattr(robot, key) == ""}, format
        assert export_omissions(robot, format)["gravity_direction"].startswith(
            "The world was turned"
        )


@pytest.mark.parametrize("name", [name for name in UNUSUAL if name != "arms"])
def test_nothing_is_named_that_comes_back(name, back):
    """No value of these robots is one that an import assumes, as some of a board with arms are."""
    robot = made(name)
    for format in formats():
        again = back(name, format)
        if again is not None:
            assert set(export_omissions(robot, format)) <= fields_that_differ(robot, again), format


def test_the_robot_with_everything_has_everything():
    """Every key of the schema has a value of its own in one of the robots above."""
    robots = [make() for make in UNUSUAL.values()] + [small_robot(name) for name in MOTIONS]
    given = {key for robot in robots for key in models.given_fields(robot)}
    only_other_shapes = {f"platform.shape.{key}" for key in ("size", "file")}
    whole = {"cables[].rail", "cables[].material"}  # where they are, their fields are
    keys = {key for robot in robots for key in schema_keys(robot)}
    sections = {key for key in keys if any(other.startswith(f"{key}.") for other in keys)}
    lists = {key for key in keys if any(other.startswith(f"{key}[].") for other in keys)}
    assert keys - given - sections - lists <= only_other_shapes | whole


def test_formats_hold_nothing_that_is_no_field():
    keys = {key for make in UNUSUAL.values() for key in schema_keys(make())}
    for format, held in HELD.items():
        assert held <= keys, format
    assert list(HELD) == list(EXPORTS)


@dataclass(kw_only=True)
class LaterRobot(Robot):
    """A robot of a schema that has grown."""

    colour: str = text("Its colour.", "")


def test_a_field_that_is_added_later_is_named():
    robot = robot_with_everything()
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
    assert fields_that_differ(robot, other) == {
        "cables[].pulley_radius", "winch.friction.coulomb", "cables[].rail.at",
        "cables[].exit_point", "cables[].material.diameter",
        *(f"platform.shape.{key}" for key in ("kind", "radius", "height", "scale", "position",
                                              "angles_deg")),
    }  # fmt: skip


@pytest.mark.parametrize("format", ["sdf", "sdf-drake", "urdf", "mjcf", "caspr"])
def test_unusual_names_come_back(format, tmp_path):
    if format not in formats():
        pytest.skip("without MuJoCo")
    robot = robot_with_everything()
    again = through(robot, format, tmp_path)
    assert [cable.name for cable in again.cables][:3] == NAMES[:3]
    assert len({cable.name for cable in again.cables}) == len(NAMES)
    named = export_omissions(robot, format).get("cables[].name", "")
    for before, after in zip(NAMES, again.cables, strict=True):
        assert (f"{before!r} is {after.name}" in named) == (before != after.name)


def test_letters_that_xml_has_not_leave_a_file_that_is_read(tmp_path):
    robot = planar_robot()
    robot.title, robot.cables[0].name = "bell \a", "\x1b[31m"
    for format in ("caspr", "wcrfx"):
        again = through(robot, format, tmp_path)
        assert again.title == "bell "
        assert {"title", "cables[].name"} <= set(export_omissions(robot, format))


@pytest.mark.parametrize("format", ["caspr", "wcrfx"])
def test_pulleys_of_all_cables_come_back(format, tmp_path):
    robot = robot_with_everything()
    again = through(robot, format, tmp_path)
    for key in HELD["wcrfx"] & {"pulley.radius", "pulley.swivel_axis", "cables[].pulley_radius"}:
        assert same(meaning(key, robot, robot), meaning(key, again, robot))
    assert again.cable_set().pulley_radius.tolist() == [0.017, *[0.031] * 5, 0.0, 0.031]


def test_without_pulleys_nothing_is_said_of_them():
    robot = robot_with_everything()
    robot.pulley.radius, robot.pulley.swivel_axis = 0.0, np.array([0.0, 0.0, 1.0])
    robot.tension_bounds.lower = 0.0
    lost = export_omissions(robot, "urdf")
    assert not {"pulley.radius", "pulley.swivel_axis", "tension_bounds.lower"} & set(lost)
    assert "tension_bounds.upper" in lost


def test_the_guide_has_what_formats_hold():
    guide = Path(__file__).parents[3] / "docs" / "guides" / "robots.md"
    lines = [line for line in guide.read_text(encoding="utf-8").splitlines() if line[:1] == "|"]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    head = next(k for k, row in enumerate(rows) if row[0] == "key")
    found: dict[str, set[str]] = {}
    for row in rows[head + 2 :]:
        for formats, held in zip(rows[head][1:], row[1:], strict=True):
            for format in re.findall(r"`(.+?)`", formats):
                keys = re.findall(r"`(.+?)`", row[0]) if held == "yes" else []
                found.setdefault(format, set()).update(keys)
    assert found == HELD


@pytest.fixture
def cdpr(tmp_path, capsys, monkeypatch):
    """Runs the command in the test's folder: exit code, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        with pytest.raises(SystemExit) as ended:
            main(list(arguments))
        return ended.value.code, *printed(capsys)

    return run


def test_the_command_says_what_was_not_written(cdpr):
    lost = export_omissions(models.load_robot("cogiro"), "gazebo-yaml")
    code, out, err = cdpr("export", "cogiro", "--format", "gazebo-yaml")
    assert code == 0
    assert out == "cogiro.yaml\n"
    assert "platform.center_of_mass (the mass was put in the middle of the box)" in err
    assert all(key in err for key in lost)
    code, out, _ = cdpr("export", "cogiro", "--format", "gazebo-yaml", "--overwrite", "--json")
    assert code == 0
    assert json.loads(out)["not_written"] == lost
