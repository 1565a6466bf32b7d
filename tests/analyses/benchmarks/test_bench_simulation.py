"""The baselines of the benchmark compute the same as what they are compared with."""

import numpy as np
import pytest

from cdpr_drake.analyses.benchmarks import dynamic_loops
from cdpr_drake.analyses.benchmarks.dynamic_loops import compiled_loop, tendon_loop
from cdpr_drake.analyses.benchmarks.simulation import (
    STEP,
    compiled_simulator,
    numpy_force,
    plant_simulator,
    region_row,
)
from cdpr_drake.cables.straight_kernel import floating_force
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_forces import CableForces

ROUNDING = 1e-9
"""Relative to forces of thousands of newtons."""


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


def test_plant_of_the_benchmark_hangs_at_rest():
    simulator = plant_simulator(CableForces)
    before = simulator.get_context().get_continuous_state_vector().CopyToVector()
    simulator.AdvanceTo(0.05)
    after = simulator.get_context().get_continuous_state_vector().CopyToVector()
    np.testing.assert_allclose(after, before, atol=1e-9)


def test_compiled_robot_of_the_benchmark_does_what_the_plant_does():
    plant, compiled = plant_simulator(CableForces, STEP), compiled_simulator("runge_kutta3", STEP)
    for simulator in (plant, compiled):
        simulator.AdvanceTo(0.05)
    expected = plant.get_context().get_continuous_state_vector().CopyToVector()
    block = compiled.get_system()
    found = block.GetOutputPort("platform_state").Eval(compiled.get_context())
    np.testing.assert_allclose(found, expected[:13], atol=1e-9)


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
    rows = dynamic_loops.dynamic_rows(quick=True)
    assert [row.name.split(", ", 2)[2] for row in rows] == [
        "compiled as a whole", "through the diagram, compiled robot",
    ]  # fmt: skip
    assert all(row.baseline.endswith("through the diagram, plant") for row in rows)
    assert all(row.ratio == pytest.approx(row.baseline_value / row.value) for row in rows)


def test_the_row_of_the_region_compares_it_with_whole_images():
    row = region_row(0.08, 1)
    assert (row.name.split(", ")[-1], row.baseline) == ("region of interest", "whole images")
    assert row.ratio == pytest.approx(row.value / row.baseline_value)
