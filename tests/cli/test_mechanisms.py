"""Commands that list, check and show mechanisms."""

import json

from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.robot_loader import robot_file
from tests.cli.commands import answer, run, told
from tests.models.mechanisms.small_mechanisms import MECHANISM, write_small


def test_check_knows_them(capsys, here):
    shipped = [str(robot_file(name)) for name in mechanism_names()]
    found = told(capsys, "check", *shipped)
    assert [one["kind"] for one in found] == ["mechanism"] * len(shipped)
    assert all(not one["problems"] and not one["notes"] for one in found)
    path = write_small(here)  # a free platform on one cable from the world
    assert "note: the home positions: hang: found no tensions" in answer(capsys, "check", path)
    path.write_text(MECHANISM.replace("E, exit", "C1, exit"), encoding="utf-8")
    assert "cables[1].name: found C1 twice" in run(capsys, "check", path)[1]


def test_robots_lists_them_apart(capsys):
    listed = told(capsys, "robots", "--mechanisms")
    assert tuple(one["name"] for one in listed) == mechanism_names()
    assert [one["eyelets"] for one in listed] == [0, 0, 2, 0, 0]
    assert "two_platforms" in answer(capsys, "robots", "--mechanisms")


def test_schema_of_mechanisms(capsys):
    schema = json.loads(answer(capsys, "schema", "mechanism"))
    joints = schema["properties"]["home"]["properties"]["joints"]
    assert joints["additionalProperties"]["anyOf"][0] == {"type": "number"}
    assert "mechanism" in schema["required"]


def test_view_writes_a_page(capsys, here):
    answer(capsys, "view", "cable_arm", "--html", "arm.html")
    assert (here / "arm.html").stat().st_size > 1e6
    answer(capsys, "view", write_small(here), "--html", "small.html")
