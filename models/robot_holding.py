"""What holds a robot's platform at rest, for any model of its cables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS
from cdpr_drake.cables.states import cable_state, check_breaking
from cdpr_drake.errors import CableGeometryError, CdprError, InfeasibleTensionError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.straight_cables import cable_lengths, gravity_wrench
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import (
    check_pose,
    rigid_platform,
    tension_problem,
    wrench_balance,
)
from cdpr_drake.schema.declarations import number_words
from cdpr_drake.statics.controlled_wrenches import combination_words
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.static_tensions import (
    LEAST_TENSION_WEIGHTS,
    StaticTensions,
    find_static_tensions,
)
from cdpr_drake.tensions.shortfall import shortfall

TRIMMED = 0.01
"""By how much of its length a cable is trimmed against the others on its winch at the start."""


def hold_robot(robot: Robot, X_WP: RigidTransform, cables: CableSet, model: str) -> StaticTensions:
    """Tensions and lengths that hold the platform against its weight.

    Args:
        robot: The robot.
        X_WP: Pose of the platform.
        cables: Its cables; over pulleys where their radius is positive.
        model: A name of `cables.CABLE_MODELS`.

    Raises:
        InfeasibleTensionError: No tensions within the robot's bounds hold this pose; sagging
            cables need a tension of `static_tensions.LEAST_TENSION_WEIGHTS` times their weight.
        CableGeometryError: A pulley reaches into the platform, a cable cannot run, or it would
            break.
        TensionProblemError: The pose lies outside the frame, or the cables hold nothing there.
    """
    check_pose(robot, X_WP)
    check_pulleys(robot, X_WP, cables)
    gravity = robot.gravity_vector()
    wrench = gravity_wrench(X_WP, robot.platform.mass, robot.center_of_mass(), gravity)
    bounds = robot.tension_limits()
    holding = find_static_tensions(cables, model, X_WP, wrench, bounds, robot.motion_type())
    if holding is None:
        own_weight = (
            f", with at least {LEAST_TENSION_WEIGHTS:g} times its own in each"
            if CABLE_MODELS[model].sags
            else ""
        )
        if robot.is_underactuated():
            raise InfeasibleTensionError(_underactuated(robot, X_WP, cables))
        at = number_words(X_WP.translation())
        raise InfeasibleTensionError(
            f"{robot.name} cannot hold the platform at {at} m: no tensions within "
            f"{bounds[0]:g}..{bounds[1]:g} N balance its weight"
            f"{own_weight or missed_by(robot, X_WP, cables)}"
        )
    check_breaking(cables, holding.tensions, holding.unstrained_lengths)
    return holding


def missed_by(robot: Robot, X_WP: RigidTransform, cables: CableSet | None) -> str:
    """By how much tensions of straight cables miss the platform's weight, as a clause."""
    missed = shortfall(tension_problem(robot, X_WP, cables=cables))
    names = [cable.name for cable in robot.cables]
    return f"; {missed.words(names, robot.motion_type().words())}"


def lengths_at_home(robot: Robot) -> tuple[Array, str]:
    """Unstrained lengths of straight cables without pulleys that hold the robot at home.

    Returns:
        The lengths, shape (m,) [m], and why they do not hold it: then they are those of cables
        without tension. Empty: they do.
    """
    X_WP, cables = robot.home.transform(), robot.cable_set().without_pulleys()
    try:
        return np.asarray(hold_robot(robot, X_WP, cables, "elastic").unstrained_lengths), ""
    except CdprError as problem:
        return cable_lengths(X_WP, cables.p_WA, cables.p_PB), str(problem)


def _underactuated(robot: Robot, X_WP: RigidTransform, cables: CableSet) -> str:
    """Why cables, fewer than degrees of freedom, do not hold a pose."""
    control = wrench_balance(robot, X_WP, cables=cables).control()
    low, high = robot.tension_limits()
    why = f"no tensions within {low:g}..{high:g} N balance its weight"
    if (short := control.shortfall()) is not None:
        names = [cable.name for cable in robot.cables]
        why += f"; {short.words(names, robot.motion_type().words())}"
    if not control.balances:
        worst = int(np.argmax(np.abs(control.unbalanced)))
        what = combination_words(control.free[:, worst], robot.motion_type().words())
        why = f"nothing balances {what}, {control.unbalanced[worst]:.3g} here"
    return (
        f"{robot.name}, {len(robot.cables)} cables for {robot.motion_type().freedom} degrees of "
        f"freedom, does not rest at {number_words(X_WP.translation())} m: {why}; accepted: a pose "
        "of rest, which cable lengths have"
    )


