"""The kernel goes from event to event as the loop in Python does, to the last bit."""

from dataclasses import replace

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.runs.seeds import run_many, with_seeds
from cdpr_drake.errors import DivergedError
from cdpr_drake.geometry.drake_pose_kernel import agrees
from cdpr_drake.models.robot_loader import robot_text
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import check_loop, set_loop
from cdpr_drake.systems.loops.servo_events import KINDS
from cdpr_drake.systems.loops.servo_loop import ServoLoop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from tests.processors import needs_fused_products

PIECE = 0.1
"""How far a loop goes at once, as runs do [s]."""


@needs_fused_products
def test_the_kernel_goes_where_processors_fuse_products():
    """NumPy's `dot` adds in another order on some, and all loops stepped in Python there."""
    assert agrees()


def scenario_of(name, *overrides, duration=0.5):
    options = ("camera.kind=projected", "integration.loop=compiled", f"duration={duration}")
    return check_loop(load_scenario(name, (*options, *overrides)))


def begun(scenario, *, python):
    loop = ServoLoop(scenario)
    if python:
        loop.python_reason = "a test asks for it"
    loop.start()
    return loop


def go(loop, until):
    while loop.time < until and loop.outcome == Outcome.RUNNING:
        loop.advance_to(min(loop.time + PIECE, until))
    return loop


def same(one, other):
    assert (one.time, one.outcome) == (other.time, other.outcome)
    for first, second in (
        (one.log.read(), other.log.read()),
        (one.state_arrays(), other.state_arrays()),
    ):
        assert list(first) == list(second)
        for name, values in first.items():
            assert values.tobytes() == second[name].tobytes(), name


def check(scenario, seeds=(0,)):
    for seed in seeds:
        seeded = replace(scenario, seed=seed)
        compiled = begun(seeded, python=False)
        assert compiled.python_reason == ""
        same(go(begun(seeded, python=True), scenario.duration), go(compiled, scenario.duration))


@needs_fused_products
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("acrobot_pbvs", ["camera.rate=30", "camera.latency_frames=2", "log_rate=70"]),
        ("acrobot_pbvs", ["estimator.compare=[first_image, control_integration]"]),
        ("acrobot_hybrid", ["controller.free_rotation=true"]),
        ("acrobot_ibvs", ["perturbations.image_bias=[2, -1]"]),
        ("acrobot_partitioned", ["controller.partition={edge_distance: 60, goal: turned}"]),
        ("acrobot_switching", ["controller.switching={bound_ratio: 1.01, first: pose}"]),
    ],
)
def test_schemes_and_estimators(name, overrides, kind):
    check(scenario_of(name, *overrides, f"estimator.kind={kind}"), seeds=(0, 7, 2**40))


@needs_fused_products
@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("acrobot_pbvs_line", ["next_tasks=[{time: 0.2, desired: {position: [0, 0, 0.2], "
                               "angles_deg: [180, 0, 180]}}]"]),
        ("acrobot_eye_to_hand", []),
        ("acrobot_pbvs", ["camera.pixel_noise=0", "integration.engine=compiled",
                          "integration.integrator=semi_implicit"]),
        ("acrobot_pbvs", ["perturbations.winch_offset=0.001",
                          "perturbations.winch_offset_spread=0.001", "controller.rate=60"]),
    ],
)  # fmt: skip
def test_tasks_mountings_integrators_and_winches(name, overrides):
    check(scenario_of(name, *overrides))


@pytest.fixture
def behaving(tmp_path):
    def write(**behaviour):
        content = yaml.safe_load(robot_text("acrobot_small"))
        content["cable"]["behaviour"] = behaviour
        path = tmp_path / "behaving.yaml"
        path.write_text(yaml.safe_dump(content))
        return scenario_of("acrobot_pbvs", f"robot={path}")

    return write


@needs_fused_products
def test_cables_that_stiffen_and_rub(behaving):
    check(behaving(stiffening=2e-3, sheave_friction=0.03))


