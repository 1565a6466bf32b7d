"""The cables of a robot as a force system beside a MultibodyPlant."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    BasicVector_,
    Context,
    ContinuousState,
    InputPortIndex,
    LeafSystem,
    LeafSystem_,
)
from pydrake.systems.scalar_conversion import TemplateSystem

from cdpr_drake.arrays import Array
from cdpr_drake.cables.behaving_kernel import creep_rates, put_crept
from cdpr_drake.cables.broken_cables import break_cables
from cdpr_drake.cables.cable_behaviour import behaviour_of
from cdpr_drake.cables.models import CABLE_MODELS, KELVIN_VOIGT, STRAIGHT, cable_law, check_model
from cdpr_drake.cables.simulation_autodiff import (
    creep_rates_array,
    model_force_and_drums_array,
    model_force_array,
    model_outputs_array,
)
from cdpr_drake.cables.simulation_kernel import (
    OUTPUTS,
    guesses_of,
    make_room,
    model_force,
    model_force_and_drums,
    outputs_kernel,
)
from cdpr_drake.cables.states import crept_at_rest
from cdpr_drake.cables.straight_kernel import floating_force, line_force, planar_force
from cdpr_drake.errors import CableGeometryError, CableModelError
from cdpr_drake.geometry.cable_paths import impossible_cable
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import RobotInPlant, pose_on_joint
from cdpr_drake.systems.robots.failures import BROKEN
from cdpr_drake.systems.robots.platform_place import PlatformPlace
from cdpr_drake.systems.robots.templates import class_for_floats

PULLS = ("tensions", "drum_tensions", "slack")
"""Those of `PORTS` that follow from the pull of a cable."""

CREPT = "crept"
"""Output port of cables that creep: the strain of the dashpot, shape (m,) [-]."""

PORTS = ("tensions", "drum_tensions", "lengths", "slack", "surplus_lengths", "sags")
"""Output ports with one number a cable, in the order of `model_outputs`' rows."""


def simulated_cables(cables: CableSet, model: str) -> CableSet:
    """The cables as a simulation of that model takes them.

    Raises:
        CableModelError: The model cannot be simulated, or cannot describe the cables.
    """
    check_model(model, cables)
    kind = CABLE_MODELS[model]
    if not kind.extensible:
        accepted = [name for name, other in CABLE_MODELS.items() if other.extensible]
        raise CableModelError(
            f"cable model: found {model}, whose tensions do not follow from its length; accepted "
            f"in a simulation with winches: {', '.join(accepted[:-1])} or {accepted[-1]}"
        )
    if not kind.damped:
        return replace(cables, retardation=np.zeros(cables.count))
    return cables


def _check_alone(in_plant: RobotInPlant) -> None:
    plant, instance = in_plant.plant, in_plant.model_instance
    found, wanted = plant.num_multibody_states(instance), in_plant.robot.joint().num_states
    if found != wanted:
        raise CableModelError(
            f"model instance {plant.GetModelInstanceName(instance)}: found {found} states; "
            f"accepted: {wanted}, those of the platform, with other bodies that move in a model "
            "instance of their own"
        )


