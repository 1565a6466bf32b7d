"""What a sensor of turns, or a tracker, tells of a platform that moves freely; and the reverse."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.calibration.free_motion_model import FreeMotionModel, usually_bent
from cdpr_drake.analyses.calibration.free_motion_samples import Stretch
from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import strain_of_tension
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_row


def earlier(states: Array, step: float, late: float) -> tuple[Rotation, Array]:
    """Turns and positions, shape (n, 3) [m], a time before even states, by Hermite's cubics.

    The model is asked earlier, not the log later: between rows of a log noise is less than at rows,
    and a clock that was sought so would be drawn to the middle between them.

    Args:
        states: Shape (n, 13).
        step: Between them [s].
        late: The time [s].
    """
    n = len(states)
    at = np.arange(n) - late / step
    k = np.clip(np.floor(at).astype(int), 0, n - 2)
    u = (at - k)[:, None]
    q, w = states[:, :4], states[:, 7:10]
    rates = np.empty((n, 7))
    rates[:, 0] = -0.5 * np.sum(w * q[:, 1:], axis=1)
    rates[:, 1:4] = 0.5 * (w * q[:, :1] + np.cross(w, q[:, 1:]))
    rates[:, 4:] = states[:, 10:13]
    x, v = states[:, :7], step * rates
    found = (
        (1.0 + 2.0 * u) * (1.0 - u) ** 2 * x[k] + u * (1.0 - u) ** 2 * v[k]
        + u**2 * (3.0 - 2.0 * u) * x[k + 1] + u**2 * (u - 1.0) * v[k + 1]
    )  # fmt: skip
    return Rotation.from_quat(found[:, [1, 2, 3, 0]]), found[:, 4:]


def sensed(
    model: FreeMotionModel, vector: Array, states: Array, step: float
) -> tuple[Rotation, Array]:
    """What the sensor would tell at even states: turns, and positions in its frame, (n, 3) [m]."""
    n = model.by_name(vector)
    turns, p = earlier(states, step, n["sensor.late"])
    if "sensor.heading" in n:
        mount = Rotation.from_rotvec([n[f"sensor.mount_{a}"] for a in "xyz"])
        return Rotation.from_rotvec([0.0, 0.0, n["sensor.heading"]]) * turns * mount, p
    if "tracker.x" in n:
        frame = Rotation.from_rotvec([n[f"tracker.turn_{a}"] for a in "xyz"])
        return frame * turns, frame.apply(p) + [n[f"tracker.{a}"] for a in "xyz"]
    return turns, p


def unsensed(
    model: FreeMotionModel, vector: Array, turns: Rotation, positions: Array | None
) -> tuple[Rotation, Array | None]:
    """The inverse of `sensed`: turns and positions of P in W."""
    n = model.by_name(vector)
    if "sensor.heading" in n:
        mount = Rotation.from_rotvec([n[f"sensor.mount_{a}"] for a in "xyz"])
        heading = Rotation.from_rotvec([0.0, 0.0, n["sensor.heading"]])
        return heading.inv() * turns * mount.inv(), positions
    if "tracker.x" in n:
        frame = Rotation.from_rotvec([n[f"tracker.turn_{a}"] for a in "xyz"])
        if positions is not None:
            positions = frame.inv().apply(positions - [n[f"tracker.{a}"] for a in "xyz"])
        return frame.inv() * turns, positions
    return turns, positions


def sensed_tensions(model: FreeMotionModel, vector: Array, tensions: Array) -> Array:
    """What load cells would tell of tensions, shape (n, m) [N]."""
    zeros, n = _zeros(model, vector), model.by_name(vector)
    return np.asarray(zeros + n["load_cells.scale"] * tensions)


def unsensed_tensions(model: FreeMotionModel, vector: Array, told: Array) -> Array:
    """The inverse of `sensed_tensions`."""
    zeros, n = _zeros(model, vector), model.by_name(vector)
    return np.asarray((told - zeros) / n["load_cells.scale"])


def _zeros(model: FreeMotionModel, vector: Array) -> Array:
    n = model.by_name(vector)
    return np.array([n[f"{c.name}.load_cell_zero"] for c in model.robot.cables])


def first_state(model: FreeMotionModel, vector: Array, stretch: Stretch) -> Array:
    """From rest at the start to the first state, as measured; see `FreeMotionModel.run`."""
    first = stretch.time[0] + model.by_name(vector)["sensor.late"]
    apart = 0.04  # long enough for the noise of turns, short beside a swing [s]
    t = np.array([first, first + apart])
    turns, p = unsensed(
        model, vector, stretch.recorded.turns_at(t), stretch.recorded.positions_at(t)
    )
    w = (turns[1] * turns[0].inv()).as_rotvec() / apart
    R_start = Rotation.from_matrix(model.start.rotation().matrix())
    if p is not None:
        place, v = p[0], (p[1] - p[0]) / apart
    else:
        place = places_by_lengths(
            model, vector, turns[:1], np.zeros((1, len(model.robot.cables))),
            np.array([model.start.translation()]),
        )[0]  # fmt: skip
        J = _jacobian(model, turns[0], place)
        v = np.linalg.lstsq(J[:, 3:], -J[:, :3] @ w, rcond=None)[0]
    turn = (turns[0] * R_start.inv()).as_rotvec()
    moved = np.concatenate([turn, place - model.start.translation(), w, v])
    if model.memory:
        row = np.concatenate([turns[0].as_quat()[[3, 0, 1, 2]], place])
        moved = np.concatenate([moved, usually_bent(row, w)])
    return moved


def _jacobian(model: FreeMotionModel, turn: Rotation, place: Array) -> Array:
    row = np.concatenate([turn.as_quat()[[3, 0, 1, 2]], place])
    return cable_paths(pose_from_row(row), model.cables).J


def places_by_lengths(
    model: FreeMotionModel, vector: Array, turns: Rotation, tensions: Array, guesses: Array
) -> Array:
    """Where the cables' lengths under tension put Po, with turns known, shape (n, 3) [m].

    Least squares of the lengths, by Gauss and Newton; NaN where cables cannot run, and for fewer
    than three cables.
    """
    cables, l0 = model.cables, model.lengths(vector)
    n = model.by_name(vector)
    EA = cables.stiffness * n["all.stiffness"] / float(np.mean(cables.stiffness))
    does = model.behaviour(vector)
    l0 = l0 * does.longer()
    places = np.array(guesses, float)
    if cables.count < 3:
        return np.full_like(places, np.nan)
    quaternions = turns.as_quat()[:, [3, 0, 1, 2]]
    for k, q in enumerate(quaternions):
        try:
            for _ in range(6):
                paths = cable_paths(pose_from_row(np.concatenate([q, places[k]])), cables)
                strains = strain_of_tension(tensions[k], EA, does.stiffening)
                lacking = l0 * (1.0 + strains) - paths.lengths
                places[k] += np.linalg.lstsq(paths.J[:, 3:], lacking, rcond=None)[0]
        except CableGeometryError:
            places[k] = np.nan
    return places
