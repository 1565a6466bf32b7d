"""Visual servoing by motor torques: what a controller is made of, and one step of it."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import PlatformDynamics
from cdpr_drake.control.tension_controller_kernel import COULOMB, LOOP_SIZE, RADIUS, STATIC, VISCOUS
from cdpr_drake.control.torque_step_kernel import (
    CABLES,
    GATHERED,
    KAPPA,
    LARGEST_RATE,
    RELAXED,
    RELAXED_STEPS,
    STEP_SIZE,
    STEPS,
    TWIST,
    WRENCH,
    torque_step,
)
from cdpr_drake.errors import ControlGainError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.tensions.methods import method_for
from cdpr_drake.tensions.quadratic_program_kernel import workspace_shape
from cdpr_drake.winches.friction import FrictionLaw


def energy_scale(dynamics: Array, n: int) -> Array:
    """Scale of the rows of a wrench that makes its squares energy over mass, shape (n,) [m, -].

    Args:
        dynamics: `PlatformDynamics.packed`.
        n: Rows: 6, or 3 of 2T1R (moment about z, forces).
    """
    radii = np.sqrt(dynamics[4:7] / dynamics[0])
    return np.concatenate([radii if n == 6 else radii[2:], np.ones(3 if n == 6 else 2)])


FALLBACK = "slack_relaxed"
"""The method that answers where no tensions within the limits give a wrench."""


EMERGENCY = "quadratic_program"
"""The method for cables that are left: any number of them may be, and bounds may meet."""


@dataclass(frozen=True, kw_only=True)
class TensionController:
    """The inner loop: wanted and measured tensions to torques; see `tension_controller_kernel`.

    Attributes:
        proportional: K_P [-].
        integral: K_I [1/s].
        derivative: K_D, of the winding speed [N s/m].
        winding_speed: u, how fast a winch may go beside what the platform's motion asks for; a
            slack cable is wound up at this speed [m/s].
        slack_below: Measured tension below which a cable counts as slack [N].
        tension_rate: Largest rate of the wanted tensions [N/s].
        radius: rho = r_w / R_g as it is believed [m/rad].
        friction: Friction as it is compensated.
        fading_speed: Cable speed below which the compensation of dry friction fades [m/s].
    """

    proportional: float = 4.0
    integral: float = 20.0
    derivative: float = 300.0
    winding_speed: float = 0.05
    slack_below: float = 0.5
    tension_rate: float = 200.0
    radius: float
    friction: FrictionLaw = FrictionLaw()  # noqa: RUF009  frozen
    fading_speed: float = 0.001

    def packed(self) -> Array:
        """For the kernels, shape (`LOOP_SIZE`,).

        Raises:
            ControlGainError: A number is negative or not finite, or 0 where it divides.
        """
        for name in ("proportional", "integral", "slack_below"):
            self._refuse(name, getattr(self, name) >= 0.0, ">= 0")
        for name in ("derivative", "winding_speed", "tension_rate", "radius", "fading_speed"):
            self._refuse(name, getattr(self, name) > 0.0, "> 0")
        friction = self.friction
        numbers = np.array([
            self.proportional, self.integral, self.derivative, self.winding_speed,
            self.slack_below, self.tension_rate, self.radius, friction.coulomb, friction.static,
            friction.viscous, friction.stribeck_speed, self.fading_speed,
        ])  # fmt: skip
        assert len(numbers) == LOOP_SIZE
        return numbers

    def largest_pole(
        self, period: float, stiffness: float, inertia: float, retardation: float = 0.0
    ) -> float:
        """Largest modulus of the poles of the sampled loop; beyond 1 it is not stable.

        Of one winch that pulls on a cable with a fixed end, within all limits and without friction:
        between samples M v' = -k (x + T v) - c_P, held c_P = K_P k (x + T v) + K_D v + z of the
        last sample, x being what is paid out.

        Args:
            period: Time between steps [s].
            stiffness: k of the cable, E S over its length [N/m].
            inertia: J of rotor, gear and drum at the motor's shaft [kg m^2].
            retardation: T of the cable [s].
        """
        P, D, k, T = self.proportional, self.derivative, stiffness, retardation
        mass = inertia / self.radius**2
        # x, v and the held pull beside the cable's own, from sample to sample.
        A = np.array([[0, 1, 0], [-k / mass, -k * T / mass, -1 / mass], [0, 0, 0]])
        between = scipy.linalg.expm(A * period)[:2]
        # K_D (s - s_c) = (1 + K_P) k (x + T v) + K_D v, of which k (x + T v) is what is measured.
        wrong = np.array([(1.0 + P) * k, (1.0 + P) * k * T + D])
        gathers = self.integral * period * wrong
        held = np.array([wrong[0] - k, wrong[1] - k * T]) + gathers
        rows = np.zeros((3, 3))
        rows[:2, :2] = between[:, :2] + np.outer(between[:, 2], held)
        rows[:2, 2] = between[:, 2]
        rows[2, :2], rows[2, 2] = gathers, 1.0
        return float(np.max(np.abs(np.linalg.eigvals(rows))))

    def _refuse(self, name: str, fits: bool, accepted: str) -> None:
        value = getattr(self, name)
        if not (fits and np.isfinite(value)):
            raise ControlGainError(
                f"{name} of a tension loop: found {value}; accepted: a number {accepted}"
            )


@dataclass(frozen=True, kw_only=True)
class ServoWrench:
    """The outer loop: from the servo's twist to a wrench; see `servo_wrench_kernel`.

    Attributes:
        mu: Rate at which a wrong twist fades [1/s].
        kappa: Gain of its integral [1/s^2].
        period: Time between steps of the servo [s].
    """

    mu: float = 20.0
    kappa: float = 100.0
    period: float


@dataclass(frozen=True)
class TorqueCommand:
    """What a step asks for.

    Attributes:
        torques: Of the motors, positive pays out, shape (m,) [N m].
        tensions: Wanted tensions, shape (m,) [N].
        wrench: F_P_W about Po that the cables shall put on the platform, shape (6,) [N m, N].
        V_P: Twist (w, v) of P in P that the winches tell, shape (6,) [rad/s, m/s].
        relaxed: Whether no tensions within the limits give that wrench: these come nearest.
    """

    torques: Array
    tensions: Array
    wrench: Array
    V_P: Array
    relaxed: bool


class TorqueServoLaw:
    """Motor torques from a visual servo's twist, as a function of readings and a memory.

    The memory is one vector of `memory_size` numbers, so that it can be a discrete state; it begins
    as `fresh_memory()`.
    """

    def __init__(
        self,
        cables: CableSet,
        dynamics: PlatformDynamics,
        bounds: Array,
        *,
        wrench: ServoWrench,
        loop: TensionController,
        period: float,
        row_scale: Array,
        method: str = "quadratic_program",
        height: float = 0.0,
        drums: Array | None = None,
    ) -> None:
        """A controller of one robot.

        Args:
            cables: The cables as they are believed to be.
            dynamics: What is believed of the platform.
            bounds: Smallest and largest tensions, shape (2, m) [N].
            wrench: The outer loop.
            loop: The inner loop.
            period: Time between steps of both [s].
            row_scale: What makes moments and forces comparable, shape (n,) [m, -].
            method: A name of `tensions.METHODS` that needs no reference.
            height: Height of the plane of a 2T1R platform [m].
            drums: Of each cable r_w / R_g, in place of the loop's [m/rad], and the share of its
                motor's friction that its torque makes up for, where several cables are on one
                motor, which gets the sum; shape (2, m); None: alike, and all of it.

        Raises:
            TensionProblemError: Unknown method, or one that the redundancy excludes.
            ControlGainError: As `TensionController.packed`, or mu, kappa or a period is negative.
        """
        m, n = cables.count, len(row_scale)
        for name, value, fits in (
            ("mu", wrench.mu, wrench.mu > 0.0), ("kappa", wrench.kappa, wrench.kappa >= 0.0),
            ("period of the servo", wrench.period, wrench.period > 0.0),
            ("period", period, period > 0.0),
        ):  # fmt: skip
            if not (fits and np.isfinite(value)):
                accepted = ">= 0" if name == "kappa" else "> 0"
                raise ControlGainError(f"{name}: found {value}; accepted: a number {accepted}")
        self._methods = tuple(
            method_for(name, m - n, False).compiled(m - n) for name in (method, FALLBACK)
        )
        step = np.array([period, wrench.period, wrench.mu, wrench.kappa, height])
        assert len(step) == STEP_SIZE
        self.cable_count, self._period, self._redundancy = m, period, m - n
        self.memory_size = CABLES + 3 * m
        loops = np.tile(loop.packed(), (m, 1))
        if drums is not None:
            loops[:, RADIUS] = drums[0]
            loops[:, [COULOMB, STATIC, VISCOUS]] *= drums[1][:, np.newaxis]
        limits = np.vstack([np.asarray(bounds, float), np.zeros(m)])
        self._given = (
            step, loops, dynamics.packed(), np.zeros(4), cables.packed(), limits,
            np.ascontiguousarray(row_scale, float), np.empty(workspace_shape(n, m)),
        )  # fmt: skip

    def without(self, broken: Array, *, braking: bool = False) -> TorqueServoLaw:
        """The same law that asks nothing of some cables, and least 2-norm of the others.

        Its memory is the same. The others may go slack: a smallest tension is a luxury, and with it
        they would hold fewer poses. Where they cannot give a wrench, what comes nearest is asked.

        With `braking` nothing is gathered, so that nothing draws the platform back to where it was,
        and nearest is what leaves least kinetic energy: for the wrench F that ends a twist V within
        1 / mu, the energy that a wrench F' would leave then, accelerations being constant, is

            (F' - F)^T M^-1 (F' - F) / (2 mu^2),

        M being the inertia, of which the diagonal about Po, along the axes of P, is taken.

        Args:
            broken: Not 0 for each cable to be left out, shape (m,).
            braking: Whether only motion is to end.

        Source: for the energy, Boumann, Bruckmann: Development of Emergency Strategies for
        Cable-Driven Parallel Robots after a Cable Break, CableCon 2019, which minimizes it, too.
        """
        other = copy.copy(self)
        chosen = method_for(EMERGENCY, self._redundancy, False).compiled(self._redundancy)
        other._methods = (chosen, self._methods[1])
        step, loops, dynamics, pose, cables, limits, scale, work = self._given
        limits = limits.copy()
        limits[0] = 0.0
        limits[:, np.asarray(broken) != 0.0] = 0.0
        if braking:
            step, scale = step.copy(), energy_scale(dynamics, len(scale))
            step[KAPPA] = 0.0
        other._given = (step, loops, dynamics, pose, cables, limits, scale, np.empty_like(work))
        return other

    def fresh_memory(self) -> Array:
        """Memory before the first step, shape (memory_size,)."""
        return np.zeros(self.memory_size)

    def step(
        self, memory: Array, wanted: Array, X_WP: RigidTransform, readings: Array, time: float
    ) -> tuple[TorqueCommand, Array]:
        """One step.

        Args:
            memory: As `fresh_memory` or the step before left it; it is not changed.
            wanted: The servo's last twist (w, v) of P in P, shape (6,) [rad/s, m/s].
            X_WP: Believed pose of the platform.
            readings: Measured tensions [N], and rates of the unstrained lengths [m/s], shape
                (2, m).
            time: Time [s].
        """
        memory, m = np.array(memory), self.cable_count
        torques = np.empty(m)
        tensions, rates = np.ascontiguousarray(readings, float)
        torque_step(
            *self._methods, *self._given, pose_row(X_WP), np.array(wanted, float), tensions, rates,
            time, memory, torques,
        )  # fmt: skip
        command = TorqueCommand(
            torques,
            memory[CABLES : CABLES + m].copy(),
            memory[WRENCH : WRENCH + 6].copy(),
            memory[TWIST : TWIST + 6].copy(),
            bool(memory[RELAXED]),
        )
        return command, memory

    def steps(self, memory: Array) -> tuple[int, int]:
        """How many steps there were, and in how many of them the fallback answered."""
        return int(memory[STEPS]), int(memory[RELAXED_STEPS])

    def largest_rate(self, memory: Array) -> float:
        """Largest rate of a taut cable's wanted tension so far [N/s]."""
        return float(memory[LARGEST_RATE])

    def gathered(self, memory: Array) -> Array:
        """int (V_d - V) dt in P, shape (6,) [rad, m]."""
        return np.array(memory[GATHERED : GATHERED + 6])
