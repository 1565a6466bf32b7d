"""The phases of picking and placing, with a platform that goes at once where it shall."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.systems.pick_and_place.pick_and_place_task import (
    Failure,
    Phase,
    PickAndPlaceGeometry,
    PickAndPlaceRules,
    PickAndPlaceState,
    PickAndPlaceTask,
    Reading,
)

PERIOD = 0.1
WEIGHT = 3.0
LIMIT = 400
"""Steps after which a task that has not ended never will."""

EXACT = 1e-9
"""Sums of a few poses in double precision [m, rad]."""


def flat(x: float, y: float, z: float, yaw: float = 0.0) -> RigidTransform:
    return RigidTransform(RollPitchYaw(0.0, 0.0, yaw), [x, y, z])


DOWN = RigidTransform(RollPitchYaw(0.0, np.pi, 0.0), [-0.06, 0.0, 0.01])

GEOMETRY = PickAndPlaceGeometry(
    X_BO=flat(-0.06, 0.0, 0.01), X_BP=flat(0.0, 0.0, 0.09), X_GT=flat(0.0, 0.085, -0.01),
    X_PC_object=DOWN, X_PC_goal=flat(0.0, 0.15, 0.0) @ DOWN,
    X_WB=flat(0.0, 0.0, 0.1), X_WG=flat(0.3, 0.1, 0.1), weight=WEIGHT,
)  # fmt: skip

RULES = PickAndPlaceRules(
    hover=0.08, distance=5e-4, angle=0.01, hold=0.2, passing_distance=2e-3, fresh=0.25, blind=2.0,
    pause=0.2, phase_limit=30.0, smoothing=0.1, period=PERIOD,
)  # fmt: skip


class World:
    """Where box and goal truly are, and what cameras and gripper tell of them."""

    def __init__(self, drift: RigidTransform | None = None) -> None:
        self.X_WB, self.X_WG = flat(0.01, -0.02, 0.1, 0.1), flat(0.31, 0.09, 0.1, -0.2)
        self.drift = drift or RigidTransform()
        self.X_WP = flat(0.0, 0.0, 0.4)
        self.X_PB: RigidTransform | None = None
        self.seen: tuple[RigidTransform | None, RigidTransform | None] = (None, None)
        self.holding = True
        self.hidden: tuple[Phase, float] | None = None

    def estimate(self) -> RigidTransform:
        return self.drift @ self.X_WP

    def reading(self, time: float, state: PickAndPlaceState) -> Reading:
        closed = state.phase in (Phase.GRASP, Phase.LIFT, Phase.CARRY, Phase.LOWER)
        if state.phase is Phase.GRASP and self.X_PB is None:
            self.X_PB = self.X_WP.inverse() @ self.X_WB
        if self.X_PB is not None and closed:
            self.X_WB = self.X_WP @ self.X_PB
        low = self.X_WB.translation()[2] <= 0.1 + EXACT
        seen, self.seen = self.seen, self._look()
        hides = self.hidden is not None and state.phase is self.hidden[0]
        if hides and time - state.began < self.hidden[1]:
            seen = (None, None)
        return Reading(
            time, self.estimate(), *seen, closed and self.holding, 0.0 if low else WEIGHT
        )

    def _look(self) -> tuple[RigidTransform, RigidTransform]:
        cameras = (self.X_WP @ GEOMETRY.X_PC_object, self.X_WP @ GEOMETRY.X_PC_goal)
        tags = (self.X_WB @ GEOMETRY.X_BO, self.X_WG @ GEOMETRY.X_GT)
        return tuple(C.inverse() @ T for C, T in zip(cameras, tags, strict=True))


def play(
    world: World, rules: PickAndPlaceRules = RULES
) -> tuple[PickAndPlaceState, list[Phase], World]:
    """Steps until the task has ended; the platform is after each step where it shall be."""
    task = PickAndPlaceTask(GEOMETRY, rules)
    state = task.start(world.estimate())
    phases = [state.phase]
    for step in range(LIMIT):
        state = task.step(state, world.reading(step * PERIOD, state))
        if state.phase is not phases[-1]:
            phases.append(state.phase)
        if state.phase in (Phase.DONE, Phase.FAILED):
            return state, phases, world
        aim = task.aim(state)
        if aim is not None:
            world.X_WP = world.drift.inverse() @ aim
    raise AssertionError(f"still in {state.phase}")


def test_all_phases_come_in_their_order_and_the_box_lies_at_the_goal():
    state, phases, world = play(World())
    assert phases == [phase for phase in Phase if phase is not Phase.FAILED]
    distance, angle = pose_error(world.X_WG, world.X_WB)
    # It is lowered a millimetre further than the goal, so that it stands; here nothing stops it.
    assert distance == pytest.approx(1e-3, abs=1e-6)
    assert angle < EXACT
    assert state.losses == 0.0


def test_an_error_of_dead_reckoning_does_not_count_while_tags_are_seen():
    drift = flat(0.02, -0.01, 0.0, 0.05)
    _, _, world = play(World(drift))
    off = (world.X_WG.inverse() @ world.X_WB).translation()
    assert np.linalg.norm(off[:2]) < EXACT


def test_a_carry_goes_on_blind_but_does_not_end_so():
    world = World()
    world.hidden = (Phase.CARRY, 1.5)
    _, phases, world = play(world)
    assert phases[-1] is Phase.DONE
    assert pose_error(world.X_WG, world.X_WB)[0] == pytest.approx(1e-3, abs=1e-6)


@pytest.mark.parametrize("phase", [Phase.APPROACH, Phase.DESCEND, Phase.CARRY, Phase.LOWER])
def test_a_tag_that_stays_hidden_ends_the_task_with_its_phase(phase):
    world = World()
    world.hidden = (phase, np.inf)
    state, _, _ = play(world)
    assert (state.failure, state.failed_in) == (Failure.TAG_NOT_SEEN, phase)
    assert state.time - state.began == 0.0


def test_a_view_that_is_lost_and_found_is_counted():
    task = PickAndPlaceTask(GEOMETRY, RULES)
    world = World()
    state = task.start(world.estimate())
    for step in range(12):
        reading = world.reading(step * PERIOD, state)
        if 4 <= step < 9:
            reading = replace(reading, X_CO=None)
        state = task.step(state, reading)
    assert state.losses == 1.0
    # Seen last at 0.3 s, again at 0.9 s; the step of the return counts no more.
    assert state.blind_time == pytest.approx(0.5)


def test_a_gripper_that_holds_nothing_or_loses_the_box_ends_the_task():
    world = World()
    world.holding = False
    state, _, _ = play(world)
    assert (state.failure, state.failed_in) == (Failure.NOT_GRASPED, Phase.GRASP)

    class Slippery(World):
        def reading(self, time, state):
            return replace(super().reading(time, state), holding=state.phase is not Phase.CARRY)

    state, _, _ = play(Slippery())
    assert (state.failure, state.failed_in) == (Failure.DROPPED, Phase.CARRY)


def test_a_phase_that_takes_too_long_ends_the_task():
    state, _, _ = play(World(), replace(RULES, phase_limit=0.15, hold=0.3))
    assert (state.failure, state.failed_in) == (Failure.TOO_LONG, Phase.APPROACH)


def test_a_state_is_the_numbers_that_it_is_kept_as():
    state, _, _ = play(World())
    again = PickAndPlaceState.unpacked(state.packed())
    np.testing.assert_allclose(again.packed(), state.packed(), rtol=0.0, atol=1e-15)
    assert (again.phase, again.failed_in, again.failure) == (Phase.DONE, Phase.DONE, Failure.NONE)
