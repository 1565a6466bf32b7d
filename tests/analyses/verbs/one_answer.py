"""Can a robot be held at a pose? Asked of every call that can answer it.

`python -m tests.analyses.verbs.one_answer [--pulleys-ignored]` prints the table of calls and
robots.
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import angles_from_rotation, pose_error, pose_from_angles
from cdpr_drake.models.robot_holding import rest_as_long
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.studio.pose_answer import PoseAnswer, RobotQuestions
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid

EDGE = 1e-4
"""Poses near the edge are so far from it, on both sides [m]."""

SHORT = 1e-3
"""Length of the planned motion that begins at a pose [m]."""

SAME_POSE = 1e-6
"""A rest so near is the one at the pose [m, rad]."""

SAGGING = "sagging cables"
"""Cables of the robot file that sag have weight, and are asked for more tension than the least."""

REASONS = {
    "few searches": r"not proven to be all|found in \d+ searches",
    "shared winch": r"several cables on a winch|several cables on one winch",
    "kind of motion": r"accepted by a plan|robot .*: motion: found|accepted for workspaces: motions"
    r"|motion: found .* accepted",
    "fewer cables": r"for \d degrees of freedom; accepted: at least|fewer cannot follow",
    "more than 8 cables": r"accepted: 1 to 8 cables",
    "exit point in platform": r"reaches into the platform",
    SAGGING: r"with at least [\d.]+ times its own in each",
}
"""Why a call answers otherwise, or not at all, by the words that its result or refusal has."""


@dataclass(frozen=True)
class Answer:
    """What a call says of a pose.

    Attributes:
        held: Whether the platform can be held; None: that is not said.
        words: Why it cannot, or what the call refuses.
        geometry: What the result says of pulleys.
    """

    held: bool | None
    words: str = ""
    geometry: str = ""

    def reason(self) -> str:
        """The first of `REASONS` in the words; empty: none."""
        found = (name for name, known in REASONS.items() if re.search(known, self.words))
        return next(found, "")


def poses_of(robot, seed=0, count=10):
    """Level poses over most of the frame, and at both sides of the edge of what is held, as X_WP.

    With fewer cables than degrees of freedom: poses of rest instead of those at the edge.
    """
    rng = np.random.default_rng([seed, len(robot.cables)])
    lower, upper = (np.array(corner, float) for corner in robot.reach())
    home, size = robot.home.transform(), upper - lower
    axes = []
    for k, points in zip(range(3), (2, 2, 1), strict=True):
        middle = float(home.translation()[k])
        if size[k] <= 0.0:
            axes.append([lower[k]])
            continue
        span = np.sort(rng.uniform(0.08, 0.92, points))
        span[points // 2] = (middle - lower[k]) / size[k]  # the home position is one of them
        axes.append(lower[k] + size[k] * np.unique(np.clip(span, 0.01, 0.99)))
    grid = WorkspaceGrid(tuple(np.array(a) for a in axes), np.zeros((1, 3)))
    found = [pose_from_angles(p, np.zeros(3)) for p in grid.positions()]
    if robot.is_underactuated():
        return found + rest_poses(robot, home, rng, count - grid.size)
    more = edge_poses(robot, home, lower, upper, rng, count - grid.size)
    return found + [pose_from_angles(p, np.zeros(3)) for p in more]


def rest_poses(robot, home, rng, count):
    """Where the platform rests on cables as long as their paths at places round home."""
    found, size = [], 0.1 * (robot.frame.upper - robot.frame.lower)
    while len(found) < count:
        X_WP = pose_from_angles(home.translation() + rng.uniform(-size, size), np.zeros(3))
        try:
            found.append(rest_as_long(robot, X_WP, robot.cable_set(), "elastic")[0])
        except CdprError:
            continue
    return found


def edge_poses(robot, home, lower, upper, rng, count):
    """Poses `EDGE` inside and outside of where tensions hold the level platform."""
    X_home = pose_from_angles(home.translation(), np.zeros(3))

    def held(p):
        try:
            return solvable(robot, pose_from_angles(p, np.zeros(3)))
        except CdprError:
            return False

    found = []
    for _ in range(200):
        if len(found) >= count or not held(X_home.translation()):
            break
        near, far = X_home.translation(), rng.uniform(lower, upper)
        if held(far):
            continue
        while np.linalg.norm(far - near) > EDGE / 10:
            middle = 0.5 * (near + far)
            near, far = (middle, far) if held(middle) else (near, middle)
        away = (far - X_home.translation()) / np.linalg.norm(far - X_home.translation())
        found += [near - EDGE * away, far + EDGE * away]
    return [np.clip(p, lower, upper) for p in found[:count]]


def solvable(robot, X_WP):
    """Whether the exact program finds tensions, over the robot's pulleys."""
    if robot.is_underactuated():
        return cdpr.solve_tensions(robot, X_WP).status == "feasible"
    return exact_tensions(tension_problem(robot, X_WP)) is not None


