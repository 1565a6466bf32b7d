"""Every scenario ends as its file says, projected; the study that runs them as they ship."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.scenarios import task
from cdpr_drake.analyses.studies.scenarios.statements import OVER, endings
from cdpr_drake.analyses.studies.scenarios.study import ending_figure, study_scenarios
from cdpr_drake.analyses.studies.scenarios.task import (
    COLUMNS,
    QUICK_DIAGRAM,
    QUICK_LOOP,
    ScenarioRun,
    quick_overrides,
)
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_file, scenario_names

LOST = "acrobot_partitioned"


def canned(self, start, stop):
    """What is found where all end as expected, at half of the errors, but one as `LOST` does."""
    scenario = load_scenario(self.name)
    wanted = scenario.expected
    outcome = Outcome.TARGET_LOST if self.name == LOST else Outcome[wanted.outcome.upper()]
    row = [
        float(outcome), 3.0, 0.5 * (wanted.position or 1.0),
        0.5 * np.radians(wanted.rotation_deg or 1.0), scenario.duration, float(not self.quick),
    ]  # fmt: skip
    return {"runs": np.array([row]), "messages": np.array(["it was not seen"], "U300")}


@pytest.mark.parametrize("name", scenario_names())
def test_every_scenario_ends_as_its_file_says(name):
    """With projected targets; what only a diagram can do is cut after a second."""
    (ending,) = endings({name: ScenarioRun(name, quick=True)(0, 1)})
    assert ending.expected is not None
    assert ending.ends_as_expected(), (ending.outcome, ending.message)
    if ending.is_judged_by_errors():
        assert ending.is_close_enough(), ending.shares()


def test_one_that_loses_its_target_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(ScenarioRun, "__call__", canned)
    study = study_scenarios(False, StudySession(workers=1))
    verdicts = {s.name: (s.verdict, s.found) for s in study.statements()}
    assert verdicts["scenarios_expect_an_end"][0] == "confirmed"
    assert verdicts["scenarios_end_as_expected"][0] == "in part"
    found = verdicts["scenarios_end_as_expected"][1]
    assert f"{LOST} (target_lost, converged expected: it was not seen)" in found
    assert verdicts["scenarios_end_close_enough"][0] == "confirmed"
    assert {s.name for s in study.statements()} == set(STUDIES["scenarios"].judges)
    assert len(study.tables()) == 2
    assert study.write(tmp_path) == {}
    told = json.loads((tmp_path / "results.json").read_text())["scenarios"]
    assert list(told) == list(scenario_names())
    assert [name for name, one in told.items() if not one["as_expected"]] == [LOST]
    assert told[LOST]["expected"]["outcome"] == "converged"
    assert {path.stem for path in tmp_path.glob("*.png")} == set(STUDIES["scenarios"].figures)


def test_a_run_that_was_cut_is_not_judged_by_its_errors(monkeypatch):
    row = dict.fromkeys(COLUMNS, 1.0) | {"outcome": float(Outcome.TIMEOUT), "distance_m": 9.0}
    name = "acrobot_pbvs"

    def ending(**changed):
        numbers = np.array([list((row | changed).values())])
        return endings({name: {"runs": numbers, "messages": np.array([""])}})[0]

    cut, whole = ending(duration_s=1.0), ending(duration_s=30.0)
    assert (cut.ends_as_expected(), cut.is_judged_by_errors()) == (True, False)
    assert (whole.ends_as_expected(), whole.is_judged_by_errors()) == (False, True)
    early = ending(duration_s=1.0, outcome=float(Outcome.DIVERGED))
    assert not early.ends_as_expected()
    arrived = ending(duration_s=1.0, outcome=float(Outcome.CONVERGED))
    assert (arrived.ends_as_expected(), arrived.is_close_enough()) == (True, False)
    unknown = ending(duration_s=30.0, outcome=float(Outcome.CONVERGED), distance_m=np.nan)
    assert not unknown.is_close_enough()


def test_the_figure_says_which_runs_were_cut_and_hides_no_error():
    """A row says that its run was cut, not how it ended then, and where no error is bounded."""
    row = dict.fromkeys(COLUMNS, 1.0) | {"outcome": float(Outcome.TIMEOUT), "rendered": 0.0}
    given = {
        "acrobot_fusion": {},
        "acrobot_ibvs": {"outcome": float(Outcome.CONVERGED)},
        "acrobot_pbvs": dict.fromkeys(COLUMNS, np.nan) | {"outcome": float(Outcome.FAILED)},
        "acrobot_open_loop": {"outcome": float(Outcome.COMPLETED), "duration_s": 30.0},
    }
    told = endings({
        name: {"runs": np.array([list((row | one).values())]), "messages": np.array([""])}
        for name, one in given.items()
    })  # fmt: skip
    assert [one.is_cut for one in told] == [True, False, False, False]
    figure = ending_figure(told, True)
    (panel,) = figure.axes
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

    monkeypatch.setattr(task, "load_scenario", refuse)
    found = ScenarioRun("planar_pbvs")(0, 1)
    assert found["runs"][0, 0] == float(Outcome.FAILED)
    assert list(found["messages"]) == ["found no robot; accepted: one"]
    (ending,) = endings({"planar_pbvs": found})
    assert ending.outcome == "failed"
    assert not ending.is_cut
    assert not ending.ends_as_expected()
    assert not ending.is_close_enough()


def test_the_full_form_changes_nothing_and_the_quick_one_projects_and_cuts():
    for name in ("acrobot_partitioned", "caroca_pbvs", "planar_computed_torque"):
        shipped, full = load_scenario(name), ScenarioRun(name).scenario()
        full = replace(full, integration=shipped.integration)  # the engine is chosen
        assert yaml_dump_typed(full) == yaml_dump_typed(shipped)
    assert quick_overrides("acrobot_partitioned") == ["camera.kind=projected"]
    assert ScenarioRun("acrobot_mobile_robot", quick=True).scenario().duration == QUICK_LOOP
    assert ScenarioRun("planar_computed_torque", quick=True).scenario().duration == QUICK_DIAGRAM


def test_what_a_file_may_expect(tmp_path):
    text = scenario_file("acrobot_pbvs").read_text()
    path = Path(tmp_path / "acrobot_pbvs.yaml")
    path.write_text(text.replace("outcome: converged", "outcome: arrived"))
    with pytest.raises(ScenarioError, match=r"expected\.outcome: found arrived; accepted: one of"):
        load_scenario(str(path))
    assert set(OVER) <= {outcome.name.lower() for outcome in Outcome}