def rest_as_long(
    robot: Robot,
    X_WP: RigidTransform,
    cables: CableSet,
    model: str,
    slack: Array | None = None,
) -> tuple[RigidTransform, StaticTensions]:
    """Where the platform comes to rest with cables as long as their paths at a pose.

    That is how robots start that have fewer cables than degrees of freedom: their weight, and not
    the pose, says how they hang.

    Args:
        robot: The robot.
        X_WP: The pose [m].
        cables: Its cables.
        model: A name of `cables.CABLE_MODELS`.
        slack: Lengths that are paid out beyond that, shape (m,) [m].

    Raises:
        EquilibriumError: It does not come to rest.
        CableGeometryError: A cable cannot run, or would break.
        TensionProblemError: A pose lies outside the frame.
    """
    check_pose(robot, X_WP)
    check_pulleys(robot, X_WP, cables)
    l0 = cable_paths(X_WP, cables).lengths + (0.0 if slack is None else slack)
    rest = equilibrium_near(cables, model, rigid_platform(robot), l0, X_WP)
    check_pose(robot, rest.X_WP)
    check_breaking(cables, rest.tensions, l0)
    state = cable_state(cables, model, rest.X_WP, l0)
    return rest.X_WP, StaticTensions(rest.tensions, state.drum_tensions, l0)


def rest_with_slack(
    robot: Robot,
    X_WP: RigidTransform,
    holding: StaticTensions,
    slack: Array,
    cables: CableSet,
    model: str,
) -> tuple[RigidTransform, StaticTensions]:
    """Where the platform comes to rest when cables are paid out, and what holds it there.

    Args:
        robot: The robot.
        X_WP: Where it was held [m].
        holding: What held it there, see `hold_robot`.
        slack: Lengths that are paid out, shape (m,) [m].
        cables: Its cables.
        model: A name of `cables.CABLE_MODELS`.

    Raises:
        EquilibriumError: It does not come to rest.
        CableGeometryError: A cable cannot run there, or would break.
        TensionProblemError: It comes to rest outside the frame.
    """
    l0 = holding.unstrained_lengths + slack
    rest = equilibrium_near(cables, model, rigid_platform(robot), l0, X_WP)
    check_pose(robot, rest.X_WP)
    check_breaking(cables, rest.tensions, l0)
    state = cable_state(cables, model, rest.X_WP, l0)
    return rest.X_WP, replace(
        holding, tensions=rest.tensions, drum_tensions=state.drum_tensions, unstrained_lengths=l0
    )


def check_pulleys(robot: Robot, X_WP: RigidTransform, cables: CableSet) -> None:
    """Checks that no pulley, or exit point without one, lies in the platform's box.

    Raises:
        CableGeometryError: One does; names the cable. Or a cable cannot run, as `cable_paths`.
    """
    paths = cable_paths(X_WP, cables)
    middle, half = robot.box_center(), robot.platform.size / 2.0
    lower, upper = middle - half, middle + half
    for i, radius in enumerate(cables.pulley_radius):
        center = X_WP.inverse().multiply(_center(cables, i, paths.p_WT[:, i]))
        outside = np.linalg.norm(center - np.clip(center, lower, upper))
        if outside < radius or (radius == 0.0 and outside == 0.0):
            raise CableGeometryError(
                f"cable {i + 1} of {robot.name}: its pulley of radius {radius:g} m at "
                f"{number_words(cables.p_WA[:, i])} m reaches into the platform; "
                "accepted: a pose with all pulleys outside of it"
            )


def check_bundles(robot: Robot, cables: CableSet, X_WP: RigidTransform) -> None:
    """Checks that cables on one winch can all be right at a pose, if they were so at home.

    Their lengths may change by different amounts from there by `TRIMMED` of their lengths, which is
    what tensioners at their ends take up.

    Raises:
        CableGeometryError: Those of one winch would have to be paid out differently.
    """
    groups = robot.winch_groups()
    if not groups.are_shared():
        return
    home = cable_paths(robot.home.transform(), cables).lengths
    lengths = cable_paths(X_WP, cables).lengths
    paid = lengths - home
    for i, first in enumerate(groups.leaders()):
        if abs(paid[i] - paid[first]) > TRIMMED * lengths[first]:
            names = robot.cables[first].name, robot.cables[i].name
            raise CableGeometryError(
                f"{names[0]} and {names[1]} of {robot.name} are on one winch, which pays out the "
                f"same of both; found {paid[first]:.4g} m and {paid[i]:.4g} m from home to the "
                f"pose at {number_words(X_WP.translation())} m; accepted: a pose where they differ "
                f"by less than {TRIMMED:.0%} of the length"
            )


def _center(cables: CableSet, i: int, p_WT: Array) -> Array:
    """Centre of a pulley, from its tangent point, which lies in the pulley's plane [m]."""
    A, n, r = cables.p_WA[:, i], cables.swivel_axis[:, i], cables.pulley_radius[i]
    out = p_WT - A
    out = out - (out @ n) * n
    norm = np.linalg.norm(out)
    return np.asarray(A if r == 0.0 or norm == 0.0 else A + r * out / norm, float)
