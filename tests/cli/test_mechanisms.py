"""Commands that take mechanisms."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.front.mechanisms import hang_mechanism, solve_mechanism_tensions
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


def test_static_is_the_front_door(capsys):
    words = ("static", "arm_on_platform", "--joint", "shoulder=0.1", "--prestress", "10")
    asked = hang_mechanism("arm_on_platform", joints={"shoulder": 0.1}, prestress=10.0)
    assert told(capsys, *words) == json.loads(json.dumps(asked.as_dict()))
    said = answer(capsys, *words)
    assert "arm_on_platform at rest: stable" in said
    assert "arm_on_platform::shoulder is held with" in said


def test_static_options(capsys):
    assert told(capsys, "static", "arm_on_platform", "--held", "none")["held"] == {}
    arm = ("static", "cable_arm")
    found = told(capsys, *arm, "--yields", "pose", "--prestress", "40")
    np.testing.assert_allclose(found["tensions_n"], 40.0, atol=1e-3)
    lengths = ",".join(f"{l0:.9f}" for l0 in found["unstrained_lengths_m"])
    again = told(capsys, *arm, "--lengths", lengths)
    np.testing.assert_allclose(again["tensions_n"], 40.0, atol=0.1)
    found = told(capsys, *arm, "--free", "elbow", "--limits", "5,200")
    assert min(found["tensions_n"]) >= 5.0
    assert found["positions"]["cable_arm::shoulder"] == [0.2]


def test_tension_is_the_front_door(capsys):
    asked = solve_mechanism_tensions("cable_arm", "closed_form")
    found = told(capsys, "tension", "cable_arm", "--method", "closed_form")
    assert found == json.loads(json.dumps(asked.as_dict()))
    said = answer(capsys, "tension", "arm_on_platform", "--held", "none")
    assert "of which they control 6 here: infeasible" in said
    assert "moment at arm_on_platform::shoulder" in said


def test_robots_lists_them_apart(capsys):
    listed = told(capsys, "robots", "--mechanisms")
    assert tuple(one["name"] for one in listed) == mechanism_names()
    assert [one["eyelets"] for one in listed] == [0, 0, 2, 0, 0]
    assert "two_platforms" in answer(capsys, "robots", "--mechanisms")


@pytest.mark.parametrize(
    ("words", "said"),
    [("static cable_arm", "cable_arm"), ("tension cable_arm --method all", "barycenter"),
     ("tension arm_on_platform --held none", "infeasible")],
)  # fmt: skip
def test_plots(capsys, here, words, said):
    assert said in answer(capsys, *words.split(), "--plot", "a.png")
    assert (here / "a.png").stat().st_size > 1000


def test_schema_of_mechanisms(capsys):
    schema = json.loads(answer(capsys, "schema", "mechanism"))
    joints = schema["properties"]["home"]["properties"]["joints"]
    assert joints["additionalProperties"]["anyOf"][0] == {"type": "number"}
    assert "mechanism" in schema["required"]


def test_view_writes_a_page(capsys, here):
    answer(capsys, "view", "cable_arm", "--html", "arm.html")
    assert (here / "arm.html").stat().st_size > 1e6
    answer(capsys, "view", write_small(here), "--html", "small.html")
