"""The verbs of workspaces and stability in Python, and that commands find and keep the same."""

import inspect
import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import cdpr_drake as cdpr
from cdpr_drake.analyses.workspaces.conditions import KINDS, MEASURES, conditions_at
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions
from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from tests.analyses.verbs.verb_checks import as_json, one_line
from tests.cli.conftest import only
from tests.messages import printed

ONE = {"workers": 1}


@pytest.fixture(scope="module")
def planar():
    return cdpr.load_robot("planar")


def test_workspaces(planar):
    found = cdpr.compute_workspace(
        planar, "wrench-feasible", (3, 3, 1), measures="capacity-margin", force=2.0, **ONE
    )
    about = pose_conditions(planar, required=SpatialSet(box=np.repeat([0.0, 2.0], 3)))
    names = ("wrench-feasible", "capacity-margin")
    expected = conditions_at(about, found.grid, names, (0, found.grid.size))
    np.testing.assert_array_equal(found.inside().ravel(), expected["wrench-feasible"])
    np.testing.assert_array_equal(found.values[names[1]].ravel(), expected[names[1]])
    assert np.any(found.inside())
    assert "wrench-feasible" in repr(found)
    assert "<table>" in found._repr_html_()
    assert len(found.to_dataframe()) == 9
    assert isinstance(found.plot("capacity-margin"), Figure)
    again = cdpr.compute_workspace(
        "planar", ["wrench-feasible"], (3, 3, 1), measures=["capacity-margin"], force=2.0, **ONE
    )
    assert as_json(found) == as_json(again)


BREAKS = "dynamic-single-failure"

