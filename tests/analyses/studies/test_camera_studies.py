"""Studies of cameras: lenses, turning cameras, textures."""

from functools import partial

import numpy as np
import pytest

from cdpr_drake.analyses.studies import lenses, pan_tilt, tagless
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.analyses.studies.made_up_studies import check_told_apart_and_written, made, verdicts

# Lenses.


def with_lens(case, seed, known=1.02, ignored=300.0):
    """What would be found: errors without a lens, and times these with one."""
    lens = case.keys["lens"]
    times = known if lens in lenses.KNOWN else ignored if lens in lenses.UNKNOWN else 1.0
    return {"final_m": times * 1e-5, "final_deg": 0.001 * times, "outcome": "timeout",
            "lost": False, "noise_cost": 1.03}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [({}, "confirmed"), ({"known": 1.2, "ignored": 2.0}, "not confirmed")],
)
def test_statements_on_lenses_hold_and_fail_of_what_they_should(changes, verdict):
    found = verdicts(made(lenses.STUDY, partial(with_lens, **changes), quick=False, seeds=2))
    assert found == dict.fromkeys(("known", "noise", "ignored"), verdict)


def test_every_variant_of_a_lens_is_a_scenario():
    for changes in lenses.VARIANTS.values():
        load_scenario("acrobot_pbvs", list(changes))


def test_a_run_comes_to_rest_where_it_should_with_a_known_lens_only():
    cases = {case.keys["lens"]: case for case in lenses.STUDY.plan(Form(quick=True))}
    names = ("ideal", lenses.KNOWN[0], lenses.UNKNOWN[0])
    rows = [lenses.measure(cases[lens], 0) for lens in names]
    ideal, known, ignored = (row["final_m"] for row in rows)
    # One run; the same noise goes through another lens.
    assert known < 1.05 * rows[1]["noise_cost"] * ideal
    assert 1.0 < rows[1]["noise_cost"] < 1.2
    assert ignored > 5.0 * ideal


# Turning cameras.


def turning(case, seed, wrong=False):
    """Joints keep what the fixed camera does not see from every second start; or contrary."""
    turned = case.keys["camera"] == pan_tilt.TURNED
    good = (turned or seed % 2 == 0) != (wrong and turned) or (wrong and not turned)
    return {
        "outcome": "converged" if good else "target_lost", "error_m": 5e-4 if good else 0.3,
        "error_rad": 0.01, "seen_at_start": good, "first_seen_s": 0.5 if good or turned else None,
        "unseen_s": 0.0 if good else 1.0, "kept": good, "converged": good,
        "median_off_px": 5.0 if turned else None, "largest_deg": 30.0 if turned else None,
        "encoder_deg": 0.1 if turned else None,
    }  # fmt: skip


def test_statements_tell_good_eyes_from_bad(tmp_path):
    check_told_apart_and_written(pan_tilt.STUDY, turning, tmp_path)


def test_starts_of_turning_cameras_are_where_they_are_said_to_be():
    for seed in range(50):
        position, angles = map(np.array, pan_tilt.start(seed))
        assert np.all((position >= pan_tilt.LOWER) & (position <= pan_tilt.UPPER))
        assert np.all(np.abs(angles) <= (pan_tilt.TILT, pan_tilt.TILT, pan_tilt.TURN))


# Textured squares.

ROWS = round(tagless.DURATION * tagless.RATE) + 1


def textured(case, seed, final=1e-4, lost=False):
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
        return textured(case, seed, final=8e-4)
    return textured(case, seed, lost=case.name == "ibvs map" and seed > 0)


def test_starts_are_the_same_for_all_and_see_the_target():
    few, more = tagless.starts(2), tagless.starts(4)
    for one, other in zip(few, more, strict=False):
        np.testing.assert_array_equal(np.concatenate(one), np.concatenate(other))
    settings = {}
    for target in ("tag", "map"):
        items = tagless.overrides("2.5d", target, 3)
        scenario = load_scenario(tagless.SCENARIO, items)
        np.testing.assert_array_equal(scenario.initial_pose.position, more[3][0])
        assert scenario.controller.scheme == "2.5d"
        settings[target] = scenario.camera, scenario.target.size, scenario.duration
    assert settings["tag"] == settings["map"]
    assert scenario.target.kind == "textured"


def test_textures_are_judged_tabled_and_drawn(tmp_path):
    found = made(tagless.STUDY, textured, quick=False, seeds=3)
    groups = dict(found.runs.by("scheme", "target"))
    assert len(groups) == len(tagless.SCHEMES) * len(tagless.TARGETS)
    assert set(verdicts(found).values()) == {"confirmed"}
    assert len(found.tables()) == 2
    assert found.write(tmp_path) == {}
    assert (tmp_path / "tagless.png").exists()
    quick = verdicts(made(tagless.STUDY, textured, seeds=3))
    assert quick["pbvs"] == "confirmed"
    assert quick["hybrid"] == quick["losses"] == "not judged in the quick form"


def test_worse_squares_and_lost_runs_are_not_confirmed():
    found = made(tagless.STUDY, worse, quick=False, seeds=3)
    said = verdicts(found)
    assert said["pbvs"] == said["losses"] == "in part (2 of 3)"
    assert said["ibvs"] == "confirmed"
    (losses,) = (one for one in found.statements if one.name == "losses")
    assert "map 0 + 2 + 0 runs" in losses.found
