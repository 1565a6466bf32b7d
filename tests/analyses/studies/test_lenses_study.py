"""The study of lenses: its runs, and what it says of what it found."""

from dataclasses import replace

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.lenses import KNOWN, STUDY, UNKNOWN, VARIANTS, measure
from cdpr_drake.systems.diagrams.load import load_scenario

IDEAL = 1e-5  # [m]


def made_up(case, seed, known=1.02, ignored=300.0):
    """What would be found: errors without a lens, and times these with one."""
    lens = case.keys["lens"]
    times = known if lens in KNOWN else ignored if lens in UNKNOWN else 1.0
    return {"final_m": times * IDEAL, "final_deg": 0.001 * times, "outcome": "timeout",
            "lost": False, "noise_cost": 1.03}  # fmt: skip


def verdicts(measure):
    study = replace(STUDY, measure=measure)(False, StudySession(workers=1, seeds=2))
    return {one.name: one.verdict for one in study.statements}


def test_statements_hold_of_what_they_should():
    assert verdicts(made_up) == {"known": "confirmed", "noise": "confirmed", "ignored": "confirmed"}


def test_statements_fail_of_what_they_should():
    told = verdicts(lambda case, seed: made_up(case, seed, known=1.2, ignored=2.0))
    assert told == dict.fromkeys(("known", "noise", "ignored"), "not confirmed")


def test_every_variant_is_a_scenario():
    for changes in VARIANTS.values():
        load_scenario("acrobot_pbvs", list(changes))


def test_a_run_comes_to_rest_where_it_should_with_a_known_lens_only():
    cases = {case.keys["lens"]: case for case in STUDY.plan(Form(quick=True))}
    rows = [measure(cases[lens], 0) for lens in ("ideal", KNOWN[0], UNKNOWN[0])]
    ideal, known, ignored = (row["final_m"] for row in rows)
    # One run; the same noise goes through another lens.
    assert known < 1.05 * rows[1]["noise_cost"] * ideal
    assert 1.0 < rows[1]["noise_cost"] < 1.2
    assert ignored > 5.0 * ideal
