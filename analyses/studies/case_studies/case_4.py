"""Case study IV: pose-based visual servoing on CAROCA, its first pose badly known."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.case_studies.path_figures import three_layouts
from cdpr_drake.analyses.studies.framework.caroca_cables import CAROCA_ASSUMPTION, CAROCA_RUN
from cdpr_drake.analyses.studies.framework.case_definition import Configuration, Plan
from cdpr_drake.analyses.studies.framework.case_run import converged, outcomes
from cdpr_drake.analyses.studies.framework.case_statements import same_accuracy
from cdpr_drake.analyses.studies.framework.case_study import configuration_study
from cdpr_drake.analyses.studies.framework.experiments import (
    as_transform,
    between,
    pose_item,
    turned,
)
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import CHOICE, SOURCE, Finding, statement

UNKNOWN = "the directions of the errors are not printed, nor how high the ground is"
"""Why runs cannot be those that were published."""

LIFT = 0.133
"""How far all heights are raised so that the tag lies on the ground [m]."""

START = as_transform(((0.713, 0.102, 1.899 + LIFT), (-18.0, 10.0, -5.0)))
"""Initial pose of the platform in W."""

PRINTED_BELIEF = as_transform(((0.561, -0.11, 2.202 + LIFT), (-25.0, 12.0, 3.0)))
"""Where section 2.3.5 makes the controller believe it to be, 0.4 m and 8 deg away."""


def believed(distance: float, angle_deg: float, lift: float = LIFT) -> str:
    """The item for a belief that is a distance [m] and an angle [deg] wrong, raised by `lift`."""
    direction, axis = between(START, PRINTED_BELIEF)
    X = turned(START, distance * direction, angle_deg, axis)
    return pose_item("perturbations.initial_pose", lowered(X, LIFT - lift))


def lowered(X: RigidTransform, height: float) -> RigidTransform:
    """A pose lower by a height [m]."""
    return RigidTransform(X.rotation(), X.translation() - np.array([0.0, 0.0, height]))


CAROCA_SERVO = (
    pose_item("initial_pose", START),
    "desired={position: [0, 0, 0.6], angles_deg: [180, 0, 180]}",
    "target.pose={position: [-0.689, -1.374, 0], angles_deg: [0, 0, 180]}",
)
"""Poses of case studies IV, V and VIII."""

AS_PRINTED = (
    pose_item("initial_pose", lowered(START, LIFT)),
    f"target.pose.position=[-0.689, -1.374, {-LIFT:g}]",
)
"""The same with the printed heights, the tag below our ground: by projected images only."""

_COMMON = (
    "Only the size of the perturbations is printed. Their directions are those of section 2.3.5: "
    "from the printed initial pose to the printed assumed one, scaled.",
    CAROCA_ASSUMPTION,
    "The simulated robot has the pulleys and the elastic cables of the prototype; the controller's "
    "model has neither.",
)

ASSUMPTIONS = (
    "Both printed pairs of poses put the tag 0.133 m below the ground; all heights are raised by "
    "as much.",
    *_COMMON,
)
"""Of cases that run raised."""


_accuracy = same_accuracy(("none", "within", "beyond"), "section 3.4.3")


@statement(
    "Within the bounds it takes 2 s longer, beyond them half as long again.",
    "46 s beyond the bounds, 50 % more than the others",
    rule="Confirmed: a quarter longer beyond them; in part: longer; a run that loses its target "
    "takes no time to its goal",
    cause=CHOICE,
)
def slower(runs: Runs) -> Finding:
    """Section 3.4.3: how long perturbed runs take to converge."""
    times = [runs.mean("time_s", configuration=name) for name in ("none", "within", "beyond")]
    raised = runs.mean("time_s", configuration="beyond_raised")
    arrives = converged(runs, "none") and converged(runs, "beyond")
    return Finding(
        found=", ".join(f"{time:.1f}" for time in times) + " s",
        held=[arrives and times[2] > 1.25 * times[0]],
        some=arrives and times[2] > times[0],
        why=f"Within: {times[1] - times[0]:+.1f} s; beyond: {times[2] / times[0]:.2f} times, "
        f"{outcomes(runs, 'beyond')}; raised, so that the tag lies on the ground, {raised:.1f} s, "
        f"{outcomes(runs, 'beyond_raised')}. The directions of the errors are not printed.",
    )


STUDY = configuration_study(
    Plan(
        name="case-4",
        why=UNKNOWN,
        cause=SOURCE,
        title="PBVS on CAROCA",
        scenario="caroca_pbvs",
        changes=(*CAROCA_SERVO, *CAROCA_RUN),
        configurations=(
            Configuration(
                "none", "no perturbation", AS_PRINTED, published={"outcome": "converged"}
            ),
            Configuration(
                "within",
                "0.2 m, 4 deg (within bounds)",
                (*AS_PRINTED, believed(0.2, 4.0, lift=0.0)),
                published={"outcome": "converged, 2 s later"},
            ),
            Configuration(
                "beyond",
                "0.4 m, 8 deg (beyond bounds)",
                (*AS_PRINTED, believed(0.4, 8.0, lift=0.0)),
                published={"outcome": "converged", "time_s": "46"},
                why="the direction of the error is not printed; along that of section 2.3.5 the "
                "tag may leave the image on the way",
            ),
            *(
                Configuration(f"{name}_raised", f"{words}, raised", changes, group="raised")
                for name, words, changes in (
                    ("none", "no perturbation", ()),
                    ("within", "0.2 m, 4 deg", (believed(0.2, 4.0),)),
                    ("beyond", "0.4 m, 8 deg", (believed(0.4, 8.0),)),
                )
            ),
        ),
        rendered=("none_raised",),
        layouts=three_layouts(36, "CAROCA"),
    ),
    source="servoing thesis 3.4.3, figures 3.36 to 3.38",
    assumptions=(
        "Both printed pairs of poses put the tag 0.133 m below the ground. The heights are kept as "
        "printed; raised by as much, so that the tag lies on the ground, in the experiment beside.",
        *_COMMON,
    ),
    checks=(_accuracy, slower),
)
