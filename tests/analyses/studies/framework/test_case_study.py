"""Studies of configurations: which runs they ask for, keep, judge, draw; how they are stopped."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.framework import case_panels as panels
from cdpr_drake.analyses.studies.framework.case_definition import Configuration, Plan
from cdpr_drake.analyses.studies.framework.case_figures import BARS, case_figures
from cdpr_drake.analyses.studies.framework.case_layouts import paths_layout
from cdpr_drake.analyses.studies.framework.case_run import METRICS
from cdpr_drake.analyses.studies.framework.case_study import configuration_study
from cdpr_drake.analyses.studies.framework.case_tables import configuration_numbers
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import Finding, statement
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.analyses.studies.made_runs import CASE_STUDIES, made_run
from tests.analyses.studies.made_up_studies import with_figures


@statement("The error is small.")
def error_is_small(runs):
    error = runs.largest("position_error_m", configuration="plain")
    return Finding(found=f"{error:.2f} m", held=[error < 0.01])


@statement("The other is lost.")
def needs_what_the_quick_form_lacks(runs):
    return Finding(found=runs.counted("outcome", configuration="turned"), held=[True])


def curve(runs, configuration="plain"):
    figure, axes = new_figure(1, 1, (3.0, 2.0), "A curve")
    axes.plot(runs(configuration=configuration).rows[0]["error"])
    return figure


def bad(runs):
    raise ValueError("no such colour\nat all")


def of_the_other(runs):
    return curve(runs, "turned")


TURNED = (
    "perturbations.camera_pose.angles_deg=[0, 0, 20]",
    "perturbations.camera_pose.position=[0, 0, 0]",
)

SHORT = configuration_study(
    Plan(
        name="short", title="Two short runs", scenario="acrobot_pbvs", changes=("duration=0.4",),
        configurations=(
            Configuration("plain", "plain", published={"outcome": "converged", "time_s": "7"}),
            Configuration("turned", "turned camera", TURNED, group="other"),
        ),
        quick=("plain",),
        layouts={"figure_1": paths_layout("Of the other", ("turned",))},
    ),
    source="made up",
    repetitions=2,
    checks=(error_is_small, needs_what_the_quick_form_lacks),
    drawings={"bad": bad, "of_the_other": of_the_other, "curve": curve},
)  # fmt: skip


WRITTEN = ("bad", "curve", "figure_1", "image_paths_other")


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("short")
    found = SHORT(session=StudySession(folder=folder, workers=1))
    figures = {name: SHORT.figures[name] for name in WRITTEN}
    failed = replace(found, study=replace(SHORT, figures=figures)).write(folder)
    return found, folder, failed


@pytest.fixture(scope="module")
def quick():
    return SHORT(quick=True, session=StudySession(workers=1))


def test_every_configuration_runs_with_every_seed_and_they_differ(result):
    runs = result[0].runs
    done = [(run["configuration"], run.seed) for run in runs]
    assert done == [("plain", 0), ("plain", 1), ("turned", 0), ("turned", 1)]
    assert runs.counts("outcome") == {"timeout": 4}
    errors = [run["error"][-1] for run in runs]
    assert not np.allclose(errors[0], errors[2], atol=1e-3)
    assert 0.0 < np.abs(errors[0] - errors[1]).max() < 0.05


def test_metrics_are_those_of_the_traces(result):
    for run in result[0].runs:
        assert set(METRICS) <= set(run.columns())
        assert run["time_s"] == pytest.approx(0.4)
        assert run["image_max_px"] == pytest.approx(run["image_deviation"].max())
        assert run["camera_mean_m"] == pytest.approx(run["camera_deviation"].mean())
        gap = np.linalg.norm(run["estimate_path"] - run["platform_path"], axis=1)
        assert run["estimate_max_m"] == pytest.approx(gap.max())
        assert not {"wall_time_s", "realtime_factor", "versions"} & set(run["summary"])


def test_what_the_quick_form_lacks_is_not_judged(result, quick):
    assert [one.verdict for one in result[0].statements] == ["not confirmed", "confirmed"]
    verdicts = [one.verdict for one in quick.statements]
    assert verdicts == ["not confirmed", "not judged in the quick form"]


def test_accuracy_and_repeatability_by_their_definition(result):
    runs = result[0].runs(configuration="plain")
    numbers = configuration_numbers(result[0].runs, "plain")
    ends = np.array([run["camera_path"][-1] for run in runs])
    half = np.linalg.norm(ends[0] - ends[1]) / 2.0
    assert numbers["repeatability_m"] == pytest.approx(half)
    assert numbers["accuracy_m"] == pytest.approx(
        np.linalg.norm(ends.mean(axis=0) - runs.rows[0]["camera_line"][1])
    )


def test_figures_are_written_and_one_that_fails_costs_no_other(result):
    found, folder, failed = result
    assert failed == {"bad.png": "no such colour"}
    assert {file.stem for file in folder.glob("*.png")} == set(WRITTEN) - {"bad"}
    figures = {name: draw for name, draw in SHORT.figures.items() if name != "bad"}
    _, drawn = with_figures(replace(found, study=replace(SHORT, figures=figures)))
    assert drawn == set(figures)
    assert {"image_paths", "image_paths_other", "deviations", "figure_1", "curve"} <= drawn


def test_figures_whose_runs_are_missing_are_not_drawn(quick):
    drawings = quick.drawings()
    for name in ("figure_1", "of_the_other", "image_paths_other", "deviations_other"):
        with pytest.raises(NothingToDraw):
            drawings[name]()
    assert drawings["curve"]().axes


def test_what_traces_do_not_have_and_no_run_measures_is_not_drawn(result):
    runs = result[0].runs
    drawings = case_figures(replace(SHORT.cases, stability=1.0))
    for name in ("cable_tensions", "stability"):
        with pytest.raises(MissingRuns):
            drawings[name](runs)
    unmeasured = {metric: None for metric, _, _ in BARS["estimates"]}
    bare = [replace(run, measured={**run.measured, **unmeasured}) for run in runs]
    with pytest.raises(NothingToDraw):
        case_figures(SHORT.cases)["estimates"](Runs(bare))


def test_results_are_written(result):
    found, folder, _ = result
    stored = json.loads((folder / "results.json").read_text())
    plain, turned = stored["cases"]
    assert plain["printed"] == {"outcome": "converged", "time_s": "7"}
    assert turned["keys"] == {"configuration": "turned", "group": "other", "camera": "projected"}
    assert plain["changes"] == ["duration=0.4", "camera.kind=projected"]
    assert set(stored["numbers"]) == {"plain", "turned"}
    with np.load(folder / "parts.npz") as parts:
        (name,) = (one for one in parts.files if "turned, seed 1" in one and "camera_path" in one)
        np.testing.assert_array_equal(parts[name][0], found.runs.rows[3]["camera_path"])


def test_tables_show_published_beside_found(result):
    assert [table.title for table in result[0].tables()] == [
        "Two short runs; projected camera",
        "Two short runs: other; projected camera",
        "Published | here (mean over the runs, +- half of the range)",
        "What the servoing thesis states",
    ]
    numbers = [(one.configuration, one.metric, one.printed) for one in SHORT.cases.published()]
    assert numbers == [("plain", "outcome", "converged"), ("plain", "time_s", "7")]


def test_what_is_done_before_a_stop_is_found_by_the_next(result, tmp_path):
    seen = []
    session = StudySession(
        folder=tmp_path, workers=1, on_progress=seen.append, should_stop=lambda: len(seen) >= 2
    )
    found = SHORT(session=session)
    assert found.interrupted
    assert 0 < len(found.runs) < 4
    whole = SHORT(session=StudySession(folder=tmp_path, workers=1))
    assert not whole.interrupted
    assert whole.runs.table() == result[0].runs.table()
    with pytest.raises(OutputFolderError, match="quick is false there, true here"):
        SHORT(quick=True, session=StudySession(folder=tmp_path))


def test_rendered_runs_are_cases_of_their_own():
    configurations = Configuration("a", "a", repetitions=3), Configuration("b", "b")
    plan = replace(SHORT.cases, configurations=configurations, rendered=("b",), quick=())
    study = configuration_study(plan, source="")
    first, *others = study.plan(Form())
    assert (first.name, first.keys["camera"], first.rendered) == ("b, rendered", "rendered", True)
    assert [case.name for case in others] == ["a", "b"]
    assert [study.count(case, Form()) for case in (first, *others)] == [1, 3, 5]
    assert [study.count(case, Form(asked_seeds=7)) for case in (first, *others)] == [1, 7, 7]
    assert [case.name for case in study.plan(Form(quick=True))] == ["a", "b"]
    assert first.changes == ("duration=0.4", "camera.kind=rendered")
    assert not first.printed


def test_checks_do_not_see_rendered_runs():
    good = made_run("plain", position_error_m=0.001)
    rendered = made_run("plain", position_error_m=1.0)
    rendered = replace(rendered, keys={**rendered.keys, "camera": "rendered"})
    assert SHORT.checks[0].judge(Runs((rendered, good))).verdict == "confirmed"
    assert error_is_small.judge(Runs((rendered, good))).verdict == "not confirmed"


@pytest.mark.parametrize("study", CASE_STUDIES, ids=lambda study: study.name)
def test_every_configuration_is_a_scenario_that_loads(study):
    plan = study.cases
    names = {c.name for c in plan.configurations}
    assert set(plan.quick) <= names
    assert set(plan.rendered) <= names
    assert plan.rendered
    for case in study.plan(Form()):
        load_scenario(case.data.scenario, [*case.changes, "seed=0"])
    for configuration in plan.configurations:
        assert set(configuration.published) <= {"outcome", *plan.metrics()}


def test_a_legend_of_long_words_takes_fewer_columns_and_fits():
    figure, axes = new_figure(1, 1, (14.0, 6.0), "Paths")
    for k in range(8):
        axes.plot([0.0, 1.0], [0.0, k], label=f"a variant of the correction with many words, {k}")
    panels.legend_below(figure, *axes.get_legend_handles_labels())
    (legend,) = figure.legends
    assert 1 < legend._ncols < 4
    assert legend.get_window_extent().width <= figure.bbox.width
