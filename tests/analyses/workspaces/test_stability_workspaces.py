"""Workspaces of stability: single poses, order, storage, continuation, figures and scene."""

import json

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.workspaces.stability_figures import curves, stability_pictures
from cdpr_drake.analyses.workspaces.stability_question import CameraTask, make_question, varied
from cdpr_drake.analyses.workspaces.stability_results import (
    CHUNK_POSES,
    load_workspaces,
    stability_workspaces,
)
from cdpr_drake.analyses.workspaces.stability_scene import workspace_html
from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.errors import CdprError, DataFileError, OutputFolderError, StabilityError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import BASELINE, PerturbationBounds
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.problem import TensionStatus
from cdpr_drake.workspaces.pose_grid import grid_by_count

OPTIONS = VerdictOptions(draws=20, seed=3)
TURNS = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]]


def question(**changes):
    grid = grid_by_count([-0.45, -0.45, 0.0], [0.45, 0.45, 1.0], [7, 7, 5], TURNS)
    asked = {
        "robot": "acrobot_large",
        "verdict": "sampled",
        "vary": {"r_A": [0.005, 0.02, 0.1], "d_theta_bp_deg": [20.0]},
        "grid": grid,
        "options": OPTIONS,
    }
    asked |= changes
    statics = static_case(load_robot(asked["robot"]), (1.0, 60.0))
    return make_question(**asked, statics=statics)


@pytest.fixture(scope="module")
def found():
    return stability_workspaces(question()).workspaces


def test_poses_are_those_of_single_judgements(found):
    asked = question()
    robot = load_robot("acrobot_large")
    for number in (0, 17, 245, 400, 489):
        X_WP = asked.grid.poses(number, number + 1)[0]
        one = judge_stability(
            asked.case, asked.bounds["r_A=0.02"], pose_row(X_WP)[None], "sampled", OPTIONS
        )
        assert found.inside("Z", "r_A=0.02").reshape(-1)[number] == one.stable[0]
        solution = distribute(tension_problem(robot, X_WP, limits=(1.0, 60.0)), "linear_program")
        held = solution.status == TensionStatus.FEASIBLE
        assert found.inside("S").reshape(-1)[number] == held


def test_both_is_the_intersection_and_places_hold_in_all_orientations(found):
    for name in found.names:
        both = found.inside("Z", name) & found.inside("S")
        np.testing.assert_array_equal(found.inside("SZ", name), both)
        np.testing.assert_array_equal(found.places("SZ", name), both[0] & both[1])
    assert np.any(found.inside("Z")[0] != found.inside("Z")[1])


def test_without_perturbation_every_regular_pose_is_stable():
    none = stability_workspaces(question(bounds=PerturbationBounds(), vary={})).workspaces
    margin = none.margin[0]
    assert np.mean(none.stable) > 0.95
    np.testing.assert_allclose(margin[none.stable[0]], 1.0, atol=1e-6)  # Pi is the identity


def test_stricter_verdicts_give_smaller_workspaces():
    by = {
        verdict: stability_workspaces(question(verdict=verdict, vary={})).workspaces
        for verdict in ("sampled", "searched", "certified")
    }
    masks = [by[verdict].inside("Z") for verdict in ("certified", "searched", "sampled")]
    assert np.all(masks[1] | ~masks[0])
    assert np.all(masks[2] | ~masks[1])
    assert np.sum(masks[0]) < np.sum(masks[1]) < np.sum(masks[2])


def test_the_same_bounds_give_the_same_and_larger_ones_less(found):
    np.testing.assert_array_equal(found.inside("Z"), found.inside("Z", "r_A=0.005"))
    volumes = [found.volume("Z", "points", f"r_A={r}").value for r in ("0.005", "0.02", "0.1")]
    assert volumes[0] > volumes[1] > volumes[2]


def test_results_load_as_they_were_saved(found, tmp_path):
    found.save(tmp_path)
    loaded = load_workspaces(tmp_path)
    assert loaded.as_dict() == found.as_dict()
    for name in found.names:
        np.testing.assert_array_equal(loaded.inside("SZ", name), found.inside("SZ", name))
    np.testing.assert_array_equal(loaded.margin, found.margin)
    assert json.loads(json.dumps(loaded.as_dict(), allow_nan=False))["options"]["seed"] == 3


def test_what_is_no_result_is_refused(tmp_path):
    with pytest.raises(DataFileError, match="found no stored workspaces"):
        load_workspaces(tmp_path)
    (tmp_path / "workspace.npz").write_bytes(b"PK")
    with pytest.raises(DataFileError, match="found no stored workspaces"):
        load_workspaces(tmp_path)


def test_a_stopped_one_continues_and_a_finished_one_is_read(found, tmp_path, monkeypatch):
    monkeypatch.setitem(CHUNK_POSES, "sampled", 100)
    reports = []
    first = stability_workspaces(
        question(), tmp_path / "w", on_progress=reports.append, should_stop=lambda: len(reports) > 9
    )
    assert first.workspaces is None
    assert not (tmp_path / "w" / "workspace.npz").exists()
    second = stability_workspaces(question(), tmp_path / "w")
    assert 0 < second.progress.found < second.progress.total
    np.testing.assert_array_equal(second.workspaces.margin, found.margin)
    third = stability_workspaces(question(), tmp_path / "w")
    assert third.progress.found == third.progress.total
    assert third.workspaces.as_dict() == found.as_dict()
    assert not (tmp_path / "w" / "chunks").exists()
    with pytest.raises(OutputFolderError, match=r"options.seed is 3 there, 4 here"):
        stability_workspaces(question(options=VerdictOptions(draws=20, seed=4)), tmp_path / "w")


