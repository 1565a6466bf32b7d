"""The baselines of benchmarks compute the same as what they are compared with."""

import numpy as np
import pytest
from scipy.optimize import leastsq

from cdpr_drake.analyses.benchmarks import dynamic_loops
from cdpr_drake.analyses.benchmarks.dynamic_loops import compiled_loop, tendon_loop
from cdpr_drake.analyses.benchmarks.identification import calibration_works
from cdpr_drake.analyses.benchmarks.point_calibration import point_works
from cdpr_drake.analyses.benchmarks.servo import (
    CORRECTIONS,
    SCENARIOS,
    Correction,
    Step,
    numpy_step,
)
from cdpr_drake.analyses.benchmarks.simulation import (
    EFFECTS,
    STEP,
    compiled_simulator,
    numpy_force,
    plant_simulator,
    region_row,
)
from cdpr_drake.analyses.benchmarks.statics import _starts, length_residuals
from cdpr_drake.cables.straight_kernel import floating_force
from cdpr_drake.geometry.poses import pose_error, pose_from_row, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.systems.controllers.schemes import SCHEMES
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.robots.cable_forces import CableForces

ROUNDING = 1e-9
"""Relative to forces of thousands of newtons."""

ROUND_OFF = 1e-10
"""Of cable velocities below 1 m/s, after two pseudo-inverses."""


# SciPy ends where its own differences let it, far below deviations of 0.2 mm and more; of a point
# mass it stops at a relative gain of 1e-8, within hundredths of deviations of 1 mm and more.
@pytest.mark.parametrize(
    ("works", "count", "same"),
    [
        (lambda: calibration_works(14), 48 + 6 * 14, 1e-6),
        (point_works, 12 + 1 + 3 * 35, 2e-5),
    ],
)
def test_both_ways_to_calibrate_end_in_the_same_points(works, count, same):
    ours, scipy, unknowns = works()
    assert unknowns == count
    np.testing.assert_allclose(ours(), scipy(), atol=same)


def test_scipy_finds_the_same_pose_from_the_same_residual():
    cables = load_robot("acrobot_large").cable_set()
    fk = ForwardKinematics(cables)
    for lengths, guess in _starts(cables, 5):
        found = pose_from_row(leastsq(length_residuals, guess, args=(cables.packed(), lengths))[0])
        ours = fk.pose(lengths, pose_from_row(guess)).X_WP
        assert pose_error(found, ours) < (1e-6, 1e-6)
        residuals = length_residuals(pose_row(ours), cables.packed(), lengths)
        np.testing.assert_allclose(residuals, 0.0, atol=1e-9)


def test_numpy_baseline_agrees_with_the_kernel():
    robot = load_robot("acrobot_small")
    random = np.random.default_rng(0)
    cables = robot.cable_set().without_pulleys().packed()
    for _ in range(20):
        state = np.concatenate(
            [random.normal(size=4), random.uniform(-0.2, 0.5, 3), random.normal(size=6)]
        )
        l0, l0_dot = random.uniform(0.9, 1.2, 8), random.normal(size=8)
        out = np.zeros(6)
        floating_force(state, l0, l0_dot, cables, 0, out)
        expected = numpy_force(state, l0, l0_dot, cables)
        np.testing.assert_allclose(out, expected, atol=ROUNDING * (1 + np.abs(expected).max()))


def test_robots_of_the_benchmark_hang_at_rest_and_the_compiled_one_does_what_the_plant_does():
    plant, compiled = plant_simulator(CableForces, STEP), compiled_simulator("runge_kutta3", STEP)
    before = plant.get_context().get_continuous_state_vector().CopyToVector()
    for simulator in (plant, compiled):
        simulator.AdvanceTo(0.05)
    after = plant.get_context().get_continuous_state_vector().CopyToVector()
    np.testing.assert_allclose(after, before, atol=1e-9)
    block = compiled.get_system()
    found = block.GetOutputPort("platform_state").Eval(compiled.get_context())
    np.testing.assert_allclose(found, after[:13], atol=1e-9)


def test_mujoco_and_daqp_close_the_same_loop():
    """Another engine and another solver, of first order in the step of 1 ms; found: 29 um, 1e-3."""
    loop, tendons = compiled_loop(), tendon_loop()
    loop.advance_to(1.5)
    tendons.advance(1500)
    assert tendons.time == pytest.approx(loop.time)
    log = loop.read_log()
    travelled = np.linalg.norm(log["X_WP"][-1, 4:] - log["X_WP"][0, 4:])
    assert travelled > 0.05
    pose = tendons.pose()
    np.testing.assert_allclose(pose[:3], loop.pose().translation(), atol=1e-4)
    turn = 2.0 * np.arccos(min(abs(pose[3:] @ loop.pose().rotation().ToQuaternion().wxyz()), 1.0))
    assert turn < 1e-4
    np.testing.assert_allclose(tendons.tensions(), log["tensions"][-1], rtol=1e-2)


def test_rows_of_the_dynamic_loop_name_what_they_compare(monkeypatch):
    monkeypatch.setattr(dynamic_loops, "has_tendons", lambda: False)
    monkeypatch.setattr(dynamic_loops, "interleaved", lambda works, repeats: [1.0, 2.0, 4.0])
    rows = dynamic_loops.dynamic_rows(quick=True)
    assert [(row.name.split(", ", 2)[2], row.ratio) for row in rows] == [
        ("compiled as a whole", 4.0), ("through the diagram, compiled robot", 2.0),
    ]  # fmt: skip
    assert all(row.baseline.endswith("through the diagram, plant") for row in rows)


def test_the_row_of_the_region_compares_it_with_whole_images():
    row = region_row(0.08, 1)
    assert (row.name.split(", ")[-1], row.baseline) == ("region of interest", "whole images")
    assert row.ratio == pytest.approx(row.value / row.baseline_value)


@pytest.mark.parametrize("name", EFFECTS)
def test_names_of_effects_say_what_is_on(name):
    scenario, overrides = EFFECTS[name]
    loaded = load_scenario(scenario, list(overrides))
    assert ("pulleys" in name) == loaded.cables.pulleys
    model = loaded.cables.model_of(load_robot(loaded.robot))
    assert ("catenary" in name) == (model == "catenary")
    assert ("friction" in name) == (loaded.winches.kind == "motor")


def test_a_servo_step_in_numpy_agrees_with_ours():
    scenario = load_scenario(SCENARIOS["ibvs"], ["controller.sigma=null"])
    step = Step(scenario)
    expected = numpy_step(step, scenario)()
    assert np.max(np.abs(expected)) > 1e-2
    np.testing.assert_allclose(step(), expected, rtol=0.0, atol=ROUND_OFF)


def test_every_scheme_is_timed():
    assert list(SCENARIOS) == list(SCHEMES)
    for scheme, name in SCENARIOS.items():
        scenario = load_scenario(name)
        assert scenario.controller.scheme == scheme
        assert np.all(np.isfinite(Step(scenario)()))


@pytest.mark.parametrize("kind", CORRECTIONS)
def test_every_kind_of_correction_that_is_timed_corrects(kind):
    changes = [f"tension_management={CORRECTIONS[kind]}", "camera.kind=projected"]
    added = Correction(load_scenario("acrobot_slack_start", changes))()
    assert added.shape == (8,)
    assert np.min(added) < 0.0
