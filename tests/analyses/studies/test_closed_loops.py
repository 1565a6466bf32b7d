"""One perturbation means the same to criterion, scenario and kinematic loop; loops with slack."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.stability import stability_along
from cdpr_drake.analyses.studies.closed_loops import (
    MANAGED,
    MODES,
    PLAIN,
    REACHED,
    STEP,
    STUDY,
    closed_loop,
    kinematic_path,
    loop_scenario,
    perturbation_of,
    stable_starts,
)
from cdpr_drake.analyses.studies.closed_loops import SETTINGS as LOOP_SETTINGS
from cdpr_drake.analyses.studies.facts import facts_of, judged
from cdpr_drake.analyses.studies.perturbed_servo import (
    Perturbation,
    perturbed_scenario,
    perturbed_servo,
)
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import BASELINE, vector_size
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import SCHEMES, StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from cdpr_drake.systems.diagrams.beliefs import believed_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome

ROUNDING = 1e-9
SETTINGS = [
    "robot=acrobot_large",
    "camera.kind=projected",
    "target.pose.position=[0, 0, 0]",
    "desired.position=[0, 0, 0.3]",
]
START = pose_from_angles(np.array([0.2, 0.1, 0.6]), np.radians([5.0, -5.0, 20.0]))
NONE = Perturbation.from_vector(np.zeros(vector_size(8)))


def servo_of(perturbation, *settings):
    return perturbed_servo(load_scenario("acrobot_pbvs", [*SETTINGS, *settings]), perturbation)


def drawn(seed):
    return draw_perturbations(pose_row(START), BASELINE, 8, 1, seed)[0]


@pytest.mark.parametrize("scheme", ["pbvs", "pbvs-line", "2.5d", "ibvs"])
@pytest.mark.parametrize("seed", range(3))
def test_the_margin_is_that_of_the_kernel(scheme, seed):
    """The plain NumPy criterion of the perturbed servo, and the kernel's with the same draw."""
    bounds = BASELINE.scaled(4.0)  # so that margins are well below those of the exact model
    d = draw_perturbations(pose_row(START), bounds, 8, 1, seed)[0]
    servo = servo_of(Perturbation.from_vector(d), f"controller.scheme={scheme}")
    robot = load_robot("acrobot_large")
    case = StabilityCase(
        robot.cable_set().without_pulleys(),
        scheme,
        X_PC=servo.X_PC,
        target=FixedObject(servo.X_WO, servo.scenario.desired.transform()),
        p_OK=servo.target.points,
        lever="object",
    )
    options = VerdictOptions(draws=1, seed=seed)
    found = judge_stability(case, bounds, pose_row(START)[None], "sampled", options).margin[0]
    assert found < 0.95
    assert servo.margin(START) == pytest.approx(found, abs=1e-7)


def test_the_scenario_makes_the_controller_believe_the_perturbation():
    d = drawn(5)
    perturbation = Perturbation.from_vector(d)
    servo = servo_of(perturbation)
    made = perturbed_scenario(servo.scenario, START, perturbation)
    believed = believed_robot(made, load_robot("acrobot_large"))
    truth, estimate = servo.models(START)
    assert believed.X_WP0.IsNearlyEqualTo(estimate.X_WP, ROUNDING)
    assert believed.X_PC.IsNearlyEqualTo(estimate.X_PC, ROUNDING)
    np.testing.assert_allclose(believed.cables.p_WA, estimate.cables.p_WA, atol=ROUNDING)
    np.testing.assert_allclose(believed.cables.p_PB, estimate.cables.p_PB, atol=ROUNDING)
    assert made.initial_pose.transform().IsNearlyEqualTo(truth.X_WP, ROUNDING)
    # All errors have full size.
    np.testing.assert_allclose(np.linalg.norm(perturbation.exits, axis=0), BASELINE.r_A)
    np.testing.assert_allclose(np.linalg.norm(perturbation.anchors, axis=0), BASELINE.r_B)
    assert np.linalg.norm(perturbation.shift) == pytest.approx(BASELINE.r_bp)
    assert np.linalg.norm(perturbation.camera_shift) == pytest.approx(BASELINE.r_pc)
    # The base scenario is not touched.
    assert servo.scenario.perturbations.exit_point_shifts is None


def test_without_perturbation_the_error_falls_exponentially():
    servo = servo_of(NONE)
    path = kinematic_path(servo, START)
    assert path.outcome == Outcome.CONVERGED
    assert len(path.errors) == pytest.approx(-np.log(REACHED) / STEP, rel=0.02)
    assert servo.margin(START) == pytest.approx(1.0, abs=1e-6)
    times = STEP * np.arange(len(path.errors))
    np.testing.assert_allclose(path.errors, path.errors[0] * np.exp(-times), rtol=0.15)


@pytest.mark.parametrize("scheme", ["pbvs", "pbvs-line", "2.5d"])
@pytest.mark.parametrize("seed", range(2))
def test_the_error_falls_wherever_the_criterion_holds(scheme, seed):
    servo = servo_of(Perturbation.from_vector(drawn(seed)), f"controller.scheme={scheme}")
    path = kinematic_path(servo, START)
    holds = np.array([servo.margin(X) > 0.0 for X in path.poses[::20]])
    assert np.all(holds)
    assert path.outcome == Outcome.CONVERGED
    assert np.max(np.diff(path.errors)) <= 0.0


