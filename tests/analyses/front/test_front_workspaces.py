"""Verbs over grids: workspaces and stability."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import cdpr_drake as cdpr
from cdpr_drake.analyses.front.session import Session
from cdpr_drake.analyses.workspaces.stability_question import make_question
from cdpr_drake.analyses.workspaces.stability_results import stability_workspaces
from cdpr_drake.analyses.workspaces.workspace_question import (
    WorkspaceRequest,
    interference_bodies,
    make_workspace_question,
)
from cdpr_drake.analyses.workspaces.workspace_results import robot_workspace
from cdpr_drake.cli.app import main
from cdpr_drake.stability.verdict import VerdictOptions
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from tests.analyses.front.front_checks import as_json, one_line, shows_itself
from tests.cli.conftest import only
from tests.messages import printed


def test_workspaces(planar):
    found = cdpr.compute_workspace(
        planar, "wrench-feasible", (3, 3, 1), measures="capacity-margin", force=2.0
    )
    question = make_workspace_question(
        "planar", ["wrench-feasible"], found.grid, ["capacity-margin"], "all",
        WorkspaceRequest(
            required=forces(2.0), pulleys=True, around=interference_bodies(planar, pulleys=True)
        ),
    )  # fmt: skip
    expected = robot_workspace(question).workspace
    assert as_json(found) == json.loads(json.dumps(expected.as_dict()))
    np.testing.assert_array_equal(found.inside(), expected.inside())
    assert np.any(found.inside())
    shows_itself(found)
    assert isinstance(found.plot("capacity-margin"), Figure)
    assert as_json(found) == as_json(
        cdpr.compute_workspace(
            "planar", ["wrench-feasible"], (3, 3, 1), measures=["capacity-margin"], force=2.0
        )
    )
    one_line(lambda: cdpr.compute_workspace(planar, "wide"), "kinds 'wide'")
    one_line(lambda: cdpr.compute_workspace(planar, measures="wide"), "measures 'wide'")
    one_line(lambda: cdpr.compute_workspace(planar, clearance=-1.0), "clearance: found")
    one_line(lambda: cdpr.compute_workspace(planar, "wrench-feasible"), "needs required, force")
    one_line(lambda: cdpr.compute_workspace(planar, grid=(3, 3)), "grid")
    one_line(lambda: cdpr.compute_workspace(planar, forse=1.0), "forse", "force")


@pytest.fixture
def few_pictures():
    with only("planes.svg", "workspace.html"):
        yield


@pytest.mark.usefixtures("few_pictures")
def test_a_workspace_as_hull_and_boxes_in_a_folder(tmp_path, monkeypatch, capsys):
    """The call and the command find, write and print the same, and continue each other's work."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "push.yaml").write_text("box: [0, 0, 0, 1, 1, 1]\n")
    said, seen = [], []
    found = cdpr.compute_workspace(
        "acrobot_large", "wrench-feasible", (3, 3, 3), required="push.yaml", box=BOX,
        hull=[0, 0, 0.3], rays=100, certify=True, boxes=300, exit_error=1e-4, boxes_mesh="b.vtu",
        folder="call", formats=("svg",), session=Session(seen.append, say=said.append),
    )  # fmt: skip
    told = as_json(found)
    assert told == json.loads(Path("call/results.json").read_text())
    assert {one.items for one in seen} == {"poses", "boxes"}
    assert said == ["Casting rays", "Writing results"]
    assert found.failed == {}
    assert not found.interrupted
    lines = shows_itself(found)
    assert "hull" in lines
    command = [
        "workspace", "acrobot_large", "--kind", "wrench-feasible", "--wrench-set", "push.yaml",
        "--grid", "3,3,3", "--box=-0.5:0.5,-0.5:0.5,0:1", "--hull", "0,0,0.3", "--rays", "100",
        "--certify", "--boxes", "300", "--exit-error", "1e-4", "--boxes-mesh", "c.vtu",
        "--format", "svg", "--workers", "1", "--json", "--out",
    ]  # fmt: skip
    for folder, words in (("call", "complete already"), ("command", "with pulleys of")):
        with pytest.raises(SystemExit) as end:
            main([*command, folder])
        assert end.value.code == 0
        shown = printed(capsys)
        assert json.loads(shown.out) == told
        assert words in shown.err
    names = [
        sorted(path.name for path in Path(one).iterdir() if path.is_file())
        for one in ("call", "command")
    ]
    assert names[0] == names[1]
    assert {"workspace.npz", "hull.npz", "boxes.npz", "planes.svg", "workspace.html"} < {*names[0]}
    for one in ("workspace.npz", "hull.npz", "boxes.npz", "planes.svg", "../b.vtu"):
        other = Path("command", one.replace("b.vtu", "c.vtu"))
        assert Path("call", one).read_bytes() == other.read_bytes()
    Path("copy").mkdir()
    assert found.write(Path("copy"), ("svg",)) == {}
    assert Path("copy/workspace.npz").read_bytes() == Path("call/workspace.npz").read_bytes()


