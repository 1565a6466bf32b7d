"""Results as tables: columns of one length, the numbers that the result itself has."""

import numpy as np
import pandas as pd
import pytest

import cdpr_drake as cdpr

QUICK = ["camera.kind=projected", "duration=0.1"]


@pytest.fixture(scope="module")
def workspace():
    return cdpr.compute_workspace("planar", grid=(4, 3, 1), measures="capacity-margin")


def test_a_workspace_has_a_row_a_pose(workspace):
    frame = workspace.to_dataframe()
    assert isinstance(frame, pd.DataFrame)
    assert len(frame) == workspace.grid.size
    np.testing.assert_array_equal(frame[["x_m", "y_m", "z_m"]], workspace.grid.positions())
    inside = frame[frame.static]
    assert len(inside) == workspace.inside("static").sum() > 0
    assert np.all(inside["capacity-margin"] >= 0.0)


def test_stability_has_a_row_a_pose():
    found = cdpr.assess_stability("planar", "pbvs", "sampled", grid=(2, 2, 1), draws=5)
    frame = found.to_dataframe()
    assert len(frame) == 4
    assert list(frame[f"Z {found.names[0]}"]) == list(found.stable[0].ravel())


def test_a_plan_and_repeated_runs():
    robot = cdpr.load_robot("planar")
    aside = cdpr.Pose(position=[0.1, 0.0, robot.plane_height])
    plan = cdpr.plan_path(robot, [None, aside], stations=50)
    frame = plan.to_dataframe()
    assert frame.time_s.is_monotonic_increasing
    assert frame.time_s.iloc[-1] == pytest.approx(plan.motion.end_time)
    runs = cdpr.repeat_run("acrobot_pbvs", QUICK, seeds=range(2), workers=1)
    assert list(runs.to_dataframe()["seed"]) == [0, 1]


def test_a_run_writes_its_replay_and_has_the_columns_of_its_log(tmp_path):
    run = cdpr.simulate("acrobot_pbvs", QUICK, folder=tmp_path / "run", formats=())
    frame, written = run.to_dataframe(), pd.read_csv(tmp_path / "run" / "log.csv")
    assert list(frame.columns) == list(written.columns)
    np.testing.assert_array_equal(frame, written)
    run.replay(tmp_path / "mine.html")
    assert "<html" in (tmp_path / "mine.html").read_text(encoding="utf-8")[:500]
