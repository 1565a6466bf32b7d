"""Studies whose measurement is made up: whether statements can fail, and what is written."""

from contextlib import suppress
from dataclasses import replace

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.reporting.progress import WorkSession


def made(study, made_up, quick=True, seeds=None):
    """A study with rows that are made up: `made_up(case, seed)`."""
    return replace(study, measure=made_up)(quick, WorkSession(workers=1, seeds=seeds))


def verdicts(found):
    """Of the statements of a study, by name: with how many parts hold where it is in part."""
    return {one.name: one.verdict_words for one in found.statements}


def with_figures(found, *names):
    """A study that writes some of its figures, and names of all that it draws: to lay all of them
    out takes long."""
    drawn = set()
    for name, draw in found.drawings().items():
        with suppress(NothingToDraw):
            assert draw().axes
            drawn.add(name)
    figures = {name: found.study.figures[name] for name in names}
    return replace(found, study=replace(found.study, figures=figures)), drawn


def check_tables_are_made(found):
    """None is left out, and none is empty."""
    tables = found.tables()
    assert all(table.row_count for table in tables)
    assert "not made" not in {str(column.header) for table in tables for column in table.columns}
