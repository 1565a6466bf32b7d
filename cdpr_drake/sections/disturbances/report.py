"""How much pushed the platform in a run: numbers."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.sections.force_control.report import FORCES
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL


def push_numbers(run: Run) -> dict[str, float]:
    """Largest force and moment on the platform in the rows of the log, and their times."""
    wrenches, numbers = run.log[APPLIED_WRENCH], {}
    for name, unit, part in (("force", "n", slice(3, 6)), ("moment", "nm", slice(3))):
        sizes = np.linalg.norm(wrenches[:, part], axis=1)
        k = int(np.argmax(sizes))
        numbers[f"largest_{name}_{unit}"] = float(sizes[k])
        numbers[f"largest_{name}_at_s"] = float(run.log["time"][k])
    return numbers


SUBJECTS = (
    Subject("disturbances", push_numbers, applies=lambda run: run.kind != TENSION_CONTROL),
    FORCES,
)
"""What a run reports of the section; dynamic control has its own numbers of forces."""
