"""Motions from samples and from files: what they meet, and what is refused."""

import re

import numpy as np
import pytest

from cdpr_drake.errors import TrajectoryError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.trajectories.sampled_motion import (
    MOTION_COLUMNS,
    TIME_COLUMN,
    read_motion,
    sampled_motion,
)

POSES = tuple(
    pose_from_angles(np.array(p), np.radians(a))
    for p, a in (([0.0, 0.0, 0.2], [0.0, 0.0, 0.0]), ([0.3, -0.2, 0.5], [40.0, -30.0, 170.0]))
)
MOTION = PoseTrajectory(POSES, (1.2,), 0.1)
RATE = 1000.0


@pytest.fixture(scope="module")
def samples():
    times = np.append(np.arange(100, 1300) / RATE, 1.3)
    return times, np.array([MOTION.motion(t) for t in times])


def test_samples_are_met_with_both_derivatives(samples):
    times, rows = samples
    found = sampled_motion(times, rows)
    assert (found.start_time, found.end_time) == (times[0], pytest.approx(times[-1]))
    # At every instant of control, whichever side of a sample rounding puts it.
    for t, row in zip(times[1:-1], rows[1:-1], strict=True):
        for instant in (np.nextafter(t, 0.0), t, np.nextafter(t, 2.0)):
            got = found.motion(instant)
            got[:4] *= np.sign(got[:4] @ row[:4])
            np.testing.assert_allclose(got, row, rtol=0.0, atol=1e-9 * np.max(np.abs(rows)))
    between = times[:-1] + 0.4e-3
    got = np.array([found.motion(t)[4:] for t in between])
    want = np.array([MOTION.motion(t)[4:] for t in between])
    np.testing.assert_allclose(got[:, :9], want[:, :9], atol=1e-8)
    np.testing.assert_allclose(found.motion(5.0)[7:], 0.0)


def test_coarse_samples_make_a_smooth_motion(samples):
    times, rows = samples
    found = sampled_motion(times[::100], rows[::100])
    far = [np.linalg.norm(found.motion(t)[4:7] - MOTION.motion(t)[4:7]) for t in times]
    assert max(far) < 1e-6


def table(path, times, rows, columns=MOTION_COLUMNS):
    lines = [",".join(("extra", *columns, TIME_COLUMN))]
    lines += [",".join(["7", *map(repr, row.tolist()), repr(float(t))]) for t, row in
              zip(times, rows, strict=True)]  # fmt: skip
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_file_says_the_same_and_may_begin_later(tmp_path, samples):
    times, rows = (values[::100] for values in samples)
    one, other = sampled_motion(times, rows), read_motion(table(tmp_path / "m.csv", times, rows))
    np.testing.assert_array_equal(one.motion(0.7321), other.motion(0.7321))
    later = read_motion(tmp_path / "m.csv", 0.5)
    np.testing.assert_allclose(later.motion(1.2321), one.motion(0.7321), atol=1e-12)


def changed(rows, at, to):
    rows = rows.copy()
    rows[at] = to
    return rows


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda t, r: (t[:1], r[:1]), "found 1 samples"),
        (lambda t, r: (t[::-1], r), "after 1.3 s; accepted: times from 0 on that grow"),
        (lambda t, r: (t - 1.0, r), "times from 0 on"),
        (lambda t, r: (t, changed(r, (3, 0), 2.0)), "at 0.4 s: found a quaternion"),
        (lambda t, r: (t[:8], r[:8]), r"at 0.8 s: found velocities up to .* rest at both ends"),
        (
            lambda t, r: (t, r * np.where((np.arange(19) > 3) & (np.arange(19) < 7), 1e3, 1.0)),
            "of one motion, in",
        ),
    ],
)
def test_samples_that_make_no_motion_are_named(samples, wrong, said):
    times, rows = (values[::100] for values in samples)
    with pytest.raises(TrajectoryError, match=said):
        sampled_motion(*wrong(times, rows))


def test_files_that_cannot_be_read_are_named(tmp_path, samples):
    times, rows = (values[::100] for values in samples)
    with pytest.raises(TrajectoryError, match="no such file of a motion"):
        read_motion(tmp_path / "none.csv")
    path = tmp_path / "m.csv"
    path.write_text("")
    with pytest.raises(TrajectoryError, match="line 1: found no column time_s"):
        read_motion(path)
    table(path, times, rows, (*MOTION_COLUMNS[:-1], "az"))
    with pytest.raises(TrajectoryError, match="found no column az_m_s2"):
        read_motion(path)
    table(path, times, rows)
    path.write_text(path.read_text().replace("7,", "7,x", 1))
    with pytest.raises(TrajectoryError, match=re.escape(f"{path}: line 2: found '7,x")):
        read_motion(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TrajectoryError, match="cannot be read as text"):
        read_motion(path)