def test_curves_have_the_values_of_the_bounds(found):
    values = {name: [value for value, _ in points] for name, points in curves(found).items()}
    assert values["r_A"] == pytest.approx([0.005, 0.02, 0.1])
    assert values["d_theta_bp"] == pytest.approx([3.0, 20.0])


def test_figures_and_scene_are_written(found, tmp_path):
    robot = load_robot("acrobot_large")
    assert not write_pictures(tmp_path, stability_pictures(found, robot))
    paths = sorted(tmp_path.iterdir())
    assert [path.name for path in paths] == ["planes.png", "solids.png", "volumes.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)
    page = workspace_html(found, robot)
    assert "<html" in page.lower()
    assert len(page) > 1e6


def test_planar_robots_have_areas():
    grid = grid_by_count([-0.48, -0.48, 0.3], [0.48, 0.48, 0.3], [9, 9, 1])
    for scheme in ("pbvs", "pbvs-line"):
        asked = question(robot="planar", scheme=scheme, grid=grid, vary={})
        workspaces = stability_workspaces(asked).workspaces
        assert workspaces.volume("SZ").unit == "m^2"
        assert 0.3 < workspaces.volume("Z").share <= 1.0


@pytest.mark.parametrize("scheme", ["pbvs", "pbvs-line", "2.5d", "ibvs"])
def test_every_scheme_has_a_workspace(scheme):
    workspaces = stability_workspaces(question(scheme=scheme, vary={})).workspaces
    assert 0.3 < workspaces.volume("Z", "points").share < 1.0


def test_the_target_may_be_a_real_one():
    X_PC = load_robot("acrobot_large").camera_mount("onboard").pose.transform()
    target = FixedObject(RigidTransform(), RigidTransform([0.0, 0.0, 0.3]))
    asked = question(task=CameraTask(target, X_PC, "object"), vary={})
    assert asked.arguments()["case"]["target"]["kind"] == "FixedObject"
    assert stability_workspaces(asked).workspaces.volume("Z", "points").share > 0.1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"scheme": "pbs"}, ["scheme", "pbs", "pbvs, pbvs-line, 2.5d, ibvs"]),
        ({"verdict": "guessed"}, ["verdict 'guessed'", "sampled, searched, certified"]),
        ({"vary": {"r_X": [1.0]}}, ["'r_X'", "r_A"]),
        ({"vary": {"r_A_deg": [1.0]}}, ["'r_A_deg'"]),
        ({"vary": {"r_A": [-1.0]}}, ["r_A", "-1", ">= 0"]),
        ({"vary": {"d_theta_bp": [5.0]}}, ["d_theta_bp", "5", "d_theta_bp_deg for degrees"]),
        ({"vary": {"d_theta_bp_deg": [-5.0]}}, ["d_theta_bp_deg", "-5", "180"]),
        ({"robot": "planar"}, ["z from 0 to 1", "0.3"]),
        (
            {"robot": "planar", "scheme": "ibvs", "grid": None},
            ["scheme", "ibvs", "planar", "pbvs, pbvs-line"],
        ),
    ],
)
def test_refuses_what_makes_no_sense(changes, words):
    with pytest.raises(CdprError) as refused:
        question(**changes)
    for word in words:
        assert word in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"limits": (-1.0, 60.0)}, ["-1", "0 <= lower"]),
        ({"mass": -1.0}, ["weight"]),
        ({"wrench": np.zeros(5)}, ["wrench", "6"]),
    ],
)
def test_refuses_loads_that_make_no_sense(changes, words):
    with pytest.raises(CdprError) as refused:
        static_case(load_robot("acrobot_large"), **changes)
    for word in words:
        assert word in str(refused.value)
    assert "\n" not in str(refused.value)


def test_too_few_cables_are_refused(tmp_path):
    file = yaml.safe_load(robot_file("acrobot_large").read_text())
    file["cables"] = file["cables"][:5]
    path = tmp_path / "five.yaml"
    path.write_text(yaml.safe_dump(file))
    with pytest.raises(CdprError, match=r"found 5 .*at least 6"):
        question(robot=str(path))


def test_bounds_vary_in_metres_radians_and_degrees():
    assert varied(BASELINE, "r_B", 0.02).r_B == 0.02
    assert varied(BASELINE, "d_theta_pc", 0.1).d_theta_pc == 0.1
    assert varied(BASELINE, "d_theta_pc_deg", 90.0).d_theta_pc == pytest.approx(np.pi / 2)
    assert varied(BASELINE, "r_B", 0.02).r_A == BASELINE.r_A
    with pytest.raises(StabilityError, match=r"'r_a' is unknown; .*r_A"):
        varied(BASELINE, "r_a", 0.1)
