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
    asked = (
        "workspace", "acrobot_large", "--kind", "static,statically-stable", "--measure",
        "capacity-margin,clearance", "--grid", "5,5,2", *ONE, "--out", "found",
    )  # fmt: skip
    found = told(capsys, *asked, "--hull", "0,0,0.3", "--rays", "300")
    assert {"static", "statically-stable", "all"} == set(found["workspaces"])
    assert 0.1 < found["workspaces"]["all"]["pose_share"] < 1.0
    assert found["measured"]["capacity-margin"]["least"] >= 0.0
    assert 0.3 < found["hull"]["volume_m3"] < 1.728
    for name in ("planes.png", "capacity-margin.png", "clearance.png", "workspace.html"):
        assert (here / "found" / name).stat().st_size > 1000
    stored = load_workspace(here / "found")
    margins = stored.values["capacity-margin"]
    np.testing.assert_array_equal(margins >= 0.0, stored.holds["static"])
    with only("boxes.png"):
        code, said, err = run(capsys, *asked)
    assert (code, "reused the grid of found" in err) == (0, True)
    assert "statically-stable" in said
    assert "grid: 5 x 5 x 2 positions, from (-0.48, -0.48, 0)" in said


def test_a_planar_robot_with_certified_boxes_and_a_range_of_turns(capsys, here):
    asked = (
        *PLANAR, "--kind", "wrench-feasible", "--force", "1", "--orientation", "0,0,-20:20:20",
        "--orientations",
    )  # fmt: skip
    with only("open_share.png", "boxes.png"):
        every = told(capsys, *asked, "all", "--certify", "--boxes", "300", "--out", "all")
        some = told(capsys, *asked, "any", "--out", "any")
    shares = [found["workspaces"]["wrench-feasible"]["places"] for found in (every, some)]
    assert shares[0] < shares[1]
    proven = every["certified"]
    total = proven["inside_share"] + proven["outside_share"] + proven["open_share"]
    assert total == pytest.approx(1.0)
    for name in ("open_share.png", "boxes.png"):
        assert (here / "all" / name).stat().st_size > 1000
    agreement = every["agreement"]["grid"]
    assert (agreement["poses"], agreement["contradictions"]) == (5 * 5 * 3, 0)
    assert agreement["in_boxes_proven_inside"] + agreement["in_boxes_proven_outside"] > 0


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
    asked = ("workspace", "caroca", "--grid", "7,7,5", *ONE, "--certify", "--boxes", "1500")
    words = {
        "over": ("over pulleys", "with pulleys of 75 mm", "over pulleys"),
        "without": (
            "without pulleys: from fixed exit points", "pulleys ignored", "from fixed exit points",
        ),
    }  # fmt: skip
    for name, more in (("over", ()), ("without", ("--no-pulleys",))):
        with only("workspace.html"):
            found = told(capsys, *asked, "--limits", "30,10000", "--out", name, *more)
        assert next(iter(found)) == "cables"
        certified = found["certified"]["cables"]
        assert (found["cables"], found["geometry"], certified) == words[name]
        assert found["agreement"]["grid"]["contradictions"] == 0
        assert found["agreement"]["grid"]["in_boxes_proven_inside"] > 0
        page = (here / name / "workspace.html").read_text()
        assert f"caroca: workspaces, {found['geometry']}" in page
    over, without = (load_workspace(here / name) for name in words)
    case = static_case(load_robot("caroca"), (30.0, 10_000.0), pulleys=True)
    feasible = statically_feasible(case, over.grid.positions(), over.grid.rotations())
    np.testing.assert_array_equal(over.holds["static"].ravel(), feasible)
    assert np.any(over.holds["static"] != without.holds["static"])


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
    asked = (
        "--grid", "3,3,3", *ONE, "--hull", ",".join(f"{x:g}" for x in robot.home.position),
        "--rays", "100", "--limits", "0,5000", "--mass", "0.1", "--json",
    )  # fmt: skip
    hulls = {}
    for name, file, more, bound in (
        ("assumed", "toy.yaml", (), "nothing"), ("given", "given.yaml", (), "frame"),
        ("unbounded", "given.yaml", ("--unbounded",), "nothing"),
        ("box", "toy.yaml", ("--box", box), "box"),
    ):  # fmt: skip
        code, out, err = run(capsys, "workspace", file, *asked, "--out", name, *more)
        assert code == 0
        hulls[name] = json.loads(out)["hull"]
        assert hulls[name]["bounded_by"] == bound
        assert ("frame was assumed" in err) == (name == "assumed")
    volumes = {name: hull["volume_m3"] for name, hull in hulls.items()}
    assert volumes["assumed"] == volumes["unbounded"] > 1.01 * volumes["given"]
    assert hulls["given"]["rays_to_the_bound"] > 0
    assert volumes["box"] == pytest.approx(0.2**3, rel=0.2)
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
