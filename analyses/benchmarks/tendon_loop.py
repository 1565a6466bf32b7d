"""The loop of dynamic control as one writes it with MuJoCo's tendons and daqp, to compare with."""

from __future__ import annotations

import importlib.util
from ctypes import c_int
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.tensions.problem import TensionProblem
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE, write_motion

LOG_STEPS = 10
"""Control steps from row to row of the log."""


def has_tendons() -> bool:
    """Whether MuJoCo and daqp are installed."""
    return all(importlib.util.find_spec(name) is not None for name in ("daqp", "mujoco"))


class DaqpLoop:
    """daqp's model, set up once and updated with each problem, as its users do in a loop."""

    def __init__(self, problem: TensionProblem) -> None:
        """With the sizes and bounds of a problem."""
        import daqp

        n, m = problem.W.shape
        self._upper = np.concatenate([problem.upper, -problem.wrench])
        self._lower = np.concatenate([problem.lower, -problem.wrench])
        sense = np.zeros(m + n, dtype=c_int)
        sense[m:] = 5  # equalities
        self._m = m
        self._model: Any = daqp.Model()
        self._model.setup(np.eye(m), np.zeros(m), problem.W.copy(), self._upper, self._lower, sense)

    def solve(self, W: Array, wrench: Array) -> Any:
        """The least-norm tensions; bounds as they were set up."""
        np.negative(wrench, out=self._upper[self._m :])
        self._lower[self._m :] = self._upper[self._m :]
        self._model.update(A=W, bupper=self._upper, blower=self._lower)
        return self._model.solve()


def tendon_model(robot: Robot, step: float) -> Any:
    """A robot as a MuJoCo model: a free body, a spatial tendon and a motor on it for each cable.

    Cables run from fixed exit points. MuJoCo's integrator is its default one, which evaluates the
    forces once a step; as every call of MuJoCo here, as its documentation writes control loops.

    Args:
        robot: The robot; not a planar one.
        step: Step of the integrator [s].
    """
    import mujoco

    def words(values: Any) -> str:
        return " ".join(repr(float(value)) for value in values)

    inertia = platform_inertia(robot)
    com = inertia.get_com()
    G = inertia.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()
    moments = [G[0, 0], G[1, 1], G[2, 2], G[0, 1], G[0, 2], G[1, 2]]
    ends = list(enumerate(robot.cables))
    exits = "".join(f'<site name="A{i}" pos="{words(c.exit_point)}"/>' for i, c in ends)
    anchors = "".join(f'<site name="B{i}" pos="{words(c.anchor_point)}"/>' for i, c in ends)
    tendons = "".join(
        f'<spatial name="T{i}"><site site="A{i}"/><site site="B{i}"/></spatial>' for i, _ in ends
    )
    motors = "".join(f'<motor tendon="T{i}" gear="-1"/>' for i, _ in ends)
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" gravity="0 0 {-robot.gravity}"/>'
        f'<worldbody>{exits}<body name="P"><freejoint/>'
        f'<inertial pos="{words(com)}" mass="{inertia.get_mass()}" '
        f'fullinertia="{words(moments)}"/>{anchors}</body></worldbody>'
        f"<tendon>{tendons}</tendon><actuator>{motors}</actuator></mujoco>"
    )


class TendonLoop:
    """Computed torque along a scenario's trajectory: MuJoCo moves the robot, daqp finds tensions.

    MuJoCo gives the tendons' Jacobian, the mass matrix and the bias, so that the loop in Python has
    little to do; the desired motion is this project's compiled one.
    """

    def __init__(self, scenario: TensionScenario, robot: Robot, problem: TensionProblem) -> None:
        """With a scenario, its robot, and a problem of tension distribution at its start."""
        import mujoco

        control = scenario.controller
        self._mujoco: Any = mujoco
        self._model = tendon_model(robot, 1.0 / control.rate)
        self._data: Any = mujoco.MjData(self._model)
        self._gains = control.stiffness, control.damping
        trajectory = scenario.trajectory.trajectory()
        self._stretches = trajectory.stretches()
        start = trajectory.pose(0.0)
        self._data.qpos[:3] = start.translation()
        self._data.qpos[3:] = start.rotation().ToQuaternion().wxyz()
        self._tensions = DaqpLoop(problem)
        self._shape = problem.W.shape[::-1]
        self._rows: list[tuple[float, Array, Array]] = []

    @property
    def time(self) -> float:
        """Time that is reached [s]."""
        return float(self._data.time)

    def pose(self) -> Array:
        """Position [m] and quaternion wxyz of the platform, shape (7,)."""
        return np.array(self._data.qpos)

    def tensions(self) -> Array:
        """Tensions of the last step, shape (m,) [N]."""
        return np.array(self._data.ctrl)

    def advance(self, steps: int) -> None:
        """Goes on by some control steps."""
        mujoco, model, data = self._mujoco, self._model, self._data
        Kp, Kd = self._gains
        qpos, qvel, ctrl, bias = data.qpos, data.qvel, data.ctrl, data.qfrc_bias
        R = data.body("P").xmat.reshape(3, 3)
        J = data.ten_J.reshape(self._shape)
        desired, turn = np.empty(MOTION_SIZE), np.empty(3)
        acceleration, force = np.empty(6), np.empty(6)
        for step in range(steps):
            if step % LOG_STEPS == 0:
                self._rows.append((data.time, qpos.copy(), ctrl.copy()))
            mujoco.mj_step1(model, data)
            write_motion(data.time, self._stretches, desired)
            mujoco.mju_subQuat(turn, desired[:4], qpos[3:])
            acceleration[:3] = (
                desired[16:] + Kp * (desired[4:7] - qpos[:3]) + Kd * (desired[10:13] - qvel[:3])
            )
            acceleration[3:] = (desired[13:16] + Kd * desired[7:10]) @ R + Kp * turn - Kd * qvel[3:]
            mujoco.mj_mulM(model, data, force, acceleration)
            force += bias
            found, _, flag, _ = self._tensions.solve(np.ascontiguousarray(-J.T), -force)
            if flag > 0:
                ctrl[:] = found
            mujoco.mj_step2(model, data)
