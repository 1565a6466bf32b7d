"""Rows of a report about statements that were judged as a test says."""

from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reproduction.rows import report_rows
from cdpr_drake.analyses.reproduction.states import StudyState, study_folder
from cdpr_drake.analyses.studies.catalogue import StudyEntry
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import Finding, judged, statement
from cdpr_drake.analyses.studies.published.register import read_register


def judged_rows(folder, **studies):
    """Rows of a register with each statement of some studies, and a table that rests on all."""
    states = {}
    for name, said in studies.items():
        study_folder(folder, name).mkdir(parents=True)
        write_json(study_folder(folder, name) / "results.json", {"statements": said})
        states[name] = StudyState(name, "finished", quick=False, code="1")
    answers = [f"{study}/{one['name']}" for study, said in studies.items() for one in said]
    register = read_register("toy", {"title": "Toy", "sections": [{
        "section": "1.1", "title": "One", "statements": answers,
        "items": [{"label": "Table 1.1", "says": "All", "answers": answers}],
    }]})  # fmt: skip
    return register, report_rows(
        [register], folder, dict.fromkeys(states, StudyEntry(_nothing)), states
    )


def said(name, held, basis="test", **more):
    check = statement(f"It is {name}.", name=name, basis=basis, **more)(
        lambda runs: Finding(found="so", held=held)
    )
    return judged([check], Runs([]))[0].as_dict()


def _nothing(quick, session):
    raise AssertionError("no study is run")
