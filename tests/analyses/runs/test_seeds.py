"""Runs over seeds: the same whoever does them, kept when stopped; numbers and figure by hand."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.frame.words import seeds
from cdpr_drake.analyses.runs import seeds as module
from cdpr_drake.analyses.runs.seeds import (
    METRICS,
    Record,
    Repetition,
    entries,
    repeat_run,
    run_many,
    statistics,
    with_seeds,
)
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import InfeasibleTensionError, OutputFormatError, SweepError
from cdpr_drake.geometry.poses import pose_from_angles, pose_from_row, pose_row
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO
from tests.analyses.runs.test_inputs_read_once import write_robot
from tests.cli.commands import killed_after, refuse, run
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
    return run_many(with_seeds(scenario, [3, 0, 7]), 1, traces=True)


@pytest.mark.parametrize("workers", [1, 2])
def test_who_runs_them_and_edits_of_the_robot_meanwhile_change_nothing(workers, scenario, runs):
    file, counts = Path(scenario.robot), []

    def edit(progress):
        counts.append((progress.done, progress.total))
        write_robot(file, "1.95")

    cases = with_seeds(scenario, [3, 0, 7])
    try:
        again = run_many(cases, workers, follow=Follow(edit))
        (heavy,) = run_many(cases[:1], 1).records
    finally:
        write_robot(file)
    assert [record.seed for record in again.records] == [3, 0, 7]
    for first, second in zip(runs.records, again.records, strict=True):
        assert without_times(first) == without_times(second)
        np.testing.assert_array_equal(first.end, second.end)
    assert counts == [(done, 3) for done in range(4)]
    assert not again.records[0].traces
    assert (again.interrupted, again.exit_code) == (False, 0)
    # So that the edit would have been seen.
    assert heavy.summary["tension_n"] != runs.records[0].summary["tension_n"]


def test_seeds_make_runs_differ_and_ends_are_in_the_frame_of_the_desired_pose(runs):
    ends = np.array([record.end for record in runs.records])
    assert np.min(np.ptp(ends[:, 4:], axis=0)) > 1e-6
    estimates = runs.values("final_pose_estimate_error_m")
    assert np.all(estimates > 0.03)
    assert len(set(estimates)) == 3
    run = ServoRun(runs.scenarios[0]).simulate()
    end = run.built.desired_platform_pose() @ pose_from_row(ends[0])
    assert end.IsNearlyEqualTo(pose_from_row(run.log["X_WP"][-1]), 1e-12)
    numbers = entries(runs.records[0].summary)
    assert all(isinstance(numbers[metric], float) for metric in METRICS)


def test_a_request_to_stop_keeps_what_is_finished(scenario):
    done = []
    follow = Follow(done.append, stop=lambda: bool(done) and done[-1].done >= 2)
    runs = run_many(with_seeds(scenario, range(50)), 1, follow=follow)
    assert (runs.interrupted, runs.exit_code) == (True, 130)
    assert [record.seed for record in runs.records] == [0, 1]
    assert runs.notes() == ["Interrupted; 2 of 50 runs; the same command goes on"]


def test_a_run_that_raises_is_named_and_the_others_go_on(scenario, monkeypatch):
    real = module._record

    def some(job, traces):
        if job[1].seed in (1, 2):
            raise ValueError("no such luck")
        return real(job, traces)

    monkeypatch.setattr(module, "_record", some)
    lines = []
    runs = run_many(with_seeds(scenario, range(4)), 1, follow=Follow(say=lines.append))
    assert lines == [f"seed {k}: ValueError: no such luck" for k in (1, 2)]
    assert runs.notes() == ["cdpr: 2 of 4 runs failed: seed 1, 2"]
    assert list(runs.lost.values()) == lines
    assert [record.seed for record in runs.records] == [0, 3]
    assert (runs.exit_code, runs.as_dict()["lost_seeds"]) == (3, [1, 2])


def test_a_scenario_that_cannot_be_built_is_an_error():
    high = load_scenario("acrobot_pbvs", [*SHORT, "initial_pose.position=[0, 0, 1.1]"])
    with pytest.raises(InfeasibleTensionError, match="cannot hold the platform"):
        run_many([high], 1)


def test_workers_that_do_not_answer_are_refused_without_any_remark_before():
    lines = []
    with pytest.raises(SweepError, match="does not answer"):
        repeat_run("acrobot_pbvs", seeds=[0], workers="/proc/x", follow=Follow(say=lines.append))
    assert lines == []


def test_all_runs_as_a_table(runs, tmp_path):
    table = runs.columns()
    assert table["seed"].tolist() == [record.seed for record in runs.records]
    assert table["outcome"].tolist() == ["timeout"] * 3
    for name in ("final_position_error_m", "image_deviation_px.max", "tension_n.max"):
        np.testing.assert_array_equal(table[name], runs.values(name))
    assert "versions.numpy" in table
    runs.write_table(tmp_path / "runs.csv")
    with (tmp_path / "runs.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(table) == list(runs.to_dataframe())
    errors = [float(row["final_position_error_m"]) for row in rows]
    np.testing.assert_array_equal(errors, table["final_position_error_m"])
    runs.write_table(tmp_path / "runs.mat")
    mat = loadmat(tmp_path / "runs.mat")
    np.testing.assert_array_equal(mat["tension_n_max"].ravel(), table["tension_n.max"])
    with pytest.raises(OutputFormatError, match=r"accepted: \.csv, \.npz, \.mat, \.parquet"):
        runs.write_table(tmp_path / "runs.xlsx")
    records = list(runs.records)
    records[1] = replace(records[1], summary={**records[1].summary, "camera_deviation_m": None})
    table = replace(runs, records=records).columns()
    assert np.isnan(table["camera_deviation_m.max"]).tolist() == [False, True, False]


# By hand.

BY_HAND = 1e-12
"""Sums of a few numbers of order one, absolute."""

SEEDS = (4, 2, 9)
OUTCOMES = ("converged", "converged", "timeout")
ENDS = ([0.003, 0.0, 0.004], [0.003, 0.002, 0.004], [0.1, 0.2, 0.3])
TURNS = (0.1, 0.3, 0.0)


def number(metric, k):
    """A number of its own for every metric and run, of order one."""
    return (1.0 + list(METRICS).index(metric)) * (k + 1.0) ** 2


def summary_of(k):
    made = {"outcome": OUTCOMES[k], "seed": SEEDS[k], "engine": "compiled", "loop": "diagram"}
    for metric in METRICS:
        key, dot, inner = metric.partition(".")
        if dot:
            made.setdefault(key, {})[inner] = number(metric, k)
        else:
            made[key] = number(metric, k)
    if k == 2:
        made["image_deviation_px"] = {"max": None, "mean": None}
    return made


def traces_of(k):
    path = np.array([[10.0, 20.0], [30.0, 40.0 + k]])
    return {
        "image_path": path, "image_line": path + 1.0, "image_time": np.array([0.0, 1.0 + k]),
        "image_deviation": np.array([5.0, 6.0 + k]),
    }  # fmt: skip


@pytest.fixture(scope="module")
def hand(scenario):
    """Runs whose numbers are written by hand; one was lost, one was not begun."""
    ends = [
        pose_row(pose_from_angles(np.array(p), np.array([0.0, 0.0, turn])))
        for p, turn in zip(ENDS, TURNS, strict=True)
    ]
    records = tuple(
        Record(k, SEEDS[k], summary_of(k), ends[k], traces_of(k) if k < 2 else {}) for k in range(3)
    )
    lost = {3: "seed 7: its process died (SIGKILL; out of memory?)"}
    return Repetition(with_seeds(scenario, [*SEEDS, 7, 8]), records, 12.5, lost)


def test_the_summary_counts_and_has_statistics(hand):
    summary = hand.as_dict()
    expected = {
        "scenario": "acrobot_pbvs", "seeds": [4, 2, 9], "wanted": 5, "interrupted": True,
        "lost_seeds": [7], "outcomes": {"converged": 2, "timeout": 1}, "engines": {"compiled": 3},
        "loops": {"diagram": 3}, "wall_time_s": 12.5, "runs": [summary_of(k) for k in range(3)],
    }  # fmt: skip
    assert {key: summary[key] for key in expected} == expected
    assert set(summary) == {*expected, "statistics", "repeatability", "versions"}
    assert list(summary["statistics"]) == list(METRICS)
    for share, (metric, found) in enumerate(summary["statistics"].items(), 1):
        values = [1.0, 4.0] if metric.startswith("image_deviation") else [1.0, 4.0, 9.0]
        expected = {
            "mean": np.mean(values), "max": values[-1], "min": 1.0, "std": np.std(values, ddof=1)
        }  # fmt: skip
        assert found == pytest.approx({k: share * v for k, v in expected.items()}, abs=BY_HAND)
    # Two ends 2 mm and 0.2 rad apart: each lies 1 mm and 0.1 rad off their mean. ISO 9283: the
    # mean distance from the barycentre and three of its deviations, which are zero.
    assert summary["repeatability"] == pytest.approx({
        "runs": 2, "accuracy_m": np.sqrt(0.003**2 + 0.001**2 + 0.004**2), "accuracy_rad": 0.2,
        "repeatability_m": 0.001, "repeatability_rad": 0.1, "iso_9283_rp_m": 0.001,
    })  # fmt: skip
    failed = replace(hand, scenarios=hand.scenarios[2:3], records=hand.records[2:], lost={})
    assert failed.as_dict()["repeatability"] is None
    assert not failed.interrupted


def test_a_number_alone_has_no_deviation_and_none_has_nothing():
    assert statistics(np.array([2.0])) == {"mean": 2.0, "max": 2.0, "min": 2.0, "std": None}
    none = {"mean": None, "max": None, "min": None, "std": None}
    assert statistics(np.array([np.nan, np.inf])) == none
    assert statistics(np.array([1.0, np.inf, 3.0]))["std"] == pytest.approx(np.sqrt(2.0))


def test_it_shows_millimetres_and_degrees(hand):
    over_runs, reached = hand.tables()
    assert over_runs.title == "acrobot_pbvs: 2 converged, 1 timeout"
    found = hand.as_dict()["statistics"]
    for row, (metric, (label, factor)) in zip(over_runs.rows, METRICS.items(), strict=True):
        unit = label[label.index("[") + 1 : label.index("]")]
        assert factor == pytest.approx({"mm": 1e3, "deg": 180.0 / np.pi}.get(unit, 1.0))
        cells = (f"{factor * found[metric][key]:.3f}" for key in ("mean", "max", "std"))
        assert row == (label, *cells)
    assert dict(reached.rows) == {
        "accuracy [mm]": f"{np.sqrt(26.0):.3f}", "accuracy [deg]": f"{np.degrees(0.2):.3f}",
        "repeatability [mm]": "1.000", "repeatability [deg]": f"{np.degrees(0.1):.3f}",
        "repeatability, ISO 9283 [mm]": "1.000",
    }  # fmt: skip
    assert hand.notes()[0] == "cdpr: 1 of 5 runs failed: seed 7"
    nothing = replace(hand, records=())
    assert nothing.tables()[0].title == "acrobot_pbvs: no run finished"
    assert nothing.figures() == {}


def test_files_and_figure_hold_what_was_found(hand, tmp_path):
    with Folder(tmp_path / "out", {}) as folder:
        hand.write(folder)
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == hand.as_dict()
    with (tmp_path / "out" / "runs.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = list(csv.reader(file))
    assert header == ["seed", "outcome", *METRICS]
    for k, row in enumerate(rows):
        assert row[:2] == [str(SEEDS[k]), OUTCOMES[k]]
        for metric, value in zip(METRICS, row[2:], strict=True):
            lost = k == 2 and metric.startswith("image_deviation")
            assert value == ("nan" if lost else str(number(metric, k)))
    figure = hand.plot()
    assert figure_faults(figure) == []
    image, deviation, ends = figure.axes
    drawn = [line.get_xydata() for line in image.lines]
    expected = [traces_of(k)[name] for k in range(2) for name in ("image_path", "image_line")]
    np.testing.assert_array_equal(drawn, expected)  # the third run has no traces
    low, high = image.get_ylim()
    assert low > high  # v points down
    over_time = [line.get_xydata() for line in deviation.lines]
    np.testing.assert_array_equal(over_time, [[[0, 5], [2, 7]]])  # the median where runs last
    points = [line.get_xydata() for line in ends.lines]
    for shown, place in zip(points, ([[3, 0], [3, 2]], [[100, 200]], [[0, 0]]), strict=True):
        np.testing.assert_allclose(shown, place)


# The command.

MANY = ("simulate", "--camera", "projected", "--workers", "1", "--seeds")


def test_seeds_are_spans_and_lists(capsys):
    words = {"0:3": [0, 1, 2], "5:6": [5], "4": [4], "3,5,8": [3, 5, 8]}
    assert {each: seeds(each) for each in words} == words
    for each in (
        "", "3:3", "5:2", "1:2:3", "-1:2", "1,1", "a", "1.5", "0:9999999999", "9999999999",
    ):  # fmt: skip
        assert "accepted: first:end" in refuse(capsys, "simulate", f"--seeds={each}")


def test_runs_over_seeds_are_a_folder_and_finished_ones_are_found_again(capsys, here):
    def repeat(span, duration="0.1", *more):
        code, out, err = run(capsys, *MANY, span, "--json", "--duration", duration, *more)
        return code, json.loads(out) if out else None, err

    code, summary, said = repeat("0:2")
    assert code == 0
    assert said.splitlines() == [
        f"{DEFAULT_SCENARIO}: by the compiled loop, as the run is repeated; else with --set "
        "integration.loop=diagram"
    ]
    assert (summary["seeds"], summary["outcomes"]) == ([0, 1], {"timeout": 2})
    assert {(one["engine"], one["loop"]) for one in summary["runs"]} == {("compiled", "compiled")}
    (folder,) = (here / "runs").iterdir()
    assert folder.name.startswith("acrobot_pbvs_taut-")
    for into in ((), ("--out", str(folder))):
        _, again, said = repeat("0:2", "0.1", *into)
        assert "2 of 2 runs were there already" in said
        assert again["runs"] == summary["runs"]  # times included: nothing was computed
    _, more, said = repeat("3,1,2", "0.1", *into)
    assert "1 of 3 runs were there already" in said
    assert [one["seed"] for one in more["runs"]] == [3, 1, 2]
    assert more["runs"][1] == summary["runs"][1]
    code, _, said = repeat("0:2", "0.2", *into)
    assert (code, "scenario.duration is 0.1 there, 0.2 here" in said) == (2, True)
    assert repeat("0:1", "0.2", *into, "--overwrite")[0] == 0
    assert os.listdir(here) == ["runs"]


def test_a_killed_repetition_goes_on_and_another_robot_in_the_same_file_is_refused(capsys, here):
    text = robot_file("acrobot_small").read_text()
    (here / "mine.yaml").write_text(text)
    options = (*MANY, "0:4", "--duration", "0.1", "--out", "out", "--set", "robot=mine.yaml")
    program = killed_after(2, "cdpr_drake.analyses.runs.seeds.Record.save")
    done = subprocess.run([sys.executable, "-c", program, *options], check=False)
    assert done.returncode == -signal.SIGKILL
    damaged, whole = sorted(here.glob("out/seeds/*.npz"))
    damaged.write_bytes(damaged.read_bytes()[:100])
    written = whole.stat().st_mtime_ns
    code, out, err = run(capsys, *options, "--json")
    assert (code, len(json.loads(out)["runs"])) == (0, 4)
    assert "1 of 4 runs were there already" in err
    assert whole.stat().st_mtime_ns == written
    mass = re.search(r"mass: ([\d.]+)", text)
    (here / "mine.yaml").write_text(text.replace(mass[0], f"mass: {1.01 * float(mass[1])}"))
    code, _, err = run(capsys, *options)
    assert (code, "out: holds other results: robot." in err) == (2, True)
