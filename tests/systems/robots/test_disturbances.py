"""Pushes over time: closed forms, the spectrum of the wind, repeatability, refusals."""

import re

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource, LogVectorOutput

from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.robots.disturbances import (
    Disturbances,
    DisturbanceSettings,
    Push,
)

GRAVITY = np.array([0.0, 0.0, -9.81])
X_WP = RigidTransform(RollPitchYaw(0.1, -0.2, 0.7), [0.3, 0.1, 0.5])


def wrenches(pushes, *, duration=2.0, rate=1000.0, seed=0):
    """Times and wrenches, one of each period."""
    builder = DiagramBuilder()
    settings = DisturbanceSettings(pushes=pushes, rate=rate)
    block = builder.AddSystem(Disturbances(settings, GRAVITY, seed=seed))
    pose = builder.AddSystem(ConstantValueSource(Value(X_WP)))
    builder.Connect(pose.get_output_port(), block.GetInputPort("X_WP"))
    log = LogVectorOutput(block.GetOutputPort("wrench"), builder, 1.0 / rate)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    found = log.FindLog(simulator.get_context())
    return found.sample_times(), found.data().T


def test_a_step_begins_and_ends():
    times, found = wrenches(
        [Push(kind="step", force=np.array([0.0, 5.0, 0.0]), start=0.5, end=1.0)]
    )
    # A row at an instant holds what stood there before: that of the period before.
    acts = (times > 0.5 + 1e-9) & (times < 1.0 + 1e-9)
    assert np.all(found[acts] == [0.0, 0.0, 0.0, 0.0, 5.0, 0.0])
    assert np.all(found[~acts] == 0.0)


def test_a_push_has_the_impulse_of_half_a_sine():
    force, length = np.array([3.0, 0.0, -1.0]), 0.3
    _, found = wrenches([Push(kind="push", force=force, start=0.2, end=0.2 + length)])
    impulse = found[:, 3:].sum(axis=0) * 1e-3
    MIDDLES = (np.pi * 1e-3 / length) ** 2 / 24  # error of the midpoint rule
    np.testing.assert_allclose(impulse, 2.0 * length / np.pi * force, rtol=2.0 * MIDDLES)


def test_a_sine_and_a_force_off_the_origin():
    point = np.array([0.1, 0.0, 0.2])
    push = Push(
        kind="sine", frequency=2.0, force=np.array([0.0, 4.0, 0.0]), frame="platform", point=point
    )
    times, found = wrenches([push])
    R = X_WP.rotation().matrix()
    f = np.sin(4.0 * np.pi * (times[1:] - 0.5e-3))[:, None] * (R @ push.force)
    np.testing.assert_allclose(found[1:, 3:], f, atol=1e-12)
    np.testing.assert_allclose(found[1:, :3], np.cross(R @ point, f), atol=1e-12)


def test_a_payload_weighs_where_it_hangs():
    _, found = wrenches([Push(kind="payload", mass=2.0, point=np.array([0.5, 0.0, 0.0]))])
    arm = X_WP.rotation().matrix() @ [0.5, 0.0, 0.0]
    np.testing.assert_allclose(found[-1, 3:], 2.0 * GRAVITY)
    np.testing.assert_allclose(found[-1, :3], np.cross(arm, 2.0 * GRAVITY))


def wind(**more):
    return Push(kind="wind", wind=np.array([8.0, 0.0, 0.0]), drag_area=0.5, **more)


def test_a_steady_wind_drags():
    _, found = wrenches([wind()])
    assert found[-1] == pytest.approx([0, 0, 0, 0.5 * 1.225 * 0.5 * 64.0, 0, 0])


def test_gusts_have_the_stated_spectrum():
    """Of first order: standard deviation and correlation over time are in closed form."""
    push = wind(intensity=0.2, length_scale=4.0)
    _, found = wrenches([push], duration=2000.0, rate=20.0, seed=3)
    force = found[1:, 3:]
    sizes = np.linalg.norm(force, axis=1) / (0.5 * 1.225 * 0.5)
    gusts = force / (0.5 * 1.225 * 0.5) / np.sqrt(sizes)[:, None] - push.wind
    kept = np.exp(-8.0 / 4.0 / 20.0)
    independent = len(gusts) * (1.0 - kept) / (1.0 + kept)
    WITHIN = 4.0 / np.sqrt(independent)  # four standard deviations
    assert np.std(gusts, axis=0) == pytest.approx(0.2 * 8.0, rel=WITHIN)
    lagged = np.mean(gusts[:-20] * gusts[20:], axis=0) / 1.6**2
    assert lagged == pytest.approx(np.exp(-8.0 / 4.0), abs=WITHIN)
    assert np.max(np.abs(np.mean(gusts, axis=0))) < 1.6 * WITHIN


def test_a_seed_repeats_and_another_does_not():
    push = wind(intensity=0.2)
    first, again, other = (wrenches([push], seed=seed)[1] for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_winds_are_independent():
    one, two = (wrenches([wind(intensity=0.2)] * k)[1] for k in (1, 2))
    assert not np.allclose(2.0 * one, two)


@pytest.mark.parametrize(
    ("push", "words"),
    [
        (Push(kind="step"), "force: found no force and no moment; accepted with step"),
        (Push(kind="push", force=np.ones(3)), "end: found none; accepted with push"),
        (Push(kind="sine", force=np.ones(3)), "frequency: found none"),
        (Push(kind="payload"), "mass: found none"),
        (Push(kind="payload", mass=0.0), "mass: found 0"),
        (Push(kind="payload", mass=1.0, force=np.ones(3)), "force: found one; accepted with pay"),
        (Push(kind="step", force=np.ones(3), mass=1.0), "mass: found one with step"),
        (
            Push(kind="step", force=np.ones(3), start=2.0, end=1.0),
            "end: found 1 s",
        ),
        (Push(kind="wind", wind=np.zeros(3), drag_area=1.0), "wind: found none"),
    ],
)
def test_what_is_not_accepted(push, words):
    settings = DisturbanceSettings(pushes=[Push(kind="step", force=np.ones(3)), push])
    with pytest.raises(ScenarioError, match=re.escape(f"disturbances.pushes[1].{words}")):
        settings.check()


def test_no_push_is_refused():
    with pytest.raises(ScenarioError, match="pushes: found none"):
        DisturbanceSettings(pushes=[]).check()
