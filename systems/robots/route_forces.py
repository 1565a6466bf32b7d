"""Cables between any bodies of a MultibodyPlant, as a force system beside it.

`RouteForces` walks the plant's joints in compiled kernels and gives a generalized force; it knows
the joints of `models.plant_tree.JOINTS`. `RouteSpatialForces` reads poses and velocities of the
bodies from the plant's ports and gives spatial forces, for any joint, at about three times the
time. `systems.robots.add_cables` chooses and wires one.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform_
from pydrake.multibody.math import SpatialForce_, SpatialVelocity_
from pydrake.multibody.plant import ExternallyAppliedSpatialForce_, MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import BasicVector, Context, InputPortIndex, LeafSystem, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from cdpr_drake.arrays import Array
from cdpr_drake.cables import route_kernel as kernels
from cdpr_drake.cables.models import CABLE_MODELS, KELVIN_VOIGT, STRAIGHT, check_routes
from cdpr_drake.cables.simulation_autodiff import (
    route_outputs_array,
    route_wrenches_array,
    tree_force_array,
    tree_outputs_array,
)
from cdpr_drake.cables.simulation_kernel import OUTPUTS
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_routes import WORLD_BODY, CableRoutes
from cdpr_drake.geometry.tree_kernel import MOTION
from cdpr_drake.models.plant_tree import PlantTree
from cdpr_drake.systems.robots.cable_forces import (
    PORTS,
    PULLS,
    simulated_cables,
    with_derivatives,
)
from cdpr_drake.systems.robots.templates import class_for_floats


def simulated_routes(routes: CableRoutes, model: str) -> CableRoutes:
    """The cables as a simulation of that model takes them.

    Raises:
        CableModelError: The model cannot be simulated, or cannot describe the cables: a cable that
            sags may run over a pulley at an exit point in the world only, and over no eyelets.
    """
    routes = replace(routes, ends=simulated_cables(routes.ends, model))
    check_routes(model, routes)
    return routes


@dataclass(frozen=True, eq=False)
class _Cables:
    """Cables as the kernels take them, and what there is to say of them."""

    routes: CableRoutes
    model: str
    packed: tuple[Array, Any, Any]

    @staticmethod
    def of(routes: CableRoutes, model: str, rows: dict[int, int]) -> _Cables:
        routes = simulated_routes(routes, model)
        return _Cables(routes, model, routes.packed(rows))

    @cached_property
    def law(self) -> int:
        return CABLE_MODELS[self.model].law

    @cached_property
    def damped(self) -> bool:
        return bool(np.any(self.routes.ends.retardation > 0.0))

    def room(self) -> Array:
        return kernels.make_route_room(self.packed[0], self.routes.count, self.law)

    def needs(self, name: str, state: set[Any], lengths: set[Any], pull: set[Any]) -> set[Any]:
        """What an output of `PORTS` depends on."""
        if name in PULLS:
            return pull
        return state if name == "lengths" and not CABLE_MODELS[self.model].sags else state | lengths

    def problem(self, bad: int, context: Context) -> CableGeometryError:
        time = context.get_time()
        t = time.value() if isinstance(time, AutoDiffXd) else time
        return CableGeometryError(
            f"at {t:g} s: {self.routes.names[bad]} cannot run: an anchor point lies in the groove "
            "of its pulley or on its swivel axis, the cable has no length, or a coordinate is not "
            "finite; accepted: a motion without that"
        )


class _CableOutputs:
    """What both blocks tell of their cables: one output a row of `PORTS`, the routes, the model."""

    _data: _Cables
    _l0: Callable[[Context], Array]
    _l0_dot: Callable[[Context], Array]
    _ones: Array
    _zeros: Array

    def _outputs(self, context: Context, l0: Array, l0_dot: Array) -> tuple[Any, int]:
        """Rows of `PORTS`, shape (6, m), and the number of a cable that cannot run, or -1."""
        raise NotImplementedError

    def _row_writer(self, row: int, needs: int) -> Callable[[Context, BasicVector], None]:
        """Writes a row of the outputs from as many inputs as it needs."""

        def write(context: Context, output: BasicVector) -> None:
            l0 = self._l0(context) if needs > 1 else self._ones
            l0_dot = self._l0_dot(context) if needs > 2 else self._zeros
            table, bad = self._outputs(context, l0, l0_dot)
            if bad >= 0:
                raise self._data.problem(bad, context)
            if isinstance(output, BasicVector):  # of floats
                output.set_value(table[row])
            else:
                output.SetFromVector(with_derivatives(table[row]))

        return write

    def routes(self) -> CableRoutes:
        """The cables as they are simulated."""
        return self._data.routes

    def model(self) -> str:
        """The model of the cables."""
        return self._data.model


# With its scope, since Drake would search the whole call stack for it.
@TemplateSystem.define("RouteForces_", T_list=(float, AutoDiffXd), scope=sys.modules[__name__])
def RouteForces_(T: Any) -> type[LeafSystem]:
    """The class for scalars of type T, float or AutoDiffXd; `RouteForces` is the one for float."""

    class Impl(_CableOutputs, LeafSystem_[T]):
        """Cables that pull on the bodies of a plant, by a model of `cables.models`.

        ======================= ========== ===== ==============================================
        port                    type       unit  meaning
        ======================= ========== ===== ==============================================
        plant_state             vector     m,rad in, the plant's state port, shape (nq + nv,)
        unstrained_lengths      vector(m)  m     in, from exit point to anchor point
        unstrained_length_rates vector(m)  m/s   in
        generalized_force       vector(nv) N, Nm out, -J_l' t, for applied_generalized_force
        force_and_drums         vector     N, Nm out, generalized_force and then drum_tensions
        tensions                vector(m)  N     out, at the anchor points
        drum_tensions           vector(m)  N     out, at the exit points, what the winches hold
        lengths                 vector(m)  m     out, under load, over pulleys and eyelets
        slack                   vector(m)  -     out, 1 where a cable pulls nothing, or one that
                                                 sags no more than its weight, else 0
        surplus_lengths         vector(m)  m     out, by which the unstrained length exceeds the
                                                 straight path
        sags                    vector(m)  m     out, largest distance from the chord
        ======================= ========== ===== ==============================================

        The force has the bits of `CableForces` where the cables are those of one platform without
        a joint.

        Raises CableGeometryError in a simulation where a cable cannot run; names it.
        """

        def _construct(
            self,
            plant: MultibodyPlant,
            routes: CableRoutes,
            model: str = KELVIN_VOIGT,
            converter: Any = None,
        ) -> None:
            """For a finalized plant.

            Args:
                plant: The plant that the routes were made for.
                routes: The cables as they really are.
                model: A name of `cables.CABLE_MODELS` but inextensible.
                converter: Of the template.

            Raises:
                CableModelError: The model cannot be simulated or cannot describe the cables, or a
                    joint is not known here.
            """
            tree = PlantTree.of(plant, routes.touched_bodies())
            self._declare(tree, _Cables.of(routes, model, tree.rows), converter)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            Impl._declare(self, other._tree, other._data, converter)

        def _declare(self, tree: PlantTree, data: _Cables, converter: Any) -> None:
            LeafSystem_[T].__init__(self, converter=converter)
            self._tree, self._data = tree, data
            m, nv = data.routes.count, tree.num_velocities
            straight = data.law == STRAIGHT
            self._force = kernels.straight_force_at if straight else kernels.any_force_at
            self._calc = kernels.straight_tree_outputs if straight else kernels.any_tree_outputs
            self._memory = kernels.RouteMemory(tree.table, data.packed, m, data.law)
            self._table = self._memory.table
            self._work, self._no_drums = np.zeros((OUTPUTS, m)), np.zeros(0)
            self._zeros, self._ones, self._damped = np.zeros(m), np.ones(m), data.damped
            self._state = self.DeclareVectorInputPort("plant_state", tree.num_states).Eval
            self._l0 = self.DeclareVectorInputPort("unstrained_lengths", m).Eval
            self._l0_dot = self.DeclareVectorInputPort("unstrained_length_rates", m).Eval
            state, lengths, rates = ({self.input_port_ticket(InputPortIndex(i))} for i in range(3))
            pull = state | lengths | (rates if data.damped else set())
            calc = self._calc_force if T is float else self._calc_force_array
            self.DeclareVectorOutputPort("generalized_force", nv, calc, pull)
            self.DeclareVectorOutputPort("force_and_drums", nv + m, self._calc_both, pull)
            for row, name in enumerate(PORTS):
                needs = data.needs(name, state, lengths, pull)
                self.DeclareVectorOutputPort(name, m, self._row_writer(row, len(needs)), needs)

        def _rates(self, context: Context) -> Array:
            return self._l0_dot(context) if self._damped else self._zeros

        def _of_any(self, context: Context) -> tuple[Any, Any]:
            force, drums, bad = tree_force_array(
                self._tree.table, self._state(context), self._l0(context), self._rates(context),
                self._data.packed, law=self._data.law, nv=self._tree.num_velocities,
            )  # fmt: skip
            if bad >= 0:
                raise self._data.problem(bad, context)
            return force, drums

        def _calc_force(self, context: Context, output: BasicVector) -> None:
            bad = self._force(
                self._table,
                self._state(context),
                self._l0(context),
                self._l0_dot(context) if self._damped else self._zeros,
                output.get_mutable_value(),
                self._no_drums,
            )
            if bad >= 0:
                raise self._data.problem(bad, context)

        def _calc_force_array(self, context: Context, output: BasicVector) -> None:
            output.SetFromVector(with_derivatives(self._of_any(context)[0]))

        def _calc_both(self, context: Context, output: BasicVector) -> None:
            if T is not float:
                output.SetFromVector(with_derivatives(np.concatenate(self._of_any(context))))
                return
            both, nv = output.get_mutable_value(), self._tree.num_velocities
            state, l0, rates = self._state(context), self._l0(context), self._rates(context)
            bad = self._force(self._table, state, l0, rates, both[:nv], both[nv:])
            if bad >= 0:
                raise self._data.problem(bad, context)

        def _outputs(self, context: Context, l0: Array, l0_dot: Array) -> tuple[Any, int]:
            state = self._state(context)
            if T is not float:
                return tree_outputs_array(
                    self._tree.table, state, l0, l0_dot, self._data.packed, self._data.law
                )
            table, (tree, *constants) = self._work, self._memory.arrays
            return table, self._calc(tree, state, l0, l0_dot, *constants, table)

    return Impl


@TemplateSystem.define(
    "RouteSpatialForces_", T_list=(float, AutoDiffXd), scope=sys.modules[__name__]
)
def RouteSpatialForces_(T: Any) -> type[LeafSystem]:
    """The class for scalars of type T; `RouteSpatialForces` is the one for float."""

    class Impl(_CableOutputs, LeafSystem_[T]):
        """As `RouteForces`, for bodies on any joints.

        ======================= ========== ===== ==============================================
        port                    type       unit  meaning
        ======================= ========== ===== ==============================================
        body_poses              abstract   m     in, the plant's port, X_WB of all bodies
        body_spatial_velocities abstract   m/s   in, the plant's port, V_WB
        unstrained_lengths      vector(m)  m     in, from exit point to anchor point
        unstrained_length_rates vector(m)  m/s   in
        spatial_forces          abstract   N, Nm out, a list of ExternallyAppliedSpatialForce, one
                                                 a body, for the plant's applied_spatial_force
        ======================= ========== ===== ==============================================

        The further outputs are those of `RouteForces` from tensions on.
        """

        def _construct(
            self,
            plant: MultibodyPlant,
            routes: CableRoutes,
            model: str = KELVIN_VOIGT,
            converter: Any = None,
        ) -> None:
            """For a finalized plant; arguments as `RouteForces`.

            Raises:
                CableModelError: The model cannot be simulated or cannot describe the cables.
            """
            bodies = routes.touched_bodies()
            rows = {WORLD_BODY: 0} | {body: 1 + k for k, body in enumerate(bodies)}
            self._declare(bodies, plant.num_bodies(), _Cables.of(routes, model, rows), converter)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            Impl._declare(self, other._bodies, other._num_bodies, other._data, converter)

        def _declare(
            self, bodies: tuple[int, ...], num_bodies: int, data: _Cables, converter: Any
        ) -> None:
            LeafSystem_[T].__init__(self, converter=converter)
            self._bodies, self._num_bodies, self._data = bodies, num_bodies, data
            m, straight = data.routes.count, data.law == STRAIGHT
            self._add = kernels.add_plain_wrenches if straight else kernels.add_any_wrenches
            self._calc = kernels.straight_route_outputs if straight else kernels.any_route_outputs
            self._constants = (*data.packed, data.room())
            dtype = float if T is float else object
            self._motion = np.zeros((1 + len(bodies), MOTION), dtype=dtype)
            self._motion[0, [0, 4, 8]] = 1.0
            self._wrenches, self._no_drums = np.zeros((1 + len(bodies), 6)), np.zeros(0)
            self._work, self._zeros, self._ones = np.zeros((OUTPUTS, m)), np.zeros(m), np.ones(m)
            poses = Value[list[RigidTransform_[T]]]([RigidTransform_[T]()] * num_bodies)
            velocities = Value[list[SpatialVelocity_[T]]]([SpatialVelocity_[T].Zero()] * num_bodies)
            self._poses = self.DeclareAbstractInputPort("body_poses", poses).Eval
            self._velocities = self.DeclareAbstractInputPort(
                "body_spatial_velocities", velocities
            ).Eval
            self._l0 = self.DeclareVectorInputPort("unstrained_lengths", m).Eval
            self._l0_dot = self.DeclareVectorInputPort("unstrained_length_rates", m).Eval
            tickets = [{self.input_port_ticket(InputPortIndex(i))} for i in range(4)]
            pull = tickets[0] | tickets[2]
            if data.damped:
                pull = pull | tickets[1] | tickets[3]
            self.DeclareAbstractOutputPort(
                "spatial_forces",
                lambda: Value[list[ExternallyAppliedSpatialForce_[T]]](),
                self._calc_forces,
                pull,
            )
            for row, name in enumerate(PORTS):
                needs = data.needs(name, tickets[0], tickets[2], pull)
                self.DeclareVectorOutputPort(name, m, self._row_writer(row, len(needs)), needs)

        def _moved(self, context: Context, with_velocities: bool) -> Any:
            motion, poses = self._motion, self._poses(context)
            velocities = self._velocities(context) if with_velocities else None
            for k, body in enumerate(self._bodies, 1):
                X = poses[body]
                motion[k, :9], motion[k, 9:12] = X.rotation().matrix().ravel(), X.translation()
                if velocities is None:
                    motion[k, 12:] = 0.0
                else:
                    motion[k, 12:15] = velocities[body].rotational()
                    motion[k, 15:] = velocities[body].translational()
            return motion

        def _calc_forces(self, context: Context, output: AbstractValue) -> None:
            damped = self._data.damped
            motion, l0 = self._moved(context, damped), self._l0(context)
            l0_dot = self._l0_dot(context) if damped else self._zeros
            if T is float:
                wrenches = self._wrenches
                wrenches[:] = 0.0
                bad = self._add(motion, l0, l0_dot, *self._constants, wrenches, self._no_drums)
            else:
                wrenches, bad = route_wrenches_array(
                    motion, l0, l0_dot, self._data.packed, self._data.law
                )
            if bad >= 0:
                raise self._data.problem(bad, context)
            forces = []
            for k, body in enumerate(self._bodies, 1):
                force = ExternallyAppliedSpatialForce_[T]()
                force.body_index = BodyIndex(body)
                force.p_BoBq_B = np.zeros(3)  # NaN in a new one of AutoDiffXd
                wrench = wrenches[k] if T is float else with_derivatives(wrenches[k])
                force.F_Bq_W = SpatialForce_[T](wrench[:3], wrench[3:])
                forces.append(force)
            output.set_value(forces)

        def _outputs(self, context: Context, l0: Array, l0_dot: Array) -> tuple[Any, int]:
            motion = self._moved(context, l0_dot is not self._zeros)
            if T is not float:
                return route_outputs_array(motion, l0, l0_dot, self._data.packed, self._data.law)
            table = self._work
            return table, self._calc(motion, l0, l0_dot, *self._constants, table)

    return Impl


if TYPE_CHECKING:  # what an editor cannot see in a template

    class RouteForces(LeafSystem):
        """`RouteForces_` for float."""

        def __init__(
            self, plant: MultibodyPlant, routes: CableRoutes, model: str = KELVIN_VOIGT
        ) -> None: ...
        def routes(self) -> CableRoutes: ...  # noqa: D102
        def model(self) -> str: ...  # noqa: D102

    class RouteSpatialForces(RouteForces):
        """`RouteSpatialForces_` for float."""
else:
    RouteForces = class_for_floats(RouteForces_)
    RouteSpatialForces = class_for_floats(RouteSpatialForces_)
