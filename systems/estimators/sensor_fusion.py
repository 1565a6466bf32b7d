"""Estimates the platform's pose from both cameras, lengths and an IMU, and says which it used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector, Context

from cdpr_drake.arrays import Array
from cdpr_drake.estimation import (
    ACCEPTED,
    COUNTED,
    EXTERNAL,
    NOTHING,
    ON_BOARD,
    REJECTED,
    USED,
    FusedBelief,
    Gates,
    Increments,
    Prior,
    correct,
    drift_lengths,
    image_covariance,
    know_object,
    length_innovation,
    move,
    move_inertially,
    object_of_image,
    remember_pose,
    sight_external,
    sight_on_board,
    start_fusion,
    take_depths,
    take_image,
    take_lengths,
    velocity_innovation,
)
from cdpr_drake.geometry import cable_paths
from cdpr_drake.spatial import exponential
from cdpr_drake.systems.estimators.fusion_task import FusionTask
from cdpr_drake.systems.estimators.pose_estimator import PoseEstimator, Read, pack_pose, unpack_pose

SOURCES = ("on_board", "external", "lengths", "on_board_depth", "external_depth")
"""What the filter may use, in the order of its outputs."""

SUREST_DEPTH = 1e-5
"""No depth is trusted further than this standard deviation [m]."""

_IMAGE, _SEEN, _REFUSED = 0, slice(1, 13), 13
"""Memory of a camera: number of its last image, what that showed, since when it is left out."""

NEAREST = 1e-3
"""What is nearer to the camera is not seen by anybody [m]."""

MOTION_SIZE = 19
"""Numbers of an IMU's motion since the start, see `perception.InertialMotion`."""


