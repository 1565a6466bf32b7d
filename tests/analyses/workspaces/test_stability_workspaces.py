"""Workspaces of stability: single poses, order, storage, continuation, figures and scene."""

import json

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import NOBODY
from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.analyses.workspaces.servo_stability import (
    ServoView,
    robot_stability,
    scenario_view,
    varied,
)
from cdpr_drake.analyses.workspaces.stability import assess_stability, load_stability
from cdpr_drake.analyses.workspaces.stability_figures import curves
from cdpr_drake.errors import (
    CdprError,
    DataFileError,
    StabilityError,
)
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import BASELINE, PerturbationBounds
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.problem import TensionStatus
from cdpr_drake.workspaces.pose_grid import grid_by_count

OPTIONS = VerdictOptions(draws=20, seed=3)
GRID = ([-0.45, -0.45, 0.0], [0.45, 0.45, 1.0], [7, 7, 5])
TURNS = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]]


def assessed(**changes):
    asked = {
        "robot": "acrobot_large", "verdict": "sampled",
        "vary": {"r_A": [0.005, 0.02, 0.1], "d_theta_bp_deg": [20.0]},
        "grid": grid_by_count(*GRID, TURNS), "draws": 20, "seed": 3, "limits": (1.0, 60.0),
        "workers": 1,
    }  # fmt: skip
    return assess_stability(**(asked | changes))


@pytest.fixture(scope="module")
def found():
    return assessed()


def test_poses_are_those_of_single_judgements(found):
    robot = load_robot("acrobot_large")
    servo = robot_stability(robot, found.grid)
    bounds = varied(servo.bounds, "r_A", 0.02)
    for number in (0, 17, 245, 400, 489):
        X_WP = found.grid.poses(number, number + 1)[0]
        one = judge_stability(servo.case, bounds, pose_row(X_WP)[None], "sampled", OPTIONS)
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
    none = assessed(bounds=PerturbationBounds(), vary={})
    margin = none.margin[0]
    assert np.mean(none.stable) > 0.95
    np.testing.assert_allclose(margin[none.stable[0]], 1.0, atol=1e-6)  # Pi is the identity


def test_stricter_verdicts_give_smaller_workspaces():
    by = {
        verdict: assessed(verdict=verdict, vary={})
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
    with Folder(tmp_path, {}) as folder:
        found.save(folder)
    loaded = load_stability(tmp_path)
    assert loaded.as_dict() == found.as_dict()
    for name in found.names:
        np.testing.assert_array_equal(loaded.inside("SZ", name), found.inside("SZ", name))
    np.testing.assert_array_equal(loaded.margin, found.margin)
    assert json.loads(json.dumps(loaded.as_dict(), allow_nan=False))["options"]["seed"] == 3


def test_what_is_no_result_is_refused(tmp_path):
    for content in (None, b"PK"):
        if content is not None:
            (tmp_path / "workspace.npz").write_bytes(content)
        with pytest.raises(DataFileError, match="found no stored workspaces"):
            load_stability(tmp_path)


def test_curves_have_the_values_of_the_bounds(found):
    values = {name: [value for value, _ in points] for name, points in curves(found).items()}
    assert values["r_A"] == pytest.approx([0.005, 0.02, 0.1])
    assert values["d_theta_bp"] == pytest.approx([3.0, 20.0])


def test_figures_and_scene_are_written(found, tmp_path):
    with Folder(tmp_path / "w", {}) as folder:
        assert not found.written(folder, ("png",), NOBODY).failed
    paths = sorted(folder.path.glob("*.png"))
    assert [path.name for path in paths] == ["planes.png", "solids.png", "volumes.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)
    page = (folder.path / "workspace.html").read_text(encoding="utf-8")
    assert "<title>acrobot_large: stability of the servo" in page
    assert '"workspace baseline/SZ"' in page
    assert len(page) > 1e6


def test_planar_robots_have_areas():
    grid = grid_by_count([-0.48, -0.48, 0.3], [0.48, 0.48, 0.3], [9, 9, 1])
    for scheme in ("pbvs", "pbvs-line"):
        workspaces = assessed(robot="planar", scheme=scheme, grid=grid, vary={})
        assert workspaces.volume("SZ").unit == "m^2"
        assert 0.3 < workspaces.volume("Z").share <= 1.0


@pytest.mark.parametrize("scheme", ["pbvs", "pbvs-line", "2.5d", "ibvs"])
def test_every_scheme_has_a_workspace(scheme):
    workspaces = assessed(scheme=scheme, vary={})
    assert 0.3 < workspaces.volume("Z", "points").share < 1.0


def test_the_target_may_be_a_real_one():
    robot = load_robot("acrobot_large")
    X_PC = robot.camera_mount("onboard").pose.transform()
    target = FixedObject(RigidTransform(), RigidTransform([0.0, 0.0, 0.3]))
    grid = grid_by_count(*GRID, TURNS)
    servo = robot_stability(robot, grid, ServoView(target, X_PC, "object"))
    judged = judge_stability(servo.case, servo.bounds, grid.pose_rows(0, grid.size), "sampled")
    assert np.mean(judged.stable) > 0.1
    scenario = load_scenario("acrobot_pbvs", ["robot=acrobot_large", "camera.kind=projected"])
    by_object, by_name = (scenario_view(robot, each) for each in (scenario, "acrobot_pbvs"))
    assert by_object.X_PC.IsExactlyEqualTo(by_name.X_PC)
    assert assessed(scenario=scenario, vary={}).arguments["case"]["target"]["kind"] == "FixedObject"


@pytest.mark.parametrize(
    ("changes", "words"), [({"mass": -1.0}, "weight"), ({"wrench": np.zeros(5)}, "wrench: .*6")]
)
def test_refuses_loads_that_make_no_sense(changes, words):
    with pytest.raises(CdprError, match=words):
        static_case(load_robot("acrobot_large"), **changes)


def test_too_few_cables_are_refused(tmp_path):
    file = yaml.safe_load(robot_file("acrobot_large").read_text())
    file["cables"] = file["cables"][:5]
    path = tmp_path / "five.yaml"
    path.write_text(yaml.safe_dump(file))
    with pytest.raises(CdprError, match=r"found 5 .*at least 6"):
        assessed(robot=str(path))


def test_bounds_vary_in_metres_radians_and_degrees():
    assert varied(BASELINE, "r_B", 0.02).r_B == 0.02
    assert varied(BASELINE, "d_theta_pc", 0.1).d_theta_pc == 0.1
    assert varied(BASELINE, "d_theta_pc_deg", 90.0).d_theta_pc == pytest.approx(np.pi / 2)
    assert varied(BASELINE, "r_B", 0.02).r_A == BASELINE.r_A
    for name, value, words in (
        ("r_a", 0.1, r"'r_a' is unknown; .*r_A"), ("r_A_deg", 1.0, "'r_A_deg' is unknown"),
        ("d_theta_bp", 5.0, "write d_theta_bp_deg for degrees"), ("d_theta_bp_deg", -5.0, "<= 180"),
    ):  # fmt: skip
        with pytest.raises(StabilityError, match=words):
            varied(BASELINE, name, value)
