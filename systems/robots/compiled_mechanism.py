"""A plant on cables that moves by itself, in compiled steps, as one block."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteStateIndex,
    DiscreteValues,
    LeafSystem,
)

from cdpr_drake.cables.models import CABLE_MODELS, KELVIN_VOIGT, STRAIGHT
from cdpr_drake.cables.route_kernel import make_route_room
from cdpr_drake.cables.simulation_kernel import OUTPUTS
from cdpr_drake.dynamics.tree_step_kernel import (
    DONE,
    NOT_FINITE,
    STUCK,
    TreeMemory,
    advance_tree,
)
from cdpr_drake.errors import CableGeometryError, CableModelError
from cdpr_drake.geometry.cable_routes import CableRoutes
from cdpr_drake.models.plant_bodies import (
    body_inertias,
    joint_damping,
    rotor_inertias,
    whole_tree,
)
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import Rest, hang
from cdpr_drake.systems.robots.cable_forces import PORTS
from cdpr_drake.systems.robots.route_forces import simulated_routes

ENDS = {
    STUCK: "the mass matrix is not positive definite",
    NOT_FINITE: "a position or velocity is not finite",
}
"""What ends a simulation, beside a cable that cannot run."""


class CompiledMechanism(LeafSystem):
    """A plant, its cables and ideal winches, as `add_cables` wires them, several times as fast.

    ======================= =============== ====== ===============================================
    port                    type            unit   meaning
    ======================= =============== ====== ===============================================
    cable_velocities        vector(m)       m/s    in, commanded, positive pays out
    joint_forces            vector(nv)      N, N m in, of motors, as a generalized force; not
                                                   connected: none
    plant_state             vector(nq + nv) m, rad out, positions and velocities of the plant
    unstrained_lengths      vector(m)       m      out
    unstrained_length_rates vector(m)       m/s    out, within the rated speed
    tensions                vector(m)       N      out, at the anchor points; and all further ports
                                                   of `RouteForces`
    ======================= =============== ====== ===============================================

    The state is discrete: every `period` the inputs are sampled, held, and the plant moves on to
    the end of the period, in steps of `max_step` at most, by the method of Drake's
    RungeKutta3Integrator. Gravity, cables, joint damping and rotor inertias count; plants with
    springs, constraints, contact or other joints are refused by name.

    Raises CableGeometryError in a simulation where a cable cannot run, or the state is no more
    finite, which a step that is too long does.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        routes: CableRoutes,
        model: str = KELVIN_VOIGT,
        *,
        period: float = 0.01,
        max_step: float = 1e-3,
        rated_speed: float = np.inf,
    ) -> None:
        """For a finalized plant that stands alone: it is read, not moved.

        Args:
            plant: The plant that the routes were made for, continuous.
            routes: The cables as they really are.
            model: A name of `cables.CABLE_MODELS` but inextensible.
            period: Time between samples of the inputs [s].
            max_step: Longest integration step [s].
            rated_speed: Largest cable speed [m/s].

        Raises:
            CableModelError: The plant has what is not known here, the model cannot describe the
                cables, or a time makes no sense.
        """
        super().__init__()
        for name, value in (("period", period), ("max_step", max_step)):
            if not (np.isfinite(value) and value > 0.0):
                raise CableModelError(f"{name}: found {value:g}; accepted: above 0 [s]")
        tree = whole_tree(plant)
        self._plant, self._routes = plant, simulated_routes(routes, model)
        self._cables = PlantCables(plant, self._routes, model)
        packed, m = self._routes.packed(tree.rows), routes.count
        law = CABLE_MODELS[model].law
        self._memory = TreeMemory(
            tree.table,
            body_inertias(plant, tree),
            np.array(plant.gravity_field().gravity_vector()),
            joint_damping(plant),
            rotor_inertias(plant),
            packed,
            make_route_room(packed[0], m, law),
        )
        self._straight, self._speed = law == STRAIGHT, rated_speed
        self._period, self._steps = period, math.ceil(period / max_step - 1e-9)
        nv = plant.num_velocities()
        home = plant.CreateDefaultContext()
        lengths, _ = self._cables.lengths_and_jacobian(home)
        self._own, self._none = plant.CreateDefaultContext(), np.zeros(nv)
        self._velocities = self.DeclareVectorInputPort("cable_velocities", m)
        self._forces = self.DeclareVectorInputPort("joint_forces", nv)
        state = plant.GetPositionsAndVelocities(home)
        self._state, self._lengths, self._rates = (
            int(self.DeclareDiscreteState(value)) for value in (state, lengths, np.zeros(m))
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)
        self.DeclareForcedDiscreteUpdateEvent(self._update)
        for name, index in (
            ("plant_state", self._state),
            ("unstrained_lengths", self._lengths),
            ("unstrained_length_rates", self._rates),
        ):
            self.DeclareStateOutputPort(name, DiscreteStateIndex(index))
        for row, name in enumerate(PORTS):
            self.DeclareVectorOutputPort(name, m, self._row_writer(row), {self.xd_ticket()})
        assert len(PORTS) == OUTPUTS

    @property
    def plant(self) -> MultibodyPlant:
        """The plant."""
        return self._plant

    def cables(self) -> PlantCables:
        """The cables as they are simulated, for statics."""
        return self._cables

    def hang(self, context: Context, **wishes: Any) -> Rest:
        """Puts the plant at rest on its cables, see `CablePorts.hang`.

        Args:
            context: This block's own context; changed. Its positions are asked for.
            wishes: As for `models.hang`.

        Raises:
            CdprError: As `models.hang`.
        """
        own = self._at(context)
        rest = hang(self._cables, own, **wishes)
        self.put(context, rest)
        return rest

    def put(self, context: Context, rest: Rest) -> None:
        """Puts plant and winches at a rest, in this block's own context."""
        state = np.concatenate([rest.positions, self._none])
        context.SetDiscreteState(self._state, state)
        context.SetDiscreteState(self._lengths, rest.unstrained_lengths)
        context.SetDiscreteState(self._rates, np.zeros(self._routes.count))

    def _at(self, context: Context) -> Context:
        state = context.get_discrete_state(self._state).value()
        self._plant.SetPositionsAndVelocities(self._own, state)
        return self._own

    def _update(self, context: Context, values: DiscreteValues) -> None:
        state, lengths, rates = (
            values.get_mutable_value(k) for k in (self._state, self._lengths, self._rates)
        )
        rates[:] = np.clip(self._velocities.Eval(context), -self._speed, self._speed)
        force = self._forces.Eval(context) if self._forces.HasValue(context) else self._none
        code = advance_tree(
            self._memory.table, self._straight, state, lengths, rates, force, self._period,
            self._steps,
        )  # fmt: skip
        if code != DONE:
            problem = ENDS.get(code) or f"{self._routes.names[code]} cannot run"
            raise CableGeometryError(
                f"after {context.get_time():g} s: {problem}; accepted: a motion without that, or "
                f"steps shorter than {self._period / self._steps:g} s"
            )

    def _row_writer(self, row: int) -> Callable[[Context, BasicVector], None]:
        def write(context: Context, output: BasicVector) -> None:
            lengths, rates = (
                context.get_discrete_state(k).value() for k in (self._lengths, self._rates)
            )
            output.set_value(self._cables.outputs(self._at(context), lengths, rates)[row])

        return write
