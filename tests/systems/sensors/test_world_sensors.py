"""The scanner on the hose of the Gazebo thesis: what its beams end on is where it was put."""

import numpy as np
import pytest

from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo

EXACT = 1e-6
"""Metres; the issue's bound for scans without noise."""

GROUND = -1e-3
"""Height of the ground that is to be seen [m]."""

QUICK = ("camera.kind=projected", "integration.engine=compiled")


@pytest.fixture(scope="module")
def servo():
    return build_visual_servo(load_scenario("caroca_world", QUICK))


def ends_of(servo, time):
    """Where the beams end in W at a time, those that do, shape (k, 3) [m]; and their angles."""
    context = servo.make_context()
    context.SetTime(time)
    servo.block.set_at_equilibrium(
        servo.block.GetMyMutableContextFromRoot(context), servo.scenario.initial_pose.transform()
    )
    sensor = servo.looking.ranges["hokuyo"]
    found = sensor.truth(sensor.GetMyContextFromRoot(context))
    hose = next(body for body in servo.scenario.world.obstacles if body.name == "hose")
    settings = servo.scenario.sensors.range_sensors[0]
    X_WS = hose.path().at(time) @ settings.pose.transform()
    there = np.isfinite(found)
    angles = sensor.angles[there]
    p_S = found[there] * np.array([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    return (X_WS @ p_S).T


@pytest.mark.parametrize("time", [0.0, 0.7])
def test_beams_end_on_the_ground_and_never_below(servo, time):
    """While the hose swings: the ground stays where it is."""
    ends = ends_of(servo, time)
    assert np.min(ends[:, 2]) == pytest.approx(GROUND, abs=EXACT)
    assert np.sum(np.abs(ends[:, 2] - GROUND) < EXACT) > 100


def test_what_rests_carries_no_sensor():
    sensor = "sensors.range_sensors=[{name: a, carrier: barrier_a}]"
    with pytest.raises(ScenarioError, match="carrier: found barrier_a, which is not there"):
        load_scenario("caroca_world", [*QUICK, sensor])
