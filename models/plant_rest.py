"""Mechanisms on cables at rest: with chosen tensions, or with given lengths.

`hang` looks for tensions, as near to wanted ones as their bounds let them be, and for the positions
of what neither cables nor motors hold; `settle` for positions, with unstrained lengths given. Both
end with Newton steps to rounding, and judge the stiffness at what they found.

    hang:    min |t - t_0|^2   s.t.   tau_g(q) - J_l(q)' t = 0 on rows without a motor,
                                      t_min <= t <= t_max
    settle:  tau_g(q) + tau_cables(q, l_0) = 0 on these rows
    stiff:   K = -d(tau_g + tau_cables)/dv at l_0; K x = lambda M x, stable where all lambda > 0.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointActuatorIndex, JointIndex, QuaternionFloatingJoint
from pydrake.solvers import MathematicalProgram, SnoptSolver
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS
from cdpr_drake.errors import CableModelError, EquilibriumError, InfeasibleTensionError
from cdpr_drake.geometry.cable_routes import Integers
from cdpr_drake.models.plant_cables import PlantCables, at_rest

Booleans = np.typing.NDArray[np.bool_]

PRESTRESS, POSE = "prestress", "pose"
"""What yields where not both can be kept."""

LEAST_SHARE = 0.01
"""Smallest tension where none is asked for, as a share of the machine's weight a cable."""

STEP = 1e-6
"""Of central differences in q, per rad and metre: their error is some 1e-10 of the derivative."""

NEUTRAL = 1e-9
"""Eigenvalues below this share of the largest are those of motion that nothing resists."""

ROUNDING = 1e-9
"""A residual is solved below this share of the largest force."""

SETTLED = 1e-6
"""Newton's method takes over below this share of the largest force."""

DESCENT_STEPS = 300
"""Of descent: slack cables that become taut, and taut ones slack, take tens."""

LARGEST_STEP = 1.0
"""Of descent, in any coordinate [rad, m]."""

LARGEST_KICK = 1e-3
"""Of the step that leaves an unstable rest, in any coordinate [rad, m]."""

NEWTON_STEPS = 20
"""Of Newton's method from what a program or least squares found: three or four are usual."""


@dataclass(frozen=True, eq=False)
class Rest:
    """A mechanism at rest.

    Attributes:
        positions: q of the plant, shape (nq,).
        tensions: At the anchor points, shape (m,) [N].
        unstrained_lengths: l0, shape (m,) [m].
        held: Forces that motors hold joints with, 0 on other rows, shape (nv,) [N, N m].
        residual: Largest force that nothing balances, on rows without a motor [N, N m].
        squared_frequencies: Eigenvalues of stiffness over inertia on the rows without a motor,
            ascending [rad^2/s^2]; a negative one: it falls away.
        notes: What is not as it was asked for.
    """

    positions: Array
    tensions: Array
    unstrained_lengths: Array
    held: Array
    residual: float
    squared_frequencies: Array
    notes: tuple[str, ...] = ()

    @property
    def stability(self) -> str:
        """Whether it stays there after a push: stable, neutral or unstable."""
        values = self.squared_frequencies
        if not len(values):
            return "stable"
        floor = NEUTRAL * float(np.max(np.abs(values)))
        return "stable" if values[0] > floor else "neutral" if values[0] > -floor else "unstable"


def rows_of_joints(plant: MultibodyPlant, names: Iterable[str]) -> Booleans:
    """Which velocities belong to joints, shape (nv,), true or false.

    Args:
        plant: The plant, finalized.
        names: Names of joints, or scoped ones, `model::joint`; a floating body's joint bears the
            body's name.

    Raises:
        EquilibriumError: There is no such joint; lists those there are.
    """
    rows = np.zeros(plant.num_velocities(), dtype=bool)
    joints = [plant.get_joint(JointIndex(i)) for i in plant.GetJointIndices()]
    for name in names:
        found = [
            joint
            for joint in joints
            if name in (joint.name(), scoped_joint(plant, joint)) and joint.num_velocities()
        ]
        if not found:
            known = sorted(scoped_joint(plant, j) for j in joints if j.num_velocities())
            raise EquilibriumError(
                f"joint: found {name}; accepted: one of {', '.join(known) or '(none moves)'}"
            )
        if len(found) > 1:
            known = [scoped_joint(plant, joint) for joint in found]
            raise EquilibriumError(f"joint: found {name} twice; accepted: {' or '.join(known)}")
        start = found[0].velocity_start()
        rows[start : start + found[0].num_velocities()] = True
    return rows


