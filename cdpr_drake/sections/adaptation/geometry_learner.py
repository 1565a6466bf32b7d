"""The block that learns exit and anchor points while a servo runs.

`recursive_calibration` does the learning; a criterion is asked before the servo gets a model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.sections.adaptation.recursive_calibration import (
    CORNER_ROWS,
    Learnt,
    Look,
    RecursiveCalibration,
)
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

if TYPE_CHECKING:
    from cdpr_drake.sections.adaptation.section import Adaptation

LEARNT, LEARNT_SIGMA, BELIEVED_POINTS = "learnt", "learnt_sigma", "believed_points"
ADAPTATION, DOUBTED, OPEN_FRAMES = "adaptation", "doubted_measurements", "open_frames"

ADAPTATION_PARTS = (
    "stations", "refused", "excited", "scatter", "surprise",
    "models_believed", "models_rejected", "margin_offered", "margin_before",
)  # fmt: skip
"""Numbers of the output `adaptation`."""


@dataclass(frozen=True, eq=False)
class Offer:
    """A model that is offered to the servo, and what it is judged by.

    Attributes:
        points: Exit and anchor points that are offered, shape (2, m, 3) [m].
        before: Those that the servo goes by, shape (2, m, 3) [m].
        robots: Points of robots that may be true, shape (n, 2, m, 3) [m].
        X_WP: Pose of the platform by what was learnt [m].
        X_WP_estimated: The servo's [m].
        X_PC: Camera on the platform by what was learnt [m].
        X_WO: Target by what was learnt [m].
    """

    points: Array
    before: Array
    robots: Array
    X_WP: RigidTransform
    X_WP_estimated: RigidTransform
    X_PC: RigidTransform
    X_WO: RigidTransform


Judge = Callable[[Offer], tuple[float, float]]
"""Worst margins over the robots of what is offered and of what the servo goes by."""


class GeometryLearner(LeafSystem):
    """Learns points from images and lengths, and offers them to a servo.

    ==================== ============== ==== =================================================
    port                 type           unit meaning
    ==================== ============== ==== =================================================
    X_CO                 RigidTransform m    in, measured pose of the target in the camera
    found                vector(1)      -    in, 1 while the target is seen
    corners              vector(8)      px   in, its corners
    measured_lengths     vector(m)      m    in, unstrained lengths that the encoders count
    measured_tensions    vector(m)      N    in
    X_WP                 RigidTransform m    in, the servo's estimate of the platform's pose
    believed_points      vector(6 m)    m    out, exit points in W cable by cable, then anchor
                                             points in P, that the servo shall go by
    learnt               vector(7 m)    m    out, the same as learnt, then by how much each length
                                             at the start was beyond the believed one
    learnt_sigma         vector(7 m)    m    out, standard deviations
    adaptation           vector(9)      -    out, see `ADAPTATION_PARTS`
    doubted_measurements vector(m + 8)  -    out, how often each length and each coordinate of a
                                             corner was dropped
    open_frames          vector(12)     -    out, share of each motion of a frame that was not
                                             excited, as `identifiability.FRAMES`
    ==================== ============== ==== =================================================

    Discrete updates at the rate of the camera. Images that come late are put beside the lengths of
    their instant.
    """

    def __init__(
        self,
        settings: Adaptation,
        learner: RecursiveCalibration,
        camera: tuple[PointTarget, Pinhole],
        rate: float,
        *,
        latency_frames: int,
        believed: Array,
        judge: Judge,
        seed: int,
    ) -> None:
        """For one servo.

        Args:
            settings: The section.
            learner: What learns.
            camera: The target, with four corners, and the camera's intrinsic parameters.
            rate: Images per second [Hz].
            latency_frames: By how many images these come late.
            believed: Points that are believed at the start, shape (2, m, 3) [m].
            judge: Asked before the servo gets a model.
            seed: Of the robots that may be true.
        """
        super().__init__()
        m = self._m = learner.count
        self._settings, self._learner, self._judge = settings, learner, judge
        self._target, self._pinhole = camera
        self._rate, self._late, self._seed = rate, latency_frames, seed
        for name in ("X_CO", "X_WP"):
            self.DeclareAbstractInputPort(name, Value(RigidTransform()))
        for name, size in (
            ("found", 1), (self._target.mark, self._target.size),
            ("measured_lengths", m), ("measured_tensions", m),
        ):  # fmt: skip
            self.DeclareVectorInputPort(name, size)
        self._memory = self.DeclareDiscreteState(learner.start())
        self._believed = self.DeclareDiscreteState(np.asarray(believed, float).ravel())
        # Models believed and rejected, margins of the last offer, time of the next [s].
        self._offers = self.DeclareDiscreteState(np.array([0.0, 0.0, np.nan, np.nan, 0.0]))
        self._readings = self.DeclareDiscreteState(np.full(2 * m * (latency_frames + 1), np.nan))
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        self.DeclareForcedDiscreteUpdateEvent(self._update)
        self.DeclareStateOutputPort(BELIEVED_POINTS, self._believed)
        ticket = {self.discrete_state_ticket(self._memory)}
        both = ticket | {self.discrete_state_ticket(self._offers)}
        for name, size, calc, tickets in (
            (LEARNT, 7 * m, self._calc_learnt, ticket),
            (LEARNT_SIGMA, 7 * m, self._calc_sigma, ticket),
            (ADAPTATION, len(ADAPTATION_PARTS), self._calc_parts, both),
            (DOUBTED, m + CORNER_ROWS, self._calc_doubted, ticket),
            (OPEN_FRAMES, 12, self._calc_frames, ticket),
        ):
            self.DeclareVectorOutputPort(name, size, calc, tickets)

    def learnt(self, context: Context) -> Learnt:
        """What is known, from this block's own context."""
        return self._learner.learnt(self._remembered(context))

    def _remembered(self, context: Context) -> Array:
        return np.asarray(context.get_discrete_state(self._memory).value())

    def _update(self, context: Context, state: DiscreteValues) -> None:
        def read(name: str) -> Array:
            return np.array(self.GetInputPort(name).Eval(context))

        held = np.array(context.get_discrete_state(self._readings).value())
        width = 2 * self._m
        held[width:] = held[:-width].copy()
        held[:width] = np.concatenate([read("measured_lengths"), read("measured_tensions")])
        state.set_value(self._readings, held)
        lengths, tensions = held[-width:].reshape(2, -1)
        if read("found")[0] == 0.0 or np.isnan(lengths).any():
            return
        X_CO = self.GetInputPort("X_CO").Eval(context)
        xy = self._target.normalized(read(self._target.mark), self._pinhole).T
        memory, _ = self._learner.take(self._remembered(context), Look(X_CO, xy, lengths, tensions))
        state.set_value(self._memory, memory)
        offers = np.array(context.get_discrete_state(self._offers).value())
        time = context.get_time()
        if not self._settings.believe or time < offers[4] - 0.5 / self._rate:
            return
        before = np.array(context.get_discrete_state(self._believed).value())
        points = self._points(self._learner.learnt(memory))
        offers[4] = time + self._settings.period
        if not np.array_equal(points, before):
            X_WP = self.GetInputPort("X_WP").Eval(context)
            offer = self._offer(memory, before, X_CO, X_WP, round(time * self._rate))
            offers[2:4] = self._judge(offer)
            wanted = max(self._settings.margin, offers[3] - self._settings.margin_loss)
            good = offers[2] > self._settings.margin and offers[2] >= wanted
            offers[0 if good else 1] += 1.0
            if good:
                state.set_value(self._believed, points)
        state.set_value(self._offers, offers)

    def _points(self, learnt: Learnt) -> Array:
        return np.concatenate([learnt.p_WA.T.ravel(), learnt.p_PB.T.ravel()])

    def _offer(
        self,
        memory: Array,
        before: Array,
        X_CO: RigidTransform,
        X_WP: RigidTransform,
        number: int,
    ) -> Offer:
        """The model of a memory, and robots by its covariance."""
        learner, m = self._learner, self._m
        known = learner.learnt(memory)
        points, count = self._points(known), 6 * m
        values, V = np.linalg.eigh(known.covariance[:count, :count])
        random = np.random.default_rng([self._seed, number])
        noise = random.standard_normal((self._settings.samples, count))
        robots = points + noise @ (V * np.sqrt(np.maximum(values, 0.0))).T
        return Offer(
            points.reshape(2, m, 3), before.reshape(2, m, 3), robots.reshape(-1, 2, m, 3),
            learner.pose(memory, X_CO), X_WP, learner.camera(memory), learner.tag(memory),
        )  # fmt: skip

    def _calc_learnt(self, context: Context, output: BasicVector) -> None:
        known = self.learnt(context)
        output.SetFromVector(np.concatenate([self._points(known), known.offsets]))

    def _calc_sigma(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.learnt(context).sigma)

    def _calc_parts(self, context: Context, output: BasicVector) -> None:
        memory = self._remembered(context)
        known = self._learner.learnt(memory)
        stations, refused = self._learner.counts(memory)[:2]
        offers = context.get_discrete_state(self._offers).value()
        output.SetFromVector(np.array([
            stations, refused, known.excited, known.scatter, self._learner.surprise(memory),
            *offers[:4],
        ]))  # fmt: skip

    def _calc_doubted(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._learner.counts(self._remembered(context))[2:])

    def _calc_frames(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._learner.open_frames(self._remembered(context)))
