"""Section `force_control` of dynamic control, and its block: laws that answer forces."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Annotated, Any, ClassVar

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DependencyTicket,
    DiscreteStateIndex,
    DiscreteValues,
)

from cdpr_drake.arrays import Array
from cdpr_drake.control.force_balance import WRENCH
from cdpr_drake.control.force_laws import (
    Admittance,
    displaced,
    hybrid_wrench,
    impedance_wrench,
    in_world,
    pose_deviation,
)
from cdpr_drake.control.task_space import PlatformDynamics, TaskGains, computed_torque
from cdpr_drake.errors import ScenarioError
from cdpr_drake.estimation.wrench_observer_kernel import MEMORY_SIZE
from cdpr_drake.estimation.wrench_observers import (
    EXTENDED,
    MOMENTUM,
    WrenchObserver,
    packed_body,
)
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_in_plant import RobotInPlant, pose_on_joint
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.schema.declarations import (
    In,
    OneOf,
    Refusal,
    Scope,
    Switch,
    filled,
    settings,
    values,
)
from cdpr_drake.schema.typed_yaml import refuse
from cdpr_drake.sections.wrench_estimation.section import ESTIMATED, PARTS
from cdpr_drake.systems.controllers.computed_torque import PoseTracking, platform_dynamics
from cdpr_drake.systems.sections import Section
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

TRACKING, IMPEDANCE, ADMITTANCE, HYBRID = "tracking", "impedance", "admittance", "hybrid"

AXES = ("x", "y", "z")
"""Axes of the task frame."""

DISPLACEMENT = "displacement"
"""Output: how far an admittance has moved the trajectory."""

TOUCHES = 0.2
"""Share of the wanted force from which something is touched: what is missing is gathered then."""


@settings
class ForceControl(Section):
    """How the platform answers forces, in the place of plain computed torque."""

    words = "How the platform answers forces, by the engine plant, beside computed torque"
    columns: ClassVar = {
        ESTIMATED: PARTS,
        DISPLACEMENT: ("rx_rad", "ry_rad", "rz_rad", "x_m", "y_m", "z_m"),
    }
    report = "cdpr_drake.sections.force_control.report:SUBJECTS"

    kind: Annotated[
        str,
        OneOf((TRACKING, IMPEDANCE, ADMITTANCE, HYBRID)),
        "tracking: computed torque; impedance: a spring and damper to the trajectory, "
        "nothing is measured; admittance: the trajectory gives way by what pushes; "
        "hybrid: a force along some axes, the trajectory along the others.",
    ]
    task_angles_deg: Annotated[
        np.ndarray, In("deg", 3), "Axes of the task frame T in W, angles as those of a pose."
    ] = values(0.0, 0.0, 0.0)
    stiffness: Annotated[
        np.ndarray | None,
        In("N m/rad, N/m", 6, ge=0.0),
        "Along (rx, ry, rz, x, y, z) of T; kinds impedance and admittance.",
    ] = None
    damping: Annotated[
        np.ndarray | None, In("N m s/rad, N s/m", 6, ge=0.0), "The same of velocities."
    ] = None
    mass: Annotated[
        np.ndarray | None, In("kg m^2, kg", 6, ge=0.0), "Virtual inertia of kind admittance."
    ] = None
    axes: Annotated[list[str], OneOf(AXES), "Axes of T along which kind hybrid presses."] = filled(
        list
    )
    force: Annotated[
        np.ndarray | None,
        In("N", 3),
        "What kind hybrid presses with, in T: the force on what is touched.",
    ] = None
    contact_stiffness: Annotated[
        float | None,
        In("N/m", gt=0.0),
        "Stiffness that contact is believed to have, kind hybrid, which is damped by that.",
    ] = None
    integral: Annotated[
        float,
        In("1/s", ge=0.0),
        "Gain of the missing force, gathered while more than a fifth of it is there; kind hybrid.",
    ] = 2.0
    observer: Annotated[
        str,
        OneOf((MOMENTUM, EXTENDED)),
        "What estimates the wrench on the platform, from the commanded tensions.",
    ] = MOMENTUM
    bandwidth: Annotated[float, In("Hz", gt=0.0), "Of that, over 2 pi."] = 10.0
    reject: Annotated[
        Switch,
        "Whether the estimated wrench is taken out, but along axes that press; with "
        "admittance that leaves the platform on the trajectory that gives way.",
    ] = False

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """What is missing or belongs to another kind, and what it is not for."""
        needs = {IMPEDANCE: ("stiffness", "damping"), ADMITTANCE: ("stiffness", "damping", "mass")}
        for name in ("stiffness", "damping", "mass"):
            is_needed = name in needs.get(self.kind, ())
            if (getattr(self, name) is not None) != is_needed:
                found, accepted = ("none", "six numbers") if is_needed else ("numbers", "null")
                yield name, f"{found} with {self.kind}", accepted
        if self.mass is not None and not np.all(self.mass > 0.0):
            yield "mass", f"{np.min(self.mass):g}", "above 0"
        hybrid = self.kind == HYBRID
        for name, there in (
            ("axes", bool(self.axes)), ("force", self.force is not None),
            ("contact_stiffness", self.contact_stiffness is not None),
        ):  # fmt: skip
            if there != hybrid:
                found, accepted = ("none", "it") if hybrid else ("one", "none")
                yield name, f"{found} with {self.kind}", accepted
        if not scope.robot.motion_type().is_free:
            yield "", f"a section for {scope.robot.name}, {scope.robot.motion}", "3R3T"
        if scope.whole is self:  # of nobody's scenario
            return
        for other in ("remote", "predictive"):
            if getattr(scope.whole, other, None) is not None:
                yield "", f"beside {other}", "one of both"
        if scope.whole.controller.balance != WRENCH:
            found = f"{scope.whole.controller.balance} beside force_control"
            yield "/controller.balance", found, WRENCH

    def needs_plant(self, scenario: Any) -> bool:
        """Always: no kernel has its laws."""
        return True

    def tension_blocks(self, settings: Any, robot: Robot) -> Mapping[str, Any]:
        """Makes a `ForceTracking`."""
        about = {"rate": settings.rate, "cables": settings.believed_cables}
        return {"controller": partial(ForceTracking, settings=self, **about)}

    def pressed(self) -> Array:
        """1 for axes of T that press, else 0, shape (6,)."""
        return np.concatenate([np.zeros(3), np.isin(AXES, self.axes)])

    def observes(self) -> bool:
        """Whether a wrench is estimated."""
        return self.kind in (ADMITTANCE, HYBRID) or self.reject


class ForceTracking(PoseTracking):
    """A `PoseTracking` that answers forces, see `control.force_laws`.

    ================ ========= ====== ==========================================================
    port             type      unit   meaning, beside those of `PoseTracking`
    ================ ========= ====== ==========================================================
    tensions         vector(m) N      in, that the cables have now
    wrench_estimated vector(6) N m, N out, what pushes the platform, about Po in W; zero without
                                      an observer
    displacement     vector(6) rad, m out, of the trajectory by an admittance, in T
    ================ ========= ====== ==========================================================

    What it gathers it samples at the rate of control; the wrench follows the state at once.
    """

    def __init__(
        self,
        in_plant: RobotInPlant,
        trajectory: PoseTrajectory,
        gains: TaskGains,
        dynamics: PlatformDynamics | None = None,
        *,
        settings: ForceControl,
        rate: float,
        cables: CableSet | None = None,
        balance: str = WRENCH,
    ) -> None:
        """For a robot whose plant is finalized, which moves freely.

        Args:
            in_plant: The robot in its plant.
            trajectory: The desired motion.
            gains: Kp and Kd of computed torque.
            dynamics: What is believed of the platform; None for the exact model.
            settings: The section.
            rate: Steps of control per second [Hz].
            cables: The cables as they are believed to be; None: the robot's, pulleys included.
            balance: What tensions balance: the wrench.

        Raises:
            ScenarioError: The settings are not accepted.
        """
        refuse(settings, "force_control", robot=in_plant.robot, error=ScenarioError)
        if balance != WRENCH:
            raise ScenarioError(f"balance: found {balance}; accepted by force_control: {WRENCH}")
        super().__init__(in_plant, trajectory, gains, dynamics)
        robot = in_plant.robot
        cables = robot.cable_set() if cables is None else cables
        self._settings, self._gains, self._cables = settings, gains, cables
        self._dynamics = dynamics or platform_dynamics(robot)
        self._period = 1.0 / rate
        self._R_WT = rotation_from_angles(np.radians(settings.task_angles_deg))
        self._pressed = settings.pressed()
        if settings.kind == IMPEDANCE:
            assert settings.stiffness is not None
            assert settings.damping is not None
            self._K = in_world(self._R_WT, settings.stiffness)
            self._D = in_world(self._R_WT, settings.damping)
        self._admittance = None
        if settings.kind == ADMITTANCE:
            assert settings.mass is not None
            assert settings.damping is not None
            assert settings.stiffness is not None
            self._admittance = Admittance(
                settings.mass, settings.damping, settings.stiffness, self._period
            )
        M = self._dynamics.M_PPo_P
        platform = rigid_platform(robot)
        inertia = M.CalcRotationalInertia().CopyToFullMatrix3()
        body = packed_body(M.get_mass(), M.get_com(), inertia, platform.acceleration())
        omega = 2.0 * np.pi * settings.bandwidth
        self._watch = WrenchObserver(settings.observer, body, omega, self._period)
        self._turned = np.kron(np.eye(2), self._R_WT.matrix())
        self._brake = 0.0
        if settings.contact_stiffness is not None:
            self._brake = 2.0 * float(np.sqrt(M.get_mass() * settings.contact_stiffness))
        self._tensions = self.DeclareVectorInputPort("tensions", cables.count).Eval
        self.DeclarePeriodicDiscreteUpdateEvent(self._period, 0.0, self._update)
        self.DeclareForcedDiscreteUpdateEvent(self._update)
        self.DeclareStateOutputPort(ESTIMATED, DiscreteStateIndex(self._outer))
        self.DeclareStateOutputPort(DISPLACEMENT, DiscreteStateIndex(self._moved))

    def logged(self) -> tuple[str, ...]:
        """As of `PoseTracking`, and what it estimates."""
        return (*super().logged(), ESTIMATED, DISPLACEMENT)

    def _declare_memory(self) -> set[DependencyTicket]:
        """States on which the wrench depends, beside the platform's."""
        self._outer = int(self.DeclareDiscreteState(6))
        self._moved = int(self.DeclareDiscreteState(6))
        self._rates = int(self.DeclareDiscreteState(6))
        self._sum = int(self.DeclareDiscreteState(3))
        self._memory = int(self.DeclareDiscreteState(MEMORY_SIZE))
        return {self.xd_ticket()}

    def _kept(self, context: Context, index: int) -> Array:
        return np.array(context.get_discrete_state(index).value())

    def _calc_wrench(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._wrench(context))

    def _wrench(self, context: Context) -> Array:
        """F_P_W about Po that the cables shall put on the platform, shape (6,) [N m, N]."""
        time, state, kind = context.get_time(), self._state(context), self._settings.kind
        X_WP, V = pose_on_joint(self._joint, state), state[7:]
        trajectory = self._trajectory
        X_WD, V_D, A_D = (
            trajectory.pose(time),
            trajectory.velocity(time),
            trajectory.acceleration(time),
        )
        if kind == HYBRID:  # along axes that press it is where it shall be
            S = in_world(self._R_WT, self._pressed)
            away = X_WD.translation() - X_WP.translation()
            X_WD = RigidTransform(X_WD.rotation(), X_WD.translation() - S[3:, 3:] @ away)
            V_D, A_D = V_D - S @ (V_D - V), A_D - S @ A_D
        none, free = TaskGains(0.0, 0.0), np.zeros(6)

        def torque(X: RigidTransform, V_X: Array, A_X: Array, gains: TaskGains) -> Array:
            return computed_torque(X_WP, V, X, V_X, A_X, dynamics=self._dynamics, gains=gains)

        outer = self._kept(context, self._outer)
        if kind == IMPEDANCE:
            e = pose_deviation(X_WP, X_WD)
            F = impedance_wrench(torque(X_WD, V_D, A_D, none), e, V_D - V, self._K, self._D)
        elif self._admittance is not None:
            y, rate = self._kept(context, self._moved), self._kept(context, self._rates)
            bend = self._admittance.acceleration(y, rate, self._turned.T @ outer)
            X_WC = displaced(X_WD, self._turned @ y)
            F = torque(X_WC, V_D + self._turned @ rate, A_D + self._turned @ bend, self._gains)
        else:
            F = torque(X_WD, V_D, A_D, self._gains)
        pressed = np.zeros(6)
        if kind == HYBRID:
            pressed = self._pressed
            f = np.concatenate(
                [np.zeros(3), self._settings_force() + self._kept(context, self._sum)]
            )
            presses = torque(X_WP, V, free, none) + self._turned @ f - self._brake * V
            F = hybrid_wrench(F, presses, self._R_WT, pressed)
        if self._settings.reject:
            F = F - in_world(self._R_WT, 1.0 - pressed) @ outer
        return F

    def _settings_force(self) -> Array:
        assert self._settings.force is not None
        return self._settings.force

    def _update(self, context: Context, state: DiscreteValues) -> None:
        if not self._settings.observes() or context.get_time() == 0.0:
            return  # at time 0 there are no tensions yet that control has chosen
        X_WP = pose_on_joint(self._joint, self._state(context))
        J = cable_jacobian(X_WP, self._cables)
        watch = self._watch
        watch.memory[:] = context.get_discrete_state(self._memory).value()
        # The known forces: cables, and the damping that the platform is believed to have.
        by_move, by_turn = self._dynamics.damping
        braked = np.repeat([by_turn, by_move], 3) * self._state(context)[7:]
        outer = watch.update(X_WP, -J.T @ self._tensions(context) - braked)
        state.set_value(self._memory, watch.memory)
        state.set_value(self._outer, outer)
        if self._admittance is not None:
            y, rate = self._kept(context, self._moved), self._kept(context, self._rates)
            y, rate = self._admittance.step(y, rate, self._turned.T @ outer)
            state.set_value(self._moved, y)
            state.set_value(self._rates, rate)
        if self._settings.kind == HYBRID:
            wanted = self._settings_force()
            there = -self._R_WT.matrix().T @ outer[3:]
            touches = (there * wanted > TOUCHES * wanted**2) & (self._pressed[3:] > 0.0)
            added = self._period * self._settings.integral * (wanted - there) * touches
            state.set_value(self._sum, self._kept(context, self._sum) + added)
