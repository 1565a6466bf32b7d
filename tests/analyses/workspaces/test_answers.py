"""Workspaces by a linear programme, by proofs, over pulleys, without a frame, and by method."""

import pickle
import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import yaml
from scipy.optimize import linprog

import cdpr_drake as cdpr
from cdpr_drake.analyses.workspaces.conditions import conditions_at
from cdpr_drake.analyses.workspaces.robot_conditions import (
    grid_conditions,
    pose_conditions,
    static_case,
)
from cdpr_drake.analyses.workspaces.workspace_hulls import robot_hull
from cdpr_drake.formats.robot_exchange import import_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.proofs import certified_workspace
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, OUTSIDE
from cdpr_drake.proofs.box_grid_agreement import hull_agreement
from cdpr_drake.proofs.certified_workspace import box_search, certified_boxes
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from tests.cli.commands import STORE_ARRAYS, ended, killed_after
from tests.cli.conftest import only
from tests.models.formats import foreign_files
from tests.motion.small_robots import content


def workspace(robot, grid, **options):
    return cdpr.compute_workspace(robot, grid=grid, workers=1, **options)


def agreement(found):
    return found.as_dict()["agreement"]["grid"]


DOWN = np.array([0.5, 0.0, -1.0]) / np.sqrt(1.25)
"""Gravity 26.6 deg off -z, in the plane xz."""


def held(robot, position, gravity):
    """Whether tensions hold the level platform there: a linear programme, by hand."""
    A, B = robot.exit_points() - np.array(position)[:, np.newaxis], robot.anchor_points()
    u = (A - B) / np.linalg.norm(A - B, axis=0)
    force = robot.platform.mass * gravity
    W = np.array([np.cross(B.T, u.T)[:, 1], u[0], u[2]])
    moment = np.cross(robot.center_of_mass(), force)[1]
    found = linprog(
        np.zeros(4), A_eq=W, b_eq=-np.array([moment, force[0], force[2]]), bounds=[(0.0, 40.0)] * 4
    )
    return found.status == 0


def test_verdicts_and_proofs_are_those_of_a_tilted_weight(tmp_path):
    body = content("upright_body", gravity_direction=[0.5, 0.0, -1.0])
    body["platform"] = body["platform"] | {"center_of_mass": [0.05, 0.0, 0.04]}
    body["tension_bounds"] = {"lower": 0.0, "upper": 40.0}
    (tmp_path / "robot.yaml").write_text(yaml.safe_dump(body), encoding="utf-8")
    robot = load_robot(tmp_path / "robot.yaml")
    found = workspace(robot, (7, 1, 7), measures="payload", certify=True, boxes=1500)
    places = found.places("static")
    verdicts, upright = (
        np.array([
            [held(robot, (x, robot.home.position[1], z), g) for z in found.grid.axes[2]]
            for x in found.grid.axes[0]
        ])
        for g in (9.81 * DOWN, np.array([0.0, 0.0, -9.81]))
    )  # fmt: skip
    np.testing.assert_array_equal(places[:, 0], verdicts)
    assert 5 < np.count_nonzero(places) < 44
    assert np.any(upright != verdicts)
    assert np.count_nonzero(np.isfinite(found.values["payload"])) == np.count_nonzero(places)
    agreed = agreement(found)
    assert agreed["contradictions"] == 0
    assert agreed["in_boxes_proven_inside"] > 3
    assert agreed["in_boxes_proven_outside"] > 3
    assert found.as_dict()["statics"]["down"] == pytest.approx(DOWN)


def test_a_robot_of_grab_whose_frame_leans_by_a_degree(tmp_path):
    path = foreign_files.grab_on_board(tmp_path)
    text, radius = path.read_text(), f'"radius": {foreign_files.RADIUS}'
    leaning = foreign_files.column([np.sin(np.radians(1.0)), 0.0, np.cos(np.radians(1.0))])
    assert text.count('"gravity_axis": [[0], [0], [1]]') == 1
    assert radius in text
    path.write_text(text.replace(radius, '"radius": 0').replace("[[0], [0], [1]]", leaning))
    found = workspace(path, (3, 3, 3)).as_dict()
    assert found["workspaces"]["static"]["pose_share"] > 0.0
    assert found["axes"].endswith("1 deg off -z")


def test_a_level_plane_carries_what_of_the_weight_is_across_it(tmp_path):
    """In a level plane nothing but the part of the weight along it can be lifted."""
    for direction in ([0.1, 0.0, -1.0], [0.0, 0.0, -1.0]):
        body = content("level_point", gravity_direction=direction)
        (tmp_path / "robot.yaml").write_text(yaml.safe_dump(body))
        robot = load_robot(tmp_path / "robot.yaml")
        if direction[0]:
            assert workspace(robot, (5, 5, 1), measures="payload").values["payload"].size == 25
        else:
            with pytest.raises(cdpr.CdprError, match="whose plane carries the weight"):
                workspace(robot, (5, 5, 1), measures="payload")


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