def scoped_joint(plant: MultibodyPlant, joint: Any) -> str:
    """Name of a joint with its model instance's before it, as Drake writes it."""
    return f"{plant.GetModelInstanceName(joint.model_instance())}::{joint.name()}"


def rows_of_motors(plant: MultibodyPlant) -> Booleans:
    """Which velocities an actuator of the plant acts on, shape (nv,), true or false."""
    rows = np.zeros(plant.num_velocities(), dtype=bool)
    for i in plant.GetJointActuatorIndices():
        rows[plant.get_joint_actuator(JointActuatorIndex(i)).joint().velocity_start()] = True
    return rows


def moved(plant: MultibodyPlant, q: Array, step: Array) -> Array:
    """Positions a step in velocities further, quaternions of unit length, shape (nq,)."""
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    return _moved(plant, context, q, step)


def _moved(plant: MultibodyPlant, scratch: Context, q: Array, step: Array) -> Array:
    plant.SetPositions(scratch, q)
    new = q + plant.MapVelocityToQDot(scratch, step)
    for i in plant.GetJointIndices():
        joint = plant.get_joint(JointIndex(i))
        if isinstance(joint, QuaternionFloatingJoint):
            start = joint.position_start()
            new[start : start + 4] /= np.linalg.norm(new[start : start + 4])
    return np.asarray(new)


@dataclass(frozen=True, eq=False)
class _Model:
    """Energy near a configuration, by a step d in the velocities without a motor:

        -f' d + d' H d / 2 + sum_i k_i max(0, s_i + J_i d)^2 / 2,

    quadratic but for cables that become taut or slack, which it follows. Differences of forces
    would average the two sides of such a kink.

    Attributes:
        others: f, of all but the straight cables, shape (r,) [N, N m].
        smooth: H: stiffness of these, and of cables that keep their tensions, shape (r, r).
        J: Length Jacobian of straight cables, shape (m, r).
        springs: k, 0 of others, shape (m,) [N/m].
        stretch: s, shape (m,) [m].
    """

    others: Array
    smooth: Array
    J: Array
    springs: Array
    stretch: Array

    def force(self) -> Array:
        """Of all, shape (r,)."""
        return self.others - self.J.T @ (self.springs * np.maximum(self.stretch, 0.0))

    def stiffness(self, taut: Booleans | None = None) -> Array:
        """With these cables taut; None: those that are."""
        J = self.J[self.stretch > 0.0 if taut is None else taut]
        k = self.springs[self.stretch > 0.0 if taut is None else taut]
        return self.smooth + J.T @ (k[:, None] * J)

    def step(self, damping: Array) -> tuple[Array, bool]:
        """d where the energy plus d' (damping) d / 2 has no slope, and whether it is least there.

        Cables that d makes taut or slack are so, if these sets do not go round in a circle.
        """
        taut = self.stretch > 0.0
        d = np.zeros(len(self.others))
        for _ in range(2 * len(taut) + 1):
            J, k = self.J[taut], self.springs[taut]
            K = self.stiffness(taut) + damping
            d = scipy.linalg.lstsq(K, self.others - J.T @ (k * self.stretch[taut]))[0]
            then = self.stretch + self.J @ d > 0.0
            if np.array_equal(then, taut):
                break
            taut = then
        return d, bool(scipy.linalg.eigvalsh(K)[0] > 0.0)


