"""`cdpr workspace`: what it writes and prints, by which model and method, and how it continues."""

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

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.workspaces.box_certificates import box_search, certified_boxes
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions, static_case
from cdpr_drake.analyses.workspaces.workspace_hulls import robot_hull
from cdpr_drake.analyses.workspaces.workspace_result import load_workspace
from cdpr_drake.models.robot_exchange import import_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.workspaces import box_judges
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, OUTSIDE
from cdpr_drake.workspaces.box_grid_agreement import hull_agreement
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from tests.cli.commands import answer, run, told
from tests.cli.conftest import only
from tests.models.formats import foreign_files

pytestmark = pytest.mark.usefixtures("here")

ROOT = Path(__file__).parents[2]
ONE = ("--workers", "1")
PLANAR = ("workspace", "planar", "--grid", "5,5,1", *ONE)


def test_kinds_measures_and_hull_of_one_robot(capsys, here):
    out = here / "found"
    asked = (
        "workspace", "acrobot_large", "--kind", "static,statically-stable", "--measure",
        "capacity-margin,clearance", "--grid", "5,5,2", *ONE, "--out", out,
    )  # fmt: skip
    found = told(capsys, *asked, "--hull", "0,0,0.3", "--rays", "300")
    assert json.loads((out / "results.json").read_text()) == found
    assert {"static", "statically-stable", "all"} == set(found["workspaces"])
    assert 0.1 < found["workspaces"]["all"]["pose_share"] < 1.0
    assert found["measured"]["capacity-margin"]["least"] >= 0.0
    assert 0.3 < found["hull"]["volume_m3"] < 1.728
    pictures = ("planes.png", "capacity-margin.png", "clearance.png", "workspace.html")
    for name in (*pictures, "hull.npz"):
        assert (out / name).stat().st_size > 1000
    stored = load_workspace(out)
    margins = stored.values["capacity-margin"]
    np.testing.assert_array_equal(margins >= 0.0, stored.holds["static"])
    with only("boxes.png"):
        code, said, err = run(capsys, *asked)
    assert (code, "reused the grid of found" in err) == (0, True)
    assert "statically-stable" in said
    assert "grid: 5 x 5 x 2 positions, from (-0.48, -0.48, 0)" in said


def test_a_planar_robot_with_certified_boxes_and_a_range_of_turns(capsys, here):
    shares = {}
    for rule in ("all", "any"):
        asked = (
            *PLANAR, "--kind", "wrench-feasible", "--force", "1", "--orientation", "0,0,-20:20:20",
            "--orientations", rule, "--out", rule,
        )  # fmt: skip
        more = ("--certify", "--boxes", "300") if rule == "all" else ()
        with only("open_share.png"):
            found = told(capsys, *asked, *more)
        shares[rule] = found["workspaces"]["wrench-feasible"]["places"]
        if more:
            proven = found["certified"]
            total = proven["inside_share"] + proven["outside_share"] + proven["open_share"]
            assert total == pytest.approx(1.0)
            assert (here / rule / "boxes.npz").is_file()
            assert (here / rule / "open_share.png").stat().st_size > 1000
            agreeing = found["agreement"]["grid"]
            assert agreeing["poses"] == 5 * 5 * 3
            assert agreeing["contradictions"] == 0
            assert agreeing["in_boxes_proven_inside"] + agreeing["in_boxes_proven_outside"] > 0
    assert shares["all"] < shares["any"]


@pytest.mark.parametrize(("robot", "pose"), [("acrobot_large", "0,0,0.3"), ("planar", "0.1,0,0.3")])
def test_sections_of_the_available_wrenches(capsys, here, robot, pose):
    answer(capsys, "tension", robot, "--pose", pose, "--plot", "wrenches=wrenches.png")
    assert (here / "wrenches.png").stat().st_size > 5000


@pytest.mark.usefixtures("without_pictures")
def test_a_camera_s_target_gets_to_several_processes(capsys):
    asked = (
        "workspace", "acrobot_small", "--kind", "target-visible", "--scenario", "acrobot_pbvs",
        "--grid", "19,15,2",
    )  # fmt: skip
    one, two = (
        told(capsys, *asked, "--workers", workers, "--out", workers)["workspaces"]
        for workers in ("1", "2")
    )
    assert one == two