REFUSALS = {
    "kind": ("planar", {"kinds": "wide"}, "kinds 'wide'"),
    "measure": ("planar", {"measures": "wide"}, "measures 'wide'"),
    "clearance": ("planar", {"clearance": -1.0}, "clearance: found"),
    "needs": ("planar", {"kinds": "wrench-feasible"}, "with required, with force"),
    "grid": ("planar", {"grid": (3, 3)}, r"grid: found \(3, 3\)"),
    "tilted": ("planar", {"orientation": [(5.0, 0.0, 0.0)]}, "accepted for the planar robot"),
    "hull": ("planar", {"hull": (0, 0)}, r"hull: found \(0, 0\)"),
    "flat hull": ("planar", {"hull": (0, 0, 0.3)}, "hull: found the planar robot planar"),
    "proof": ("planar", {"certify": True, "kinds": ("static", "stable")}, "certify: found kinds"),
    "any": ("planar", {"certify": True, "orientations": "any"}, "certify: found orientations any"),
    "boxes": ("planar", {"boxes": 0}, "boxes: found 0"),
    "box": ("planar", {"box": (np.ones(3), -np.ones(3))}, "box: accepted: lower below upper"),
    "a": ("planar", {"accelerations": (1.0, 2.0, 3.0)}, r"accelerations: found \(1.0, 2.0, 3.0\)"),
    "reaction": ("acrobot_large", {"kinds": BREAKS, "reactions": ["pray"]}, "'pray' is unknown"),
    "moving": ("acrobot_large", {"kinds": BREAKS, "moving": [1.0, 0.0]}, "accepted: three finite"),
    "alone": ("acrobot_large", {"moving": [1.0, 0.0, 0.0]}, f"{BREAKS} among them"),
    "mass": ("acrobot_large", {"kinds": BREAKS, "mass": 2.0}, f"mass: found with kinds {BREAKS}"),
    "mode": ("acrobot_large", {"kinds": BREAKS, "scenario": "acrobot_pbvs"}, "winches.mode: found"),
    "other kind": (
        "acrobot_large", {"kinds": BREAKS, "scenario": "acrobot_pick_and_place"}, "a visual servo",
    ),
    "breaks, hull": ("acrobot_large", {"kinds": BREAKS, "hull": [0.0, 0.0, 0.3]}, "hull: found ki"),
    "breaks, proof": ("acrobot_large", {"kinds": BREAKS, "certify": True}, "certify: found kinds"),
    "breaks, flat": ("planar", {"kinds": BREAKS}, f"kind {BREAKS}: found planar"),
    "no target": (
        "acrobot_large", {"kinds": "target-visible", "scenario": "acrobot_pick_and_place"},
        "accepted for workspaces: a visual servo",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("robot", "asked", "words"), REFUSALS.values(), ids=REFUSALS.keys())
def test_what_a_workspace_cannot_be_asked_for(robot, asked, words, tmp_path):
    with pytest.raises(CdprError, match=words) as refused:
        cdpr.compute_workspace(robot, folder=tmp_path / "w", **asked)
    assert len(str(refused.value).splitlines()) == 1
    assert not any(tmp_path.iterdir())


@pytest.fixture
def few_pictures():
    with only("planes.svg", "workspace.html"):
        yield


BOX = ([-0.5, -0.5, 0.0], [0.5, 0.5, 1.0])


@pytest.mark.usefixtures("few_pictures")
def test_a_workspace_as_hull_and_boxes_in_a_folder(tmp_path, monkeypatch, capsys):
    """The call and the command find, write and print the same, and continue each other's work."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "push.yaml").write_text("box: [0, 0, 0, 1, 1, 1]\n")
    seen = []
    found = cdpr.compute_workspace(
        "acrobot_large", "wrench-feasible", (3, 3, 3), required="push.yaml", box=BOX,
        hull=[0, 0, 0.3], rays=100, certify=True, boxes=300, exit_error=1e-4, boxes_mesh="b.vtu",
        folder="call", formats=("svg",), follow=cdpr.Follow(seen.append), **ONE,
    )  # fmt: skip
    numbers = as_json(found)
    assert numbers == json.loads(Path("call/results.json").read_text())
    assert {progress.unit for progress in seen} == {"rays", "poses", "boxes"}
    assert (found.failed, found.stopped, found.exit_code) == ({}, False, 0)
    assert "hull: " in repr(found)
    assert numbers["certified"]["lower_m_rad"][:3] == BOX[0]
    assert numbers["grid"]["upper_m"] == BOX[1]
    command = [
        "workspace", "acrobot_large", "--kind", "wrench-feasible", "--wrench-set", "push.yaml",
        "--grid", "3,3,3", "--box=-0.5:0.5,-0.5:0.5,0:1", "--hull", "0,0,0.3", "--rays", "100",
        "--certify", "--boxes", "300", "--exit-error", "1e-4", "--boxes-mesh", "c.vtu",
        "--figure-format", "svg", "--workers", "1", "--json", "--out",
    ]  # fmt: skip
    for folder, reused in (("call", True), ("command", False)):
        with pytest.raises(SystemExit) as end:
            main([*command, folder])
        assert end.value.code == 0
        shown = printed(capsys)
        assert json.loads(shown.out) == numbers
        assert ("reused the grid of call" in shown.err) == reused
    names = [{path.name for path in Path(one).iterdir()} for one in ("call", "command")]
    assert names[0] == names[1]
    assert {"workspace.npz", "hull.npz", "boxes.npz", "planes.svg", "workspace.html"} < names[0]
    for one in ("workspace.npz", "hull.npz", "boxes.npz", "planes.svg", "../b.vtu"):
        other = Path("command", one.replace("b.vtu", "c.vtu"))
        assert Path("call", one).read_bytes() == other.read_bytes()


@pytest.mark.parametrize("verb", ["compute_workspace", "assess_stability"])
def test_a_question_over_a_grid_that_is_stopped_goes_on(planar, tmp_path, verb):
    asked = {"assess_stability": {"verdict": "sampled", "draws": 2}}.get(verb, {})
    call = partial(
        getattr(cdpr, verb), planar, grid=(3, 3, 1), folder=tmp_path / "w", **asked, **ONE
    )
    with pytest.raises(cdpr.StoppedError, match=r"stopped after 0 of (9|18) poses"):
        call(follow=cdpr.Follow(stop=lambda: True))
    assert not (tmp_path / "w").exists()
    assert as_json(call()) == json.loads((tmp_path / "w" / "results.json").read_text())
    said = []
    again = call(follow=cdpr.Follow(say=said.append))
    assert said == [f"reused the grid of {tmp_path / 'w'}"]
    assert again.folder == tmp_path / "w"


def test_stability(planar):
    asked = {"grid": (3, 3, 1), "draws": 5, "vary": {"r_A": [0.01]}, **ONE}
    found = cdpr.assess_stability(planar, verdict="sampled", **asked)
    assert "r_A=0.01" in repr(found)
    assert "Z r_A=0.01" in found.to_dataframe()
    assert isinstance(found.plot("volumes"), Figure)
    for wrong, words in (
        ({"draws": 0}, "draws"), ({"verdict": "guessed"}, "guessed"), ({"force": 1.0}, "force"),
        ({"mass": -1.0}, "mass: found -1"), ({"limits": (-1.0, 60.0)}, "0 <= lower"),
        ({"vary": {"r_A": [0.01, 0.010000001]}}, "agree to six digits"),
    ):  # fmt: skip
        one_line(lambda wrong=wrong: cdpr.assess_stability(planar, **wrong), words)


def test_a_robot_and_its_name_have_one_grid_and_one_task(planar):
    """What a catalogue or a scenario adds to a robot does not depend on how it is given."""
    both = [cdpr.compute_workspace(one, **ONE).grid.shape for one in (planar, "planar")]
    assert both[0] == both[1]
    asked = {"grid": (2, 2, 1), "verdict": "sampled", "draws": 2, **ONE}
    seen = [
        as_json(cdpr.assess_stability(one, scenario="planar_pbvs", **asked))
        for one in (planar, "planar")
    ]
    assert seen[0] == seen[1]


def test_the_help_names_every_kind_and_measure():
    words = " ".join(inspect.getdoc(cdpr.compute_workspace).split())
    for name in (*KINDS, *MEASURES):
        assert name in words