class SensorFusion(PoseEstimator):
    """An invariant Kalman filter with gates; see `estimation.sensor_filter` for its equations.

    ====================== ============== ======== ===========================================
    port                   type           unit     meaning
    ====================== ============== ======== ===========================================
    platform_velocity      vector(6)      rad/s,   in, twist (w, v) of P in P asked for
                                          m/s
    measured_lengths       vector(m)      m        in, what encoders count; with lengths only
    measured_tensions      vector(m)      N        in; with lengths only
    X_CO, found            as a camera    m, -     in, the object; with the camera on board
    X_CQ                   RigidTransform m        in, the platform's tag; with the camera in
                                                   the world
    platform_tag_found     vector(1)      -        in, 1 while that is seen
    on_board_depths        vector(n)      m        in, of the object's points; 0: none read
    external_depths        vector(n)      m        in, of the tag's points; 0: none read
    inertial_motion        vector(19)     rad, m   in, of an IMU since the start
    X_WP                   RigidTransform m        out, estimated pose of the platform
    X_CO_fused             RigidTransform m        out, the object as the poses put it
    fused_marks            vector(2 n)    px       out, its points in the image
    fused_found            vector(1)      -        out, 1 while its pose is known
    fusion_sources         vector(5)      -        out, what became of `SOURCES` at the last
                                                   step: 1 used, or the share of readings that
                                                   was; 0 nothing new, -1 rejected
    fusion_nis             vector(5)      -        out, normalized innovation squared then,
                                                   over its degrees of freedom; NaN: nothing new
    fusion_covariance      vector(36)     rad, m   out, of the pose's error, a twist of P in P
    ====================== ============== ======== ===========================================

    An image counts once, at the pose of the time at which it was taken. What is less likely than
    the gate allows is left out; a source that is left out for longer than the patience is believed
    to be out of calibration, which is then found anew with what the others say.
    """

    def __init__(self, task: FusionTask) -> None:
        """With a task."""
        self._task = task
        tuning, eyes = task.tuning, (task.on_board, task.external)
        self._m = task.counted.cables.count
        self._past = max((eye.past(task.rate) for eye in eyes if eye is not None), default=0)
        lost = _spread(tuning.lost_rotation_deg, tuning.lost_position)
        self._gates = Gates(tuning.gate, tuning.patience, lost)
        n, m = self._past, self._m
        self._sizes = {
            "clock": 2, "velocity": 3, "knows": 1, "X_WO": 12, "X_PC": 12, "X_WE": 12,
            "biases": 6, "offsets": m, "past": 12 * n, "reference": m, "motion": MOTION_SIZE,
            "on_board": 14, "external": 14, "refused": m, "sources": 5, "nis": 5,
            "covariance": (COUNTED + m + 6 * n) ** 2,
        }  # fmt: skip
        super().__init__(task.X_WP0, task.rate, np.zeros(sum(self._sizes.values())))
        self._declare_inputs()
        self._declare_outputs()

    def _declare_inputs(self) -> None:
        task = self._task
        self.DeclareVectorInputPort("platform_velocity", 6)
        if task.tuning.lengths:
            self.DeclareVectorInputPort("measured_lengths", self._m)
            self.DeclareVectorInputPort("measured_tensions", self._m)
        for eye, pose, found, name in (
            (task.on_board, "X_CO", "found", "on_board"),
            (task.external, "X_CQ", "platform_tag_found", "external"),
        ):
            if eye is None or not eye.used:
                continue
            self.DeclareAbstractInputPort(pose, Value(RigidTransform()))
            self.DeclareVectorInputPort(found, 1)
            if eye.depth is not None:
                self.DeclareVectorInputPort(f"{name}_depths", eye.points.shape[1])
        if task.imu is not None:
            self.DeclareVectorInputPort("inertial_motion", MOTION_SIZE)

    def _declare_outputs(self) -> None:
        self.DeclareAbstractOutputPort(
            "X_CO_fused", lambda: Value(RigidTransform()), self._calc_object
        )
        sizes = {"fused_found": 1, "fusion_sources": 5, "fusion_nis": 5, "fusion_covariance": 36}
        if self._task.on_board is not None:
            sizes["fused_marks"] = 2 * self._task.on_board.points.shape[1]
        for name, size in sizes.items():
            self.DeclareVectorOutputPort(name, size, self._writer(name))

    def _calc_object(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.shown(self.memory_now(context))["X_CO_fused"])

    def _writer(self, name: str) -> Callable[[Context, BasicVector], None]:
        def write(context: Context, output: BasicVector) -> None:
            # What became of sources is known after a step; a log looks before images are taken.
            done = name in ("fusion_sources", "fusion_nis")
            memory = self.memory_done(context) if done else self.memory_now(context)
            output.SetFromVector(self.shown(memory)[name])

        return write

    def shown(self, memory: Array) -> dict[str, RigidTransform | Array]:
        """What stands on the outputs but X_WP, from the whole memory after a control step."""
        X_WP, extra = self.parts_of(memory)
        parts = self._split(extra)
        belief = self._belief(X_WP, parts)
        begun = parts["clock"][1] != 0.0
        shown: dict[str, RigidTransform | Array] = {
            "fused_found": parts["knows"] if begun else np.zeros(1),
            "fusion_sources": parts["sources"],
            "fusion_nis": parts["nis"],
            "fusion_covariance": belief.pose_covariance.ravel() if begun else np.zeros(36),
            "X_CO_fused": RigidTransform(),
        }
        eye = self._task.on_board
        if eye is not None:
            shown["fused_marks"] = np.zeros(2 * eye.points.shape[1])
        if begun and belief.X_WO is not None:
            X_CO = (belief.X_WP @ belief.X_PC).inverse() @ belief.X_WO
            shown["X_CO_fused"] = X_CO
            p_C = X_CO @ eye.points if eye is not None else np.zeros((3, 0))
            if np.any(p_C[2] <= NEAREST):
                shown["fused_found"] = np.zeros(1)
            elif eye is not None:
                shown["fused_marks"] = eye.pinhole.project(p_C).T.ravel()
        return shown

    def belief(self, context: Context) -> FusedBelief:
        """What the filter believes after its last step, from this system's own context."""
        X_WP, extra = self.memory(context)
        return self._belief(X_WP, self._split(extra))

    def between(self, read: Read, X_WP: RigidTransform, elapsed: float) -> RigidTransform:
        """Moves on with the velocity that holds."""
        return X_WP @ exponential(read("platform_velocity") * elapsed)

    def advance(
        self, read: Read, X_WP: RigidTransform, extra: Array, elapsed: float
    ) -> tuple[RigidTransform, Array]:
        """Predicts to now, then takes in what is new."""
        parts = self._split(extra)
        now = parts["clock"][0] + elapsed
        parts["sources"][:] = NOTHING
        parts["nis"][:] = np.nan
        if parts["clock"][1] == 0.0:
            belief = self._begin(read, X_WP, parts)
        else:
            belief = remember_pose(self._belief(X_WP, parts))
            belief = self._move(read, belief, parts, elapsed)
        parts["clock"][:] = now, 1.0
        task = self._task
        if task.on_board is not None and task.on_board.used and read("found")[0] != 0.0:
            belief = self._look(read, belief, parts, "on_board", now)
        if task.external is not None and read("platform_tag_found")[0] != 0.0:
            belief = self._look(read, belief, parts, "external", now)
        if task.tuning.lengths:
            belief = self._count(read, belief, parts, elapsed)
        return belief.X_WP, self._packed(belief, parts)

    def _begin(self, read: Read, X_WP: RigidTransform, parts: dict[str, Array]) -> FusedBelief:
        """The belief before anything was read."""
        task, t = self._task, self._task.tuning
        imu, cables = task.imu, task.counted.cables
        none = np.zeros(6)
        prior = Prior(
            pose=_spread(t.start_rotation_deg, t.start_position),
            on_board=_spread(t.on_board_rotation_deg, t.on_board_position),
            external=_spread(t.external_rotation_deg, t.external_position),
            offsets=np.full(self._m, t.length_offset),
            biases=none
            if imu is None
            else np.repeat([imu.gyroscope_bias, imu.accelerometer_bias], 3),
        )
        if t.lengths:
            counted, tensions = read("measured_lengths"), read("measured_tensions")
            parts["reference"][:] = task.counted.reference(X_WP, counted, tensions)
            # How much cable is slack from the start nobody knows.
            slack = np.where(tensions < t.taut, t.lost_position, 0.0)
            prior = replace(prior, offsets=np.hypot(prior.offsets, slack))
        if imu is not None:
            parts["motion"][:] = read("inertial_motion")
        X_WE = RigidTransform() if task.X_WE is None else task.X_WE
        J = cable_paths(X_WP, cables).J
        belief = start_fusion(X_WP, task.X_PC, X_WE, prior, J, self._past)
        for name in ("on_board", "external"):
            parts[name][_IMAGE], parts[name][_REFUSED] = -1.0, ACCEPTED
        if task.X_WO is not None and t.told_object is not None:
            told = _spread(t.told_object.rotation_deg, t.told_object.position)
            belief = know_object(belief, task.X_WO, np.diag(told**2))
        return belief

    def _move(
        self, read: Read, belief: FusedBelief, parts: dict[str, Array], elapsed: float
    ) -> FusedBelief:
        """Moves on by what was asked for, or by what an IMU felt."""
        task, t = self._task, self._task.tuning
        V_P, imu = read("platform_velocity"), task.imu
        belief = drift_lengths(belief, np.full(self._m, t.length_drift**2 * elapsed))
        if imu is None or task.gravity is None:
            noise = _spread(t.angular_velocity_deg, t.velocity) ** 2
            return move(belief, V_P, elapsed, noise)
        motion = np.array(read("inertial_motion"))
        felt = motion_between(parts["motion"], motion, task.p_PS)
        parts["motion"][:] = motion
        if felt.elapsed <= 0.0:
            return belief
        noise = np.repeat([imu.gyroscope_noise**2, imu.accelerometer_noise**2], 3)
        walk = np.repeat([imu.gyroscope_walk**2, imu.accelerometer_walk**2], 3)
        belief = move_inertially(belief, felt, task.gravity, noise, walk)
        H, innovation = velocity_innovation(belief, V_P[3:])
        return correct(belief, H, innovation, t.asked_velocity**2 * np.eye(3))

    def _look(
        self, read: Read, belief: FusedBelief, parts: dict[str, Array], name: str, now: float
    ) -> FusedBelief:
        """The belief after a camera's image, if that is new, and after the depths beside it."""
        task, on_board = self._task, name == "on_board"
        eye = task.on_board if on_board else task.external
        assert eye is not None
        state, place = parts[name], SOURCES.index(name)
        seen = read("X_CO" if on_board else "X_CQ")
        number, age = eye.age(now)
        if number <= state[_IMAGE] or np.array_equal(pack_pose(seen), state[_SEEN]):
            return belief  # no noise is the same twice: a picture that stands still says nothing
        state[_IMAGE], state[_SEEN] = number, pack_pose(seen)
        steps = age * task.rate
        R = image_covariance(seen, eye.points, task.tuning.pixel, eye.focal)
        if on_board and belief.X_WO is None:
            parts["sources"][place] = USED
            return object_of_image(belief, seen, R, steps)
        if on_board:
            sight_of, calibration = partial(sight_on_board, steps=steps), ON_BOARD
        else:
            assert task.X_PQ is not None
            sight_of = partial(sight_external, X_PQ=task.X_PQ, steps=steps)
            calibration = EXTERNAL
        taken = take_image(
            belief, sight_of, (seen, R), calibration, self._gates, (state[_REFUSED], now)
        )
        state[_REFUSED] = taken.refused_since
        parts["sources"][place], parts["nis"][place] = taken.status, taken.nis
        if eye.depth is None or taken.status == REJECTED:
            return taken.belief
        depths, place = np.array(read(f"{name}_depths")), SOURCES.index(f"{name}_depth")
        deviations = eye.depth.noise + eye.depth.noise_per_square * depths**2
        deviations = np.maximum(deviations * task.tuning.depth_share, SUREST_DEPTH)
        taken = take_depths(taken.belief, sight_of, eye.points, depths, deviations, self._gates)
        parts["sources"][place], parts["nis"][place] = taken.status, taken.nis
        return taken.belief

    def _count(
        self, read: Read, belief: FusedBelief, parts: dict[str, Array], elapsed: float
    ) -> FusedBelief:
        """The belief after what winches count."""
        t, counted = self._task.tuning, self._task.counted
        tensions = read("measured_tensions")
        lengths = counted.lengths(read("measured_lengths"), parts["reference"], tensions)
        paths = cable_paths(belief.X_WP, counted.cables)
        measured = (*length_innovation(belief, lengths, paths.lengths, paths.J), t.length)
        taken, parts["refused"] = take_lengths(
            belief, measured, tensions >= t.taut, self._gates, parts["refused"], elapsed
        )
        place = SOURCES.index("lengths")
        parts["sources"][place], parts["nis"][place] = taken.status, taken.nis
        return taken.belief

    def _split(self, extra: Array) -> dict[str, Array]:
        """Copies of the parts of the memory, by their names."""
        ends = np.cumsum(list(self._sizes.values()))
        return dict(zip(self._sizes, np.split(extra.copy(), ends[:-1]), strict=True))

    def _belief(self, X_WP: RigidTransform, parts: dict[str, Array]) -> FusedBelief:
        """A belief from the parts of a memory."""
        size = COUNTED + self._m + 6 * self._past
        past = tuple(unpack_pose(row) for row in parts["past"].reshape(-1, 12))
        if parts["clock"][1] == 0.0:
            none = RigidTransform()
            return FusedBelief(
                X_WP, np.zeros(3), None, none, none, np.zeros(6), np.zeros(self._m), (),
                np.zeros((size, size)),
            )  # fmt: skip
        return FusedBelief(
            X_WP=X_WP,
            velocity=parts["velocity"],
            X_WO=unpack_pose(parts["X_WO"]) if parts["knows"][0] != 0.0 else None,
            X_PC=unpack_pose(parts["X_PC"]),
            X_WE=unpack_pose(parts["X_WE"]),
            biases=parts["biases"],
            offsets=parts["offsets"],
            past=past,
            covariance=parts["covariance"].reshape(size, size),
        )

    def _packed(self, belief: FusedBelief, parts: dict[str, Array]) -> Array:
        """The memory with a belief in it."""
        X_WO = belief.X_WO
        parts |= {
            "velocity": belief.velocity,
            "knows": np.array([0.0 if X_WO is None else 1.0]),
            "X_WO": np.zeros(12) if X_WO is None else pack_pose(X_WO),
            "X_PC": pack_pose(belief.X_PC),
            "X_WE": pack_pose(belief.X_WE),
            "biases": belief.biases,
            "offsets": belief.offsets,
            "past": np.array([pack_pose(X) for X in belief.past]).ravel(),
            "covariance": belief.covariance.ravel(),
        }
        return np.concatenate([parts[name] for name in self._sizes])


