"""Every scenario ends as its file says, projected; the study that runs them as they ship."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.reporting.progress import WorkSession
from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS
from cdpr_drake.analyses.studies import scenarios
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.analyses.studies.scenarios import (
    OVER,
    QUICK_DIAGRAM,
    QUICK_LOOP,
    STUDY,
    as_run,
    ended,
    figure,
    measure,
    quick_overrides,
)
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_file, scenario_kind, scenario_names
from tests.analyses.studies.scenario_titles import TITLES

LOST = "acrobot_partitioned"


def case_of(name, short=True):
    return Case(name=name, keys={"scenario": name, "short": short})


def made_up(case, seed):
    return ending_well(case.keys["scenario"])


@cache
def ending_well(name):
    """What is found where all end as expected, at half of the errors, but one as `LOST` does."""
    shipped = load_scenario(name)
    wanted = shipped.expected
    row = {
        "outcome": "target_lost" if name == LOST else wanted.outcome, "time_s": 3.0,
        "distance_m": 0.5 * (wanted.position or 1.0),
        "angle_rad": 0.5 * np.radians(wanted.rotation_deg or 1.0),
        "duration_s": shipped.duration, "rendered": True, "message": "it was not seen",
    }  # fmt: skip
    return ended(row, wanted, shipped.duration)


def ran(name, items):
    """The study's row of a scenario, and the run that it made.

    With what makes what its title names happen soon, where it has that; then its own length counts.
    """
    known, kept = SCENARIO_KINDS[scenario_kind(name)], []

    def run(scenario, session):
        result = known.run(scenario, session)
        kept.append(told(known, scenario, result))
        return result

    with pytest.MonkeyPatch.context() as patch:
        changed = replace(known, run=run)
        if items:
            assert any(item.startswith("duration=") for item in items)
            known.check(as_run(name, True))
            changed = replace(changed, check=lambda scenario: None)
            overrides = [*quick_overrides(name), *items]
            patch.setattr(scenarios, "quick_overrides", lambda name: overrides)
            patch.setattr(scenarios, "QUICK_DIAGRAM", np.inf)
        patch.setitem(SCENARIO_KINDS, scenario_kind(name), changed)
        return measure(case_of(name), 0), *kept


def told(kind, scenario, result):
    """What the checks of `TITLES` read of a run."""
    log = {key: np.array(rows) for key, rows in getattr(result, "log", {}).items()}
    return SimpleNamespace(
        summary=kind.numbers(result), log=log, end=kind.end_error(result),
        desired=getattr(getattr(scenario, "desired", None), "position", None),
        scheme=getattr(getattr(scenario, "controller", None), "scheme", None),
    )  # fmt: skip


@pytest.mark.parametrize("name", scenario_names())
def test_every_scenario_ends_as_its_file_says_and_does_what_its_title_names(name):
    """With projected targets; what only a diagram can do is cut after a second, or after as long as
    what the title names takes."""
    checks, items = TITLES[name]
    row, run = ran(name, items)
    assert row["expected"] is not None
    assert row["as_expected"], (row["outcome"], row["message"])
    assert row["close_enough"] is not False, (row["distance_share"], row["angle_share"])
    for check in checks:
        assert check(run), (name, check.__name__, run.summary["outcome"])


def test_one_that_loses_its_target_is_named(tmp_path):
    study = replace(STUDY, measure=made_up)(False, WorkSession(workers=1))
    verdicts = {s.name: (s.verdict, s.found) for s in study.statements}
    assert verdicts["scenarios_expect_an_end"][0] == "confirmed"
    verdict, found = verdicts["scenarios_end_as_expected"]
    assert verdict == "in part"
    assert f"{LOST} (target_lost, converged expected: it was not seen)" in found
    assert verdicts["scenarios_end_close_enough"][0] == "confirmed"
    assert len(study.tables()) == 2
    assert study.write(tmp_path) == {}
    told = json.loads((tmp_path / "results.json").read_text())["runs"]
    assert [one["case"] for one in told] == list(scenario_names())
    (lost,) = (one for one in told if not one["as_expected"])
    assert (lost["case"], lost["expected"]["outcome"]) == (LOST, "converged")
    assert {path.stem for path in tmp_path.glob("*.png")} == {"endings"}


def test_errors_beyond_what_is_expected_and_files_that_expect_nothing_are_named():
    def worse(case, seed):
        row = made_up(case, seed)
        if case.name == "acrobot_pbvs":
            return row | {"close_enough": False, "distance_share": 3.0}
        return row | {"expected": None, "as_expected": False} if case.name == LOST else row

    study = replace(STUDY, measure=worse)(False, WorkSession(workers=1))
    verdicts = {s.name: (s.verdict, s.found) for s in study.statements}
    assert verdicts["scenarios_expect_an_end"][0] == "in part"
    assert verdicts["scenarios_expect_an_end"][1].endswith(f"; not {LOST}")
    assert verdicts["scenarios_end_close_enough"][0] == "in part"
    assert verdicts["scenarios_end_close_enough"][1].endswith("3, acrobot_pbvs; not acrobot_pbvs")


ROW = {
    "outcome": "timeout", "time_s": 1.0, "distance_m": 1.0, "angle_rad": 1.0, "duration_s": 1.0,
    "rendered": False, "message": "",
}  # fmt: skip


def ending(name, **changed):
    shipped = load_scenario(name)
    return ended(ROW | changed, shipped.expected, shipped.duration)


def test_a_run_that_was_cut_is_not_judged_by_its_errors():
    name = "acrobot_pbvs"
    cut, whole = ending(name), ending(name, duration_s=30.0)
    assert (cut["as_expected"], cut["close_enough"]) == (True, None)
    assert (whole["as_expected"], whole["close_enough"]) == (False, False)
    assert not ending(name, outcome="diverged")["as_expected"]
    arrived = ending(name, outcome="converged")
    assert (arrived["as_expected"], arrived["close_enough"]) == (True, False)
    unknown = ending(name, duration_s=30.0, outcome="converged", distance_m=np.nan)
    assert unknown["close_enough"] is False


def test_the_figure_says_which_runs_were_cut_and_hides_no_error():
    """A row says that its run was cut, not how it ended then, and where no error is bounded."""
    nothing = dict.fromkeys(("time_s", "distance_m", "angle_rad", "duration_s"), np.nan)
    given = {
        "acrobot_fusion": {},
        "acrobot_ibvs": {"outcome": "converged"},
        "acrobot_pbvs": {"outcome": "failed", **nothing},
        "acrobot_open_loop": {"outcome": "completed", "duration_s": 30.0},
    }
    rows = [Run(n, None, {"short": True}, ending(n, **one)) for n, one in given.items()]
    assert [row["cut"] for row in rows] == [True, False, False, False]
    (panel,) = figure(Runs(rows)).axes
    words = [label.get_text() for label in panel.get_yticklabels()]
    assert words == [
        "acrobot_fusion: cut at 1 s", "acrobot_ibvs: converged", "acrobot_pbvs: failed",
        "acrobot_open_loop: completed, any error",
    ]  # fmt: skip
    labels = [text.get_text() for text in panel.get_legend().get_texts()]
    assert len(labels) == len(set(labels))
    assert "largest expected" in labels
    assert "another outcome" in labels
    places = {
        line.get_label(): {y - round(y) for y in line.get_ydata()}
        for line in panel.get_lines() if line.get_marker() in "os"
    }  # fmt: skip
    assert places["distance"].isdisjoint(places["angle"])


def test_one_that_cannot_be_run_costs_no_other(monkeypatch):
    def refuse(*arguments):
        raise ScenarioError("found no robot; accepted: one")

    monkeypatch.setattr(scenarios, "as_run", refuse)
    row = measure(case_of("planar_pbvs"), 0)
    assert (row["outcome"], row["message"]) == ("failed", "found no robot; accepted: one")
    assert not row["cut"]
    assert not row["as_expected"]
    assert row["close_enough"] is False


def test_the_full_form_changes_nothing_and_the_quick_one_projects_and_cuts():
    for name in ("acrobot_partitioned", "caroca_pbvs", "planar_computed_torque"):
        shipped, full = load_scenario(name), as_run(name, False)
        full = replace(full, integration=shipped.integration)  # the engine is chosen
        assert yaml_dump_typed(full) == yaml_dump_typed(shipped)
    assert quick_overrides("acrobot_partitioned") == ["camera.kind=projected"]
    assert as_run("acrobot_mobile_robot", True).duration == QUICK_LOOP
    assert as_run("planar_computed_torque", True).duration == QUICK_DIAGRAM


def test_what_a_file_may_expect(tmp_path):
    text = scenario_file("acrobot_pbvs").read_text()
    path = Path(tmp_path / "acrobot_pbvs.yaml")
    path.write_text(text.replace("outcome: converged", "outcome: arrived"))
    with pytest.raises(ScenarioError, match=r"expected\.outcome: found arrived; accepted: one of"):
        load_scenario(str(path))
    assert set(OVER) <= {outcome.name.lower() for outcome in Outcome}
