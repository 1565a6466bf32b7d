"""The study of learning on the way: statements can fail, tables and figure are written."""

from cdpr_drake.analyses.studies.adaptation import LEARNT, NOTHING, STUDY, TRUE
from tests.analyses.studies.made_up_studies import check_statements_tell_apart, check_written


def made_up(case, seed, wrong=False):
    """Learning is better than the wrong model and near the true one; with `wrong` contrary."""
    model, learns = case.keys["model"], case.keys["model"] == LEARNT
    size = {TRUE: 1.0, LEARNT: 2.0 if wrong else 1.1}.get(model, 1.5)
    return {
        "outcome": "converged", "error_m": 1e-4 * size, "way_m": 0.3 * size,
        "deviation_m": 0.01 * size, "off_m": 0.002 * size, "slack_s": 5.0 * size,
        "before_m": 0.01 if learns else None,
        "after_m": (0.02 if wrong else 0.005) if learns else None,
        "largest_sigmas": (4.0 if wrong else 2.0) if learns else None,
        "excited": 22 if learns else None, "believed": 5 if learns else None,
        "rejected": 0 if learns else None, "doubts": [],
        "doubted": learns and (case.keys["flaw"] != NOTHING) != wrong,
    }  # fmt: skip


def test_statements_tell_good_learning_from_bad():
    check_statements_tell_apart(STUDY, made_up)


def test_tables_and_figure(tmp_path):
    check_written(STUDY, made_up, tmp_path)
