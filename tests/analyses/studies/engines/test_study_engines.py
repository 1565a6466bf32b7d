"""The study of engines: what it runs, what it states of what was found."""

from dataclasses import replace

import numpy as np
import pytest
from cdpr_drake.analyses.studies.engines.study import STUDY, measure

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import CONFIRMED, NOT_CONFIRMED
from cdpr_drake.analyses.studies.engines import pairs
from cdpr_drake.analyses.studies.engines import study as module
from cdpr_drake.analyses.studies.framework.study import Form
from tests.analyses.studies.made_up_studies import made, verdicts

PAIR = {
    "outcome_plant": "converged", "outcome_compiled": "converged", "time_plant_s": 1.0,
    "time_compiled_s": 1.0, "distance_m": 1e-6, "angle_rad": 0.0, "final_distance_m": 1e-9,
    "final_angle_rad": 0.0, "final_error_plant_m": 0.0, "final_error_compiled_m": 0.0,
    "tension_difference_n": 0.0, "largest_tension_n": 1.0, "slack_share": 0.0,
}  # fmt: skip


def same(case, seed):
    """Engines that agree."""
    kind = case.keys["kind"]
    if kind == "taut":
        return {
            "distance_m": 1e-8, "angle_rad": 1e-8, "energy_difference": 1e-8,
            "least_tension_n": 1.0,
        }  # fmt: skip
    if kind == "order":
        return order_row(case, 2.0**-3)
    if kind == "energy":
        return {
            "largest_gain": 0.0, "least_gain": -0.01, "semi_implicit_gain": 0.0,
            "slack_cables": 3, "largest_tension_n": 1.0,
        }  # fmt: skip
    return PAIR


def order_row(case, ratio):
    errors = (ratio ** np.arange(5)).tolist()
    return {
        "steps_s": case.data.steps(),
        "distances_m": dict.fromkeys(pairs.METHODS, errors),
        "orders": dict.fromkeys(pairs.METHODS, pairs.order_of(errors)),
    }


def parted(case, seed):
    """Engines that part in everything."""
    row = same(case, seed)
    kind = case.keys["kind"]
    if kind == "order":
        return order_row(case, 1.0)
    return (
        row
        | {
            "taut": {"distance_m": 2e-6},
            "scenario": {"outcome_compiled": "timeout"},
            "impacts": {"final_error_compiled_m": 1e-3},
            "energy": {"largest_gain": 0.5, "least_gain": -0.1},
        }[kind]
    )


@pytest.mark.parametrize(("measure", "verdict"), [(same, CONFIRMED), (parted, NOT_CONFIRMED)])
def test_engines_that_part_are_told_so(measure, verdict, tmp_path):
    found = made(STUDY, measure)
    assert verdicts(found) == dict.fromkeys(STUDY.names_of_checks(), verdict)
    assert found.write(tmp_path) == {}
    assert (tmp_path / "engines.png").exists()
    assert [len(table.columns) for table in found.tables()] == [10, 5]


@pytest.mark.parametrize(
    "worse", [{"time_compiled_s": 1.1}, {"final_error_compiled_m": 1e-4}, {"slack_share": 1.0}]
)
def test_each_part_of_what_ships_counts(worse):
    found = made(STUDY, lambda case, seed: same(case, seed) | worse)
    (shipped,) = [one for one in found.statements if one.name == "shipped"]
    assert (shipped.verdict == CONFIRMED) == ("slack_share" in worse)
    assert shipped.of == len(module.QUICK_SCENARIOS)


def test_it_runs_what_the_form_says(monkeypatch):
    quick = made(STUDY, same).runs.counts("kind")
    assert quick == {
        "scenario": len(module.QUICK_SCENARIOS), "taut": module.QUICK_MOTIONS,
        "order": len(pairs.ORDERS), "energy": len(pairs.ENERGY_STEPS),
        "impacts": module.QUICK_RUNS,
    }  # fmt: skip
    assert made(STUDY, same, seeds=4).runs.counts("kind") == quick | {"taut": 4, "impacts": 4}
    monkeypatch.setattr(module, "robot_scenario_names", lambda: ("planar_pbvs", "acrobot_pbvs"))
    full = {case.name: case for case in STUDY.plan(Form())}
    assert "scenario planar_pbvs" in full
    assert STUDY.count(full["impacts"], Form()) == 200
    assert STUDY.count(full["taut motions"], Form()) == 30
    assert STUDY.count(full["energy 0.0001 s"], Form()) == 1
    assert f"duration={module.QUICK_DURATION}" not in full["scenario acrobot_pbvs"].changes


def test_methods_have_their_orders_and_taut_motions_agree():
    plan = {case.name: case for case in STUDY.plan(Form(quick=True))}
    scenario = replace(plan["scenario acrobot_pbvs"], changes=("duration=0.1",))
    cases = [plan["order taut"], replace(plan["taut motions"], most=1), scenario]
    found = replace(STUDY, cases=lambda form: cases, checks=STUDY.checks[:2] + STUDY.checks[3:4])
    result = verdicts(found(True, StudySession(workers=1)))
    assert result == dict.fromkeys(("taut", "shipped", "orders"), CONFIRMED)


def test_energies_of_a_short_fall():
    (case,) = [one for one in STUDY.plan(Form(quick=True)) if one.name == "energy 0.0001 s"]
    row = measure(replace(case, data=0.05), 0)
    assert row["largest_gain"] < 0.01
    assert row["slack_cables"] == 8


def test_an_order_is_that_of_a_power():
    steps = np.array(pairs.ORDERS["taut"].steps())
    np.testing.assert_allclose([pairs.order_of(steps**p) for p in (1.0, 2.0, 3.0)], [1.0, 2.0, 3.0])


def test_a_row_does_not_depend_on_the_others(monkeypatch):
    monkeypatch.setattr(pairs, "TAUT_DURATION", 1.0)
    assert pairs.taut_row(1) == pairs.taut_row(1) != pairs.taut_row(0)
    assert pairs.slack_override(3) == pairs.slack_override(3) != pairs.slack_override(4)
    pair = pairs.run_pair("planar_pbvs", ["duration=0.1"])
    assert pair["outcome_plant"] == pair["outcome_compiled"] == "timeout"
    assert set(pair) == set(PAIR)
