"""The ordinary robot's step: the bits of Heun's and Kutta's methods as they are written down."""

import numpy as np
import pytest

from cdpr_drake.cables.straight_kernel import floating_force
from cdpr_drake.cables.straight_lanes_kernel import put_columns
from cdpr_drake.dynamics.plain_step_kernel import plain_step
from cdpr_drake.dynamics.platform_kernel import floating_rates
from cdpr_drake.dynamics.robot_arrays import APPLIED, BODY_SIZE

STEPS = 100


def derivative(y, asked, limit, cables, body):
    """By the scalar law of the cables, one after the other."""
    out, force = np.zeros(len(y)), np.zeros(6)
    out[13:] = np.clip(asked, -limit, limit)
    floating_force(y[:13].copy(), y[13:].copy(), out[13:].copy(), cables, 0, force)
    floating_rates(y, force, body, out)
    return out


def as_written(third, y, h, at, f):
    """The step, and its platform by the lower order."""
    k1 = f(y, at(0.0))
    if not third:
        low = y + h * k1
        return y + 0.5 * h * (k1 + f(low, at(h))), low[:13]
    k2 = f(y + 0.5 * h * k1, at(0.5 * h))
    k3 = f(y + h * (2.0 * k2 - k1), at(h))
    return y + h / 6.0 * (k1 + 4.0 * k2 + k3), (y + h * k2)[:13]


@pytest.mark.parametrize("third", [True, False])
@pytest.mark.parametrize("applied", [0.0, 1.0])
@pytest.mark.parametrize("m", [4, 8, 11])
def test_a_step_has_the_bits_of_what_is_written_down(third, applied, m):
    rng = np.random.default_rng(m)
    h, time, limit, turned = 1e-3, 0.02, 0.5, 0
    for _ in range(STEPS):
        body, cables = rng.normal(size=BODY_SIZE), rng.normal(size=(m, 17))
        body[APPLIED], cables[:, 6], cables[:, 7] = applied, 1e3, 1e-3
        work, columns = np.full((8, 13 + m), 3.0), np.zeros((8, max(m, 6)))
        work[0] = rng.normal(size=13 + m)
        work[0, 13:] = rng.uniform(0.3, 4.0, m)
        command, rate = rng.normal(size=m), rng.normal(size=m)
        put_columns(cables, columns)

        def at(passed, command=command, rate=rate):
            return command + rate * (time + passed)

        def f(y, asked, cables=cables, body=body):
            return derivative(y, asked, limit, cables, body)

        begun = work[0].copy()
        wanted, low = as_written(third, begun, h, at, f)
        plain_step(work, body, columns, limit, third, h, command, rate, time)
        np.testing.assert_array_equal(work[1], wanted)
        np.testing.assert_array_equal(work[2, :13], low)
        np.testing.assert_array_equal(work[0], begun)
        turned += np.abs(command + rate * time).max() > limit
    assert turned > 0  # rated speeds count
