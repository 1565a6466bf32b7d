"""Repeated runs: the same whoever does them, kept when stopped, and counted rightly."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.io import loadmat

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.simulation.monte_carlo import ManyRuns, run_many, with_seeds
from cdpr_drake.analyses.simulation.monte_carlo_report import (
    METRICS,
    repetition_figure,
    repetition_pictures,
    repetition_summary,
    repetition_table,
    statistics,
    write_repetitions,
)
from cdpr_drake.analyses.simulation.monte_carlo_store import RunRecord
from cdpr_drake.errors import InfeasibleTensionError, OutputFormatError
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.figure_faults import figure_faults

SHORT = [
    "camera.kind=projected",
    "duration=0.6",
    "perturbations.exit_points=0.01",
    "perturbations.initial_pose_shift={distance: 0.05, angle_deg: 5}",
]
TIMES = ("wall_time_s", "realtime_factor")


def without_times(record):
    return {key: value for key, value in record.summary.items() if key not in TIMES}


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("acrobot_pbvs", SHORT)


@pytest.fixture(scope="module")
def runs(scenario):
    return run_many(with_seeds(scenario, [3, 0, 7]), workers=1, keep_traces=True)


def test_processes_give_the_same_results_in_the_same_order(scenario, runs):
    seen = []
    again = run_many(with_seeds(scenario, [3, 0, 7]), workers=2, on_progress=seen.append)
    assert [record.seed for record in again.records] == [3, 0, 7]
    for one, other in zip(runs.records, again.records, strict=True):
        assert without_times(one) == without_times(other)
        np.testing.assert_array_equal(one.end, other.end)
    assert sorted(p.done for p in seen) == [1, 2, 3]
    assert all(p.total == 3 for p in seen)
    assert not again.records[0].traces
    assert not again.interrupted


def test_seeds_make_runs_differ(runs):
    ends = np.array([record.end for record in runs.records])
    assert np.min(np.ptp(ends[:, 4:], axis=0)) > 1e-6
    estimates = runs.values("final_pose_estimate_error_m")
    assert np.all(estimates > 0.03)
    assert len(set(estimates)) == 3


def test_a_request_to_stop_keeps_what_is_finished(scenario):
    done = []
    runs = run_many(
        with_seeds(scenario, range(50)),
        workers=1,
        on_progress=done.append,
        should_stop=lambda: len(done) >= 2,
    )
    assert runs.interrupted
    assert [record.seed for record in runs.records] == [0, 1]


def test_a_scenario_that_cannot_be_built_is_an_error():
    high = load_scenario("acrobot_pbvs", [*SHORT, "initial_pose.position=[0, 0, 1.1]"])
    with pytest.raises(InfeasibleTensionError, match="cannot hold the platform"):
        run_many([high], workers=1)


def record(seed, outcome, position):
    summary = {"outcome": outcome, "final_position_error_m": position[0], "seed": seed}
    X = pose_from_angles(np.array(position), np.zeros(3))
    return RunRecord(seed, seed, summary, pose_row(X), {})


def test_repeatability_counts_converged_runs_only():
    runs = ManyRuns(
        (
            record(0, "converged", [2.0, 0.0, 0.0]),
            record(1, "converged", [4.0, 0.0, 0.0]),
            record(2, "diverged", [90.0, 0.0, 0.0]),
        ),
        3,
        1.0,
    )
    found = runs.repeatability()
    assert found.count == 2
    assert found.accuracy == pytest.approx(3.0)
    assert found.repeatability == pytest.approx(1.0)
    np.testing.assert_array_equal(runs.values("final_position_error_m"), [2.0, 4.0, 90.0])
    lost = ManyRuns((record(2, "diverged", [90.0, 0.0, 0.0]),), 1, 1.0)
    assert lost.repeatability() is None


def test_statistics_leave_out_what_is_not_a_number():
    found = statistics(np.array([1.0, np.nan, 3.0]))
    assert found == {"mean": 2.0, "max": 3.0, "min": 1.0, "std": pytest.approx(np.sqrt(2.0))}
    assert statistics(np.array([np.nan]))["mean"] is None
    assert statistics(np.array([2.0]))["std"] is None


def test_what_it_writes(scenario, runs, tmp_path):
    summary = write_repetitions(tmp_path, scenario, runs, load_robot(scenario.robot))
    assert write_pictures(tmp_path, repetition_pictures(scenario, runs)) == {}
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"summary.json", "runs.csv", "scenario.yaml", "robot.yaml", "repetitions.png"}
    assert json.loads((tmp_path / "summary.json").read_text()) == summary
    rows = (tmp_path / "runs.csv").read_text().splitlines()
    assert len(rows) == 4
    assert rows[0] == ",".join(["seed", "outcome", *METRICS])
    again = load_scenario(str(tmp_path / "scenario.yaml"))
    assert again.perturbations.exit_points == 0.01
    errors = runs.values("pose_estimate_error_m.max")
    assert summary["statistics"]["pose_estimate_error_m.max"]["max"] == np.max(errors)


def test_the_table_has_a_row_for_each_metric(scenario, runs):
    table = repetition_table(repetition_summary(scenario, runs))
    assert table.row_count == len(METRICS)  # none of these short runs converges
    assert "3 timeout" in table.title


def test_all_runs_as_one_table(runs, tmp_path):
    table = runs.table()
    assert {len(column) for column in table.values()} == {len(runs.records)}
    assert table["seed"].tolist() == [record.seed for record in runs.records]
    assert table["outcome"].tolist() == ["timeout"] * 3
    for name in ("final_position_error_m", "image_deviation_px.max", "tension_n.max"):
        np.testing.assert_array_equal(table[name], runs.values(name))
    assert "versions.numpy" in table

    runs.write_table(tmp_path / "runs.csv")
    with (tmp_path / "runs.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(table)
    errors = [float(row["final_position_error_m"]) for row in rows]
    np.testing.assert_array_equal(errors, table["final_position_error_m"])
    runs.write_table(tmp_path / "runs.npz")
    assert np.load(tmp_path / "runs.npz")["outcome"].tolist() == ["timeout"] * 3
    runs.write_table(tmp_path / "runs.mat")
    mat = loadmat(tmp_path / "runs.mat")
    np.testing.assert_array_equal(mat["tension_n_max"].ravel(), table["tension_n.max"])
    assert [str(cell[0]) for cell in mat["outcome"].ravel()] == ["timeout"] * 3
    with pytest.raises(OutputFormatError, match=r"accepted: \.csv, \.npz, \.mat, \.parquet"):
        runs.write_table(tmp_path / "runs.xlsx")


def test_a_table_says_where_a_run_has_no_number(runs):
    records = list(runs.records)
    without = {**records[1].summary, "camera_deviation_m": None}
    records[1] = replace(records[1], summary=without)
    table = replace(runs, records=tuple(records)).table()
    assert np.isnan(table["camera_deviation_m.max"]).tolist() == [False, True, False]


def test_a_table_as_parquet(runs, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    runs.write_table(tmp_path / "runs.parquet")
    found = parquet.read_table(tmp_path / "runs.parquet")
    assert found["outcome"].to_pylist() == ["timeout"] * 3
    assert found["seed"].to_pylist() == runs.table()["seed"].tolist()


def test_distances_of_many_runs_are_a_median_in_their_range(scenario, runs):
    """Curves of twenty runs were one dark band."""
    short = runs.records[0]
    cut = {name: short.traces[name][:9] for name in ("image_time", "image_path", "image_deviation")}
    some = [replace(short, traces={**short.traces, **cut}), *runs.records[1:]]
    figure = repetition_figure(scenario, replace(runs, records=some))
    assert figure_faults(figure) == []
    deviation = figure.axes[1]
    (median,) = deviation.lines
    assert median.get_xdata()[-1] == some[1].traces["image_time"][-1]
    both = np.mean([record.traces["image_deviation"][-1] for record in some[1:]])
    assert median.get_ydata()[-1] == pytest.approx(both)
    (band,) = deviation.collections
    assert band.get_datalim(deviation.transData).y1 == pytest.approx(
        max(np.max(record.traces["image_deviation"]) for record in some)
    )