def test_a_camera_mounted_the_wrong_way_round_does_not_converge():
    """What the criterion refuses, and rightly so."""
    turned = replace(NONE, camera_turn=RotationMatrix.MakeZRotation(np.pi * 0.9))
    servo = servo_of(turned)
    assert servo.margin(START) < 0.0
    path = kinematic_path(servo, START)
    assert path.outcome in (Outcome.TARGET_LOST, Outcome.DIVERGED)


def test_no_perturbation_believes_the_truth():
    X = RigidTransform(RotationMatrix.MakeZRotation(0.3), [1.0, 2.0, 3.0])
    assert NONE.platform(X).IsNearlyEqualTo(X, ROUNDING)
    assert NONE.camera(X).IsNearlyEqualTo(X, ROUNDING)


# A loop that ends hanging on five cables arrives with tension management, if the mass is in the
# middle of the platform's box. With the fitted centre of mass of the robot's file, 30 mm below, the
# same loop arrives by itself, on six cables.

SCHEME = "pbvs-line"
HANGING = pose_from_angles(
    np.array([0.07004729, -0.28586191, 1.0559333]),
    np.radians([10.97339115, 10.825974, -29.56824256]),
)
"""0.1 m below the exit points, where slack moves between cables at once."""

LONG_ENOUGH = 16.0
"""With tension management it arrives within 14 s; without, it hangs on five cables [s]."""


@pytest.fixture(scope="module")
def robots(tmp_path_factory):
    """The robot as it is, and the file of one with its mass in the middle of the box."""
    content = yaml.safe_load(robot_file("acrobot_large").read_text(encoding="utf-8"))
    content["platform"]["center_of_mass"] = [0.0, 0.0, 0.035]
    path = tmp_path_factory.mktemp("middle") / "robot.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return {"fitted": "acrobot_large", "middle": path}


@pytest.fixture(scope="module")
def worst():
    """The worst errors that a search finds at the start, as in the study."""
    found = perturbation_of(SCHEME, pose_row(HANGING), worst=True)
    # Stable, says the criterion, which takes every cable as taut.
    assert perturbed_servo(loop_scenario(SCHEME), found).margin(HANGING) > 0.0
    return found


@pytest.mark.parametrize(
    ("mass", "managed", "expected", "taut"),
    [
        ("middle", "{threshold: [1.0], gain: 0.003}", "CONVERGED", 8),
        ("middle", "null", "TIMEOUT", 5),
        ("fitted", "null", "CONVERGED", 6),
    ],
)
def test_whether_a_loop_with_slack_arrives(robots, worst, mass, managed, expected, taut):
    items = [
        *LOOP_SETTINGS, f"robot={robots[mass]}", f"controller.scheme={SCHEME}",
        f"duration={LONG_ENOUGH}", "integration.engine=compiled", f"tension_management={managed}",
    ]  # fmt: skip
    made = perturbed_scenario(load_scenario("acrobot_pbvs", items), HANGING, worst)
    made.estimator.kind, made.sensors.tracker = "shifted", "ideal"
    result = ServoRun(made).simulate()
    along = stability_along(result)
    assert (result.outcome.name, along.taut[-1]) == (expected, taut)
    if taut == 8:
        assert along.underactuated_time() < 2.0
    if taut == 5:
        assert along.underactuated_time() > 0.5 * LONG_ENOUGH


def test_starts_lie_in_the_workspace_and_loops_from_them_converge():
    starts, counts = stable_starts("pbvs", 2)
    np.testing.assert_array_equal(starts, stable_starts("pbvs", 3)[0][:2])
    assert counts["drawn"] >= 2 + sum(counts[name] for name in ("not_held", "not_seen"))
    row = closed_loop("pbvs", "kinematic", starts[0].tolist())
    assert (row["outcome"], row["error_growth"], row["error_peak"]) == ("converged", 0.0, 1.0)
    shifted = closed_loop("pbvs", "shifted", starts[0].tolist())
    assert shifted["estimate_error_m"] == pytest.approx(0.03)
    assert shifted["estimate_error_rad"] == pytest.approx(np.radians(3.0))


def verdicts(modes=(), **ends):
    """Facts on loops that converge, but for the first of PBVS in some modes."""
    usual = {"outcome": "converged", "poses_outside_z": 0, "taut_at_end": 8}
    rows = [
        {"scheme": scheme, "mode": mode, "seed": seed, "start_pose": [0.0] * 7, **usual}
        | (ends if mode in modes and (scheme, seed) == ("pbvs", 0) else {})
        for scheme in SCHEMES
        for mode in MODES
        for seed in range(2)
    ]
    found = judged(facts_of(STUDY.name), pd.DataFrame(rows), STUDY.finds, {}, "")
    return {one["name"]: one for one in found}


def test_a_loop_has_to_arrive_and_hanging_ones_by_managed_tensions():
    hangs = {"outcome": "timeout", "taut_at_end": 5}
    assert verdicts()["reached"]["verdict"] == "confirmed"
    assert verdicts((MANAGED,), **hangs)["reached"]["verdict"] == "confirmed"  # not about it
    lost = verdicts(("shifted",), outcome="target_lost")["reached"]
    assert (lost["verdict"], lost["held"], lost["of"]) == ("in part", 3, 4)
    assert verdicts()["managed"]["verdict"] == "not judged"  # no loop hangs
    arrives, stays = verdicts((PLAIN,), **hangs), verdicts((PLAIN, MANAGED), **hangs)
    assert arrives["managed"]["verdict"] == "confirmed"
    assert "pbvs start 0 at (0.00, 0.00, 0.00) m on 5 cables" in arrives["managed"]["found"]
    assert stays["managed"]["verdict"] == "not confirmed"
