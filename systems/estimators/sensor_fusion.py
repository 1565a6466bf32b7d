"""Estimates the platform's pose from both cameras, lengths and an IMU, and says which it used."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.camera_miscalibration import (
    Answer,
    answers,
    calibration_verdicts,
    mixture,
)
from cdpr_drake.estimation.pose_filter import image_covariance
from cdpr_drake.estimation.sensor_filter import (
    COUNTED,
    EXTERNAL,
    ON_BOARD,
    FusedBelief,
    correct,
    drift_lengths,
    know_object,
    move,
    move_inertially,
    remember_pose,
    start_fusion,
)
from cdpr_drake.estimation.sensor_models import (
    Look,
    image_innovation,
    length_innovation,
    motion_between,
    object_of_image,
    sight_external,
    sight_on_board,
    velocity_innovation,
)
from cdpr_drake.estimation.source_gates import (
    ACCEPTED,
    NOTHING,
    REJECTED,
    USED,
    Gates,
    take_depths,
    take_image,
    take_lengths,
)
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential
from cdpr_drake.systems.estimators.fusion_task import FusionTask, inertial_variances, spread
from cdpr_drake.systems.estimators.pose_estimator import PoseEstimator, Read, pack_pose, unpack_pose

SOURCES = ("on_board", "external", "lengths", "on_board_depth", "external_depth")
"""What the filter may use, in the order of its outputs."""

_IMAGE, _SEEN, _REFUSED = 0, slice(1, 13), 13
"""Memory of a camera: number of its last image, what that showed, since when it is left out."""

CALIBRATION_SIZE = 30
"""Numbers that say what is found of both calibrations."""

NEAREST = 1e-3
"""What is nearer to the camera is not seen by anybody [m]."""

MOTION_SIZE = 19
"""Numbers of an IMU's motion since the start, see `InertialMotion`."""


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
    fusion_calibration     vector(30)     -, rad,  out, `CalibrationVerdict.row` of the camera on
                                          m        board, then of that in the world
    ====================== ============== ======== ===========================================

    An image counts once, at the pose of the time at which it was taken. What is less likely than
    the gate allows is left out; a source that is left out for longer than the patience is believed
    to be out of calibration, which is then found anew with what the others say.

    Where a camera's calibration is doubted, poses are means over all answers to which cameras are
    worse than told, and covariances have what these differ by, see
    `estimation.camera_miscalibration`.
    """

    def __init__(self, task: FusionTask) -> None:
        """With a task."""
        self._task = task
        tuning, eyes = task.tuning, (task.on_board, task.external)
        self._m = task.counted.cables.count
        self._past = max((eye.past(task.rate) for eye in eyes if eye is not None), default=0)
        lost = spread(tuning.lost_rotation_deg, tuning.lost_position)
        self._cameras = task.calibrations()
        self._gates = Gates(tuning.gate, tuning.patience, lost)
        n, m = self._past, self._m
        self._sizes = {
            "clock": 2, "velocity": 3, "knows": 1, "X_WO": 12, "X_PC": 12, "X_WE": 12,
            "biases": 6, "offsets": m, "past": 12 * n, "reference": m, "motion": MOTION_SIZE,
            "on_board": 14, "external": 14, "refused": m, "sources": 5, "nis": 5,
            "covariance": (COUNTED + m + 6 * n) ** 2, "X_WP": 12, "settled": 1, "wrong": 2,
            "X_CO_mixed": 12, "covariance_mixed": 36, "calibration": CALIBRATION_SIZE,
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
        sizes = {
            "fused_found": 1, "fusion_sources": 5, "fusion_nis": 5, "fusion_covariance": 36,
            "fusion_calibration": CALIBRATION_SIZE,
        }  # fmt: skip
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
        parts = self._split(self.parts_of(memory)[1])
        begun = parts["clock"][1] != 0.0
        shown: dict[str, RigidTransform | Array] = {
            "fused_found": parts["knows"] if begun else np.zeros(1),
            "fusion_sources": parts["sources"],
            "fusion_nis": parts["nis"],
            "fusion_covariance": parts["covariance_mixed"],
            "fusion_calibration": parts["calibration"],
            "X_CO_fused": RigidTransform(),
        }
        eye = self._task.on_board
        if eye is not None:
            shown["fused_marks"] = np.zeros(2 * eye.points.shape[1])
        if begun and parts["knows"][0] != 0.0:
            X_CO = unpack_pose(parts["X_CO_mixed"])
            shown["X_CO_fused"] = X_CO
            p_C = X_CO @ eye.points if eye is not None else np.zeros((3, 0))
            if np.any(p_C[2] <= NEAREST):
                shown["fused_found"] = np.zeros(1)
            elif eye is not None:
                shown["fused_marks"] = eye.pinhole.ideal.project(p_C).T.ravel()
        return shown

    def belief(self, context: Context) -> FusedBelief:
        """What the filter believes after its last step, from this system's own context."""
        _, extra = self.memory(context)
        parts = self._split(extra)
        return mixture(self._answers(self._belief(parts), parts))

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
            belief = remember_pose(self._belief(parts))
            belief = self._move(read, belief, parts, elapsed)
        parts["clock"][:] = now, 1.0
        task = self._task
        if task.on_board is not None and task.on_board.used and read("found")[0] != 0.0:
            belief = self._look(read, belief, parts, "on_board", now)
        if task.external is not None and read("platform_tag_found")[0] != 0.0:
            belief = self._look(read, belief, parts, "external", now)
        if task.tuning.lengths:
            belief = self._count(read, belief, parts, elapsed)
        found = self._answers(belief, parts)
        whole = mixture(found)
        parts["covariance_mixed"][:] = whole.pose_covariance.ravel()
        if whole.X_WO is not None:
            X_CO = (whole.X_WP @ whole.X_PC).inverse() @ whole.X_WO
            parts["X_CO_mixed"][:] = pack_pose(X_CO)
        parts["calibration"][:] = self._judged_rows(found, parts).ravel()
        return whole.X_WP, self._packed(belief, parts)

    def _answers(self, belief: FusedBelief, parts: dict[str, Array]) -> list[Answer]:
        """What is believed under each answer to which cameras are worse than told; one answer once
        that is settled."""
        if parts["settled"][0] != 0.0:
            return [Answer((False, False), 1.0, belief)]
        return answers(belief, self._cameras)

    def _judged_rows(self, found: list[Answer], parts: dict[str, Array]) -> Array:
        """What is found of both calibrations, NaN of a camera that is not read, shape (2, 15)."""
        rows = np.array([one.row() for one in calibration_verdicts(found, self._cameras)])
        if parts["settled"][0] != 0.0:
            rows[:, 0] = parts["wrong"]
        for row, eye in zip(rows, (self._task.on_board, self._task.external), strict=True):
            if eye is None or not eye.used:
                row[:] = np.nan
        return rows

    def _begin(self, read: Read, X_WP: RigidTransform, parts: dict[str, Array]) -> FusedBelief:
        """The belief before anything was read."""
        task, t = self._task, self._task.tuning
        imu, cables, slack = task.imu, task.counted.cables, np.zeros(self._m)
        if t.lengths:
            counted, tensions = read("measured_lengths"), read("measured_tensions")
            parts["reference"][:] = task.counted.reference(X_WP, counted, tensions)
            # How much cable is slack from the start nobody knows.
            slack = np.where(tensions < t.taut, t.lost_position, 0.0)
        if imu is not None:
            parts["motion"][:] = read("inertial_motion")
        X_PC, X_WE = (camera.X for camera in self._cameras)
        J = cable_paths(X_WP, cables).J
        belief = start_fusion(X_WP, X_PC, X_WE, task.prior(slack), J, self._past)
        for name in ("on_board", "external"):
            parts[name][_IMAGE], parts[name][_REFUSED] = -1.0, ACCEPTED
        if task.X_WO is not None and t.told_object is not None:
            told = spread(t.told_object.rotation_deg, t.told_object.position)
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
            noise = spread(t.angular_velocity_deg, t.velocity) ** 2
            return move(belief, V_P, elapsed, noise)
        motion = np.array(read("inertial_motion"))
        felt = motion_between(parts["motion"], motion, task.p_PS)
        parts["motion"][:] = motion
        if felt.elapsed <= 0.0:
            return belief
        belief = move_inertially(belief, felt, task.gravity, *inertial_variances(imu))
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
        pixel = task.tuning.pixel
        if on_board and belief.X_WO is None:
            R = image_covariance(seen, eye.points, pixel, eye.focal)
            parts["sources"][place] = USED
            return object_of_image(belief, seen, R, steps)
        if on_board:
            sight_of, calibration = partial(sight_on_board, steps=steps), ON_BOARD
        else:
            assert task.X_PQ is not None
            sight_of = partial(sight_external, X_PQ=task.X_PQ, steps=steps)
            calibration = EXTERNAL
        read_image = partial(image_innovation, look=Look(seen, eye.points, pixel / eye.focal))
        since = state[_REFUSED], now
        taken = take_image(belief, sight_of, read_image, calibration, self._gates, since)
        if taken.anew:
            # What was told of it is forgotten, so nothing can be weighed by that any longer.
            found = self._answers(belief, parts)
            taken = take_image(
                mixture(found), sight_of, read_image, calibration, self._gates, since
            )
            if parts["settled"][0] == 0.0:
                parts["wrong"][:] = [
                    one.probability for one in calibration_verdicts(found, self._cameras)
                ]
            parts["settled"][:], parts["wrong"][place] = 1.0, 1.0
        state[_REFUSED] = taken.refused_since
        parts["sources"][place], parts["nis"][place] = taken.status, taken.nis
        if eye.depth is None or taken.status == REJECTED:
            return taken.belief
        depths, place = np.array(read(f"{name}_depths")), SOURCES.index(f"{name}_depth")
        deviations = eye.depth_deviations(depths, task.tuning.depth_share)
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

    def _belief(self, parts: dict[str, Array]) -> FusedBelief:
        """The filter's belief from the parts of a memory, before answers are weighed."""
        size = COUNTED + self._m + 6 * self._past
        past = tuple(unpack_pose(row) for row in parts["past"].reshape(-1, 12))
        return FusedBelief(
            X_WP=unpack_pose(parts["X_WP"]),
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
            "X_WP": pack_pose(belief.X_WP),
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
