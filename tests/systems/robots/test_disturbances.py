"""Pushes over time: closed forms, the spectrum of the wind, repeatability."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource, LogVectorOutput

from cdpr_drake.systems.robots.disturbances import Disturbances, DisturbanceSettings, Push

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