class _Question:
    """A mechanism on cables: its forces at positions, and their derivatives."""

    def __init__(self, cables: PlantCables, context: Context, held: Booleans) -> None:
        self.cables, self.plant = cables, cables.plant
        self.context, self.scratch = at_rest(self.plant, context), at_rest(self.plant, context)
        self.held, self.kept = held, ~held
        self.q = np.array(self.plant.GetPositions(self.context))
        _, J = cables.lengths_and_jacobian(self.context)
        self.load = float(np.max(np.abs(cables.forces_at_rest(self.context)), initial=0.0))
        self.reach = np.max(np.abs(J), axis=0, initial=0.0)

    def at(self, q: Array) -> Context:
        self.plant.SetPositions(self.context, q)
        return self.context

    def moved(self, q: Array, step: Array) -> Array:
        return _moved(self.plant, self.scratch, q, step)

    def with_tensions(self, q: Array, t: Array) -> Array:
        context = self.at(q)
        return self.cables.forces_at_rest(context) - self.cables.length_jacobian(context).T @ t

    def with_lengths(self, q: Array, l0: Array) -> Array:
        context = self.at(q)
        return self.cables.forces_at_rest(context) + self.cables.generalized_force(context, l0)

    def model(self, q: Array, l0: Array) -> _Model:
        """What happens near q, on the rows without a motor."""
        rows = np.flatnonzero(self.kept)
        if CABLE_MODELS[self.cables.model].sags:
            m = self.cables.routes.count
            K = -self.by_position(lambda x: self.with_lengths(x, l0), q, rows)[rows]
            force = self.with_lengths(q, l0)[rows]
            return _Model(force, (K + K.T) / 2.0, np.zeros((m, len(rows))), np.zeros(m), -l0)
        lengths, J = self.cables.lengths_and_jacobian(self.at(q))
        stretch, springs = lengths - l0, self.cables.routes.ends.stiffness / l0
        t = springs * np.maximum(stretch, 0.0)
        H = -self.by_position(lambda x: self.with_tensions(x, t), q, rows)[rows]
        others = self.cables.forces_at_rest(self.at(q))[rows]
        return _Model(others, (H + H.T) / 2.0, J[:, rows], springs, stretch)

    def by_position(self, force: Any, q: Array, columns: Integers) -> Array:
        """Derivative of a force (q) by velocities of these columns, shape (nv, k)."""
        nv = self.plant.num_velocities()
        D = np.zeros((nv, len(columns)))
        for j, column in enumerate(columns):
            step = np.zeros(nv)
            step[column] = STEP
            D[:, j] = (force(self.moved(q, step)) - force(self.moved(q, -step))) / (2.0 * STEP)
        return D

    def rest(self, q: Array, tensions: Array, l0: Array, notes: tuple[str, ...]) -> Rest:
        force = self.with_lengths(q, l0)
        rows = np.flatnonzero(self.kept)
        K = self.model(q, l0).stiffness() if len(rows) else np.zeros((0, 0))
        M = self.plant.CalcMassMatrix(self.at(q))[np.ix_(rows, rows)]
        squared = scipy.linalg.eigh(K, M, eigvals_only=True) if len(rows) else []
        held = np.where(self.held, -force, 0.0)
        residual = float(np.max(np.abs(force[rows]), initial=0.0))
        return Rest(q, tensions, l0, held, residual, np.asarray(squared), notes)


def _held_rows(plant: MultibodyPlant, held: Iterable[str] | None) -> Booleans:
    return rows_of_motors(plant) if held is None else rows_of_joints(plant, held)


