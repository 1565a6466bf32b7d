"""Section `disturbances` by closed forms, and sections of others that push a platform."""

from typing import Annotated

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource, LogVectorOutput, MatrixGain

from cdpr_drake.analyses.runs.simulate import KINDS
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.errors import ScenarioError
from cdpr_drake.schema.declarations import In, filled, settings
from cdpr_drake.schema.typed_yaml import refuse
from cdpr_drake.sections.disturbances.section import Disturbances, DisturbanceSettings, Push
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sections import Section

GRAVITY = np.array([0.0, 0.0, -9.81])
X_WP = RigidTransform(RollPitchYaw(0.1, -0.2, 0.7), [0.3, 0.1, 0.5])
R = X_WP.rotation().matrix()
DRAG = 0.5 * 1.225 * 0.5
"""Half the density of air times the area of the wind below [kg/m]."""


def wrenches(*pushes, duration=1.2, rate=1000.0, seed=0):
    """Times and wrenches, one of each period."""
    builder = DiagramBuilder()
    settings = DisturbanceSettings(pushes=list(pushes), rate=rate)
    block = builder.AddSystem(Disturbances(settings, GRAVITY, seed=seed))
    pose = builder.AddSystem(ConstantValueSource(Value(X_WP)))
    builder.Connect(pose.get_output_port(), block.GetInputPort("X_WP"))
    log = LogVectorOutput(block.GetOutputPort("wrench"), builder, 1.0 / rate)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    found = log.FindLog(simulator.get_context())
    return found.sample_times(), found.data().T


def test_a_step_begins_and_ends():
    times, found = wrenches(Push(kind="step", force=np.array([0.0, 5.0, 0.0]), start=0.5, end=1.0))
    # A row at an instant holds what stood there before: that of the period before.
    acts = (times > 0.5 + 1e-9) & (times < 1.0 + 1e-9)
    assert np.all(found[acts] == [0.0, 0.0, 0.0, 0.0, 5.0, 0.0])
    assert np.all(found[~acts] == 0.0)


def test_a_push_has_the_impulse_of_half_a_sine():
    force, length = np.array([3.0, 0.0, -1.0]), 0.3
    _, found = wrenches(Push(kind="push", force=force, start=0.2, end=0.2 + length))
    impulse = found[:, 3:].sum(axis=0) * 1e-3
    MIDDLES = (np.pi * 1e-3 / length) ** 2 / 24  # error of the midpoint rule
    np.testing.assert_allclose(impulse, 2.0 * length / np.pi * force, rtol=2.0 * MIDDLES)


def test_a_sine_and_a_force_off_the_origin():
    point, force = np.array([0.1, 0.0, 0.2]), np.array([0.0, 4.0, 0.0])
    push = Push(kind="sine", frequency=2.0, force=force, frame="platform", point=point)
    times, found = wrenches(push)
    f = np.sin(4.0 * np.pi * (times[1:] - 0.5e-3))[:, None] * (R @ force)
    np.testing.assert_allclose(found[1:, 3:], f, atol=1e-12)
    np.testing.assert_allclose(found[1:, :3], np.cross(R @ point, f), atol=1e-12)


def test_a_payload_weighs_where_it_hangs():
    payload = Push(kind="payload", mass=2.0, point=np.array([0.5, 0.0, 0.0]))
    _, found = wrenches(payload, duration=0.1)
    np.testing.assert_allclose(found[-1, 3:], 2.0 * GRAVITY)
    np.testing.assert_allclose(found[-1, :3], np.cross(R @ [0.5, 0.0, 0.0], 2.0 * GRAVITY))


def wind(**more):
    return Push(kind="wind", wind=np.array([8.0, 0.0, 0.0]), drag_area=0.5, **more)


def test_a_steady_wind_drags():
    _, found = wrenches(wind(), duration=0.1)
    assert found[-1] == pytest.approx([0, 0, 0, DRAG * 64.0, 0, 0])


def test_gusts_have_the_stated_spectrum():
    """Of first order: standard deviation and correlation over time are in closed form."""
    push, rate, lag = wind(intensity=0.2, length_scale=4.0), 10.0, 5
    _, found = wrenches(push, duration=1000.0, rate=rate, seed=3)
    force = found[1:, 3:]
    sizes = np.linalg.norm(force, axis=1) / DRAG
    gusts = force / DRAG / np.sqrt(sizes)[:, None] - push.wind
    kept = np.exp(-8.0 / 4.0 / rate)
    independent = len(gusts) * (1.0 - kept) / (1.0 + kept)
    WITHIN = 4.0 / np.sqrt(independent)  # four standard deviations
    assert np.std(gusts, axis=0) == pytest.approx(0.2 * 8.0, rel=WITHIN)
    lagged = np.mean(gusts[:-lag] * gusts[lag:], axis=0) / 1.6**2
    assert lagged == pytest.approx(np.exp(-8.0 / 4.0 * lag / rate), abs=WITHIN)
    assert np.max(np.abs(np.mean(gusts, axis=0))) < 1.6 * WITHIN


def test_a_seed_repeats_another_does_not_and_winds_are_independent():
    push = wind(intensity=0.2)
    first, again, other = (wrenches(push, duration=0.2, seed=k)[1] for k in (1, 1, 2))
    two = wrenches(push, push, duration=0.2, seed=1)[1]
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert not np.allclose(2.0 * first, two)


ONES = np.ones(3)

