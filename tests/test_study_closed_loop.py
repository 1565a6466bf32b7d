"""The study of closed loops, in its quick form."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.closed_loop import MODES, ClosedLoopTask
from cdpr_drake.analyses.studies import STUDIES
from cdpr_drake.analyses.study_closed_loop import (
    QUICK_STARTS,
    SEED,
    VERDICT,
    study_closed_loop,
)
from cdpr_drake.analyses.workspace_defaults import workspace_defaults
from cdpr_drake.models import load_robot
from cdpr_drake.stability_verdict import VerdictOptions
from cdpr_drake.systems import Outcome

CONVERGED = 1e-3
"""Largest distance from the desired pose at the end of a run that converged [m]."""


@pytest.fixture(scope="module")
def study():
    reports = []
    found = study_closed_loop(quick=True, on_progress=reports.append, workers=1)
    assert reports[-1].done == reports[-1].total == len(MODES) * QUICK_STARTS
    return found


def test_it_is_known_by_name():
    assert STUDIES["stability-closed-loop"] is study_closed_loop
    for scheme in ("pbvs-line", "2.5d", "ibvs"):
        stopped = STUDIES[f"stability-closed-loop-{scheme}"](quick=True, should_stop=lambda: True)
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


def test_the_shifted_estimate_stays_as_wrong_as_the_bounds_allow(study):
    np.testing.assert_allclose(study.column("shifted", "estimate_error_m"), 0.03, rtol=1e-6)
    np.testing.assert_allclose(
        study.column("shifted", "estimate_error_rad"), np.radians(3.0), rtol=1e-6
    )


def test_a_run_does_not_depend_on_the_others(study):
    task = ClosedLoopTask(
        study.scenario,
        study.case,
        workspace_defaults(load_robot("acrobot_large"), "acrobot_large").bounds,
        study.starts.poses,
        VERDICT,
        VerdictOptions(seed=SEED),
        "control_integration",
        SEED,
    )
    again = task(1, 2)
    np.testing.assert_array_equal(again["runs"][0], study.runs["control_integration"][1])
    np.testing.assert_array_equal(again["way"][0], study.ways["control_integration"][1])


def test_results_and_figures_are_written(study, tmp_path):
    study.write(tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"results.json", "runs.npz", "errors.png", "ways.png"}
    found = json.loads((tmp_path / "results.json").read_text())
    for run in found["runs"]:
        assert run["converged"] + run["target_lost"] + run["otherwise"] == QUICK_STARTS
        assert len(run["not_converged"]) == QUICK_STARTS - run["converged"]
    assert study.tables()


def test_it_stops_when_asked():
    found = study_closed_loop(quick=True, workers=1, should_stop=lambda: True)
    assert found.interrupted
    assert not found.runs
    assert found.as_dict()["runs"] == []
