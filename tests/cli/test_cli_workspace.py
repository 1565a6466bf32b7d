"""`cdpr workspace`: what it writes and prints, how it continues, and what it refuses."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.workspaces.box_certificates import box_search, certified_boxes
from cdpr_drake.analyses.workspaces.workspace_hulls import question_hull
from cdpr_drake.analyses.workspaces.workspace_question import make_workspace_question
from cdpr_drake.analyses.workspaces.workspace_results import load_robot_workspace
from cdpr_drake.cli.app import main
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, OUTSIDE
from cdpr_drake.workspaces.box_grid_agreement import hull_agreement
from cdpr_drake.workspaces.pose_grid import grid_by_count
from tests.messages import printed


def ended(arguments):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    return end.value.code


PLANAR = ["workspace", "planar", "--grid", "9,9,1", "--workers", "1"]


@pytest.mark.usefixtures("no_room_for_pictures")
def test_pictures_that_fail_cost_nothing_else(tmp_path, capsys):
    out = tmp_path / "found"
    assert ended([*PLANAR, "--out", str(out)]) == 3
    err = printed(capsys).err
    for name in ("planes.png", "workspace.html"):
        assert f"{name}: not written: [Errno 28]" in err
    assert "The data is complete" in err
    assert json.loads((out / "results.json").read_text())
    assert not [path for path in out.rglob("*") if path.suffix in (".png", ".html")]


def test_kinds_measures_hull_and_boxes_of_one_robot(tmp_path, capsys):
    out = tmp_path / "found"
    arguments = [
        "workspace", "acrobot_large", "--kind", "static,statically-stable", "--measure",
        "capacity-margin,clearance", "--grid", "7,7,3", "--workers", "1", "--out", str(out),
    ]  # fmt: skip
    assert ended([*arguments, "--hull", "0,0,0.3", "--rays", "300", "--json"]) == 0
    told = json.loads(printed(capsys).out)
    assert json.loads((out / "results.json").read_text()) == told
    assert {"static", "statically-stable", "all"} == set(told["workspaces"])
    assert 0.1 < told["workspaces"]["all"]["pose_share"] < 1.0
    assert told["measured"]["capacity-margin"]["least"] >= 0.0
    assert 0.3 < told["hull"]["volume_m3"] < 1.728
    for name in (
        "planes.png",
        "capacity-margin.png",
        "clearance.png",
        "workspace.html",
        "hull.npz",
    ):
        assert (out / name).stat().st_size > 1000
    stored = load_robot_workspace(out)
    margins = stored.values["capacity-margin"]
    np.testing.assert_array_equal(margins >= 0.0, stored.holds["static"])
    assert ended(arguments) == 0
    said = printed(capsys)
    assert "complete already" in said.err
    assert "statically-stable" in said.out


def test_a_planar_robot_with_certified_boxes_and_a_range_of_turns(tmp_path, capsys):
    shares = {}
    for rule in ("all", "any"):
        out = tmp_path / rule
        asked = [
            *PLANAR, "--kind", "wrench-feasible", "--force", "1", "--orientation", "0,0,-20:20:20",
            "--orientations", rule, "--out", str(out), "--json",
        ]  # fmt: skip
        more = ["--certify", "--boxes", "600"] if rule == "all" else []
        assert ended([*asked, *more]) == 0
        told = json.loads(printed(capsys).out)
        shares[rule] = told["workspaces"]["wrench-feasible"]["places"]
        if more:
            proven = told["certified"]
            total = proven["inside_share"] + proven["outside_share"] + proven["open_share"]
            assert total == pytest.approx(1.0)
            assert (out / "boxes.npz").is_file()
            assert (out / "open_share.png").stat().st_size > 1000
            agreeing = told["agreement"]["grid"]
            assert agreeing["poses"] == 9 * 9 * 3
            assert agreeing["contradictions"] == 0
            assert agreeing["in_boxes_proven_inside"] + agreeing["in_boxes_proven_outside"] > 0
    assert shares["all"] < shares["any"]


def test_dynamic_visible_and_closure_kinds(tmp_path, capsys):
    out = tmp_path / "found"
    kinds = "dynamic,wrench-closure,singularity-free,collision-free,static"
    asked = [
        "workspace", "acrobot_fully_constrained", "--kind", kinds, "--acceleration", "0.5,1",
        "--velocity", "0,0,1", "--grid", "5,5,3", "--workers", "1", "--out", str(out), "--json",
        "--limits", "0.5,60",
    ]  # fmt: skip
    assert ended(asked) == 0
    told = json.loads(printed(capsys).out)["workspaces"]
    assert told["dynamic"]["poses"] <= told["static"]["poses"]
    assert set(told) == {*kinds.split(","), "all"}


def test_files_of_wrenches_and_obstacles(tmp_path, capsys):
    wrenches = tmp_path / "wrenches.yaml"
    wrenches.write_text("vertices: [[0, 0, 0, 5, 0, 0], [0, 0, 0, -5, 0, 0]]\n")
    boxes = tmp_path / "boxes.yaml"
    boxes.write_text("boxes:\n  - {pose: {position: [0.2, 0.2, 0.3]}, size: [0.2, 0.2, 0.2]}\n")
    asked = [
        "workspace", "planar", "--grid", "9,9,1", "--workers", "1", "--json", "--kind",
        "wrench-feasible,collision-free", "--wrench-set", str(wrenches), "--obstacles", str(boxes),
        "--out", str(tmp_path / "found"),
    ]  # fmt: skip
    assert ended(asked) == 0
    told = json.loads(printed(capsys).out)["workspaces"]
    assert 0 < told["collision-free"]["poses"] < 81
    assert 0 < told["wrench-feasible"]["poses"] < 81


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--kind", "statc"], ["--kind 'statc'", "static"]),
        (["--measure", "capacity"], ["--measure 'capacity'", "capacity-margin"]),
        (["--kind", "wrench-feasible"], ["wrench-feasible", "--wrench-set"]),
        (["--kind", "dynamic"], ["dynamic", "--acceleration"]),
        (["--kind", "target-visible"], ["target-visible", "--scenario"]),
        (["--orientations", "most"], ["--orientations", "all"]),
        (["--force", "inf"], ["force", "finite"]),
        (["--force", "1", "--wrench-set", "no.yaml"], ["--wrench-set", "--force"]),
        (["--wrench-set", "no.yaml"], ["no.yaml", "no such file"]),
        (["--obstacles", "no.yaml"], ["no.yaml", "no such file"]),
        (["--acceleration", "-1"], ["--acceleration"]),
        (["--velocity", "1,2"], ["--velocity", "1,2"]),
        (["--clearance", "-1"], ["--clearance"]),
        (["--measure", "payload"], ["payload", "planar"]),
        (["--hull", "0,0,0.3"], ["--hull", "planar"]),
        (["--mesh", "a.stl"], ["--mesh", "--hull"]),
        (
            ["--certify", "--kind", "static,singularity-free"],
            ["--certify", "static,singularity-free", "collision-free"],
        ),
        (["--certify", "--boxes", "0"], ["--boxes", "0"]),
        (["--certify", "--method", "closed_form"], ["--certify", "--method closed_form"]),
        (["--box", "0:1,0:1"], ["--box", "lower:upper"]),
        (["--box", "0:1,0:1,1:0"], ["--box", "1:0"]),
        (["--box", "0:1,0:1,0:inf"], ["--box", "inf"]),
        (["--box", "-1e308:1e308,0:1,0:1"], ["--box", "1e+06"]),
        (["--box", "0:1,0:1,nan:1"], ["--box", "nan"]),
        (["--box", "5:6,0:1,0:1", "--grid", "3,3,1"], ["grid", "frame of planar"]),
        (["--unbounded"], ["--unbounded", "--hull"]),
        (["--unbounded", "--hull", "0,0,0.3", "--box", "0:1,0:1,0:1"], ["--unbounded", "--box"]),
        (["--method", "closed"], ["closed", "closed_form"]),
        (["--method", "barycenter"], ["barycenter", "redundancy"]),
        (["--method", "dykstra", "--kind", "wrench-closure"], ["--method dykstra", "static"]),
        (["--refine", "0,0,0"], ["--refine", "--certify"]),
        (["--certify", "--refine", "0,0"], ["--refine", "x,y,z"]),
        (["--certify", "--refine", "0,0,0", "--refine-boxes", "0"], ["--refine-boxes", "0"]),
        (["--certify", "--refine", "0,0,0", "--refine-reach", "-1"], ["--refine-reach", "-1"]),
        (["--boxes-mesh", "a.vtu"], ["--boxes-mesh", "--certify"]),
        (["--certify", "--boxes-mesh", "a.stl"], ["a.stl", "vtu"]),
        (["--orientation", "0,0,0:10:0"], ["psi", "step"]),
        (["--orientation", "0,0"], ["--orientation"]),
        (["--orientation", "0,0,0:360:0.001"], ["--orientation", "10000"]),
        (["--mass", "0"], ["--mass"]),
        (["--workers", "0"], ["--workers"]),
    ],
)
def test_refuses_and_leaves_nothing(tmp_path, capsys, monkeypatch, more, words):
    monkeypatch.chdir(tmp_path)
    assert ended([*PLANAR, *more]) == 2
    said = printed(capsys).err
    assert said.count("\n") == 1
    assert len(said) <= 500
    for word in words:
        assert word in said
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("box: [0, 0, 0, 0, 0, 0]\n", ["no wrench but zero"]),
        ("box: [0, 0, 0, .inf, 0, 0]\n", ["box"]),
        ("vertices: []\n", ["vertices"]),
        ("verts: []\n", ["verts"]),
    ],
)
def test_refuses_sets_of_wrenches(tmp_path, capsys, monkeypatch, content, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "set.yaml").write_text(content)
    assert ended([*PLANAR, "--kind", "wrench-feasible", "--wrench-set", "set.yaml"]) == 2
    said = printed(capsys).err
    for word in ["set.yaml", *words]:
        assert word in said
    assert [path.name for path in tmp_path.iterdir()] == ["set.yaml"]


def test_a_centre_outside_the_workspace_is_told_where_one_is(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = ["workspace", "acrobot_large", "--grid", "3,3,3", "--hull", "0,0,1.19"]
    assert ended(asked) == 2
    assert "such as (" in printed(capsys).err
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(("robot", "pose"), [("acrobot_large", "0,0,0.3"), ("planar", "0.1,0,0.3")])
def test_sections_of_the_available_wrenches(tmp_path, capsys, robot, pose):
    path = tmp_path / "wrenches.png"
    assert ended(["tension", robot, "--pose", pose, "--wrench-set-plot", str(path)]) == 0
    assert path.stat().st_size > 5000


def test_a_camera_s_target_gets_to_several_processes(tmp_path, capsys):
    asked = [
        "workspace", "acrobot_small", "--kind", "target-visible", "--scenario", "acrobot_pbvs",
        "--grid", "19,15,2", "--json",
    ]  # fmt: skip
    told = []
    for workers in ("1", "2"):
        assert ended([*asked, "--workers", workers, "--out", str(tmp_path / workers)]) == 0
        told.append(json.loads(printed(capsys).out)["workspaces"])
    assert told[0] == told[1]


STATIC = [*PLANAR, "--kind", "static", "--certify", "--json"]


def test_more_boxes_continue_a_search_for_fewer(tmp_path, capsys, monkeypatch):
    """The result is the same, and what was judged is not judged again."""
    from cdpr_drake.workspaces import box_judges as module

    assert ended([*STATIC, "--boxes", "900", "--out", str(tmp_path / "whole")]) == 0
    whole = json.loads(printed(capsys).out)["certified"]
    again = tmp_path / "again"
    assert ended([*STATIC, "--boxes", "300", "--out", str(again)]) == 0
    judged, judge = [], module._judge
    monkeypatch.setattr(
        module, "_judge", lambda task, *boxes: judged.append(len(boxes[0])) or judge(task, *boxes)
    )
    printed(capsys)
    assert ended([*STATIC, "--boxes", "900", "--out", str(again)]) == 0
    assert json.loads(printed(capsys).out)["certified"] == whole
    assert sum(judged) < 900
    for name in ("poses", "halves", "verdicts"):
        both = [np.load(folder / "boxes.npz")[name] for folder in (tmp_path / "whole", again)]
        np.testing.assert_array_equal(*both)


def test_open_boxes_are_cut_further_along_a_way(tmp_path, capsys):
    corners = np.array(load_robot("planar").reach())
    words = ";".join(",".join(str(x) for x in corner) for corner in corners)
    way = ["--boxes", "900", "--refine", words, "--refine-reach", "0.01"]
    asked = [*STATIC, *way, "--refine-boxes"]
    assert ended([*asked, "800", "--out", str(tmp_path / "whole")]) == 0
    whole = json.loads(printed(capsys).out)
    more = whole["refined"]
    assert 0 < more["boxes_judged"] <= 800
    assert more["open_share_after"] < more["open_share_before"]
    assert whole["certified"]["boxes_judged"] == 900 + more["boxes_judged"]
    # Fewer, then the rest: the same boxes, of which the first are not judged again.
    again = tmp_path / "again"
    assert ended([*asked, "300", "--out", str(again)]) == 0
    assert json.loads(printed(capsys).out)["refined"]["boxes_judged"] == 300
    assert ended([*asked, "800", "--out", str(again)]) == 0
    assert json.loads(printed(capsys).out)["refined"] == more
    for name in ("poses", "halves", "verdicts"):
        both = [np.load(folder / "boxes.npz")[name] for folder in (tmp_path / "whole", again)]
        np.testing.assert_array_equal(*both)
    assert (
        ended([*STATIC, "--boxes", "90", "--refine", "9,9,9", "--out", str(tmp_path / "no")]) == 2
    )
    assert "--refine: found a way that is nowhere" in printed(capsys).err
    poses, halves, verdicts = (
        np.load(again / "boxes.npz")[name] for name in ("poses", "halves", "verdicts")
    )
    line = corners[0] + np.linspace(0.0, 1.0, 500)[:, np.newaxis] * (corners[1] - corners[0])
    within = np.abs(line[:, np.newaxis, :2] - poses[:, :2]) <= halves[:, :2]
    hit = np.any(np.all(within, axis=2), axis=0)
    sizes = np.prod(halves[:, :2], axis=1) * np.where(halves[:, 5] > 0.0, halves[:, 5], 1.0)
    open_share = np.sum(sizes[hit & (verdicts == 0)]) / np.sum(sizes[hit])
    assert open_share < more["open_share_before"]


OBSTACLES = """\
spheres: [{position: [0.1, 0.1, 0.0], radius: 0.05}]
capsules: [{start: [-0.2, 0.0, 0.0], end: [-0.2, 0.2, 0.0], radius: 0.02}]
"""


def test_several_kinds_are_proven_at_once_among_convex_obstacles(tmp_path, capsys):
    (tmp_path / "o.yaml").write_text(OBSTACLES)
    asked = [*PLANAR, "--kind", "static,collision-free", "--certify", "--json"]
    asked += ["--obstacles", str(tmp_path / "o.yaml"), "--boxes", "3000"]
    assert ended([*asked, "--out", str(tmp_path / "out")]) == 0
    told = json.loads(printed(capsys).out)
    proven = told["certified"]
    assert proven["boxes_judged"] == 3000
    assert min(proven["inside_share"], proven["outside_share"]) > 0.01
    assert told["agreement"]["grid"]["contradictions"] == 0
    assert (tmp_path / "out" / "boxes.png").is_file()
    (tmp_path / "o.yaml").write_text("spheres: [{position: [0, 0, 0], radius: 0}]\n")
    assert ended([*asked, "--out", str(tmp_path / "out2")]) == 2
    assert "spheres[0].radius" in printed(capsys).err
    assert not (tmp_path / "out2").exists()


def planar_search():
    robot = load_robot("planar")
    point = [0.0, 0.0, robot.plane_height]
    grid = grid_by_count(point, point, (1, 1, 1))
    return box_search(make_workspace_question("planar", ["static"], grid), robot)


def test_a_search_for_boxes_goes_on_after_kill(tmp_path, monkeypatch):
    """kill -9 in the middle loses seconds at most; the next search ends as one that was not."""
    script = (
        f"from tests.cli.test_cli_workspace import killed_search; killed_search({str(tmp_path)!r})"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr
    with np.load(tmp_path / "boxes_journal.npz") as stored:
        assert 0 < len(stored["verdicts"]) < 9000
    search = planar_search()
    whole, continued = certified_boxes(search, 9000), certified_boxes(search, 9000, tmp_path)
    for name in ("poses", "halves", "verdicts", "curve"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(continued, name))


def killed_search(folder):
    """Judges some boxes, and is killed; called in a process of its own."""
    # By its name: the face of the room has a function that is called as the module.
    import_module("cdpr_drake.analyses.workspaces.box_certificates").SAVE_SECONDS = 0.0

    def die(judged, share):
        if judged > 4500:
            os.kill(os.getpid(), signal.SIGKILL)

    certified_boxes(planar_search(), 9000, Path(folder), on_progress=die)


def test_a_broken_proof_is_reported_loudly(tmp_path, capsys, monkeypatch):
    """A proof that calls every box inside contradicts the grid at each pose outside."""
    from cdpr_drake.workspaces import box_judges as module

    def wrong(task, poses, halves):
        return np.full(len(poses), INSIDE), halves

    monkeypatch.setattr(module, "_judge", wrong)
    out = tmp_path / "found"
    assert ended([*STATIC, "--out", str(out)]) == 1
    said = printed(capsys)
    told = json.loads(said.out)
    outside = told["workspaces"]["static"]["of_poses"] - told["workspaces"]["static"]["poses"]
    agreeing = told["agreement"]["grid"]
    assert agreeing["contradictions"] == outside > 0
    assert len(agreeing["first_contradictions_m_rad"]) > 0
    assert "proven boxes contradict" in said.err
    assert json.loads((out / "results.json").read_text()) == told


@pytest.mark.parametrize("verdict", [INSIDE, OUTSIDE])
def test_the_ends_of_a_hull_s_rays_are_compared_with_boxes(verdict):
    robot = "acrobot_large"
    question = make_workspace_question(
        robot, ["static"], grid_by_count([0, 0, 0.3], [0, 0, 0.3], (1, 1, 1))
    )
    loaded = load_robot(robot)
    hull = question_hull(question, loaded, np.array([0.0, 0.0, 0.3]), 200)
    found = certified_boxes(box_search(question, loaded), 4000)
    fine = hull_agreement(found, hull, np.zeros(3))
    assert fine.poses > 20
    assert fine.inside == fine.outside == 0
    broken = replace(found, verdicts=np.full(len(found.verdicts), verdict))
    bad = hull_agreement(broken, hull, np.zeros(3))
    assert len(bad.broken) > 0.8 * bad.poses


def test_hull_and_boxes_as_files_of_vtk(tmp_path, capsys):
    meshio = pytest.importorskip("meshio")
    out, hull, boxes = tmp_path / "found", tmp_path / "hull.vtk", tmp_path / "boxes.vtu"
    asked = [
        "workspace", "acrobot_large", "--grid", "3,3,3", "--workers", "1", "--hull", "0,0,0.3",
        "--rays", "300", "--mesh", str(hull), "--certify", "--boxes", "2000", "--boxes-mesh",
        str(boxes), "--out", str(out), "--json",
    ]  # fmt: skip
    assert ended(asked) == 0
    told = json.loads(printed(capsys).out)
    mesh = meshio.read(hull)
    a, b, c = (mesh.points[mesh.cells_dict["triangle"][:, k]] for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert volume == pytest.approx(told["hull"]["volume_m3"])
    mesh = meshio.read(boxes)
    corners = mesh.points[mesh.cells_dict["hexahedron"]]
    volumes = np.prod(np.ptp(corners, axis=1), axis=1)
    inside = mesh.cell_data["verdict"][0] == INSIDE
    assert volumes[inside].sum() / volumes.sum() == pytest.approx(told["certified"]["inside_share"])
    assert (out / "workspace.html").stat().st_size > 100_000