STATIC = (*PLANAR, "--kind", "static", "--certify")


def same_boxes(one, other):
    for name in ("poses", "halves", "verdicts"):
        both = [np.load(Path(folder, "boxes.npz"))[name] for folder in (one, other)]
        np.testing.assert_array_equal(*both)


@pytest.mark.usefixtures("without_pictures")
def test_more_boxes_continue_a_search_for_fewer(capsys, monkeypatch):
    """The result is the same, and what was judged is not judged again."""
    whole = told(capsys, *STATIC, "--boxes", "300", "--out", "whole")["certified"]
    answer(capsys, *STATIC, "--boxes", "100", "--out", "again")
    judged, judge = [], box_judges._judge
    monkeypatch.setattr(
        box_judges, "_judge",
        lambda task, *boxes: judged.append(len(boxes[0])) or judge(task, *boxes),
    )  # fmt: skip
    again = told(capsys, *STATIC, "--boxes", "300", "--out", "again")["certified"]
    assert again == whole
    assert sum(judged) < 300
    same_boxes("whole", "again")


@pytest.mark.usefixtures("without_pictures")
def test_open_boxes_are_cut_further_along_a_way(capsys):
    corners = np.array(load_robot("planar").reach())
    words = ";".join(",".join(str(x) for x in corner) for corner in corners)
    asked = (*STATIC, "--boxes", "300", "--refine", words, "--refine-reach", "0.01")
    asked += ("--refine-boxes",)
    whole = told(capsys, *asked, "300", "--out", "whole")
    more = whole["refined"]
    assert 0 < more["boxes_judged"] <= 300
    assert more["open_share_after"] < more["open_share_before"]
    assert whole["certified"]["boxes_judged"] == 300 + more["boxes_judged"]
    # Fewer, then the rest: the same boxes, of which the first are not judged again.
    assert told(capsys, *asked, "100", "--out", "again")["refined"]["boxes_judged"] == 100
    assert told(capsys, *asked, "300", "--out", "again")["refined"] == more
    same_boxes("whole", "again")
    code, _, err = run(capsys, *STATIC, "--boxes", "90", "--refine", "9,9,9", "--out", "no")
    assert (code, "--refine: found a way that is nowhere" in err) == (2, True)
    poses, halves, verdicts = (
        np.load("again/boxes.npz")[name] for name in ("poses", "halves", "verdicts")
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


def test_several_kinds_are_proven_at_once_among_convex_obstacles(capsys, here):
    (here / "o.yaml").write_text(OBSTACLES)
    asked = (*PLANAR, "--kind", "static,collision-free", "--certify", "--obstacles", "o.yaml")
    with only("boxes.png"):
        found = told(capsys, *asked, "--boxes", "1000", "--out", "out")
    proven = found["certified"]
    assert proven["boxes_judged"] == 1000
    assert min(proven["inside_share"], proven["outside_share"]) > 0.01
    assert found["agreement"]["grid"]["contradictions"] == 0
    assert (here / "out" / "boxes.png").is_file()


def planar_search():
    robot = load_robot("planar")
    return box_search(robot, pose_conditions(robot), ["static"], np.zeros((1, 3)))


MOST = 1500
"""Boxes of a search that is killed half way."""


def test_a_search_for_boxes_goes_on_after_kill(tmp_path):
    """kill -9 in the middle loses seconds at most; the next search ends as one that was not."""
    script = "from tests.cli.test_cli_workspace import killed_search as s; s"
    words = [sys.executable, "-c", f"{script}({str(tmp_path / 'out')!r})"]
    done = subprocess.run(words, capture_output=True, check=False, cwd=ROOT)
    assert done.returncode == -signal.SIGKILL, done.stderr
    with np.load(tmp_path / "out" / "boxes_journal.npz") as stored:
        assert 0 < len(stored["verdicts"]) < MOST
    search = planar_search()
    with Folder(tmp_path / "out", {"boxes": True}) as folder:
        whole, continued = certified_boxes(search, MOST), certified_boxes(search, MOST, folder)
    for name in ("poses", "halves", "verdicts", "curve"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(continued, name))


def killed_search(folder):
    """Judges some boxes, and is killed; called in a process of its own."""
    # By its name: the face of the room has a function that is called as the module.
    import_module("cdpr_drake.analyses.workspaces.box_certificates").SAVE_SECONDS = 0.0

    def die(judged, share):
        if judged > MOST / 2:
            os.kill(os.getpid(), signal.SIGKILL)

    with Folder(Path(folder), {"boxes": True}) as kept:
        certified_boxes(planar_search(), MOST, kept, on_progress=die)


@pytest.mark.usefixtures("without_pictures")
def test_a_broken_proof_is_reported_loudly(capsys, here, monkeypatch):
    """A proof that calls every box inside contradicts the grid at each pose outside."""

    def wrong(task, poses, halves):
        return np.full(len(poses), INSIDE), halves

    monkeypatch.setattr(box_judges, "_judge", wrong)
    code, out, err = run(capsys, *STATIC, "--out", "found", "--json")
    assert code == 1
    found = json.loads(out)
    outside = found["workspaces"]["static"]["of_poses"] - found["workspaces"]["static"]["poses"]
    agreeing = found["agreement"]["grid"]
    assert agreeing["contradictions"] == outside > 0
    assert len(agreeing["first_contradictions_m_rad"]) > 0
    assert "proven boxes contradict" in err
    assert json.loads((here / "found" / "results.json").read_text()) == found


@pytest.fixture(scope="module")
def hull_and_boxes():
    """Of ACROBOT."""
    robot = load_robot("acrobot_large")
    about = pose_conditions(robot)
    hull = robot_hull(robot, about, ["static"], (0.0, 0.0, 0.3), rays=200)
    return hull, certified_boxes(box_search(robot, about, ["static"], np.zeros((1, 3))), 4000)


@pytest.mark.parametrize("verdict", [INSIDE, OUTSIDE])
def test_the_ends_of_a_hull_s_rays_are_compared_with_boxes(hull_and_boxes, verdict):
    hull, found = hull_and_boxes
    fine = hull_agreement(found, hull, np.zeros(3))
    assert fine.poses > 20
    assert fine.inside == fine.outside == 0
    broken = replace(found, verdicts=np.full(len(found.verdicts), verdict))
    bad = hull_agreement(broken, hull, np.zeros(3))
    assert len(bad.broken) > 0.8 * bad.poses


@pytest.mark.usefixtures("without_pictures")
def test_hull_and_boxes_as_files_of_vtk(capsys):
    meshio = pytest.importorskip("meshio")
    found = told(
        capsys, "workspace", "acrobot_large", "--grid", "3,3,3", *ONE, "--hull", "0,0,0.3",
        "--rays", "300", "--mesh", "hull.vtk", "--certify", "--boxes", "1000",
        "--boxes-mesh", "boxes.vtu",
    )  # fmt: skip
    mesh = meshio.read("hull.vtk")
    a, b, c = (mesh.points[mesh.cells_dict["triangle"][:, k]] for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert volume == pytest.approx(found["hull"]["volume_m3"])
    mesh = meshio.read("boxes.vtu")
    corners = mesh.points[mesh.cells_dict["hexahedron"]]
    volumes = np.prod(np.ptp(corners, axis=1), axis=1)
    inside = mesh.cell_data["verdict"][0] == INSIDE
    share = volumes[inside].sum() / volumes.sum()
    assert share == pytest.approx(found["certified"]["inside_share"])


def test_pulleys_are_in_grid_and_proof_and_said_first(capsys, here):
    """They were left out, grid and boxes, and nothing said so."""
    found, holds = [], []
    for k, more in enumerate(((), ("--no-pulleys",))):
        asked = ("workspace", "caroca", "--grid", "7,7,5", *ONE, "--certify", "--boxes", "1500")
        with only("workspace.html"):
            one = told(capsys, *asked, "--limits", "30,10000", "--out", f"{k}", *more)
        found.append(one)
        holds.append(load_workspace(here / f"{k}").holds["static"])
        assert next(iter(one)) == "cables"
        assert one["agreement"]["grid"]["contradictions"] == 0
        assert one["agreement"]["grid"]["in_boxes_proven_inside"] > 0
        page = (here / f"{k}" / "workspace.html").read_text()
        assert f"caroca: workspaces, {one['geometry']}" in page
    assert [(one["cables"], one["geometry"], one["certified"]["cables"]) for one in found] == [
        ("over pulleys", "with pulleys of 75 mm", "over pulleys"),
        ("without pulleys: from fixed exit points", "pulleys ignored", "from fixed exit points"),
    ]
    case = static_case(load_robot("caroca"), (30.0, 10_000.0), pulleys=True)
    grid = load_workspace(here / "0").grid
    feasible = statically_feasible(case, grid.positions(), grid.rotations())
    np.testing.assert_array_equal(holds[0].ravel(), feasible)
    assert np.any(holds[0] != holds[1])


@pytest.mark.usefixtures("without_pictures")
def test_an_assumed_frame_bounds_no_hull(capsys, here):
    """Of an imported robot it was the box of the exit points, and rays ended there."""
    (here / "source").mkdir()
    text = import_robot(foreign_files.wirex(here / "source")).yaml()
    (here / "toy.yaml").write_text(text)
    robot = load_robot(here / "toy.yaml")
    assert robot.frame.assumed
    (here / "given.yaml").write_text(text.replace("  assumed: true\n", ""))
    small = robot.home.position[:, np.newaxis] + 0.1 * np.array([-1.0, 1.0])
    box = ",".join(f"{low:.6f}:{high:.6f}" for low, high in small)
    hulls = {}
    for name, file, more in (
        ("assumed", "toy.yaml", ()),
        ("given", "given.yaml", ()),
        ("unbounded", "given.yaml", ("--unbounded",)),
        ("box", "toy.yaml", ("--box", box)),
    ):
        code, out, err = run(
            capsys, "workspace", file, "--grid", "3,3,3", *ONE,
            "--hull", ",".join(f"{x:g}" for x in robot.home.position), "--rays", "100",
            "--limits", "0,5000", "--mass", "0.1", "--json", "--out", name, *more,
        )  # fmt: skip
        assert code == 0
        hulls[name] = json.loads(out)["hull"]
        assert ("frame was assumed" in err) == (name == "assumed")
    assert [one["bounded_by"] for one in hulls.values()] == ["nothing", "frame", "nothing", "box"]
    assert hulls["assumed"]["volume_m3"] == hulls["unbounded"]["volume_m3"]
    assert hulls["assumed"]["volume_m3"] > 1.01 * hulls["given"]["volume_m3"]
    assert hulls["given"]["rays_to_the_bound"] > 0
    assert hulls["box"]["volume_m3"] == pytest.approx(0.2**3, rel=0.2)
    beyond = ("--grid", "2,2,2", "--box", "9:10,9:10,9:10", *ONE)
    assert told(capsys, "workspace", "toy.yaml", *beyond)["workspaces"]["static"]["poses"] == 0
    grid = load_workspace(here / "box").grid
    for axis, (low, high) in zip(grid.axes, small, strict=True):
        np.testing.assert_allclose(axis[[0, -1]], (low, high), atol=1e-5)


@pytest.mark.usefixtures("without_pictures")
def test_a_method_that_misses_tensions_has_a_smaller_workspace(capsys):
    shares = {}
    for method in (None, "quadratic_program", "closed_form"):
        more = () if method is None else ("--method", method)
        found = told(capsys, "workspace", "acrobot_large", "--grid", "9,9,5", *ONE, *more)
        assert found["method"] == method
        shares[method] = found["workspaces"]["static"]["pose_share"]
    assert shares[None] == shares["quadratic_program"] > shares["closed_form"] > 0.0
