"""The study of textured squares: its starts, what it asks for, what it says of what it found."""

from dataclasses import replace

import numpy as np

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.tagless import (
    DURATION,
    RATE,
    SCENARIO,
    SCHEMES,
    STUDY,
    TARGETS,
    overrides,
    starts,
)
from cdpr_drake.systems.diagrams.load import load_scenario

ROWS = round(DURATION * RATE) + 1


def made_up(case, seed, final=1e-4, lost=False):
    """What would be found without rendering: a tag at 0.1 mm, textures at half of that."""
    share = 1.0 if case.keys["target"] == "tag" else 0.5
    curve = np.geomspace(0.3, 1e-4, ROWS)
    return {
        "final_m": final * share, "final_deg": 0.02 * share, "outcome": "timeout", "lost": lost,
        "without_target": 0, "by_features": 1, "start_m": 0.3, "distance_m": curve,
        "angle_rad": curve,
    }  # fmt: skip


def worse(case, seed):
    """Eight times the error on one texture, two runs that are lost on another."""
    if case.name == "pbvs print":
        return made_up(case, seed, final=8e-4)
    return made_up(case, seed, lost=case.name == "ibvs map" and seed > 0)


def study(measure, quick=False):
    return replace(STUDY, measure=measure)(quick, StudySession(workers=1, seeds=3))


def test_starts_are_the_same_for_all_and_see_the_target():
    few, more = starts(2), starts(4)
    for one, other in zip(few, more, strict=False):
        np.testing.assert_array_equal(np.concatenate(one), np.concatenate(other))
    settings = {}
    for target in ("tag", "map"):
        scenario = load_scenario(SCENARIO, overrides("2.5d", target, 3))
        np.testing.assert_array_equal(scenario.initial_pose.position, more[3][0])
        assert scenario.controller.scheme == "2.5d"
        settings[target] = scenario.camera, scenario.target.size, scenario.duration
    assert settings["tag"] == settings["map"]
    assert scenario.target.kind == "textured"


def test_it_judges_tables_and_draws(tmp_path):
    found = study(made_up)
    assert len(dict(found.runs.by("scheme", "target"))) == len(SCHEMES) * len(TARGETS)
    assert {s.verdict for s in found.statements} == {"confirmed"}
    assert len(found.tables()) == 2
    assert found.write(tmp_path) == {}
    assert (tmp_path / "tagless.png").exists()


def test_the_quick_form_says_what_it_does_not_judge():
    said = {s.name: s.verdict for s in study(made_up, quick=True).statements}
    assert said["pbvs"] == "confirmed"
    assert said["hybrid"] == said["losses"] == "not judged in the quick form"


def test_worse_squares_and_lost_runs_are_not_confirmed():
    said = {s.name: s for s in study(worse).statements}
    assert said["pbvs"].verdict_words == "in part (2 of 3)"
    assert said["ibvs"].verdict == "confirmed"
    assert said["losses"].verdict_words == "in part (2 of 3)"
    assert "map 0 + 2 + 0 runs" in said["losses"].found
