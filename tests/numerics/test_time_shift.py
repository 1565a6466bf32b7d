import numpy as np
import pytest

from cdpr_drake.numerics.time_shift import WORSE, tracker_shift

TIME = np.linspace(0.0, 10.0, 201)


def lengths(time):
    return 1.0 + 0.1 * np.stack([np.sin(1.3 * time), np.cos(0.7 * time + 0.3)], axis=1)


@pytest.mark.parametrize("late", [-0.4, -0.03, 0.12, 0.9])
def test_a_late_tracker_is_found(late):
    noise = 1e-4 * np.random.default_rng(0).standard_normal((201, 2))
    counted = 0.3 + 1.01 * lengths(TIME) + noise  # offsets and drums may be off
    shift, better = tracker_shift(TIME, counted, lengths(TIME - late))
    assert shift == pytest.approx(late, abs=5e-3)
    assert better > WORSE


def test_a_tracker_in_time_is_left_alone():
    noise = 1e-3 * np.random.default_rng(0).standard_normal((201, 2))
    assert tracker_shift(TIME, lengths(TIME) + noise, lengths(TIME))[1] < 1.1


@pytest.mark.parametrize("count", [3, 201])
def test_logs_that_cannot_tell_say_so(count):
    still = np.ones((count, 2)) + 1e-4 * np.random.default_rng(0).standard_normal((count, 2))
    assert tracker_shift(TIME[:count], still, still) == (0.0, 1.0)