def test_pulleys_are_in_grid_and_proof():
    limits = (30.0, 10_000.0)
    over, without = (
        workspace("caroca", (7, 7, 5), certify=True, boxes=1500, limits=limits, pulleys=pulleys)
        for pulleys in (True, False)
    )
    for found, words in ((over, "over pulleys"), (without, "from fixed exit points")):
        assert agreement(found)["contradictions"] == 0
        assert agreement(found)["in_boxes_proven_inside"] > 0
        assert found.as_dict()["certified"]["cables"] == words
    case = static_case(load_robot("caroca"), limits, pulleys=True)
    feasible = statically_feasible(case, over.grid.positions(), over.grid.rotations())
    np.testing.assert_array_equal(over.holds["static"].ravel(), feasible)
    assert np.any(over.holds["static"] != without.holds["static"])


def test_an_assumed_frame_bounds_no_hull(tmp_path):
    """Of an imported robot it was the box of the exit points, and rays ended there."""
    (tmp_path / "source").mkdir()
    text = import_robot(foreign_files.wirex(tmp_path / "source")).yaml()
    (tmp_path / "toy.yaml").write_text(text)
    (tmp_path / "given.yaml").write_text(text.replace("  assumed: true\n", ""))
    toy, given = (load_robot(tmp_path / name) for name in ("toy.yaml", "given.yaml"))
    assert toy.frame.assumed
    low, high = toy.home.position - 0.1, toy.home.position + 0.1
    found = {
        name: workspace(
            robot, (3, 3, 3), hull=toy.home.position, rays=100, limits=(0.0, 5000.0), mass=0.1,
            **more,
        )
        for name, robot, more in (
            ("assumed", toy, {}), ("given", given, {}), ("unbounded", given, {"unbounded": True}),
            ("box", toy, {"box": (low, high)}),
        )
    }  # fmt: skip
    hulls = {name: each.as_dict()["hull"] for name, each in found.items()}
    assert {name: hull["bounded_by"] for name, hull in hulls.items()} == {
        "assumed": "nothing", "given": "frame", "unbounded": "nothing", "box": "box",
    }  # fmt: skip
    volumes = {name: hull["volume_m3"] for name, hull in hulls.items()}
    assert volumes["assumed"] == volumes["unbounded"] > 1.01 * volumes["given"]
    assert hulls["given"]["rays_to_the_bound"] > 0
    assert volumes["box"] == pytest.approx(0.2**3, rel=0.2)
    for axis, *ends in zip(found["box"].grid.axes, low, high, strict=True):
        np.testing.assert_allclose(axis[[0, -1]], ends, atol=1e-5)
    assert not np.any(workspace(toy, (2, 2, 2), box=([9.0] * 3, [10.0] * 3)).inside("static"))


def test_a_method_that_misses_tensions_has_a_smaller_workspace():
    shares = {
        method: workspace("acrobot_large", (9, 9, 5), method=method).inside("static").mean()
        for method in (None, "quadratic_program", "closed_form")
    }
    assert shares[None] == shares["quadratic_program"] > shares["closed_form"] > 0.0


def test_a_camera_s_target_gets_to_other_processes():
    grid = workspace("acrobot_small", (5, 4, 2)).grid
    kinds = ("target-visible",)
    about = grid_conditions("acrobot_small", kinds, (), grid, "acrobot_pbvs")
    work = partial(conditions_at, about, grid, kinds)
    here, there = (
        each((0, grid.size))[kinds[0]] for each in (work, pickle.loads(pickle.dumps(work)))
    )
    np.testing.assert_array_equal(here, there)
    assert 0 < np.count_nonzero(here) < grid.size


BOXES = (
    "workspace", "planar", "--grid", "2,2,1", "--certify", "--boxes", "1500", "--refine",
    "0.5,0.5,0.3;0,0.5,0.3", "--refine-boxes", "300", "--workers", "1",
)  # fmt: skip
"""A command whose grid is written twice, then a journal each time that boxes were judged."""

AT_ONCE = """
from cdpr_drake.proofs import certified_workspace
certified_workspace.SAVE_SECONDS = 0.0
"""


@pytest.mark.parametrize(
    ("writes", "name", "function"), [(11, "boxes", "certify"), (20, "refined", "refine")]
)
def test_a_killed_search_for_boxes_goes_on_to_the_same_bytes(
    tmp_path, monkeypatch, writes, name, function
):
    """By SIGKILL, when the grid and some boxes are kept."""
    monkeypatch.chdir(tmp_path)
    Path("killed.py").write_text(killed_after(writes, STORE_ARRAYS, AT_ONCE))
    words = [sys.executable, "killed.py", *BOXES, "--out", "killed"]
    assert subprocess.run(words, check=False).returncode == -signal.SIGKILL
    with np.load(f"killed/{name}_journal.npz") as journal:
        judged = len(journal["verdicts"])
    assert not Path("killed/boxes.npz").exists()
    spy = Mock(wraps=getattr(certified_workspace, function))
    monkeypatch.setattr(certified_workspace, function, spy)
    with only():
        assert [ended(*BOXES, "--out", folder) for folder in ("killed", "whole")] == [0, 0]
    known = [call.kwargs["known"] for call in spy.call_args_list]
    assert len(known[0].arrays()[0]) == judged
    assert known[1] is None
    killed, whole = (
        {path.name: path.read_bytes() for path in Path(folder).glob("[!.]*")}
        for folder in ("killed", "whole")
    )
    assert {"boxes.npz", "results.json", f"{name}_journal.npz"} <= {*whole}
    assert killed == whole
