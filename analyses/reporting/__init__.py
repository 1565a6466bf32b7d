"""Where results go: folders, logs, tables, statements on what was published, provenance."""

from cdpr_drake.analyses.reporting.exported_logs import (
    LOG_WRITERS,
    checked_log_formats,
    log_exports,
    write_columns,
)
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.log_files import (
    column_names,
    finite,
    spread,
    write_json,
    write_log,
    write_scenario,
    write_whole,
)
from cdpr_drake.analyses.reporting.log_on_disk import (
    CHECKPOINT,
    PARTS,
    UNWRITTEN_CHECKPOINT,
    Log,
    LogOnDisk,
    log_block,
    log_rows,
)
from cdpr_drake.analyses.reporting.output_folder import (
    MARKER,
    ResultsFolder,
    continued_folder,
    holds_log,
    mark,
    results_folder,
    resumed_folder,
    unfinished_folder,
)
from cdpr_drake.analyses.reporting.pictures import NothingToDraw, Pictures, write_pictures
from cdpr_drake.analyses.reporting.progress import (
    ALONE,
    StoppableStudy,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.run_inputs import BELIEVED_FILE, write_run_inputs
from cdpr_drake.analyses.reporting.statements import (
    CONFIRMED,
    IN_PART,
    NOT_CONFIRMED,
    NOT_IN_QUICK,
    NOT_JUDGED,
    NOT_TESTABLE,
    Statement,
    judge_name,
    judge_names,
    judged,
    judged_statements,
    not_judged,
    verdict,
)
from cdpr_drake.analyses.reporting.tables import new_table, statement_table
from cdpr_drake.analyses.reporting.timing import (
    TimingRow,
    interleaved,
    processor_seconds,
    real_time_row,
    seconds_each,
    seconds_per_call,
)

__all__ = [
    "ALONE", "BELIEVED_FILE", "CHECKPOINT", "CONFIRMED", "IN_PART", "LOG_WRITERS", "MARKER",
    "NOT_CONFIRMED", "NOT_IN_QUICK", "NOT_JUDGED", "NOT_TESTABLE", "PARTS", "UNWRITTEN_CHECKPOINT",
    "Log", "LogOnDisk", "NothingToDraw", "Pictures", "ResultsFolder", "Statement",
    "StoppableStudy", "StudySession", "TimingRow", "WorkProgress",
    "checked_log_formats", "code_version", "column_names", "continued_folder",
    "finite", "free_folder", "holds_log", "interleaved", "judge_name", "judge_names", "judged",
    "judged_statements", "log_block", "log_exports", "log_rows", "mark", "new_table", "not_judged",
    "package_versions", "processor_seconds", "real_time_row", "results_folder", "resumed_folder",
    "seconds_each", "seconds_per_call", "spread", "statement_table", "unfinished_folder", "verdict",
    "write_columns", "write_json", "write_log", "write_pictures", "write_run_inputs",
    "write_scenario", "write_whole",
]  # fmt: skip