def grid_at(X_WP):
    """The grid of one pose."""
    angles = angles_from_rotation(X_WP.rotation())
    return WorkspaceGrid(tuple(np.array([x]) for x in X_WP.translation()), angles[np.newaxis])


def refused(ask):
    """The answer of a call, or its refusal."""
    try:
        return ask()
    except CdprError as problem:
        words = str(problem)
        says_no = re.search(r"no tensions|cannot hold|does not rest|no motion", words)
        return Answer(False if says_no else None, words)


def by_tensions(robot, X_WP, pulleys):
    result = cdpr.solve_tensions(robot, X_WP, pulleys=pulleys)
    return Answer(result.status == "feasible", str(result), result.as_dict()["geometry"])


def by_static(robot, X_WP, pulleys):
    result = cdpr.solve_static(robot, X_WP, pulleys=pulleys)
    return Answer(True, "", result.as_dict()["geometry"])


def by_workspace(robot, X_WP, pulleys):
    result = cdpr.compute_workspace(robot, "static", grid_at(X_WP), pulleys=pulleys, workers=1)
    return Answer(bool(result.inside().all()), "", result.as_dict()["geometry"])


def by_stability(robot, X_WP, pulleys):
    result = cdpr.assess_stability(
        robot, verdict="sampled", grid=grid_at(X_WP), pulleys=pulleys, draws=1
    )
    return Answer(bool(result.inside("S").all()), "", result.as_dict()["geometry"])


def by_plan(robot, X_WP, pulleys):
    """A plan that begins at the pose and goes a way towards home, or away from there."""
    p, home = X_WP.translation(), robot.home.transform().translation()
    way = home - p
    if np.linalg.norm(way) < SHORT:
        way = np.eye(3)[np.argmax(robot.reach()[1] > robot.reach()[0])]
    there = RigidTransform(X_WP.rotation(), p + SHORT * way / np.linalg.norm(way))
    result = cdpr.plan_path(
        robot, [X_WP, there], reserve=0.0, corners="rest", stations=10, pulleys=pulleys
    )
    return Answer(True, "", result.as_dict()["geometry"])


def by_equilibria(robot, X_WP, pulleys):
    """Whether the platform rests at the pose on the lengths that `solve_static` gives there."""
    l0 = cdpr.solve_static(robot, X_WP, pulleys=pulleys).l0
    result = cdpr.find_equilibria(robot, l0, model="elastic", pulleys=pulleys, searches=2)
    there = [one for one in result.rests if max(pose_error(one.X_WP, X_WP)) < SAME_POSE]
    return Answer(True if there else None, result.lines()[0], result.as_dict()["geometry"])


def by_studio(robot, X_WP, pulleys):
    assert pulleys
    answer = PoseAnswer(RobotQuestions(robot), X_WP)
    told = {answer.status == "feasible", answer.rest is not None}
    words = f"{answer.why_no_tensions} {answer.why_no_rest}"
    return Answer(told.pop() if len(told) == 1 else None, words, answer.geometry)


CALLS = {
    "solve_tensions": by_tensions, "solve_static": by_static, "compute_workspace": by_workspace,
    "find_equilibria": by_equilibria, "plan_path": by_plan, "assess_stability": by_stability,
    "studio": by_studio,
}  # fmt: skip


def answers_at(robot, X_WP, pulleys=True):
    """The answer of each call at a pose; the studio has no way to ignore pulleys."""
    return {
        name: refused(lambda call=call: call(robot, X_WP, pulleys))
        for name, call in CALLS.items()
        if pulleys or name != "studio"
    }


def agreement(name, pulleys=True):
    """For each call what it answers beside `solve_tensions`, counted, and what has no reason."""
    robot = load_robot(name)
    counts = {call: Counter() for call in CALLS}
    silent = []
    for X_WP in poses_of(robot):
        answers = answers_at(robot, X_WP, pulleys)
        held = answers["solve_tensions"].held
        for call, answer in answers.items():
            if answer.geometry and not answer.geometry.startswith(robot.geometry_words(pulleys)):
                counts[call]["OTHER GEOMETRY"] += 1
                silent.append((call, X_WP.translation().tolist(), held, answer))
            elif answer.held is not None and answer.held == held:
                counts[call]["held" if held else "not held"] += 1
            elif why := answer.reason() or (held is None and answers["solve_tensions"].reason()):
                counts[call][why] += 1
            else:
                counts[call]["NO REASON"] += 1
                silent.append((call, X_WP.translation().tolist(), held, answer))
    return counts, silent


def print_table(pulleys=True):
    """A row a robot, a column a call: agreements and reasons."""
    print("| robot | geometry | " + " | ".join(CALLS) + " |")
    print("|" + " --- |" * (len(CALLS) + 2))
    for name in robot_names():
        counts, _ = agreement(name, pulleys)
        cells = [", ".join(f"{n} {why}" for why, n in sorted(counts[c].items())) for c in CALLS]
        geometry = load_robot(name).geometry_words(pulleys)
        print(f"| {name} | {geometry} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    print_table("--pulleys-ignored" not in sys.argv)