BOX = ([-0.5, -0.5, 0.0], [0.5, 0.5, 1.0])


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"hull": (0, 0)}, ["hull: found (0, 0)"]),
        ({"hull": (0, 0, 0.3)}, ["hull: found the planar"]),
        ({"unbounded": True}, ["unbounded: needs hull"]),
        ({"unbounded": True, "hull": (0, 0, 0.3), "box": BOX}, ["unbounded: found box"]),
        ({"mesh": "a.stl"}, ["mesh: needs hull"]),
        ({"certify": True, "boxes_mesh": "a.stl"}, ["a.stl", "vtu"]),
        ({"certify": True, "boxes": 0}, ["boxes: found 0"]),
        ({"certify": True, "kinds": ("static", "stable")}, ["certify: found kinds static,stable"]),
        ({"certify": True, "orientations": "any"}, ["certify: found orientations any"]),
        ({"certify": True, "method": "closed_form"}, ["certify: found method closed_form"]),
        ({"certfy": True}, ["certfy", "certify"]),
        ({"box": (BOX[1], BOX[0])}, ["box: accepted: lower below upper"]),
        ({"required": "no.yaml"}, ["no.yaml", "no such file"]),
        ({"required": "no.yaml", "force": 1.0}, ["required: found force or moment too"]),
    ],
)
def test_what_a_workspace_cannot_be_asked_for(planar, tmp_path, asked, words):
    one_line(lambda: cdpr.compute_workspace(planar, folder=tmp_path / "w", **asked), *words)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("verb", ["compute_workspace", "assess_stability"])
def test_a_question_over_a_grid_that_is_stopped_goes_on(planar, tmp_path, verb):
    asked = {"assess_stability": {"verdict": "sampled", "options": {"draws": 2}}}.get(verb, {})
    call = partial(getattr(cdpr, verb), planar, grid=(3, 3, 1), folder=tmp_path / "w", **asked)
    with pytest.raises(cdpr.StoppedError, match=r"stopped after 0 of (9|18) poses"):
        call(session=Session(should_stop=lambda: True))
    assert not (tmp_path / "w" / "results.json").exists()
    assert as_json(call()) == json.loads((tmp_path / "w" / "results.json").read_text())
    seen = []
    again = call(session=Session(seen.append))
    assert [one.found for one in seen] == [seen[0].total]
    assert again.folder == tmp_path / "w"
    assert again.failed == {}


def forces(force):
    return SpatialSet(box=np.array([0.0, 0.0, 0.0, force, force, force]))


def test_stability(planar):
    found = cdpr.assess_stability(
        planar, verdict="sampled", grid=(3, 3, 1), options={"draws": 5}, vary={"r_A": [0.01]}
    )
    question = make_question(
        "planar", verdict="sampled", grid=found.grid, options=VerdictOptions(draws=5),
        vary={"r_A": [0.01]},
    )  # fmt: skip
    expected = stability_workspaces(question).workspaces
    assert as_json(found) == json.loads(json.dumps(expected.as_dict()))
    np.testing.assert_array_equal(found.margin, expected.margin)
    assert "r_A=0.01" in shows_itself(found)
    assert isinstance(found.plot(), Figure)
    one_line(lambda: cdpr.assess_stability(planar, options={"drawn": 5}), "drawn", "draws")
    one_line(lambda: cdpr.assess_stability(planar, verdict="guessed"), "guessed")
    one_line(lambda: cdpr.assess_stability(planar, force=1.0), "force")


def test_a_robot_and_its_name_have_one_grid_and_one_task(planar):
    """What a catalogue or a scenario adds to a robot does not depend on how it is given."""
    both = [cdpr.compute_workspace(one, "static").grid.shape for one in (planar, "planar")]
    assert both[0] == both[1]
    asked = {"grid": (2, 2, 1), "verdict": "sampled", "options": {"draws": 2}}
    seen = [
        as_json(cdpr.assess_stability(one, scenario="planar_pbvs", **asked))
        for one in (planar, "planar")
    ]
    assert seen[0] == seen[1]
