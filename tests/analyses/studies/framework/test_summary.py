"""Tables of runs: captions of coarse grids."""

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.framework.summary import note_coarse


def caption(before, *quick):
    table = new_table("Shares", ("robot",), ())
    table.caption = before
    runs = [Run(str(n), None, {"grid": Form(one).grid}, {}) for n, one in enumerate(quick)]
    return note_coarse(table, Runs(runs), "it means little.").caption


def test_tables_of_coarse_grids_say_so():
    assert caption(None, True, True) == "Coarse grid: it means little."
    assert caption("In per cent.", False, True) == "In per cent.\nCoarse grid: it means little."


def test_tables_of_full_grids_and_of_none_say_nothing():
    assert caption("In per cent.", False) == "In per cent."
    assert caption(None) is None
    table = new_table("Distances", ("robot",), ())
    assert note_coarse(table, Runs([Run("a", None, {"robot": "a"}, {})])).caption is None