def test_cables_that_creep_stay_in_python(behaving):
    loop = ServoLoop(behaving(creep_stiffness=2.0, creep_time=0.3))
    assert loop.python_reason == "its cables creep"


@needs_fused_products
def test_a_target_that_gets_out_of_view_ends_it():
    away = "desired={position: [0.4, 0.4, 0.09], angles_deg: [180, 0, 180]}"
    scenario = scenario_of("acrobot_pbvs", away, "stop.target_lost=0.1", duration=8.0)
    check(scenario)
    assert go(begun(scenario, python=False), 8.0).outcome == Outcome.TARGET_LOST


@needs_fused_products
def test_a_pose_that_is_held_ends_it():
    scenario = scenario_of("acrobot_pbvs", duration=20.0)
    check(scenario)
    assert go(begun(scenario, python=False), 20.0).outcome == Outcome.CONVERGED


@needs_fused_products
@pytest.mark.parametrize("first", [True, False])
def test_a_state_goes_from_one_to_the_other(first):
    """Halfway, in the middle of a period, as from a checkpoint."""
    scenario = scenario_of("acrobot_switching", "estimator.compare=[first_image]")
    began = go(begun(scenario, python=first), 0.25)
    went_on = begun(scenario, python=not first)
    go(went_on, 0.1)  # its arrays stand elsewhere then
    went_on.restore_state(began.state_arrays())
    reached = went_on.state_arrays()
    for name, values in began.state_arrays().items():
        assert values.tobytes() == reached[name].tobytes(), name
    went_on.log.clear()
    began.log.clear()
    same(go(went_on, 0.5), go(began, 0.5))


@needs_fused_products
def test_what_python_raises_is_raised():
    scenario = scenario_of("acrobot_pbvs", duration=5.0)
    messages = []
    for python in (True, False):
        loop = go(begun(scenario, python=python), 0.2)
        state = loop.state_arrays()
        state["motion"][10] = 1e200  # a speed that no step can follow
        loop.restore_state(state)
        with pytest.raises(DivergedError) as problem:
            go(loop, 1.0)
        messages.append((str(problem.value), loop.time))
    assert messages[0] == messages[1]


@needs_fused_products
def test_any_number_of_workers_gives_the_same():
    runs = with_seeds(scenario_of("acrobot_pbvs", duration=0.2), range(3))
    one, two = (run_many(runs, workers, traces=True) for workers in (1, 2))
    for first, second in zip(one.records, two.records, strict=True):
        np.testing.assert_array_equal(first.end, second.end)
        for name, values in first.traces.items():
            np.testing.assert_array_equal(values, second.traces[name])


@pytest.mark.parametrize(
    ("name", "overrides", "reason"),
    [
        ("acrobot_circles", [], "its target is no plane of points"),
        ("acrobot_moving_tag", [], "its target moves"),
        ("acrobot_slack_start_tca", [], "its tensions are managed"),
        ("planar_pbvs", [], "its platform is no floating body"),
        ("acrobot_friction", [], "its winches have motors"),
        ("acrobot_pbvs", ["estimator.kind=cable_lengths"], "its estimator is cable_lengths"),
        ("acrobot_pbvs", ["sensors.log=[tension]"], "its sensors are logged"),
        ("acrobot_pbvs", ["camera.focus_zoom=0.1"], "the focus of its camera changes"),
    ],
)
def test_what_stays_in_python_is_said(name, overrides, reason):
    scenario = scenario_of(name, *overrides)
    assert ServoLoop(scenario).python_reason == reason
    assert f"(its events in Python, since {reason})" in set_loop(scenario)[1]


@needs_fused_products
def test_nothing_is_said_where_the_kernel_goes():
    scenario = scenario_of("acrobot_pbvs")
    assert set_loop(scenario)[1] == f"{scenario.name}: by the compiled loop"