# With its scope, since Drake would search the whole call stack for it.
@TemplateSystem.define("CableForces_", T_list=(float, AutoDiffXd), scope=sys.modules[__name__])
def CableForces_(T: Any) -> type[LeafSystem]:
    """The class for scalars of type T, float or AutoDiffXd; `CableForces` is the one for float."""

    class Impl(LeafSystem_[T]):
        """Cables that pull on the platform of a robot, by a model of `cables.models`.

        ======================= ========== ===== ==============================================
        port                    type       unit  meaning
        ======================= ========== ===== ==============================================
        platform_state          vector     m     in, from the plant's state port of the robot's
                                                 model instance, shape (13,), in a plane (6,),
                                                 on a line (2,), see `PlatformJoint`
        unstrained_lengths      vector(m)  m     in, from the exit points to the platform
        unstrained_length_rates vector(m)  m/s   in
        broken                  vector(m)  -     in, only if `breakable`, may stay open: not 0 for
                                                 each cable that is broken and pulls nothing
        generalized_force       vector(nv) N, Nm out, for the plant's applied_generalized_force
        force_and_drums         vector     N, Nm out, generalized_force and then drum_tensions,
                                                 which is quicker than both
        tensions                vector(m)  N     out, at the platform
        drum_tensions           vector(m)  N     out, at the exit points, what the winches hold
        lengths                 vector(m)  m     out, under load: of straight cables |A_i B_i|, or
                                                 along the groove and then straight
        slack                   vector(m)  -     out, 1 where a straight cable pulls nothing, or a
                                                 catenary with no more than its weight, else 0
        surplus_lengths         vector(m)  m     out, by which the unstrained length exceeds the
                                                 straight path
        sags                    vector(m)  m     out, largest distance from the chord
        crept                   vector(m)  -     out, of cables that creep: the strain that has
        ======================= ========== ===== ==============================================

        Cables without pulleys that are straight pull exactly nothing where they are slack. An
        elastic cable is one without damping. The catenary is solved anew at each call, from the
        last solution; that saves steps and changes the result by less than its rounding.

        Raises CableGeometryError in a simulation where an anchor point comes into the groove of
        its pulley or onto its swivel axis.
        """

        def _construct(
            self,
            in_plant: RobotInPlant,
            cables: CableSet | None = None,
            model: str = KELVIN_VOIGT,
            breakable: bool = False,
            crept: Array | None = None,
            converter: Any = None,
        ) -> None:
            """For a robot whose plant is finalized; see `cdpr_drake.models.add_robot`.

            Args:
                in_plant: The robot in its plant.
                cables: The cables as they really are; None: the robot's, from fixed exit points.
                model: A name of `cables.CABLE_MODELS` but inextensible.
                breakable: Whether cables may break, by an input.
                crept: Strains that have crept in default contexts, shape (m,), of cables that
                    creep; None: none.
                converter: Of the template.

            Raises:
                CableModelError: The model cannot be simulated, or cannot describe the cables; or
                    other bodies move in the robot's model instance, whose state is read.
            """
            _check_alone(in_plant)
            cables = in_plant.robot.cable_set().without_pulleys() if cables is None else cables
            whole = simulated_cables(cables, model)
            crept = np.zeros(whole.count) if crept is None or not len(crept) else crept
            self._declare(PlatformPlace.of(in_plant), whole, model, breakable, crept, converter)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            breakable = other._broken is not None
            Impl._declare(
                self, other._place, other._set, other._model, breakable, other._start, converter
            )

        def _declare(
            self,
            place: PlatformPlace,
            cables: CableSet,
            model: str,
            breakable: bool,
            start: Array,
            converter: Any,
        ) -> None:
            LeafSystem_[T].__init__(self, converter=converter)
            self._start = start
            self._place, self._set, self._model = place, cables, model
            joint = place.joint
            check_model(model, joint.turned(cables))
            self._whole = joint.turned(cables).packed()
            self._rows = self._whole.copy()
            m = cables.count
            kind = CABLE_MODELS[model]
            self._law = cable_law(model, cables)
            self._room = make_room(m, self._law, joint.height, place.start)
            self._work, self._outputs = np.zeros((OUTPUTS, m)), outputs_kernel(self._law)
            # Looked up once: these are called several thousand times per simulated second.
            self._state = self.DeclareVectorInputPort("platform_state", place.num_states).Eval
            self._l0 = self.DeclareVectorInputPort("unstrained_lengths", m).Eval
            self._l0_dot = self.DeclareVectorInputPort("unstrained_length_rates", m).Eval
            calc = self._calc_force if T is float else self._calc_force_array
            if T is float and self._law == STRAIGHT and not cables.has_pulleys():
                calc = self._calc_line_force if joint.is_line else self._calc_planar_force
                if joint.is_floating:
                    calc = self._calc_floating_force
            # Only damped cables ask for rates, lengths of straight ones only for the pose. What
            # needs less can be fed back without an algebraic loop.
            state, lengths, rates = (self.input_port_ticket(InputPortIndex(i)) for i in range(3))
            rubs = behaviour_of(cables).sheave_friction > 0.0
            self._damped = rubs or bool(np.any(cables.retardation > 0.0))
            pull = {state, lengths, rates} if self._damped else {state, lengths}
            self._broken = None
            extra = set()
            self._creeps = behaviour_of(cables).creep_stiffness > 0.0
            if self._creeps:
                self.DeclareContinuousState(BasicVector_[T](start))
                extra = {self.xc_ticket()}
                pull |= extra
            if breakable:  # which pulleys a cable runs over changes, too
                self._broken = self.DeclareVectorInputPort(BROKEN, m)
                extra = extra | {self._broken.ticket()}
                pull |= extra
            self._zeros, self._ones = np.zeros(m), np.ones(m)
            self.DeclareVectorOutputPort("generalized_force", place.num_velocities, calc, pull)
            self.DeclareVectorOutputPort(
                "force_and_drums", place.num_velocities + m, self._calc_both, pull
            )
            for row, name in enumerate(PORTS):
                needs = pull if name in PULLS else {state, lengths}
                if name == "lengths" and not kind.sags:
                    needs = {state}
                writer = self._row_writer(row, len(needs - extra))
                self.DeclareVectorOutputPort(name, m, writer, needs | extra)
            if self._creeps:
                self.DeclareVectorOutputPort(CREPT, m, self._write_crept, {self.xc_ticket()})

        def relax(self, context: Context, X_WP: RigidTransform, l0: Array) -> None:
            """Has cables been at rest for long, if they creep.

            Args:
                context: This system's own context.
                X_WP: Pose of the platform [m].
                l0: Unstrained lengths, shape (m,) [m].
            """
            if self._creeps:
                context.SetContinuousState(crept_at_rest(self._set, X_WP, l0))

        def _crept(self, context: Context) -> Any:
            """What has crept, None of cables that do not; kernels for floats find it there."""
            if not self._creeps:
                return None
            z = context.get_continuous_state_vector().CopyToVector()
            if T is float:
                put_crept(z, guesses_of(self._room, len(z)))
            return z

        def _write_crept(self, context: Context, output: BasicVector) -> None:
            output.SetFromVector(context.get_continuous_state_vector().CopyToVector())

        def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
            """How fast cables creep."""
            if not self._creeps:
                return
            z, state = self._crept(context), self._state(context)
            inputs = state, self._l0(context), self._rates(context), self._cables_now(context)
            if T is float:
                rates = np.empty(len(z))
                if self._outputs(*inputs, self._room, self._work) >= 0:
                    raise self._problem(context, state)
                creep_rates(guesses_of(self._room, len(z)), inputs[3], rates)
            else:
                rates = creep_rates_array(*inputs, self._law, self._place.joint.height, crept=z)
            derivatives.get_mutable_vector().SetFromVector(rates)

        def _cables_now(self, context: Context) -> Array:
            if self._broken is not None and self._broken.HasValue(context):
                broken = self._broken.Eval(context)
                if T is not float:
                    broken = np.array([x.value() for x in broken])
                break_cables(self._whole, broken, self._rows)
                return self._rows
            return self._whole

        def _rates(self, context: Context) -> Array:
            return self._l0_dot(context) if self._damped else self._zeros

        def _calc_floating_force(self, context: Context, output: BasicVector) -> None:
            floating_force(
                self._state(context),
                self._l0(context),
                self._rates(context),
                self._cables_now(context),
                self._place.start,
                output.get_mutable_value(),
            )

        def _calc_planar_force(self, context: Context, output: BasicVector) -> None:
            planar_force(
                self._state(context),
                self._l0(context),
                self._rates(context),
                self._cables_now(context),
                self._place.start,
                output.get_mutable_value(),
                self._place.joint.height,
            )

        def _calc_line_force(self, context: Context, output: BasicVector) -> None:
            line_force(
                self._state(context),
                self._l0(context),
                self._rates(context),
                self._cables_now(context),
                self._place.start,
                output.get_mutable_value(),
            )

        def _calc_force(self, context: Context, output: BasicVector) -> None:
            state = self._state(context)
            self._crept(context)
            bad = model_force(
                state,
                self._l0(context),
                self._rates(context),
                self._cables_now(context),
                self._room,
                output.get_mutable_value(),
            )
            if bad >= 0:
                raise self._problem(context, state)

        def _calc_force_array(self, context: Context, output: BasicVector) -> None:
            state = self._state(context)
            force, bad = model_force_array(
                state,
                self._l0(context),
                self._rates(context),
                self._cables_now(context),
                self._law,
                self._place.joint.height,
                start=self._place.start,
                nv=self._place.num_velocities,
                crept=self._crept(context),
            )
            if bad >= 0:
                raise self._problem(context, np.array([x.value() for x in state]))
            output.SetFromVector(with_derivatives(force))

        def _calc_both(self, context: Context, output: BasicVector) -> None:
            state, place = self._state(context), self._place
            inputs = state, self._l0(context), self._rates(context), self._cables_now(context)
            crept = self._crept(context)
            if T is float:
                bad = model_force_and_drums(
                    *inputs, self._room, place.num_velocities, output.get_mutable_value()
                )
                if bad >= 0:
                    raise self._problem(context, state)
                return
            both, bad = model_force_and_drums_array(
                *inputs,
                self._law,
                place.joint.height,
                start=place.start,
                nv=place.num_velocities,
                crept=crept,
            )
            if bad >= 0:
                raise self._problem(context, np.array([x.value() for x in state]))
            output.SetFromVector(with_derivatives(both))

        def _row_writer(self, row: int, needs: int) -> Callable[[Context, BasicVector], None]:
            """Writes a row of `model_outputs` from as many inputs as it needs."""

            def write(context: Context, output: BasicVector) -> None:
                state = self._state(context)
                l0 = self._l0(context) if needs > 1 else self._ones
                l0_dot = self._l0_dot(context) if needs > 2 else self._zeros
                inputs = state, l0, l0_dot, self._cables_now(context)
                crept = self._crept(context)
                if T is not float:
                    height = self._place.joint.height
                    table, bad = model_outputs_array(*inputs, self._law, height, crept=crept)
                    output.SetFromVector(with_derivatives(table[row]))
                    return
                bad = self._outputs(*inputs, self._room, self._work)
                if bad >= 0:
                    raise self._problem(context, state)
                output.set_value(self._work[row])

            return write

        def _problem(self, context: Context, state: Array) -> CableGeometryError:
            X_WP: RigidTransform = pose_on_joint(self._place.joint, state)
            time = context.get_time()
            t = time.value() if isinstance(time, AutoDiffXd) else time
            return CableGeometryError(f"at {t:g} s: {impossible_cable(X_WP, self._set)}")

        def cables(self) -> Array:
            """`CableSet.packed` of the cables in the frames of `PlatformJoint`, shape (m, 17)."""
            return self._whole

        def cable_set(self) -> CableSet:
            """The cables as they are simulated."""
            return self._set

        def model(self) -> str:
            """The model of the cables."""
            return self._model

    return Impl


def with_derivatives(values: Any) -> Any:
    """An array of AutoDiffXd only; exact zeros come as floats."""
    return np.array([x if isinstance(x, AutoDiffXd) else AutoDiffXd(x) for x in values])


if TYPE_CHECKING:  # what an editor cannot see in a template

    class CableForces(LeafSystem):
        """`CableForces_` for float."""

        def __init__(
            self,
            in_plant: RobotInPlant,
            cables: CableSet | None = None,
            model: str = KELVIN_VOIGT,
            breakable: bool = False,
            crept: Array | None = None,
        ) -> None: ...
        def cables(self) -> Array: ...  # noqa: D102
        def cable_set(self) -> CableSet: ...  # noqa: D102
        def model(self) -> str: ...  # noqa: D102
        def relax(self, context: Context, X_WP: RigidTransform, l0: Array) -> None: ...  # noqa: D102
else:
    CableForces = class_for_floats(CableForces_)