def hang(
    cables: PlantCables,
    context: Context,
    *,
    yields: str = PRESTRESS,
    free: Iterable[str] | None = None,
    held: Iterable[str] | None = None,
    prestress: Array | float | None = None,
    lower: Array | float | None = None,
    upper: Array | float = np.inf,
) -> Rest:
    """Tensions that hold a mechanism where it is, and where what hangs on it comes to rest.

    Args:
        cables: Its cables; straight ones.
        context: Of the plant; not changed. Its positions are asked for, or are the start.
        yields: `PRESTRESS`: positions stay, but those of free joints, and tensions are as near to
            the prestress as they can be; `POSE`: all positions but those that motors hold may
            change so that tensions get there.
        free: Joints that settle, by name; None: those that neither cables nor motors act on.
        held: Joints that motors hold, by name; None: those with actuators in the plant.
        prestress: Wanted tensions, shape (m,) or one for all [N]; None: as small as they can be.
        lower: Smallest tensions, shape (m,) or one for all [N]; None: `LEAST_SHARE` of the weight
            a cable, or 0, with a note, where nothing hangs so. At 0 a cable is at the edge of
            slack, and a plant linearized there is wrong on one side.
        upper: Largest tensions, shape (m,) or one for all [N]; a cable's breaking load, where that
            is less.

    Raises:
        InfeasibleTensionError: No tensions within the bounds hold it; names the joint.
        EquilibriumError: Free joints do not come to rest, or a joint is not there.
        CableModelError: The cables sag: their tensions say no lengths here; `settle` takes them.
        CableGeometryError: A cable cannot run.
    """
    plant, m = cables.plant, cables.routes.count
    sagging = CABLE_MODELS[cables.model].sags and np.any(cables.routes.ends.linear_weight > 0.0)
    if sagging or not CABLE_MODELS[cables.model].extensible:
        straight = [n for n, kind in CABLE_MODELS.items() if kind.extensible and not kind.sags]
        raise CableModelError(
            f"hang: found cables by the model {cables.model}; accepted: {' or '.join(straight)}"
        )
    if yields not in (PRESTRESS, POSE):
        raise EquilibriumError(f"yields: found {yields!r}; accepted: {PRESTRESS} or {POSE}")
    question = _Question(cables, context, _held_rows(plant, held))
    if free is not None:
        moving = rows_of_joints(plant, free) & question.kept
    elif yields == POSE:
        moving = question.kept
    else:
        moving = question.kept & (question.reach == 0.0)
    wanted = _per_cable(0.0 if prestress is None else prestress, m, "prestress")
    high = np.minimum(_per_cable(upper, m, "upper"), cables.routes.ends.breaking_load)
    mass = plant.CalcTotalMass(question.context)
    gravity = float(np.linalg.norm(plant.gravity_field().gravity_vector()))
    least = LEAST_SHARE * mass * gravity / m
    tried = [least, 0.0] if lower is None else [lower]
    problem: Exception | None = None
    for k, low in enumerate(tried):
        bounds = _per_cable(low, m, "lower"), high
        if np.any(bounds[0] > high):
            raise InfeasibleTensionError(
                f"tensions: found lower bounds of up to {np.max(bounds[0]):g} N above upper ones "
                f"of {np.min(high):g} N; accepted: lower <= upper"
            )
        try:
            q, t = _nearest(question, np.flatnonzero(moving), wanted, bounds)
        except InfeasibleTensionError as found:
            problem = found
            continue
        l0 = cables.unstrained_lengths(question.at(q), t)
        slack = [cables.routes.names[i] for i in np.flatnonzero(t <= 0.0)]
        notes: tuple[str, ...] = ()
        if k and slack:
            notes = (
                f"no tensions of at least {least:.3g} N hold it: {', '.join(slack)} at the edge of "
                "slack, where derivatives are one-sided",
            )
        return question.rest(q, t, l0, notes)
    assert problem is not None
    raise problem


def _per_cable(value: Array | float, m: int, name: str) -> Array:
    values = np.full(m, float(value)) if np.ndim(value) == 0 else np.array(value, dtype=float)
    if values.shape != (m,) or np.any(np.isnan(values)) or np.any(values < 0.0):
        raise InfeasibleTensionError(
            f"{name}: found {value}; accepted: one number >= 0, or {m} of them [N]"
        )
    return values


