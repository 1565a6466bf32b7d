"""Repeated runs: the same whoever does them, kept when stopped; what they leave, by hand."""

import csv
import errno
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.runs.seeds import METRICS, Repetition, run_many, statistics, with_seeds
from cdpr_drake.analyses.simulation.monte_carlo_report import (
    repetition_figure,
    repetition_pictures,
    repetition_summary,
    repetition_table,
    write_repetitions,
)
from cdpr_drake.analyses.simulation.monte_carlo_store import RunRecord, StoredRuns
from cdpr_drake.errors import InfeasibleTensionError, OutputFolderError, OutputFormatError
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.analyses.simulation.run_by_hand import run_by_hand
from tests.analyses.simulation.test_inputs_read_once import write_robot
from tests.figure_faults import figure_faults

SHORT = [
    "camera.kind=projected", "duration=0.2", "perturbations.exit_points=0.01",
    "perturbations.initial_pose_shift={distance: 0.05, angle_deg: 5}",
    "integration.engine=compiled",
]  # fmt: skip
TIMES = ("wall_time_s", "realtime_factor")


def without_times(record):
    return {key: value for key, value in record.summary.items() if key not in TIMES}


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    file = write_robot(tmp_path_factory.mktemp("robot") / "mine.yaml")
    return load_scenario("acrobot_pbvs", [*SHORT, f"robot={file}"])


@pytest.fixture(scope="module")
def runs(scenario):
    return run_many(with_seeds(scenario, [3, 0, 7]), workers=1, keep_traces=True)


@pytest.mark.parametrize("workers", [1, 2])
def test_who_runs_them_and_edits_of_the_robot_meanwhile_change_nothing(workers, scenario, runs):
    file, seen = Path(scenario.robot), []

    def edit(progress):
        seen.append(progress)
        write_robot(file, "1.95")

    asked = with_seeds(scenario, [3, 0, 7])
    try:
        again = run_many(asked, workers, edit)
        (heavy,) = run_many(asked[:1], 1).records
    finally:
        write_robot(file)
    assert [record.seed for record in again.records] == [3, 0, 7]
    for one, other in zip(runs.records, again.records, strict=True):
        assert without_times(one) == without_times(other)
        np.testing.assert_array_equal(one.end, other.end)
    assert sorted(p.done for p in seen) == [1, 2, 3]
    assert all(p.total == 3 for p in seen)
    assert not again.records[0].traces
    assert not again.interrupted
    # So that the edit would have been seen.
    assert heavy.summary["tension_n"] != runs.records[0].summary["tension_n"]


def test_seeds_make_runs_differ(runs):
    ends = np.array([record.end for record in runs.records])
    assert np.min(np.ptp(ends[:, 4:], axis=0)) > 1e-6
    estimates = runs.values("final_pose_estimate_error_m")
    assert np.all(estimates > 0.03)
    assert len(set(estimates)) == 3


def test_a_request_to_stop_keeps_what_is_finished(scenario):
    done = []
    asked = with_seeds(scenario, range(50))
    runs = run_many(asked, 1, done.append, should_stop=lambda: len(done) >= 2)
    assert runs.interrupted
    assert [record.seed for record in runs.records] == [0, 1]


def test_a_scenario_that_cannot_be_built_is_an_error():
    high = load_scenario("acrobot_pbvs", [*SHORT, "initial_pose.position=[0, 0, 1.1]"])
    with pytest.raises(InfeasibleTensionError, match="cannot hold the platform"):
        run_many([high], workers=1)


def test_runs_are_kept_by_their_seeds_and_a_damaged_one_is_missing(scenario, runs, tmp_path):
    for record in runs.records:
        StoredRuns(tmp_path / "out", scenario).store(record)
    again = StoredRuns(tmp_path / "out", replace(scenario, seed=5))
    for index, record in enumerate(runs.records):
        stored = again.load(index, record.seed)
        assert (stored.index, stored.seed, stored.summary) == (index, record.seed, record.summary)
        np.testing.assert_array_equal(stored.end, record.end)
        assert stored.traces.keys() == record.traces.keys()
        for name, values in record.traces.items():
            np.testing.assert_array_equal(stored.traces[name], values)
    file = tmp_path / "out" / "chunks" / "seed-0.npz"
    file.write_bytes(file.read_bytes()[:100])
    assert again.load(0, 0) is None
    assert again.load(0, 1) is None


def test_other_folders_are_refused_and_left_alone(scenario, runs, tmp_path, monkeypatch):
    (tmp_path / "thesis.txt").write_text("x")
    with pytest.raises(OutputFolderError, match="holds files already"):
        StoredRuns(tmp_path, scenario)
    with pytest.raises(OutputFolderError, match="found a file"):
        StoredRuns(tmp_path / "thesis.txt", scenario)
    assert os.listdir(tmp_path) == ["thesis.txt"]
    folder = StoredRuns(tmp_path / "out", scenario)
    with pytest.raises(OutputFolderError, match=r"scenario\.duration is 0\.2 there, 0\.3 here"):
        StoredRuns(tmp_path / "out", replace(scenario, duration=0.3))

    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full)
    with pytest.raises(OutputFolderError, match=r"out: cannot be written: No space left.*kept"):
        folder.store(runs.records[0])
    (tmp_path / "out" / "arguments.json").write_text("{")
    with pytest.raises(OutputFolderError, match="no JSON"):
        StoredRuns(tmp_path / "out", scenario)


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


