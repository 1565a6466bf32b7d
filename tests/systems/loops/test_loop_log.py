"""The log of a loop: what stands still is copied, what changed is read again."""

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.systems.loops.loop_log import FIRST_ROWS, LoopLog, RowOf
from cdpr_drake.systems.loops.loop_state import Clock, first_time


def test_rows_are_what_stood_there_when_they_were_written():
    """Also beyond the room of the start, and after the log was emptied."""
    now = {}

    def stand(k):
        now["slow"] = now["slow"] if k % 3 else np.array([float(k), -k])
        now["pose"] = now["pose"] if k % 2 else RigidTransform([float(k), 0.0, 1.0])
        now["table"] = np.array([[k, k + 0.25], [k + 0.5, k + 0.75]])

    def table():
        return now["table"]

    stand(0)
    log = LoopLog(
        {
            "second": RowOf(table, 1),
            "slow": lambda: now["slow"],
            "pose": lambda: now["pose"],
            "first": RowOf(table, 0),
        }
    )
    count = FIRST_ROWS + 5
    for start in (0, 600):
        stand(start)
        for k in range(start, start + count):
            stand(k)
            log.append(0.1 * k)
        values, k = log.read(), np.arange(start, start + count)
        assert list(values) == ["time", "second", "slow", "pose", "first"]
        np.testing.assert_array_equal(values["time"], 0.1 * k)
        np.testing.assert_array_equal(values["slow"], np.transpose([k - k % 3, -(k - k % 3)]))
        np.testing.assert_array_equal(values["pose"][:, 4], k - k % 2)
        np.testing.assert_array_equal(values["pose"][:, :4], np.tile([1.0, 0, 0, 0], (count, 1)))
        np.testing.assert_array_equal(values["first"], np.transpose([k, k + 0.25]))
        np.testing.assert_array_equal(values["second"], np.transpose([k + 0.5, k + 0.75]))
        log.clear()
        assert log.rows() == 0


def test_the_first_of_clocks_is_found_but_not_after_the_end():
    clocks = [Clock(0.3), Clock(0.2)]
    assert first_time(clocks, 1.0) == 0.0
    assert all(clock.strikes(0.0) for clock in clocks)
    assert first_time(clocks, 1.0) == 0.2
    assert first_time(clocks, 0.1) == 0.1
