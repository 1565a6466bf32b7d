"""The study of schemes: the same starts for all, what it says of what it found, numbers by hand."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.studies.framework.statement import judged
from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.analyses.studies.schemes.statements import CHECKS
from cdpr_drake.analyses.studies.schemes.study import STUDY
from cdpr_drake.analyses.studies.schemes.trials import (
    DESIRED,
    FREE,
    ROBOT,
    SCENARIO,
    SEED,
    TURNS,
    TURNS_DEG,
    VARIANTS,
    FreeCamera,
    free_starts,
    measure,
    measured,
    robot_overrides,
    robot_starts,
    turned,
)
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.analyses.studies.made_up_studies import made, verdicts

BY_HAND = 1e-9


@pytest.fixture(scope="module")
def half_turns():
    """Half a turn, almost, by each scheme."""
    return {name: FreeCamera(name).run(turned(TURNS_DEG[-1]), bounded=False) for name in VARIANTS}


def test_half_a_turn_is_the_classic_retreat_of_image_based_servoing(half_turns):
    assert half_turns["ibvs"]["retreat_m"] > 10.0
    assert not half_turns["ibvs"]["arrived"]
    for name in ("pbvs", "pbvs-line", "2.5d", "partitioned", "partitioned, turned"):
        assert half_turns[name]["retreat_m"] < 1e-3
        assert half_turns[name]["arrived"]
    assert half_turns["switching"]["arrived"]
    assert half_turns["switching"]["switches"] == 1.0
    assert half_turns["switching"]["bound_share"] < 1.0


def test_paths_in_the_image_are_arcs_about_its_middle(half_turns):
    """A dot of a square turns at its distance from the middle, by each focal length its share."""
    pinhole = FreeCamera("pbvs").pinhole
    row = half_turns["partitioned, turned"]
    np.testing.assert_allclose(row["depths_m"], DESIRED, atol=1e-6)
    radius = 0.03 * np.sqrt(2.0) / DESIRED
    lengths = [angle * radius * np.radians(TURNS_DEG[-1]) for angle in (pinhole.fx, pinhole.fy)]
    assert lengths[0] < row["image_path_px"] < lengths[1]
    assert row["dots_px"].shape[1:] == (2, 4)


def test_numbers_of_a_motion_by_hand():
    """Straight back by 0.1 m beyond the farther end, and there again."""
    free = FreeCamera("ibvs")
    poses = [turned(0.0)]
    for depth in (0.2, 0.25, DESIRED):
        X = turned(0.0)
        X.set_translation([0.0, 0.0, depth])
        poses.append(X)
    row = measured(poses, free.X_CdO, free.target, free.pinhole)
    assert row["retreat_m"] == pytest.approx(0.1, abs=BY_HAND)
    np.testing.assert_allclose(row["depths_m"], [DESIRED, 0.2, 0.25, DESIRED])
    out = 0.03 * np.hypot(free.pinhole.fx, free.pinhole.fy) * (1.0 / DESIRED - 1.0 / 0.25)
    assert row["image_path_px"] == pytest.approx(2.0 * out, abs=1e-6)
    below = 0.5 * free.pinhole.height - 0.03 * free.pinhole.fy / DESIRED
    assert row["room_px"] == pytest.approx(below, abs=1e-6)


def test_starts_are_the_same_for_all_and_see_the_dots():
    for few, more in ((free_starts(2), free_starts(3)), (robot_starts(2), robot_starts(3))):
        assert all(one is other or one == other for one, other in zip(few, more, strict=False)) or (
            few[0].IsNearlyEqualTo(more[0], 0.0)
        )
    free = FreeCamera("pbvs")
    assert all(free.target.in_view(X_CO, free.pinhole) for X_CO in free_starts(3))
    for variant in VARIANTS:
        scenario = load_scenario(SCENARIO, robot_overrides(variant, 1))
        assert scenario.controller.scheme == variant.split(",")[0]
        assert scenario.initial_pose.position.tolist() == robot_starts(2)[1][0]
        assert scenario.seed == 1


@pytest.mark.parametrize("trial", [FREE, ROBOT])
def test_a_run_depends_on_its_number_alone(trial):
    case = Case(name="a", keys={"trial": trial, "scheme": "switching"})
    first, second, again = (measure(case, seed) for seed in (0, 1, 0))
    assert first == again
    assert first["image_path_px"] != second["image_path_px"]
    assert "depths_m" not in first


def made_up(case, seed):
    """A run that arrives; ibvs retreats, the line of pbvs loses, one run switches."""
    trial, scheme = case.keys["trial"], case.keys["scheme"]
    nothing = 0.0 if scheme == "switching" else np.nan
    row = {
        "arrived": True, "lost": False, "time_s": 5.0, "image_path_px": 200.0, "retreat_m": 0.0,
        "switches": nothing, "bound_share": nothing, "room_px": 50.0,
    }  # fmt: skip
    if trial == TURNS:
        row["depths_m"] = np.full(3, DESIRED)
    half = case.keys.get("turn_deg") == TURNS_DEG[-1]
    if half and scheme == "ibvs":
        row |= {"arrived": False, "retreat_m": 50.0}
    if half and scheme == "switching":
        row |= {"switches": 1.0, "bound_share": 0.9}
    if trial == FREE and seed == 0 and scheme in ("ibvs", "pbvs", "pbvs-line", "partitioned"):
        row |= {"arrived": False, "lost": scheme != "ibvs"}
    return row


def said(spoil):
    """Verdicts by name, of made-up runs with changes."""

    def changed(case, seed):
        return made_up(case, seed) | spoil(case, seed)

    return {one.name: one.verdict for one in made(STUDY, changed, False, seeds=3).statements}


@pytest.mark.parametrize(
    ("check", "names", "changes", "verdict"),
    [
        ("image_far", ["turns, ibvs, 179 deg"], {"arrived": True}, "in part"),
        ("image_far", ["free camera, ibvs"], {"arrived": True}, "in part"),
        ("image_far", ["turns, ibvs, 179 deg"], {"retreat_m": 0.0}, "not confirmed"),
        ("pose_loses", ["free camera, pbvs"], {"lost": False}, "in part"),
        ("partition_decouples", ["turns, partitioned, 60 deg"], {"retreat_m": 0.2}, "in part"),
        ("partition_decouples", ["free camera, partitioned"], {"retreat_m": 0.7}, "in part"),
        ("switching_by_bounds", ["turns, switching, 60 deg"], {"bound_share": 1.5}, "in part"),
        ("hybrid_free_of_minima", ["free camera, 2.5d"], {"arrived": False}, "not confirmed"),
    ],
)
def test_what_is_not_so_is_not_confirmed(check, names, changes, verdict):
    assert said(lambda case, seed: changes if case.name in names else {})[check] == verdict


def test_a_field_that_loses_almost_as_many_holds_in_part():
    def lost(case, seed):
        least = {"free camera, partitioned": 0, "free camera, partitioned, field": 1}
        return {"lost": seed >= least[case.name]} if case.name in least else {}

    assert said(lost)["field_keeps_points"] == "in part"


def test_what_lacks_is_not_judged():
    runs = made(STUDY, made_up, False, seeds=1).runs
    without = replace(runs, rows=[run for run in runs if run.case != "ACROBOT, 2.5d"])
    names = {one.name for one in judged(CHECKS, without, complete=False)}
    assert {one.name for one in CHECKS} - names == {"hybrid_free_of_minima"}


def test_it_judges_tabulates_and_writes(tmp_path):
    assert set(verdicts(made(STUDY, made_up, False, seeds=3)).values()) == {"confirmed"}
    study = made(STUDY, made_up, seeds=2)
    assert len(study.runs) == len(VARIANTS) * (len(TURNS_DEG) + 2 + 2)
    assert len(study.tables()) == 4
    study.write(tmp_path)
    written = json.loads((tmp_path / "results.json").read_text())
    assert len(written["parameters"]["robot_starts"]) == 2
    assert written["parameters"]["seed"] == SEED
    assert (tmp_path / "schemes.png").exists()
