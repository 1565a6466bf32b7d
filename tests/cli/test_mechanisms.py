"""Commands that take mechanisms."""

import json
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.front.mechanisms import hang_mechanism, solve_mechanism_tensions
from cdpr_drake.cli.app import main
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.robot_loader import robot_file
from tests.messages import printed
from tests.models.mechanisms.small_mechanisms import MECHANISM, write_small


def run(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    """What a command prints, on stderr where it is refused."""
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    said = printed(capsys)
    assert ended.value.code == code, said.err
    return said.out if code == 0 else said.err


def test_check_knows_them(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    shipped = [str(robot_file(name)) for name in mechanism_names()]
    found = json.loads(run(capsys, "check", *shipped, "--json"))
    assert [one["kind"] for one in found] == ["mechanism"] * len(shipped)
    assert all(not one["problems"] and not one["notes"] for one in found)
    path = write_small(tmp_path)  # a free platform on one cable from the world
    assert "note: the home positions: hang: found no tensions" in run(capsys, "check", str(path))
    path.write_text(MECHANISM.replace("E, exit", "C1, exit"), encoding="utf-8")
    with pytest.raises(SystemExit):
        main(["check", str(path)])
    assert "cables[1].name: found C1 twice" in capsys.readouterr().out


def test_static_is_the_front_door(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["static", "arm_on_platform", "--joint", "shoulder=0.1", "--prestress", "10"]
    found = json.loads(run(capsys, *words, "--json"))
    asked = hang_mechanism("arm_on_platform", joints={"shoulder": 0.1}, prestress=10.0)
    assert found == json.loads(json.dumps(asked.as_dict()))
    printed = run(capsys, *words)
    assert "arm_on_platform at rest: stable" in printed
    assert "arm_on_platform::shoulder is held with" in printed


def test_static_options(capsys: pytest.CaptureFixture[str]) -> None:
    told = json.loads(run(capsys, "static", "arm_on_platform", "--held", "none", "--json"))
    assert told["held"] == {}
    words = ["static", "cable_arm", "--yields", "pose", "--prestress", "40", "--json"]
    told = json.loads(run(capsys, *words))
    np.testing.assert_allclose(told["tensions_n"], 40.0, atol=1e-3)
    lengths = ",".join(f"{l0:.9f}" for l0 in told["unstrained_lengths_m"])
    again = json.loads(run(capsys, "static", "cable_arm", "--lengths", lengths, "--json"))
    np.testing.assert_allclose(again["tensions_n"], 40.0, atol=0.1)
    words = ["static", "cable_arm", "--free", "elbow", "--limits", "5,200", "--json"]
    told = json.loads(run(capsys, *words))
    assert min(told["tensions_n"]) >= 5.0
    assert told["positions"]["cable_arm::shoulder"] == [0.2]


def test_tension_is_the_front_door(capsys: pytest.CaptureFixture[str]) -> None:
    found = json.loads(run(capsys, "tension", "cable_arm", "--method", "closed_form", "--json"))
    asked = solve_mechanism_tensions("cable_arm", "closed_form")
    assert found == json.loads(json.dumps(asked.as_dict()))
    assert "barycenter" in run(capsys, "tension", "cable_arm", "--method", "all")
    printed = run(capsys, "tension", "arm_on_platform", "--held", "none")
    assert "of which they control 6 here: infeasible" in printed
    assert "moment at arm_on_platform::shoulder" in printed


REFUSED = [
    (["static", "cable_arm", "--pose", "0,0,0"], "--pose: found with a mechanism"),
    (["static", "planar", "--held", "none"], "--held: found with a robot with one platform"),
    (["static", "cable_arm", "--joint", "elbow"], "--joint: found 'elbow'"),
    (["static", "cable_arm", "--joint", "knee=1"], "found knee; accepted: one of cable_arm::elbow"),
    (["static", "cable_arm", "--yields", "both"], "yields: found 'both'"),
    (["static", "cable_arm", "--prestress", "1,2"], "--prestress: found '1,2'"),
    (["static", "cable_arm", "--lengths", "1,2"], "--lengths: found '1,2'"),
    (["static", "cable_arm", "--lengths", ""], "--lengths: found ''"),
    (["static", "cable_arm", "--held", "knee"], "joint: found knee"),
    (["tension", "cable_arm", "--wrench", "0,0,0,0,0,1"], "--wrench: found with a mechanism"),
    (["tension", "planar", "--joint", "a=1", "--pose", "0,0,0"], "--joint: found with a robot"),
    (["tension", "nowhere.yaml"], "nowhere.yaml"),
    (["tension", "cable_arm", "--method", "none"], "method: found none"),
    (["robots", "--mechanisms", "--cables", "8"], "--mechanisms: found with other choices"),
]


@pytest.mark.parametrize(("words", "said"), REFUSED)
def test_what_is_not_accepted(
    capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    message = run(capsys, *words, code=2)
    lines = [line for line in message.splitlines() if line.startswith("cdpr: ")]
    assert len(lines) == 1
    assert said in lines[0]


def test_robots_lists_them_apart(capsys: pytest.CaptureFixture[str]) -> None:
    listed = json.loads(run(capsys, "robots", "--mechanisms", "--json"))
    assert tuple(one["name"] for one in listed) == mechanism_names()
    assert [one["eyelets"] for one in listed] == [0, 0, 2, 0, 0]
    assert "two_platforms" in run(capsys, "robots", "--mechanisms")


def test_plots(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for k, words in enumerate((
        ["static", "cable_arm"], ["tension", "cable_arm", "--method", "all"],
        ["tension", "arm_on_platform", "--held", "none"],
    )):  # fmt: skip
        page = tmp_path / f"{k}.png"
        run(capsys, *words, "--plot", str(page))
        assert page.stat().st_size > 1000


def test_schema_of_mechanisms(capsys: pytest.CaptureFixture[str]) -> None:
    schema = json.loads(run(capsys, "schema", "mechanism"))
    joints = schema["properties"]["home"]["properties"]["joints"]
    assert joints["additionalProperties"]["anyOf"][0] == {"type": "number"}
    assert "mechanism" in schema["required"]


def test_view_writes_a_page(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    page = tmp_path / "arm.html"
    run(capsys, "view", "cable_arm", "--html", str(page))
    assert page.stat().st_size > 1e6
    run(capsys, "view", str(write_small(tmp_path)), "--html", str(page))