def motion_between(before: Array, after: Array, p_PS: Array) -> Increments:
    """What the platform's origin felt between two motions of an IMU at p_PS, shape (3,) [m].

    The motions since the start, shape (19,) each, hold the rotation row by row, velocity [m/s] and
    position [m] of So without gravity, angular velocity in P [rad/s], and the time [s]; see
    `perception.InertialMotion`.
    """
    R0, R1 = (values[:9].reshape(3, 3) for values in (before, after))
    elapsed = float(after[18] - before[18])
    velocity = R0.T @ (after[9:12] - before[9:12])
    position = R0.T @ (after[12:15] - before[12:15] - before[9:12] * elapsed)
    turn = RotationMatrix.ProjectToRotationMatrix(R0.T @ R1)
    # So goes round Po: v_S = v_P + w x r.
    round_before, round_after = (np.cross(values[15:18], p_PS) for values in (before, after))
    velocity -= turn.matrix() @ round_after - round_before
    position -= turn.matrix() @ p_PS - p_PS - round_before * elapsed
    return Increments(turn, velocity, position, elapsed)


def _spread(rotation_deg: float, translation: float) -> Array:
    """Standard deviations of a twist, shape (6,) [rad, m]."""
    return np.repeat([float(np.radians(rotation_deg)), translation], 3)
