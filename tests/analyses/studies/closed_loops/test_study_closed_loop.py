"""The study of closed loops: its starts, its loops, what it says of them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.closed_loops.loops import (
    CURVE,
    MANAGED,
    MODES,
    PLAIN,
    WAY_POSES,
    measure,
    stable_starts,
)
from cdpr_drake.analyses.studies.closed_loops.study import QUICK_STARTS, closed_loop_study
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.stability_case import SCHEMES

ROUNDING = 1e-12
"""Of a quotient of the same two numbers."""

CONVERGED = 1e-3
"""Largest distance from the desired pose at the end of a run that converged [m]."""

STUDY = closed_loop_study("pbvs")


def run(measure=measure, study=STUDY, **session):
    return replace(study, measure=measure)(True, StudySession(workers=1, **session))


@pytest.fixture(scope="module")
def study():
    return run()


def made_up(case, seed):
    """A loop that converges."""
    curve = np.linspace(1.0, 0.0, CURVE)
    return {
        "outcome": "converged", "time_s": 5.0, "position_error_m": 1e-4,
        "rotation_error_rad": 1e-4, "error_growth": 0.0, "least_margin": 0.5,
        "poses_checked": WAY_POSES, "poses_outside_z": 0, "estimate_error_m": 0.03,
        "estimate_error_rad": 0.05, "taut_at_end": 8, "error_peak": 1.0,
        "start_pose": case.data[seed], "curve": curve, "way": np.zeros((WAY_POSES, 7)),
    }  # fmt: skip


def ending(modes, **ends):
    """Made-up loops, of which the first of some modes ends otherwise."""

    def loop(case, seed):
        other = ends if case.keys["mode"] in modes and seed == 0 else {}
        return made_up(case, seed) | other

    return {one.name: one for one in run(loop).statements}


def test_a_folder_of_another_study_is_refused(tmp_path):
    run(made_up, folder=tmp_path)
    with pytest.raises(OutputFolderError, match=r"scheme is .pbvs. there, .ibvs. here"):
        run(made_up, closed_loop_study("ibvs"), folder=tmp_path)


def test_each_scheme_is_known_by_name():
    for scheme in SCHEMES:
        name = "stability-closed-loop" + ("" if scheme == "pbvs" else f"-{scheme}")
        found = STUDIES[name].run(True, StudySession(should_stop=lambda: True))
        assert found.interrupted
        assert len(found.runs) == 0
        assert found.as_dict()["parameters"]["scheme"] == scheme
        assert len(found.cases[0].data) == QUICK_STARTS
        assert {case.keys["scheme"] for case in found.cases} == {scheme}


def test_starts_lie_in_the_workspace():
    starts = stable_starts("pbvs", QUICK_STARTS)
    assert starts.poses.shape == (QUICK_STARTS, 7)
    defaults = workspace_defaults(load_robot("acrobot_large"), "acrobot_large")
    assert np.all(starts.poses[:, 4:] >= defaults.lower)
    assert np.all(starts.poses[:, 4:] <= defaults.upper)
    s = starts
    assert s.drawn >= s.not_held + s.not_seen + s.not_stable + QUICK_STARTS
    np.testing.assert_array_equal(starts.poses, stable_starts("pbvs", 3).poses[:QUICK_STARTS])


def test_loops_converge_or_lose_the_tag(study):
    assert [mode for mode, _ in study.runs.by("mode")] == list(MODES)
    assert set(study.runs.counts("outcome")) <= {"converged", "target_lost"}
    assert study.runs.largest("position_error_m", outcome="converged") < CONVERGED
    assert study.runs.largest("error_growth", mode="kinematic") == 0.0
    assert study.runs.largest("error_peak", mode="kinematic") == 1.0
    for row in study.runs:  # samples of the same errors
        assert np.max(row["curve"] / row["curve"][0]) <= row["error_peak"] * (1.0 + ROUNDING)


def test_the_shifted_estimate_stays_as_wrong_as_the_bounds_allow(study):
    shifted = study.runs(mode="shifted")
    np.testing.assert_allclose(shifted["estimate_error_m"], 0.03, rtol=1e-6)
    np.testing.assert_allclose(shifted["estimate_error_rad"], np.radians(3.0), rtol=1e-6)


def test_a_loop_does_not_depend_on_the_others(study):
    for mode in ("kinematic", "control_integration"):
        (case,) = [one for one in study.cases if one.name == mode]
        row = study.runs(mode=mode).rows[1]
        again = measure(case, 1)
        assert again["time_s"] == row["time_s"]
        np.testing.assert_array_equal(again["way"], row["way"])


def test_what_hangs_on_slack_cables_is_judged_by_how_it_ends_with_managed_tensions():
    assert ending(())["managed"].verdict == "not testable"
    hangs = {"outcome": "timeout", "taut_at_end": 5}
    arrives, stays = ending((PLAIN,), **hangs)["managed"], ending((PLAIN, MANAGED), **hangs)
    assert (arrives.verdict, stays["managed"].verdict) == ("confirmed", "not confirmed")
    assert "start 0 at" in arrives.found
    assert "m on 5 cables, with it converged; 1 and 2 of 2 converge" in arrives.found
    assert "1 and 1 of 2 converge without and with it, 0 without it alone" in stays["managed"].found


@pytest.mark.parametrize(
    ("ends", "verdict"),
    [
        ({}, "confirmed"),
        ({"outcome": "target_lost", "poses_outside_z": 1}, "in part"),
        ({"outcome": "target_lost"}, "not confirmed"),
    ],
)
def test_a_loop_has_to_arrive_where_its_way_stays_inside(ends, verdict):
    assert ending(("shifted",), **ends)["reached"].verdict == verdict
    assert ending((MANAGED,), **ends)["reached"].verdict == "confirmed"  # not what it is about


def test_statements_wait_for_their_modes(tmp_path):
    asked = iter([False] * QUICK_STARTS + [True] * 100)
    stopped = run(made_up, folder=tmp_path, should_stop=lambda: next(asked))
    assert [one.name for one in stopped.statements] == ["reached"]
    continued = run(made_up, folder=tmp_path)
    assert continued.progress.found == QUICK_STARTS
    assert len(continued.statements) == 2


def test_results_and_figures_are_written(study, tmp_path):
    assert study.write(tmp_path) == {}
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"results.json", "runs.csv", "errors.png", "ways.png"}
    found = json.loads((tmp_path / "results.json").read_text())
    for counts in found["numbers"]["modes"].values():
        parts = (counts["converged"], counts["target_lost"], counts["otherwise"])
        assert sum(parts) == counts["runs"] == QUICK_STARTS
    lost = run(lambda case, seed: made_up(case, seed) | {"outcome": "target_lost"})
    assert [len(found.tables()) for found in (run(made_up), lost)] == [2, 3]
