"""Section `stability` of a scenario, and its block: the stability criterion along a run."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    CacheEntry,
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    ValueProducer,
)

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.schema.declarations import In, Refusal, Scope, settings
from cdpr_drake.systems.monitoring.servo_criterion import ServoCriterion
from cdpr_drake.systems.sections import Section

OUTPUTS = ("taut_cables", "jacobian_rank", "stability_margin")
"""Outputs of a `StabilityWatch`, and quantities of the log."""


@settings
class StabilitySettings(Section):
    """Logs how many cables pull, the rank of their Jacobian, and the criterion's margin."""

    words = "The stability criterion along the run, in its log"

    threshold: Annotated[
        float | None,
        In("N", ge=0.0),
        "Tension from which a cable counts as taut; null: one that is not slack.",
    ] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Robots whose cables share winches, and laws that the criterion does not know."""
        scheme = scope.whole.controller.scheme
        if scheme in ("partitioned", "switching"):
            found = f"a section with controller.scheme {scheme}, whose law the criterion"
            accepted = "null, or pbvs, pbvs-line, 2.5d, ibvs, circles"
            yield "", f"{found} does not know", accepted
        if scope.robot.winch_groups().are_shared():
            found = "a section, whose criterion takes each cable to have a winch of its own"
            yield "", found, f"null for {scope.robot.name}"

    def add_to(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> Mapping[str, OutputPort]:
        """Adds a `StabilityWatch`."""
        from cdpr_drake.systems.diagrams.servo_watches import criterion_of  # which has scenarios

        watch = StabilityWatch(criterion_of(blocks, settings.controller.pulleys), self.threshold)
        builder.AddNamedSystem(blocks.prefix + "stability", watch)
        for port, source in (
            ("X_WP", blocks.block.GetOutputPort("X_WP")),
            ("X_WP_estimated", blocks.estimator.GetOutputPort("X_WP")),
            ("tensions", blocks.block.GetOutputPort("tensions")),
            ("slack", blocks.block.GetOutputPort("slack")),
        ):
            builder.Connect(source, watch.GetInputPort(port))
        return {name: watch.GetOutputPort(name) for name in OUTPUTS}


class StabilityWatch(LeafSystem):
    """Tells whether enough cables pull, and whether the servo is stable by the criterion.

    ================ ============== ==== ====================================================
    port             type           unit meaning
    ================ ============== ==== ====================================================
    X_WP             RigidTransform m    in, true pose of the platform
    X_WP_estimated   RigidTransform m    in, its estimate
    tensions         vector(m)      N    in, true ones
    slack            vector(m)      -    in, 1 where slack
    taut_cables      vector(1)      -    out, number of cables that pull
    jacobian_rank    vector(1)      -    out, rank of the Jacobian with their rows only; 0 where a
                                         cable cannot run
    stability_margin vector(1)      -    out, smallest eigenvalue of the symmetric part of Pi; 0
                                         where the rank is less than the platform's degrees of
                                         freedom, NaN where the features leave a motion free or a
                                         cable cannot run
    ================ ============== ==== ====================================================

    Reckons when an output is asked for, and costs nothing else.

    Source: servoing thesis 5.3.1, Fig. 5.18.
    """

    def __init__(self, criterion: ServoCriterion, threshold: float | None = None) -> None:
        """With a servo's criterion, and the tension from which a cable pulls [N]; None: one that is
        not slack."""
        super().__init__()
        self._criterion, self._threshold = criterion, threshold
        m = criterion.cables.count
        self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._X_hat = self.DeclareAbstractInputPort("X_WP_estimated", Value(RigidTransform()))
        self._tensions = self.DeclareVectorInputPort("tensions", m)
        self._slack = self.DeclareVectorInputPort("slack", m)
        found = self.DeclareCacheEntry(
            "stability",
            ValueProducer(lambda: Value(np.zeros(3)), self._calc),
            {self.time_ticket(), self.all_input_ports_ticket()},
        )
        for k, name in enumerate(OUTPUTS):
            self._declare_part(name, k, found)

    def _declare_part(self, name: str, k: int, found: CacheEntry) -> None:
        def write(context: Context, output: BasicVector) -> None:
            output.SetAtIndex(0, found.Eval(context)[k])

        self.DeclareVectorOutputPort(name, 1, write, {found.ticket()})

    def _calc(self, context: Context, value: Value) -> None:
        value.set_value(self._now(context))

    def _now(self, context: Context) -> Array:
        """Taut cables, rank and margin at a context's time, shape (3,) [-]."""
        if self._threshold is None:
            taut = self._slack.Eval(context) == 0.0
        else:
            taut = self._tensions.Eval(context) >= self._threshold
        count = float(np.sum(taut))
        try:
            rank, margin = self._criterion.at(
                self._X_WP.Eval(context), self._X_hat.Eval(context), taut, context.get_time()
            )
        except CableGeometryError:
            return np.array([count, 0.0, np.nan])
        return np.array([count, float(rank), margin])
