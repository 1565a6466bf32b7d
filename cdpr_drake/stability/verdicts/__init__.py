"""Verdicts on poses, of growing weight: sampled, searched, certified.

Source: servoing thesis 3.3 for sampling; the certificate is this project's own, see
`stability.certificate`.
"""

from cdpr_drake.stability.verdicts.any_target import some_target_possible
from cdpr_drake.stability.verdicts.verdict import (
    VERDICTS,
    StabilityChunk,
    VerdictOptions,
    judge_all_verdicts,
    judge_stability,
    packed_case,
    worst_perturbations,
)

__all__ = [
    "VERDICTS", "StabilityChunk", "VerdictOptions", "judge_all_verdicts", "judge_stability",
    "packed_case", "some_target_possible", "worst_perturbations",
]  # fmt: skip
