"""Case studies: which runs they ask for, what they keep, judge, draw, and how they are stopped."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import Statement, verdict
from cdpr_drake.analyses.studies.case_studies import CASE_STUDIES
from cdpr_drake.analyses.studies.framework import case_panels as panels
from cdpr_drake.analyses.studies.framework.case_definition import CaseStudy, Configuration
from cdpr_drake.analyses.studies.framework.case_figures import case_drawings
from cdpr_drake.analyses.studies.framework.case_layouts import paths_layout
from cdpr_drake.analyses.studies.framework.case_run import METRICS, CaseRuns
from cdpr_drake.analyses.studies.framework.case_study import run_case_study
from cdpr_drake.analyses.studies.framework.case_tables import configuration_numbers
from cdpr_drake.analyses.studies.tension_cases import TENSION_CASES
from cdpr_drake.analyses.visualization.figure_files import write_figures
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.systems.diagrams.load import load_scenario


def _error_is_small(runs: CaseRuns) -> Statement:
    error = runs.largest("plain", "position_error_m")
    return Statement("The error is small.", "", f"{error:.2f} m", verdict(error < 0.01), "")


def _needs_a_run_that_is_missing(runs: CaseRuns) -> Statement:
    return Statement("?", "", runs.outcomes("missing"), verdict(True), "")


SHORT = CaseStudy(
    name="short",
    title="Two short runs",
    source="made up",
    scenario="acrobot_pbvs",
    changes=("duration=0.4",),
    configurations=(
        Configuration("plain", "plain", published={"outcome": "converged", "time_s": "7"}),
        Configuration(
            "turned",
            "turned camera",
            (
                "perturbations.camera_pose.angles_deg=[0, 0, 20]",
                "perturbations.camera_pose.position=[0, 0, 0]",
            ),
            group="other",
        ),
    ),
    repetitions=2,
    quick=("plain",),
    judges=(_error_is_small, _needs_a_run_that_is_missing),
)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("short")
    found = run_case_study(SHORT, session=StudySession(folder=folder, workers=1))
    found.write(folder)
    return found, folder


def test_every_configuration_runs_with_every_seed(result):
    found, _ = result
    done = [(run.job.configuration, run.job.seed) for run in found.runs]
    assert done == [("plain", 0), ("plain", 1), ("turned", 0), ("turned", 1)]
    assert not found.interrupted
    assert all(run.outcome == "timeout" for run in found.runs)


def test_configurations_differ_and_seeds_differ(result):
    found, _ = result
    errors = [run.traces["error"][-1] for run in found.runs]
    assert not np.allclose(errors[0], errors[2], atol=1e-3)
    assert 0.0 < np.abs(errors[0] - errors[1]).max() < 0.05


def test_metrics_are_those_of_the_traces(result):
    found, _ = result
    for run in found.runs:
        assert set(run.metrics) == set(METRICS)
        traces = run.traces
        assert run.metrics["time_s"] == pytest.approx(0.4)
        assert run.metrics["image_max_px"] == pytest.approx(traces["image_deviation"].max())
        assert run.metrics["camera_mean_m"] == pytest.approx(traces["camera_deviation"].mean())
        gap = np.linalg.norm(traces["estimate_path"] - traces["platform_path"], axis=1)
        assert run.metrics["estimate_max_m"] == pytest.approx(gap.max())


def test_statements_without_their_runs_are_left_out(result):
    found, _ = result
    assert [statement.words for statement in found.statements] == ["The error is small."]
    assert found.statements[0].verdict == "not confirmed"


def test_accuracy_and_repeatability_by_their_definition(result):
    found, _ = result
    numbers = configuration_numbers(CaseRuns(found.runs), "plain", METRICS)
    ends = np.array([run.traces["camera_path"][-1] for run in found.runs[:2]])
    half = np.linalg.norm(ends[0] - ends[1]) / 2.0
    assert numbers["repeatability_m"] == pytest.approx(half)
    assert numbers["accuracy_m"] == pytest.approx(
        np.linalg.norm(ends.mean(axis=0) - found.runs[0].traces["camera_line"][1])
    )


def test_one_figure_that_fails_is_named_and_costs_no_other(result, tmp_path, monkeypatch):
    found, _ = result
    really = Figure.savefig

    def cut(figure, path, **options):
        if "deviations_other" in path.name:
            raise OSError(28, "No space left on device")
        really(figure, path, **options)

    monkeypatch.setattr(Figure, "savefig", cut)
    failed = found.write(tmp_path)
    assert failed == {"deviations_other.png": "[Errno 28] No space left on device"}
    names = {file.name for file in tmp_path.glob("*.png")}
    assert {"image_paths.png", "image_paths_other.png", "deviations.png", "errors.png"} <= names
    assert not {name for name in names if "stability" in name}  # nothing to draw is no failure


def curve(runs: CaseRuns) -> Figure:
    figure, axes = new_figure(1, 1, (3.0, 2.0), "A curve")
    axes.plot(runs.of("plain")[0].traces["error"])
    return figure


def bad(runs: CaseRuns) -> Figure:
    raise ValueError("no such colour\nat all")


def missing(runs: CaseRuns) -> Figure:
    return curve(CaseRuns(runs.of("missing")))


def test_figures_whose_runs_are_missing_are_left_out_and_that_is_no_failure(result, tmp_path):
    found, _ = result
    case = replace(
        SHORT,
        layouts={"figure_1": paths_layout("Not yet", ("missing",))},
        drawings={"bad": bad, "missing": missing, "curve": curve},
    )
    drawn = case_drawings(case, found.runs)
    for name in ("figure_1", "missing", "cable_tensions"):  # of the last, traces have nothing
        with pytest.raises(NothingToDraw):
            drawn[name]()
    own = {name: drawn[name] for name in ("figure_1", "bad", "missing", "curve")}
    assert write_figures(tmp_path, own) == {"bad.png": "no such colour"}
    assert [file.name for file in tmp_path.iterdir()] == ["curve.png"]


def test_without_any_run_nothing_is_drawn_and_nothing_fails(result, tmp_path):
    found, _ = result
    case = replace(
        SHORT,
        layouts={"figure_1": paths_layout("Not yet", ("plain",))},
        drawings={"curve": curve},
    )
    assert replace(found, case=case, runs=(), statements=()).write(tmp_path) == {}
    assert [file.name for file in tmp_path.iterdir()] == ["results.json"]


def test_results_traces_and_figures_are_written(result):
    found, folder = result
    stored = json.loads((folder / "results.json").read_text())
    assert [c["name"] for c in stored["configurations"]] == ["plain", "turned"]
    assert stored["configurations"][0]["published"] == {"outcome": "converged", "time_s": "7"}
    assert stored["runs"][0]["changes"] == ["duration=0.4", "camera.kind=projected", "seed=0"]
    with np.load(folder / "traces.npz") as traces:
        np.testing.assert_array_equal(
            traces["turned/1/camera_path"], found.runs[3].traces["camera_path"]
        )
    names = {file.name for file in folder.glob("*.png")}
    assert {"image_paths.png", "image_paths_other.png", "deviations.png", "errors.png"} <= names
    assert {name.removesuffix(".png") for name in names} <= set(found.case.figures())


def test_tables_show_published_beside_found(result):
    found, _ = result
    titles = [table.title for table in found.tables()]
    assert titles == [
        "Two short runs; projected camera",
        "Two short runs: other; projected camera",
        "Published | here (mean over the runs, +- half of the range)",
        "What the servoing thesis states",
    ]


def test_what_is_done_before_a_stop_is_found_by_the_next(result, tmp_path):
    seen = []

    def should_stop():
        return len(seen) >= 2

    found = run_case_study(
        SHORT,
        session=StudySession(
            folder=tmp_path, workers=1, on_progress=seen.append, should_stop=should_stop
        ),
    )
    assert found.interrupted
    assert len(found.runs) == 1
    told = []
    whole = run_case_study(
        SHORT, session=StudySession(folder=tmp_path, workers=1, on_progress=told.append)
    )
    assert not whole.interrupted
    assert told[0].found > 0.0
    straight, _ = result
    for run, other in zip(whole.runs, straight.runs, strict=True):
        assert (run.outcome, run.message, run.features) == (
            other.outcome,
            other.message,
            other.features,
        )
        assert run.metrics == finite(other.metrics)
        assert run.summary["sim_time_s"] == other.summary["sim_time_s"]
        for name, array in other.traces.items():
            np.testing.assert_array_equal(run.traces[name], array)


def test_a_finished_study_is_found_again(result):
    found, folder = result
    told = []
    again = run_case_study(SHORT, session=StudySession(folder=folder, on_progress=told.append))
    assert told[0].found == told[0].total
    assert [s.as_dict() for s in again.statements] == [s.as_dict() for s in found.statements]
    with pytest.raises(OutputFolderError, match="quick is false there, true here"):
        run_case_study(SHORT, quick=True, session=StudySession(folder=folder))


def test_as_many_seeds_as_asked_for():
    assert [job.seed for job in SHORT.jobs(quick=True, seeds=3)] == [0, 1, 2]


def test_quick_form_asks_for_its_configurations_once():
    assert [job.configuration for job in SHORT.jobs(quick=True)] == ["plain"]


@pytest.mark.parametrize("case", [*CASE_STUDIES, *TENSION_CASES], ids=lambda case: case.name)
def test_every_configuration_is_a_scenario_that_loads(case):
    names = [c.name for c in case.configurations]
    assert len(set(names)) == len(names)
    assert set(case.quick) <= set(names)
    assert set(case.rendered) <= set(names)
    assert case.rendered
    for job in case.jobs(quick=False):
        if job.seed == 0:
            load_scenario(job.scenario, job.changes)
    for configuration in case.configurations:
        assert set(configuration.published) <= {"outcome", *case.metrics()}


def test_a_legend_of_long_words_takes_fewer_columns_and_fits():
    figure, axes = new_figure(1, 1, (14.0, 6.0), "Paths")
    for k in range(8):
        axes.plot([0.0, 1.0], [0.0, k], label=f"a variant of the correction with many words, {k}")
    panels.legend_below(figure, *axes.get_legend_handles_labels())
    (legend,) = figure.legends
    assert 1 < legend._ncols < 4
    assert legend.get_window_extent().width <= figure.bbox.width
