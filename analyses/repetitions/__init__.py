"""Many runs of one scenario: over seeds, in processes, kept in a folder, and what they came to."""

from cdpr_drake.analyses.repetitions.kept_runs import KeptRuns, repetition_folder
from cdpr_drake.analyses.repetitions.many_runs import ManyRuns, run_many, with_seeds
from cdpr_drake.analyses.repetitions.report import (
    repetition_pictures,
    repetition_table,
    write_repetitions,
)

__all__ = [
    "KeptRuns", "ManyRuns", "repetition_folder", "repetition_pictures", "repetition_table",
    "run_many", "with_seeds", "write_repetitions",
]  # fmt: skip
