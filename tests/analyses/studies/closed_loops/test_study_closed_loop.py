"""The study of closed loops, in its quick form."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.closed_loops.loops import (
    COLUMNS,
    MANAGED,
    MODES,
    PLAIN,
    ClosedLoopTask,
)
from cdpr_drake.analyses.studies.closed_loops.study import (
    QUICK_STARTS,
    SEED,
    VERDICT,
    managed,
    study_closed_loop,
)
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.verdict import VerdictOptions
from cdpr_drake.systems.monitoring.run_monitor import Outcome

ROUNDING = 1e-12
"""Of a quotient of the same two numbers."""

CONVERGED = 1e-3
"""Largest distance from the desired pose at the end of a run that converged [m]."""


STOP_AFTER = 3
"""Loops of the first session, in the middle of the second mode."""


@pytest.fixture(scope="module")
def sessions(tmp_path_factory):
    """The study in two sessions, and the reports of the second one."""
    folder = tmp_path_factory.mktemp("study") / "parts"
    reports = []
    first = study_closed_loop(
        True, StudySession(folder, reports.append, lambda: reports[-1].done >= STOP_AFTER, 1)
    )
    first.write(folder)  # as the command does
    reports = []
    return (
        first,
        study_closed_loop(True, StudySession(folder=folder, on_progress=reports.append, workers=1)),
        reports,
        folder,
    )


@pytest.fixture(scope="module")
def study(sessions):
    return sessions[1]


def test_a_stopped_study_continues_where_it_stopped(sessions):
    first, second, reports, folder = sessions
    assert first.interrupted
    assert list(first.runs) == ["kinematic"]  # of the second mode one start is missing
    np.testing.assert_array_equal(first.starts.poses, second.starts.poses)
    np.testing.assert_array_equal(first.runs["kinematic"], second.runs["kinematic"])
    assert not second.interrupted
    assert next(report.found for report in reports if report.found) == STOP_AFTER
    assert reports[-1].done == reports[-1].total == len(MODES) * QUICK_STARTS
    again = study_closed_loop(True, StudySession(folder=folder, workers=1))
    assert again.progress.found == again.progress.total
    for mode in MODES:
        np.testing.assert_array_equal(again.runs[mode], second.runs[mode])
        np.testing.assert_array_equal(again.curves[mode], second.curves[mode])


def test_a_folder_of_another_study_is_refused(sessions):
    folder = sessions[-1]
    with pytest.raises(OutputFolderError, match=r"controller.scheme is .pbvs. there, .ibvs. here"):
        study_closed_loop(True, StudySession(folder=folder, workers=1), scheme="ibvs")
    with pytest.raises(OutputFolderError, match="quick is true there, false here"):
        study_closed_loop(False, StudySession(folder=folder, should_stop=lambda: True))


def test_it_is_known_by_name():
    assert STUDIES["stability-closed-loop"].run is study_closed_loop
    for scheme in ("pbvs-line", "2.5d", "ibvs"):
        entry = STUDIES[f"stability-closed-loop-{scheme}"]
        stopped = entry.run(True, StudySession(should_stop=lambda: True))
        assert entry.continues
        assert (stopped.scheme, stopped.scenario.controller.scheme) == (scheme, scheme)
        assert len(stopped.starts.poses) == QUICK_STARTS


def test_starts_lie_in_the_workspace(study):
    poses = study.starts.poses
    assert poses.shape == (QUICK_STARTS, 7)
    defaults = workspace_defaults(load_robot("acrobot_large"), "acrobot_large")
    assert np.all(poses[:, 4:] >= defaults.lower)
    assert np.all(poses[:, 4:] <= defaults.upper)
    s = study.starts
    assert s.drawn >= s.not_held + s.not_seen + s.not_stable + QUICK_STARTS


def test_runs_converge_or_lose_the_tag(study):
    for mode in MODES:
        outcomes = study.column(mode, "outcome")
        assert set(outcomes) <= {float(Outcome.CONVERGED), float(Outcome.TARGET_LOST)}
        good = outcomes == Outcome.CONVERGED
        assert np.all(study.column(mode, "position_error_m")[good] < CONVERGED)
    assert np.max(study.column("kinematic", "error_growth")) == 0.0
    assert np.all(study.column("kinematic", "error_peak") == 1.0)
    for mode in study.curves:  # samples of the same errors
        peaks = np.max(study.curves[mode] / study.curves[mode][:, :1], axis=1)
        assert np.all(peaks <= study.column(mode, "error_peak") * (1.0 + ROUNDING))


def test_the_shifted_estimate_stays_as_wrong_as_the_bounds_allow(study):
    np.testing.assert_allclose(study.column("shifted", "estimate_error_m"), 0.03, rtol=1e-6)
    np.testing.assert_allclose(
        study.column("shifted", "estimate_error_rad"), np.radians(3.0), rtol=1e-6
    )


def test_a_run_does_not_depend_on_the_others(study):
    # The first from before the interruption, the others from after it.
    for loop in ("kinematic", "control_integration"):
        task = ClosedLoopTask(
            scenario=study.scenario,
            case=study.case,
            bounds=workspace_defaults(load_robot("acrobot_large"), "acrobot_large").bounds,
            starts=study.starts.poses,
            verdict=VERDICT,
            options=VerdictOptions(seed=SEED),
            loop=loop,
            seed=SEED,
        )
        again = task(1, 2)
        np.testing.assert_array_equal(again["runs"][0], study.runs[loop][1])
        np.testing.assert_array_equal(again["way"][0], study.ways[loop][1])


def test_what_hangs_on_slack_cables_is_judged_by_how_it_ends_with_managed_tensions(study):
    assert managed(study).verdict == "not testable"  # none of the short form hangs
    hung, arrived, hangs = (study.runs[PLAIN].copy() for _ in range(3))
    outcome, taut = COLUMNS.index("outcome"), COLUMNS.index("taut_at_end")
    hung[:, [outcome, taut]] = [[Outcome.TIMEOUT, 5.0], [Outcome.CONVERGED, 8.0]]
    arrived[:, outcome] = Outcome.CONVERGED
    hangs[:, outcome] = Outcome.TIMEOUT
    for ends, said in ((arrived, "confirmed"), (hangs, "not confirmed")):
        found = managed(replace(study, runs={PLAIN: hung, MANAGED: ends}))
        assert found.verdict == said
        assert "start 0 at" in found.found
        assert "m on 5 cables" in found.found
    assert "1 and 0 of 2 converge without and with it, 1 without it alone" in found.found
    with pytest.raises(KeyError):
        managed(replace(study, runs={PLAIN: hung}))


def test_results_and_figures_are_written(study, tmp_path):
    study.write(tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"results.json", "runs.npz", "errors.png", "ways.png"}
    found = json.loads((tmp_path / "results.json").read_text())
    for run in found["runs"]:
        assert run["converged"] + run["target_lost"] + run["otherwise"] == QUICK_STARTS
        assert len(run["not_converged"]) == QUICK_STARTS - run["converged"]
    assert study.tables()


def test_one_figure_that_fails_is_named_and_costs_no_other(study, tmp_path, monkeypatch):
    saved = Figure.savefig

    def cut(figure, path, **options):
        if "errors" in path.name:
            path.write_bytes(b"half")
            raise OSError(28, "No space left on device")
        saved(figure, path, **options)

    monkeypatch.setattr(Figure, "savefig", cut)
    assert study.write(tmp_path) == {"errors.png": "[Errno 28] No space left on device"}
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"results.json", "runs.npz", "ways.png"}


def test_without_runs_there_are_data_and_no_failures(study, tmp_path):
    none = replace(study, runs={}, curves={}, ways={})
    assert none.write(tmp_path) == {}
    assert {path.name for path in tmp_path.iterdir()} == {"results.json", "runs.npz"}


def test_it_stops_when_asked():
    found = study_closed_loop(quick=True, session=StudySession(workers=1, should_stop=lambda: True))
    assert found.interrupted
    assert not found.runs
    assert found.as_dict()["runs"] == []
