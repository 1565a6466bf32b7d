"""All that was published, repeated by one command: studies run one after the other, one report.

`run_studies` runs studies of the catalogue, each in a folder of its own, and continues where it was
stopped or killed; `report_rows` puts what they found beside every published number, table, figure
and statement, see `published.published_registers`; `write_report` makes one page of that. The page
is made of files alone, so that it is the same whether a study was run now or before.
"""

from cdpr_drake.analyses.reproduction.page import write_report
from cdpr_drake.analyses.reproduction.rows import (
    CITED,
    FAILED,
    MISSING,
    NOT_ASKED,
    NOT_FINISHED,
    SHOWN,
    ReportRow,
    report_rows,
)
from cdpr_drake.analyses.reproduction.runner import RunSettings, run_studies
from cdpr_drake.analyses.reproduction.scorecard import Scorecard
from cdpr_drake.analyses.reproduction.states import StudyState, check_folder

__all__ = [
    "CITED", "FAILED", "MISSING", "NOT_ASKED", "NOT_FINISHED", "SHOWN", "ReportRow", "RunSettings",
    "Scorecard", "StudyState", "check_folder", "report_rows", "run_studies", "write_report",
]  # fmt: skip
