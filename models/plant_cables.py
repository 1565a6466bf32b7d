"""Cables between any bodies of a MultibodyPlant: lengths, their Jacobian, and generalized forces.

The equation that all statics and control of such a machine starts from, at rest:

    tau_g(q) + tau_a - J_l(q)' t + B u = 0,

with tau_g from gravity and the plant's force elements, tau_a what else acts, J_l the length
Jacobian (l_dot = J_l v), t the tensions, u the forces of motors on joints. On the rows that no
motor holds, W = -J_l' is the wrench matrix, and tau_g + tau_a the wrench, of
`tensions.TensionProblem`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, JacobianWrtVariable, MultibodyForces
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.cables import route_kernel as kernels
from cdpr_drake.cables.models import CABLE_MODELS, KELVIN_VOIGT, STRAIGHT, check_routes
from cdpr_drake.cables.simulation_kernel import OUTPUTS
from cdpr_drake.errors import CableGeometryError, CableModelError
from cdpr_drake.geometry.cable_routes import WORLD_BODY, CableRoutes, Integers
from cdpr_drake.geometry.tree_kernel import MOTION

TILT = 1e-12
"""Angle between gravity and -z up to which cables that sag hang in vertical planes [rad]."""


@dataclass(frozen=True, eq=False)
class PlantCables:
    """Cables of a finalized plant, asked at contexts of that plant; for joints of any kind.

    Attributes:
        plant: The plant.
        routes: The cables.
        model: A name of `cables.CABLE_MODELS`, by which unstrained lengths mean tensions.

    Raises:
        CableModelError: The model is not known or cannot describe the cables, or cables sag where
            gravity does not point along -z.
    """

    plant: MultibodyPlant
    routes: CableRoutes
    model: str = KELVIN_VOIGT

    def __post_init__(self) -> None:
        check_routes(self.model, self.routes)
        gravity = self.plant.gravity_field().gravity_vector()
        if not CABLE_MODELS[self.model].sags or not np.any(self.routes.ends.linear_weight > 0.0):
            return
        if np.linalg.norm(gravity[:2]) > TILT * np.linalg.norm(gravity) or gravity[2] > 0.0:
            raise CableModelError(
                f"cable model: found {self.model} in a plant with gravity {gravity} m/s^2; "
                "accepted: gravity along -z, or straight cables"
            )

    @cached_property
    def bodies(self) -> tuple[int, ...]:
        """Indices of the bodies that cables pull on."""
        return self.routes.touched_bodies()

    @cached_property
    def _packed(self) -> tuple[Array, Integers, Integers]:
        rows = {WORLD_BODY: 0} | {body: 1 + k for k, body in enumerate(self.bodies)}
        return self.routes.packed(rows)

    @property
    def law(self) -> int:
        """Number of the cables' law."""
        return CABLE_MODELS[self.model].law

    @cached_property
    def _straight_room(self) -> Array:
        """Where lines of straight cables are worked out; nothing in it is kept between calls."""
        return self._room()

    def _room(self) -> Array:
        return kernels.make_route_room(self._packed[0], self.routes.count, self.law)

    def motions(self, context: Context) -> Array:
        """Motions of world and bodies in W, shape (n, 18), see `tree_kernel.MOTION`."""
        motion = np.zeros((1 + len(self.bodies), MOTION))
        motion[0, [0, 4, 8]] = 1.0
        for k, index in enumerate(self.bodies, 1):
            body = self.plant.get_body(BodyIndex(index))
            X = self.plant.EvalBodyPoseInWorld(context, body)
            V = self.plant.EvalBodySpatialVelocityInWorld(context, body)
            motion[k, :9], motion[k, 9:12] = X.rotation().matrix().ravel(), X.translation()
            motion[k, 12:15], motion[k, 15:] = V.rotational(), V.translational()
        return motion

    def _jacobians(self, context: Context) -> Array:
        """Of the bodies' spatial velocities (w, v of Bo) in W by v, shape (n, 6, nv)."""
        plant, W = self.plant, self.plant.world_frame()
        J = np.zeros((1 + len(self.bodies), 6, plant.num_velocities()))
        for k, index in enumerate(self.bodies, 1):
            frame = plant.get_body(BodyIndex(index)).body_frame()
            J[k] = plant.CalcJacobianSpatialVelocity(
                context, JacobianWrtVariable.kV, frame, np.zeros(3), W, W
            )
        return J

    def lengths_and_jacobian(self, context: Context) -> tuple[Array, Array]:
        """Lengths of the straight cables and how they change, at a context of the plant.

        Returns:
            l, shape (m,) [m], and J_l, shape (m, nv), with l_dot = J_l v.

        Raises:
            CableGeometryError: A cable cannot run there; names it.
        """
        motion, m = self.motions(context), self.routes.count
        lengths, wrenches = np.zeros(m), np.zeros((m, len(motion), 6))
        bad = kernels.route_lengths(motion, *self._packed, self._straight_room, lengths, wrenches)
        self._check(bad)
        return lengths, -np.einsum("mki,kiv->mv", wrenches, self._jacobians(context))

    def length_jacobian(self, context: Context) -> Array:
        """J_l of `lengths_and_jacobian`, shape (m, nv)."""
        return self.lengths_and_jacobian(context)[1]

    def generalized_force(self, context: Context, l0: Array, l0_dot: Array | None = None) -> Array:
        """What the cables do to the plant with unstrained lengths, -J_l' t of straight ones.

        Args:
            context: Of the plant.
            l0: Unstrained lengths, shape (m,) [m].
            l0_dot: Their rates, shape (m,) [m/s]; None: at rest.

        Returns:
            Generalized force, shape (nv,) [N, N m].

        Raises:
            CableGeometryError: A cable cannot run there; names it.
        """
        motion, m = self.motions(context), self.routes.count
        wrenches, rates = np.zeros((len(motion), 6)), np.zeros(m) if l0_dot is None else l0_dot
        add = kernels.add_plain_wrenches if self.law == STRAIGHT else kernels.add_any_wrenches
        bad = add(motion, l0, rates, *self._packed, self._room(), wrenches, np.zeros(0))
        self._check(bad)
        return np.einsum("kiv,ki->v", self._jacobians(context), wrenches)

    def outputs(self, context: Context, l0: Array, l0_dot: Array | None = None) -> Array:
        """What the cables do, shape (6, m), rows as `cables.simulation_kernel.OUTPUTS`.

        Raises:
            CableGeometryError: A cable cannot run there; names it.
        """
        m = self.routes.count
        table, rates = np.zeros((OUTPUTS, m)), np.zeros(m) if l0_dot is None else l0_dot
        straight = self.law == STRAIGHT
        calc = kernels.straight_route_outputs if straight else kernels.any_route_outputs
        bad = calc(self.motions(context), l0, rates, *self._packed, self._room(), table)
        self._check(bad)
        return table

    def unstrained_lengths(self, context: Context, tensions: Array) -> Array:
        """Lengths with which straight cables pull so: l0 = l / (1 + t / E S), shape (m,) [m]."""
        lengths, _ = self.lengths_and_jacobian(context)
        return np.asarray(lengths / (1.0 + tensions / self.routes.ends.stiffness))

    def energy(self, context: Context, l0: Array) -> float:
        """Potential energy of cables and plant, of weight from z = 0 in W on [J].

        Args:
            context: Of the plant.
            l0: Unstrained lengths, shape (m,) [m].
        """
        motion, m, room = self.motions(context), self.routes.count, self._room()
        if self.law != STRAIGHT:
            table = np.zeros((OUTPUTS, m))
            kernels.any_route_outputs(motion, l0, np.zeros(m), *self._packed, room, table)
        stored = kernels.route_energy(motion, l0, *self._packed, room)
        return float(stored + self.plant.CalcPotentialEnergy(context))

    def other_forces(self, context: Context) -> Array:
        """tau_g: of gravity and all force elements at rest, shape (nv,) [N, N m].

        Velocities in the context are not looked at.
        """
        return self.forces_at_rest(at_rest(self.plant, context))

    def forces_at_rest(self, context: Context) -> Array:
        """As `other_forces`, at a context without velocities, which saves a copy of it."""
        plant = self.plant
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)
        needed = plant.CalcInverseDynamics(context, np.zeros(plant.num_velocities()), forces)
        return -np.asarray(needed)

    def _check(self, bad: int) -> None:
        if bad >= 0:
            raise CableGeometryError(
                f"{self.routes.names[bad]} cannot run: an anchor point lies in the groove of its "
                "pulley or on its swivel axis, or two of its points coincide; accepted: a "
                "configuration without that"
            )


def at_rest(plant: MultibodyPlant, context: Context) -> Context:
    """A context of one's own with the same positions and parameters, and no velocities."""
    own = plant.CreateDefaultContext()
    own.SetTimeStateAndParametersFrom(context)
    plant.SetVelocities(own, np.zeros(plant.num_velocities()))
    return own