# By hand.

BY_HAND = 1e-12
"""Sums of a few numbers of order one, absolute."""

SEEDS = (4, 2, 9)
OUTCOMES = ("converged", "converged", "timeout")
ENDS = ([0.003, 0.0, 0.004], [0.003, 0.002, 0.004], [0.1, 0.2, 0.3])
TURNS = (0.1, 0.3, 0.0)


LABELS = {
    "final_position_error_m": "final position error [mm]",
    "final_rotation_error_rad": "final rotation error [deg]",
    "image_deviation_px.max": "from the line in the image, largest [px]",
    "image_deviation_px.mean": "from the line in the image, mean [px]",
    "camera_deviation_m.max": "from the line in space, largest [mm]",
    "camera_deviation_m.mean": "from the line in space, mean [mm]",
    "pose_estimate_error_m.max": "pose estimate, largest error [mm]",
    "pose_estimate_error_m.mean": "pose estimate, mean error [mm]",
    "pose_estimate_error_rad.max": "pose estimate, largest error [deg]",
    "sim_time_s": "time [s]",
    "slack_cable_seconds": "slack [cable seconds]",
}
"""What users read in tables and find in runs.csv."""


def test_metrics_are_numbers_of_a_run_and_named_in_words():
    assert {metric: label for metric, (label, _) in METRICS.items()} == LABELS
    found = run_by_hand().as_dict()
    for metric in METRICS:
        key, _, inner = metric.partition(".")
        value = found[key][inner] if inner else found[key]
        assert isinstance(value, float), metric


def number(metric, run):
    """A number of its own for every metric and run, of order one."""
    return (1.0 + list(METRICS).index(metric)) * (run + 1.0) ** 2


def summary_of(run):
    made = {"outcome": OUTCOMES[run], "seed": SEEDS[run], "engine": "compiled", "loop": "diagram"}
    for metric in METRICS:
        key, dot, inner = metric.partition(".")
        if dot:
            made.setdefault(key, {})[inner] = number(metric, run)
        else:
            made[key] = number(metric, run)
    if run == 2:
        made["image_deviation_px"] = {"max": None, "mean": None}
    return made


def traces_of(run):
    path = np.array([[10.0, 20.0], [30.0, 40.0 + run]])
    return {
        "image_path": path,
        "image_line": path + 1.0,
        "image_time": np.array([0.0, 1.0 + run]),
        "image_deviation": np.array([5.0, 6.0 + run]),
    }


@pytest.fixture(scope="module")
def hand():
    """Runs whose numbers are written by hand."""
    poses = [
        pose_row(pose_from_angles(np.array(p), np.array([0.0, 0.0, turn])))
        for p, turn in zip(ENDS, TURNS, strict=True)
    ]
    records = [
        RunRecord(k, SEEDS[k], summary_of(k), poses[k], traces_of(k) if k < 2 else {})
        for k in range(3)
    ]
    return Repetition(tuple(records), 5, 12.5, (7,))


@pytest.fixture(scope="module")
def summary(scenario, hand):
    return repetition_summary(scenario, hand)


def test_the_summary_counts(summary):
    expected = {
        "scenario": "acrobot_pbvs",
        "seeds": [4, 2, 9],
        "wanted": 5,
        "interrupted": True,
        "lost_seeds": [7],
        "outcomes": {"converged": 2, "timeout": 1},
        "engines": {"compiled": 3},
        "loops": {"diagram": 3},
        "wall_time_s": 12.5,
        "runs": [summary_of(k) for k in range(3)],
    }
    assert {key: summary[key] for key in expected} == expected
    assert {"drake", "numpy"} <= set(summary["versions"])
    assert set(summary) == {*expected, "statistics", "repeatability", "versions"}


def test_statistics_of_every_metric(summary):
    assert list(summary["statistics"]) == list(METRICS)
    for k, (metric, found) in enumerate(summary["statistics"].items()):
        share = k + 1.0
        values = [1.0, 4.0] if metric.startswith("image_deviation") else [1.0, 4.0, 9.0]
        mean = sum(values) / len(values)
        std = (sum((v - mean) ** 2 for v in values) / (len(values) - 1)) ** 0.5
        assert found == pytest.approx(
            {"mean": share * mean, "max": share * values[-1], "min": share, "std": share * std},
            abs=BY_HAND,
        )


def test_one_number_has_no_deviation_and_none_has_nothing():
    assert statistics(np.array([2.0])) == {"mean": 2.0, "max": 2.0, "min": 2.0, "std": None}
    none = {"mean": None, "max": None, "min": None, "std": None}
    assert statistics(np.array([np.nan, np.inf])) == none
    assert statistics(np.array([1.0, np.inf, 3.0]))["std"] == pytest.approx(np.sqrt(2.0))


