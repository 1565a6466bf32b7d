"""Studies whose measurement is made up: whether statements can fail, and what is written."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.framework.study import Study, StudyResult

MadeUp = Callable[..., dict[str, Any]]
"""Row of a case with a seed; with `wrong` one that is contrary to what statements say."""


def results(study: Study, made_up: MadeUp, wrong: bool = False) -> StudyResult:
    """A study in its quick form with rows that are made up."""
    return replace(study, measure=partial(made_up, wrong=wrong))(True, StudySession(workers=1))


def check_statements_tell_apart(study: Study, made_up: MadeUp) -> None:
    """All statements hold of good rows, and none of contrary ones."""
    for wrong, verdict in ((False, "confirmed"), (True, "not confirmed")):
        assert {one.verdict for one in results(study, made_up, wrong).statements} == {verdict}


def check_written(study: Study, made_up: MadeUp, folder: Path) -> None:
    """Tables, and a figure of the study's name, of good rows and of contrary ones."""
    for wrong in (False, True):
        found = results(study, made_up, wrong)
        assert len(found.tables()) > 0
        (folder / str(wrong)).mkdir()
        assert not found.write(folder / str(wrong))
        assert (folder / str(wrong) / f"{study.name}.png").is_file()