def _nearest(
    question: _Question, moving: Integers, wanted: Array, bounds: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Positions and tensions: the program of `hang`, then Newton's steps."""
    plant, q0 = question.plant, question.q
    rows, k, m = np.flatnonzero(question.kept), len(moving), len(wanted)
    scale = max(question.load, float(np.max(wanted)), 1e-3)
    nv = plant.num_velocities()

    def position(x: Array) -> Array:
        step = np.zeros(nv)
        step[moving] = x[:k]
        return question.moved(q0, step)

    def residual(x: Array) -> Array:
        return question.with_tensions(position(x), scale * x[k:])[rows] / scale

    def gradient(x: Array) -> Array:
        D = np.zeros((len(rows), k + m))
        for j in range(k):
            step = np.zeros(k + m)
            step[j] = STEP
            D[:, j] = (residual(x + step) - residual(x - step)) / (2.0 * STEP)
        D[:, k:] = -question.cables.length_jacobian(question.at(position(x))).T[rows]
        return D

    def balance(x: Any) -> Any:
        if x.dtype != object:
            return residual(x)
        numbers = ExtractValue(x).ravel()
        return InitializeAutoDiff(residual(numbers), gradient(numbers) @ ExtractGradient(x))

    low, high = bounds[0] / scale, bounds[1] / scale
    program = MathematicalProgram()
    x = program.NewContinuousVariables(k + m, "x")
    program.AddBoundingBoxConstraint(low, high, x[k:])
    program.AddQuadraticErrorCost(np.eye(m), wanted / scale, x[k:])
    if len(rows):
        program.AddConstraint(balance, np.zeros(len(rows)), np.zeros(len(rows)), x)
    start = np.concatenate([np.zeros(k), np.clip(wanted / scale, low, high)])
    result = SnoptSolver().Solve(program, start, None)
    found = np.array(result.get_x_val())
    found[k:] = np.clip(found[k:], low, high)
    # Newton, least steps, with tensions at a bound staying there.
    for _ in range(NEWTON_STEPS):
        r = residual(found)
        if not len(r) or np.max(np.abs(r)) <= 0.1 * ROUNDING * 1e-5:
            break
        D = gradient(found)
        at_bound = np.concatenate([np.zeros(k, bool), (found[k:] <= low) | (found[k:] >= high)])
        D[:, at_bound] = 0.0
        new = found - np.linalg.lstsq(D, r, rcond=None)[0]
        new[k:] = np.clip(new[k:], low, high)
        if not np.max(np.abs(residual(new))) < np.max(np.abs(r)):
            break
        found = new
    r = residual(found)
    if len(r) and not np.max(np.abs(r)) <= ROUNDING:
        worst = rows[int(np.argmax(np.abs(r)))]
        raise InfeasibleTensionError(
            f"hang: found no tensions within {np.min(bounds[0]):g}..{np.max(bounds[1]):g} N that "
            f"hold {_row_name(plant, worst)}, where {scale * np.max(np.abs(r)):.3g} N or N m stay "
            "unbalanced; accepted: wider bounds, a joint among those held, or among those free"
        )
    return position(found), scale * found[k:]


def _row_name(plant: MultibodyPlant, row: int) -> str:
    for i in plant.GetJointIndices():
        joint = plant.get_joint(JointIndex(i))
        start = joint.velocity_start() if joint.num_velocities() else -1
        if start <= row < start + joint.num_velocities():
            number = f" (velocity {row - start})" if joint.num_velocities() > 1 else ""
            return f"joint {scoped_joint(plant, joint)}{number}"
    return f"velocity {row}"


def settle(
    cables: PlantCables,
    context: Context,
    unstrained_lengths: Array,
    *,
    held: Iterable[str] | None = None,
) -> Rest:
    """Where a mechanism comes to rest on cables of given unstrained lengths, from where it is.

    A rest from which it would fall away at a touch is left.

    Args:
        cables: Its cables, by any model that is extensible.
        context: Of the plant; not changed. Its positions are the start.
        unstrained_lengths: Shape (m,) [m].
        held: Joints that motors hold where they are, by name; None: those with actuators.

    Raises:
        EquilibriumError: No rest is found from there.
        CableModelError: The cables do not stretch.
        CableGeometryError: A cable cannot run.
    """
    plant = cables.plant
    if not CABLE_MODELS[cables.model].extensible:
        accepted = [name for name, kind in CABLE_MODELS.items() if kind.extensible]
        raise CableModelError(
            f"settle: found cables by the model {cables.model}; accepted: one of "
            f"{', '.join(accepted)}"
        )
    l0 = np.array(unstrained_lengths, dtype=float)
    if l0.shape != (cables.routes.count,) or not np.all(np.isfinite(l0) & (l0 > 0.0)):
        raise EquilibriumError(
            f"unstrained_lengths: found {unstrained_lengths}; accepted: {cables.routes.count} "
            "numbers > 0 [m]"
        )
    question = _Question(cables, context, _held_rows(plant, held))
    rows = np.flatnonzero(question.kept)
    scale = max(question.load, 1e-3)
    q = question.q
    if len(rows):
        q = _newton(question, _descend(question, q, l0, rows), l0, rows)
    force = question.with_lengths(q, l0)[rows]
    if not np.max(np.abs(force), initial=0.0) <= 1e3 * ROUNDING * scale:
        worst = rows[int(np.argmax(np.abs(force)))]
        raise EquilibriumError(
            f"settle: found no rest from there: {np.max(np.abs(force)):.3g} N or N m stay "
            f"unbalanced at {_row_name(plant, worst)}; accepted: lengths and a start from which it "
            "comes to rest"
        )
    tensions = cables.outputs(question.at(q), l0)[0]
    return question.rest(q, tensions, l0, ())


def _descend(question: _Question, q: Array, l0: Array, rows: Integers) -> Array:
    """Steps of Levenberg and Marquardt that lower the energy, until forces are small.

    Descent ends in a minimum, where a mechanism stays; Newton's method alone would as well end in
    a saddle. A step goes where the model of the energy plus mu d' D d / 2 is least, with D the
    diagonal of the inertia, mu as small as can be.
    """
    plant = question.plant

    def energy(x: Array) -> float:
        return question.cables.energy(question.at(x), l0)

    def moved_by(d: Array) -> Array:
        whole = np.zeros(plant.num_velocities())
        whole[rows] = d
        return question.moved(q, whole)

    mu, height = 0.0, energy(q)
    for _ in range(DESCENT_STEPS):
        model = question.model(q, l0)
        D = np.diag(np.diag(plant.CalcMassMatrix(question.at(q))[np.ix_(rows, rows)]))
        values, modes = scipy.linalg.eigh(model.stiffness(), D)
        softest, largest = float(values[0]), float(np.max(np.abs(values)))
        if np.max(np.abs(model.force())) <= SETTLED * max(question.load, 1e-3):
            if softest > -NEUTRAL * largest:
                break
            kick = LARGEST_KICK * modes[:, 0] / np.max(np.abs(modes[:, 0]))
            new = min(moved_by(kick), moved_by(-kick), key=energy)
            lower = energy(new)
            if not lower < height:
                break
            q, height, mu = new, lower, 0.0
            continue
        while True:
            d, least = model.step(mu * D)
            if least and np.max(np.abs(d)) < LARGEST_STEP:
                new = moved_by(d)
                lower = energy(new)
                if lower < height:
                    break
            mu = max(4.0 * mu, 1e-6 * largest)
            if mu > 1e9 * largest:
                return q
        q, height, mu = new, lower, mu / 8.0
    return q


def _newton(question: _Question, q: Array, l0: Array, rows: Integers) -> Array:
    """Newton's steps while they make the largest force smaller."""
    size = float(np.max(np.abs(question.with_lengths(q, l0)[rows]), initial=0.0))
    none = np.zeros((len(rows), len(rows)))
    for _ in range(NEWTON_STEPS):
        step = np.zeros(question.plant.num_velocities())
        step[rows] = question.model(q, l0).step(none)[0]
        new = question.moved(q, step)
        smaller = float(np.max(np.abs(question.with_lengths(new, l0)[rows]), initial=0.0))
        if not smaller < size:
            break
        q, size = new, smaller
    return q