def test_repeatability_is_of_the_poses_that_converged(summary):
    """Two ends 2 mm and 0.2 rad apart: each lies 1 mm and 0.1 rad off their mean."""
    found = summary["repeatability"]
    assert found["runs"] == 2
    assert found["accuracy_m"] == pytest.approx(np.sqrt(0.003**2 + 0.001**2 + 0.004**2))
    assert found["accuracy_rad"] == pytest.approx(0.2)
    assert found["repeatability_m"] == pytest.approx(0.001)
    assert found["repeatability_rad"] == pytest.approx(0.1)
    # ISO 9283: the mean distance from the barycentre and three of its deviations, which are zero.
    assert found["iso_9283_rp_m"] == pytest.approx(0.001)


def test_without_a_run_that_converged_there_is_none(scenario, hand):
    failed = Repetition(hand.records[2:], 1, 1.0)
    summary = repetition_summary(scenario, failed)
    assert summary["repeatability"] is None
    assert summary["interrupted"] is False
    assert repetition_table(summary).row_count == len(METRICS)


def test_the_table_shows_millimetres_and_degrees(summary):
    table = repetition_table(summary)
    words, mean, largest, std = (list(column.cells) for column in table.columns)
    assert table.title == "acrobot_pbvs: 2 converged, 1 timeout"
    assert [column.header for column in table.columns] == ["over runs", "mean", "max", "std"]
    assert [column.justify for column in table.columns] == ["left", "right", "right", "right"]
    assert words[: len(METRICS)] == [label for label, _ in METRICS.values()]
    for k, (metric, (label, factor)) in enumerate(METRICS.items()):
        unit = label[label.index("[") + 1 : label.index("]")]
        assert factor == pytest.approx({"mm": 1e3, "deg": 180.0 / np.pi}.get(unit, 1.0))
        found = summary["statistics"][metric]
        for column, key in ((mean, "mean"), (largest, "max"), (std, "std")):
            assert column[k] == f"{factor * found[key]:.3f}"
    below = dict(zip(words[len(METRICS) :], mean[len(METRICS) :], strict=True))
    assert below == {
        "accuracy [mm]": f"{np.sqrt(26.0):.3f}",
        "accuracy [deg]": f"{np.degrees(0.2):.3f}",
        "repeatability [mm]": "1.000",
        "repeatability [deg]": f"{np.degrees(0.1):.3f}",
        "repeatability, ISO 9283 [mm]": "1.000",
    }
    assert largest[len(METRICS) :] == std[len(METRICS) :] == [""] * 5
    assert [row.end_section for row in table.rows].index(True) == len(METRICS) - 1


def test_a_table_of_nothing_says_so(scenario):
    table = repetition_table(repetition_summary(scenario, Repetition((), 3, 0.1)))
    assert table.title == "acrobot_pbvs: no run finished"
    assert list(table.columns[1].cells) == ["-"] * len(METRICS)


def test_files_hold_what_was_found(scenario, hand, summary, tmp_path):
    assert write_repetitions(tmp_path, scenario, hand, load_robot(scenario.robot)) == summary
    assert json.loads((tmp_path / "summary.json").read_text(encoding="utf-8")) == summary
    with (tmp_path / "runs.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = list(csv.reader(file))
    assert header == ["seed", "outcome", *METRICS]
    assert [row[:2] for row in rows] == [
        [str(seed), outcome] for seed, outcome in zip(SEEDS, OUTCOMES, strict=True)
    ]
    for run, row in enumerate(rows):
        for metric, value in zip(METRICS, row[2:], strict=True):
            lost = run == 2 and metric.startswith("image_deviation")
            assert value == ("nan" if lost else str(number(metric, run)))
    assert load_scenario(str(tmp_path / "scenario.yaml")).perturbations.exit_points == 0.01
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"summary.json", "runs.csv", "scenario.yaml", "robot.yaml"}


def test_the_figure_draws_paths_and_ends_in_millimetres(scenario, hand, tmp_path):
    assert repetition_pictures(scenario, Repetition((), 3, 0.1)) == {}
    assert write_pictures(tmp_path, repetition_pictures(scenario, hand)) == {}
    assert [path.name for path in tmp_path.iterdir()] == ["repetitions.png"]
    image, deviation, ends = repetition_figure(scenario, hand).axes
    drawn = [line.get_xydata() for line in image.lines]
    for run in range(2):
        path = traces_of(run)["image_path"]
        assert any(np.array_equal(data, path) for data in drawn)
        assert any(np.array_equal(data, path + 1.0) for data in drawn)
    assert len(drawn) == 4  # the third run has no traces
    low, high = image.get_ylim()
    assert low > high  # v points down
    over_time = [line.get_xydata() for line in deviation.lines]
    np.testing.assert_array_equal(over_time, [[[0, 5], [2, 7]]])  # the median where runs last
    points = [line.get_xydata() for line in ends.lines]
    np.testing.assert_allclose(points[0], [[3.0, 0.0], [3.0, 2.0]])
    np.testing.assert_allclose(points[1], [[100.0, 200.0]])
    np.testing.assert_array_equal(points[2], [[0.0, 0.0]])
    assert len(points) == 3
