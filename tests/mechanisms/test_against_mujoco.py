"""An independent engine: the same machines in MuJoCo, at random states, by both kinds of forces."""

import mujoco
import numpy as np
import pytest

from cdpr_drake.models.plant_mjcf import export_plant_mjcf
from tests.mechanisms.cabled import METHODS, Cabled, alone, cables_of, random_states, taut_lengths
from tests.mechanisms.machines import MACHINES

STATES = 20

LENGTH = 1e-12
"""Of a cable of metres, over several segments [m]; found 4e-15."""

ACCELERATION, SHARE = 1e-8, 1e-12
"""Of accelerations [m/s^2, rad/s^2] absolute, and as a share of those above 1e4. Found: 4e-10 at
2e4, the rounding of two ways to solve for them."""


def in_mujoco(name, l0):
    """MuJoCo's accelerations and lengths of cables at states, in its coordinates."""
    made = export_plant_mjcf(alone(name).plant, alone(name).routes, l0)
    assert made.left_out == ()
    model = mujoco.MjModel.from_xml_string(made.text)
    data = mujoco.MjData(model)
    found = []
    for q, v in random_states(name, STATES, seed=11):
        data.qpos[:], data.qvel[:] = made.positions(q), made.velocities(q, v)
        mujoco.mj_forward(model, data)
        found.append((np.array(data.qacc), np.array(data.ten_length)))
    return made, found


@pytest.fixture(scope="module", params=MACHINES)
def machine_in_mujoco(request):
    """A machine at lengths with which a third to a half of the cables is slack."""
    l0 = (
        taut_lengths(request.param)
        * (1.0 + 0.02 * np.sin(np.arange(1.0, 100.0)))[: len(taut_lengths(request.param))]
    )
    return request.param, l0, *in_mujoco(request.param, l0)


@pytest.mark.parametrize("method", METHODS)
def test_accelerations(machine_in_mujoco, method):
    name, l0, made, found = machine_in_mujoco
    cabled = Cabled(name, method)
    assert cabled.ports.method == method
    cabled.set_lengths(l0)
    slack = []
    for (q, v), (theirs, _) in zip(random_states(name, STATES, seed=11), found, strict=True):
        ours = made.velocities(q, cabled.accelerations(q, v))
        bound = max(ACCELERATION, SHARE * float(np.max(np.abs(theirs))))
        assert np.max(np.abs(ours - theirs)) < bound
        slack.append(cabled.output("slack"))
    assert 0.1 < np.mean(slack) < 0.9  # both kinds are there


def test_lengths(machine_in_mujoco):
    name, _, _, found = machine_in_mujoco
    cables, context = cables_of(name), alone(name).home()
    for (q, _), (_, theirs) in zip(random_states(name, STATES, seed=11), found, strict=True):
        cables.plant.SetPositions(context, q)
        lengths, _ = cables.lengths_and_jacobian(context)
        assert np.max(np.abs(lengths - theirs)) < LENGTH


def test_coordinates_there_and_back(machine_in_mujoco):
    name, _, made, _ = machine_in_mujoco
    for q, v in random_states(name, 3, seed=12):
        qpos, qvel = made.positions(q), made.velocities(q, v)
        again = made.plant_positions(qpos)
        np.testing.assert_allclose(made.positions(again), qpos, atol=1e-14)
        np.testing.assert_allclose(made.plant_velocities(qpos, qvel), v, atol=1e-14)
