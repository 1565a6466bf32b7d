"""Runs of configurations that nobody ran."""

from functools import cache

from cdpr_drake.analyses.studies.case_studies import CASE_STUDIES
from cdpr_drake.analyses.studies.framework.case_run import METRICS
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.tension_cases import TENSION_CASES
from cdpr_drake.systems.cameras.camera_settings import PROJECTED


@cache
def configurations():
    """Names of all configurations of all case studies."""
    studies = (*CASE_STUDIES, *TENSION_CASES)
    return tuple(dict.fromkeys(c.name for study in studies for c in study.cases.configurations))


def made_run(name, outcome="converged", seed=0, metrics=METRICS, **row):
    """A run with projected images; metrics that `row` does not name are 0."""
    keys = {"configuration": name, "group": "", "camera": PROJECTED}
    usual = {**dict.fromkeys(metrics, 0.0), "outcome": outcome, "stop_position_m": 0.005}
    return Run(name, seed, keys, {**usual, **row})


def made_runs(runs):
    """Runs of which any configuration of any case study may be missing."""
    return Runs(tuple(runs), lambda: {"configuration": configurations()})
