"""Where results go: folders, logs, tables, statements on what was published, provenance."""

from cdpr_drake.analyses.reporting.log_files import (
    finite,
    spread,
    write_log,
    write_scenario,
    write_summary,
)
from cdpr_drake.analyses.reporting.output_folder import (
    continued_folder,
    free_folder,
    results_folder,
)
from cdpr_drake.analyses.reporting.progress import StudyProgress
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import (
    NOT_CONFIRMED,
    NOT_TESTABLE,
    Statement,
    verdict,
)
from cdpr_drake.analyses.reporting.tables import new_table, statement_table
from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, seconds_per_call

__all__ = [
    "NOT_CONFIRMED", "NOT_TESTABLE", "Statement", "StudyProgress", "TimingRow", "code_version",
    "continued_folder", "finite", "free_folder", "interleaved", "new_table", "package_versions",
    "results_folder", "seconds_per_call", "spread", "statement_table", "verdict", "write_log",
    "write_scenario", "write_summary",
]  # fmt: skip
