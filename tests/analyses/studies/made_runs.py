"""Runs of configurations that nobody ran."""

from functools import cache

from cdpr_drake.analyses.studies.catalogue import MODULES, STUDIES
from cdpr_drake.analyses.studies.framework.case_run import METRICS
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.systems.cameras.camera_settings import PROJECTED

CASE_STUDIES = tuple(
    STUDIES[name].run
    for name, place in MODULES.items()
    if place.startswith(("case_studies", "tension_cases"))
)
"""All studies of configurations."""


@cache
def configurations():
    """Names of all configurations of all case studies."""
    return tuple(dict.fromkeys(c.name for one in CASE_STUDIES for c in one.cases.configurations))


def made_run(name, outcome="converged", seed=0, metrics=METRICS, **row):
    """A run with projected images; metrics that `row` does not name are 0."""
    keys = {"configuration": name, "group": "", "camera": PROJECTED}
    usual = {**dict.fromkeys(metrics, 0.0), "outcome": outcome, "stop_position_m": 0.005}
    return Run(name, seed, keys, {**usual, **row})


def made_runs(runs):
    """Runs of which any configuration of any case study may be missing."""
    return Runs(tuple(runs), lambda: {"configuration": configurations()})