PUSHES = {
    r"force: found no force and no moment; accepted: a force, a moment, or both": Push(kind="step"),
    "end: found none; accepted: one, with push": Push(kind="push", force=ONES),
    "frequency: found none": Push(kind="sine", force=ONES),
    "mass: found none": Push(kind="payload"),
    "mass: found 0": Push(kind="payload", mass=0.0),
    "force: found one; accepted: none, with pay": Push(kind="payload", mass=1.0, force=ONES),
    "mass: found one with step": Push(kind="step", force=ONES, mass=1.0),
    "end: found 1 s": Push(kind="step", force=ONES, start=2.0, end=1.0),
    "wind: found none": Push(kind="wind", wind=np.zeros(3), drag_area=1.0),
}  # fmt: skip


@pytest.mark.parametrize("words", PUSHES)
def test_what_is_missing_or_of_another_kind_is_refused(words):
    two = DisturbanceSettings(pushes=[Push(kind="step", force=ONES), PUSHES[words]])
    with pytest.raises(ScenarioError, match=r"disturbances\.pushes\[1\]\." + words):
        refuse(two, "disturbances", error=ScenarioError)


GUSTS = "disturbances={pushes: [{kind: wind, wind: [8, 0, 0], drag_area: 0.5, intensity: 0.2}]}"


@pytest.mark.parametrize(
    ("name", "quick"),
    [
        ("acrobot_pbvs", ["camera.kind=projected"]),
        ("acrobot_pick_and_place", ["camera.kind=projected"]),
        ("acrobot_computed_torque", []),
    ],
)
def test_every_kind_of_run_is_pushed_by_the_gusts_of_its_seed(name, quick):
    logs = {}
    for key in ("seed=1", "seed=2", "disturbances=null"):
        scenario = load_scenario(name, [*quick, "duration=0.05", "seed=1", GUSTS, key])
        run = KINDS[scenario.kind](scenario).simulate()
        logs[key] = run.log
        forces = run.as_dict().get("disturbances" if scenario.kind != TENSION_CONTROL else "forces")
        if key == "disturbances=null":
            assert forces is None
            continue
        sizes = np.linalg.norm(run.log["applied_wrench"][:, 3:], axis=1)
        assert forces["largest_force_n"] == pytest.approx(np.max(sizes))
    still = logs["disturbances=null"]
    assert "applied_wrench" not in still
    blown, other = (logs[f"seed={seed}"]["applied_wrench"][:, 3] for seed in (1, 2))
    assert blown[1] > 0.0
    assert not np.any(blown[1:] == other[1:])
    assert logs["seed=1"]["X_WP"][-1, 4] > still["X_WP"][-1, 4]


# Sections of others.

DRAG_OF_AIR = 3.0
"""Force per velocity of the section below [N s/m]."""


@settings
class Air(Section):
    """Air that brakes the platform by its velocity: a toy of a section that pushes."""

    words = "Air"

    drag: Annotated[float, In("N s/m", gt=0.0), "Force per velocity."] = DRAG_OF_AIR

    def push(self, builder, platform):
        """Adds the force against the velocity of Po, the last numbers of the state."""
        D = np.zeros((6, platform.state.size()))
        D[3:, -3:] = -self.drag * np.eye(3)
        block = builder.AddNamedSystem(platform.prefix + "air", MatrixGain(D))
        builder.Connect(platform.state, block.get_input_port())
        return block.get_output_port()


@settings
class AiryServo(Scenario):
    """A visual servo in air."""

    air: Annotated[Air, "Air."] = filled(Air)


@settings
class AiryTensions(TensionScenario):
    """Dynamic control in air."""

    air: Annotated[Air, "Air."] = filled(Air)


WEIGHT = "disturbances={pushes: [{kind: payload, mass: 0.1}]}"


@pytest.mark.parametrize(
    ("schema", "name", "quick"),
    [
        (AiryServo, "acrobot_pbvs", ["camera.kind=projected", "duration=0.5"]),
        (AiryTensions, "acrobot_computed_torque", ["duration=0.5", "trajectory.pause=0"]),
    ],
)
def test_a_section_brakes_a_platform_by_its_velocity_and_another_pushes_beside_it(
    schema, name, quick
):
    run = KINDS[load_scenario(name).kind]
    log = run(load_scenario(name, [*quick, WEIGHT, "log_rate=1000"], schema=schema)).simulate().log
    alone = run(load_scenario(name, [*quick, "log_rate=1000"], schema=schema)).simulate().log
    for each, weight in ((log, 0.1 * 9.81), (alone, 0.0)):
        v = np.gradient(each["X_WP"][:, 4:], each["time"], axis=0)
        expected = -DRAG_OF_AIR * v - [0.0, 0.0, weight]
        assert np.ptp(v) > 0.02
        SLOPES = 2e-2 * np.ptp(v) * DRAG_OF_AIR  # of differences from row to row
        np.testing.assert_allclose(each["applied_wrench"][5:-5, 3:], expected[5:-5], atol=SLOPES)
        assert np.all(each["applied_wrench"][:, :3] == 0.0)
    plain = run(load_scenario(name, [*quick, "log_rate=1000"])).simulate().log
    assert np.max(np.abs(plain["X_WP"] - alone["X_WP"])) > 1e-9


def test_compiled_steps_of_dynamic_control_refuse_what_pushes():
    compiled = ["integration.engine=compiled"]
    scenario = load_scenario("acrobot_computed_torque", compiled, schema=AiryTensions)
    with pytest.raises(ScenarioError, match=r"integration\.engine: found compiled beside what pu"):
        TensionRun(scenario).simulate()
