"""Verdicts on poses, of growing weight: sampled, searched, certified.

Source: servoing thesis 3.3 for sampling; the certificate is this project's own, see
`stability.certificate`.
"""

from cdpr_drake.stability.verdicts.verdict import (
    VERDICTS,
    StabilityChunk,
    VerdictOptions,
    judge,
    judge_all,
    packed_case,
    pose_rows,
    worst_perturbations,
)

__all__ = [
    "VERDICTS", "StabilityChunk", "VerdictOptions", "judge", "judge_all", "packed_case",
    "pose_rows", "worst_perturbations",
]  # fmt: skip
