"""`cdpr workspace`: what it writes and prints of hulls, proofs and axes, and how it goes on."""

import json

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.workspaces.workspace_result import load_workspace
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.proofs import box_judges
from cdpr_drake.proofs.box_expansion_kernel import INSIDE
from tests.cli.commands import answer, run, told
from tests.cli.conftest import only
from tests.motion.small_robots import content

pytestmark = pytest.mark.usefixtures("here")

ONE = ("--workers", "1")
PLANAR = ("workspace", "planar", "--grid", "5,5,1", *ONE)
STATIC = (*PLANAR, "--kind", "static", "--certify")


def test_kinds_measures_and_hull_of_one_robot(capsys, here):
    meshio = pytest.importorskip("meshio")
    asked = (
        "workspace", "acrobot_large", "--kind", "static,statically-stable", "--measure",
        "capacity-margin,clearance", "--grid", "5,5,2", *ONE, "--out", "found",
    )  # fmt: skip
    found = told(capsys, *asked, "--hull", "0,0,0.3", "--rays", "300", "--mesh", "hull.vtk")
    assert {"static", "statically-stable", "all"} == set(found["workspaces"])
    assert 0.1 < found["workspaces"]["all"]["pose_share"] < 1.0
    assert found["measured"]["capacity-margin"]["least"] >= 0.0
    assert 0.3 < found["hull"]["volume_m3"] < 1.728
    for name in ("planes.png", "capacity-margin.png", "clearance.png", "workspace.html"):
        assert (here / "found" / name).stat().st_size > 1000
    stored = load_workspace(here / "found")
    margins = stored.values["capacity-margin"]
    np.testing.assert_array_equal(margins >= 0.0, stored.holds["static"])
    mesh = meshio.read("hull.vtk")
    a, b, c = (mesh.points[mesh.cells_dict["triangle"][:, k]] for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert volume == pytest.approx(found["hull"]["volume_m3"])
    with only("boxes.png"):
        code, said, err = run(capsys, *asked)
    assert (code, "reused the grid of found" in err) == (0, True)
    assert "statically-stable" in said
    assert "grid: 5 x 5 x 2 positions, from (-0.48, -0.48, 0)" in said
    assert "axes" not in said  # which are mentioned where they are out of the ordinary


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


@pytest.mark.usefixtures("without_pictures")
def test_boxes_as_a_file_of_vtk(capsys):
    meshio = pytest.importorskip("meshio")
    found = told(
        capsys, "workspace", "acrobot_large", "--grid", "2,2,2", *ONE, "--certify", "--boxes",
        "1000", "--boxes-mesh", "boxes.vtu",
    )  # fmt: skip
    mesh = meshio.read("boxes.vtu")
    corners = mesh.points[mesh.cells_dict["hexahedron"]]
    volumes = np.prod(np.ptp(corners, axis=1), axis=1)
    inside = mesh.cell_data["verdict"][0] == INSIDE
    share = volumes[inside].sum() / volumes.sum()
    assert share == pytest.approx(found["certified"]["inside_share"])


@pytest.mark.usefixtures("without_pictures")
def test_open_boxes_are_cut_further_along_a_way(capsys, here):
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
    for name in ("poses", "halves", "verdicts"):
        both = [np.load(here / folder / "boxes.npz")[name] for folder in ("whole", "again")]
        np.testing.assert_array_equal(*both)
    code, _, err = run(capsys, *STATIC, "--boxes", "90", "--refine", "9,9,9", "--out", "no")
    assert (code, "--refine: found a way that is nowhere" in err) == (2, True)


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


def test_what_is_out_of_the_ordinary_is_said_on_the_page_and_in_words(capsys, here):
    """Axes of which gravity is not -z, and pulleys, which were left out and nothing said so."""
    body = content("upright_body", gravity_direction=[0.5, 0.0, -1.0])
    (here / "tilted.yaml").write_text(yaml.safe_dump(body), encoding="utf-8")
    axes = (
        "those of W, which was not turned; the weight pulls along (0.447214, 0, -0.894427), "
        "26.57 deg off -z"
    )
    for robot, grid, more, words, title in (
        ("tilted.yaml", "3,1,3", (), axes, axes),
        ("caroca", "3,3,3", (), "with pulleys of 75 mm", "workspaces, with pulleys"),
        ("caroca", "3,3,3", ("--no-pulleys",), "pulleys ignored", "workspaces, pulleys ignored"),
    ):
        asked = ("workspace", robot, "--grid", grid, *ONE, *more, "--out", "found", "--overwrite")
        with only("workspace.html"):
            assert words in " ".join(answer(capsys, *asked).split())
        kept = json.loads((here / "found" / "results.json").read_text())
        assert words in (kept["axes"], kept["geometry"], kept["cables"])
        assert title in (here / "found" / "workspace.html").read_text(encoding="utf-8")
