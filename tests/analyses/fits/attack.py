"""Logs with systematic errors, and clean ones: what a calibration says of each.

`python -m tests.analyses.fits.attack` prints a table of attacks. `--clean 200` calibrates so
many clean logs and counts false alarms. `--robot ROBOT --log LOG` attacks another log, whose clean
fit is the truth then. `--seed` draws other poses, noise and rows. An attack is met where the
verdict is a misfit, or a refusal, with its reason, or where poses stay within their stated
deviations, see `WITHIN`.
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

import cdpr_drake as cdpr
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.analyses.fits.setup import Sigmas
from cdpr_drake.analyses.logs.measurements import Measurements, read_measurements
from cdpr_drake.calibration.measurements import simulated_poses
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from tests.analyses.fits.logs import ROBOT, inclinations, numbers, random_poses

WITHIN = 3.0
"""Poses are right where their errors, the larger of turn and place, are at most so many of their
stated deviations, root mean square over rows. Right sigmas make 1, and noise of twice its sigma 2,
which no test of a fit may blame; another half is left to errors that are no noise."""

FACTORS = (1.05, 0.97, 1.02)
"""By which readings are off."""

NOISE = Sigmas(lengths=5e-4, place=5e-4, turn=1e-3, swivels=2e-3, tilt=2e-3, yaw=4e-3, tensions=0.5)
"""Of simulated sensors."""

SHARES = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Shares of rows that are off."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A robot, what was measured of it, and what is asked.

    Attributes:
        robot, log: The robot as it is believed, and the log.
        poses: Where the platform was, X_WP.
        options: Arguments of `calibrate`.
    """

    robot: Robot
    log: Measurements
    poses: list[RigidTransform]
    options: dict


@cache
def _resting(count: int, seed: int) -> tuple[list[RigidTransform], np.ndarray]:
    """Poses at which the weight holds IRMA4U, and tensions there."""
    robot, random = load_robot("irma4u"), np.random.default_rng(seed)
    platform, cables = rigid_platform(robot), robot.cable_set()
    model = calibration_model(robot)
    poses, tensions = [], []
    while len(poses) < count:
        place = np.append(random.uniform(-0.4, 0.4, 2), random.uniform(0.4, 1.2))
        X_WP = pose_from_angles(place, random.uniform(-0.2, 0.2, 3))
        lengths = numbers(model, [X_WP])[0, :, 0]
        rest = equilibrium_near(cables, "elastic", platform, lengths, X_WP)
        if np.min(rest.tensions) > 3.0 and np.max(rest.tensions) < 300.0:
            poses.append(rest.X_WP)
            tensions.append(rest.tensions)
    return poses, np.array(tensions)


def scene(name: str, count: int = 27, seed: int = 0, **options: object) -> Scene:
    """A simulated log: "tracked" or "blind", and the number of cables."""
    kind, cables = name[:-1], int(name[-1])
    random = np.random.default_rng([seed, cables, len(kind)])
    if cables == 4:
        robot, (poses, tensions) = load_robot("irma4u"), _resting(count, seed)
    else:
        tensions = None
        robot, poses = replace(ROBOT, cables=ROBOT.cables[:cables]), random_poses(random, count)
    true = numbers(calibration_model(robot), poses)
    strain = 0.0 if tensions is None else tensions / robot.stiffness()

    def noisy(values: np.ndarray, sigma: float) -> np.ndarray:
        return values + sigma * random.standard_normal(values.shape)

    lengths = noisy(true[:, :, 0] / (1.0 + strain), NOISE.lengths)
    log = Measurements(Path(name), count, lengths=lengths)
    if tensions is not None:
        log = replace(log, tensions=noisy(tensions, NOISE.tensions))
    if kind == "tracked":
        seen = simulated_poses(poses, NOISE.turn, NOISE.place, random)
        asked = {"unknown": ("exit_points", "length_offsets"), "priors": {"exit_points": 0.01}}
        return Scene(robot, replace(log, poses=list(seen)), poses, {**asked, **options})
    sigmas = [NOISE.tilt, NOISE.tilt, NOISE.yaw]
    tilts = inclinations(poses) + random.standard_normal((count, 3)) * sigmas
    log = replace(log, swivels=noisy(true[:, :, 2], NOISE.swivels), tilts=tilts)
    asked = {} if cables == 4 else {"unknown": ("length_offsets",), "rest": False}
    return Scene(robot, log, poses, {"start": poses[0], **asked, **options})


def _with(log: Measurements, field: str, where: object, values: object) -> Measurements:
    """A copy with other readings at these places."""
    readings = getattr(log, field).copy()
    readings[where] = values
    return replace(log, **{field: readings})


def _scaled(log: Measurements, field: str, where: object, factor: float) -> Measurements:
    return _with(log, field, where, factor * getattr(log, field)[where])


def _turned_angles(log: Measurements, axis: int, rows: np.ndarray) -> Measurements:
    """Roll, pitch or yaw of a tracker with the other sign, in some rows."""
    poses = list(log.poses)
    for row in rows:
        angles = RollPitchYaw(poses[row].rotation()).vector()
        angles[axis] *= -1.0
        poses[row] = RigidTransform(RollPitchYaw(angles), poses[row].translation())
    return replace(log, poses=poses)


def attacks(log: Measurements, seed: int = 1) -> Iterator[tuple[str, Measurements]]:
    """Logs with errors that its measurements may have, each with the name of its error."""
    field = "lengths" if log.lengths is not None else "angles"
    readings = getattr(log, field)
    count, cables = readings.shape

    def rows(share: float, order: np.ndarray) -> np.ndarray:
        return order[: max(1, round(share * count))]

    def swapped(field: str, k: int, n: int, rows: object = slice(None)) -> Measurements:
        values = getattr(log, field).copy()
        values[rows, k], values[rows, n] = getattr(log, field)[rows, n], values[rows, k].copy()
        return replace(log, **{field: values})

    def late(rows: int, cables: object) -> Measurements:
        return _with(log, field, np.s_[rows:, cables], readings[:-rows, cables])

    def added(course: np.ndarray) -> Measurements:
        mean = np.nanmean(np.abs(readings[:, 1]))
        return _with(log, field, np.s_[:, 1], readings[:, 1] + mean * course)

    mixed = np.random.default_rng(seed).permutation(count)
    for axis, name in enumerate(("roll", "pitch", "yaw")):
        for share, some in ((1.0, ""), (0.4, " in 40 % of rows")):
            hit = rows(share, mixed)
            if log.tilts is not None:
                yield f"-{name}{some}", _scaled(log, "tilts", (hit, axis), -1.0)
            if log.poses is not None:
                yield f"-{name} of tracker{some}", _turned_angles(log, axis, hit)
    if log.swivels is not None:
        yield "-swivel of cable 1", _scaled(log, "swivels", np.s_[:, 0], -1.0)
        yield "swivels of cables 1, 2 swapped", swapped("swivels", 0, 1)
        yield "swivel of cable 2 in degrees", _scaled(log, "swivels", np.s_[:, 1], 57.3)
    if log.tensions is not None:
        yield "-tension of cable 1", _scaled(log, "tensions", np.s_[:, 0], -1.0)
        yield "tensions in kgf", _scaled(log, "tensions", np.s_[:, :], 1.0 / 9.81)
    for share in SHARES:
        for which, order in (("the first", np.arange(count)), ("mixed", mixed)):
            for factor in FACTORS if share in (0.3, 0.5) else FACTORS[:1]:
                name = f"{100 * share:.0f} % of rows, {which}, x {factor:g}"
                yield name, _scaled(log, field, rows(share, order), factor)
    half = np.random.default_rng(seed + 1).uniform(size=readings.shape) < 0.5
    for factor in FACTORS:
        for name, where in (
            ("half of all lengths", half),
            ("cable 1", np.s_[:, 0]),
            ("cable 3", np.s_[:, 2]),
            ("cables 2, 3", np.s_[:, 1:3]),
            ("all cables", np.s_[:, :]),
        ):
            yield f"{name} x {factor:g}", _scaled(log, field, where, factor)
    yield "cable 2 in inches", _scaled(log, field, np.s_[:, 1], 1.0 / 0.0254)
    yield "cables 1, 2 swapped", swapped(field, 0, 1)
    yield f"cables 1, {cables} swapped", swapped(field, 0, cables - 1)
    yield "cables 2, 3 swapped in 40 % of rows", swapped(field, 1, 2, rows(0.4, mixed))
    yield "cable 1 late by 1", late(1, 0)
    yield "cable 1 late by 3", late(3, 0)
    yield "all cables late by 1", late(1, np.s_[:])
    yield "all cables late by 2", late(2, np.s_[:])
    s = np.linspace(0.0, 1.0, count)
    yield "cable 2 drifts by 5 %", added(0.05 * s)
    yield "cable 2 slips by 5 % for a while", added(0.05 * (abs(s - 0.5) < 0.2))


@dataclass(frozen=True)
class Outcome:
    """What a calibration said.

    Attributes:
        status: "converged", "misfit", "not_converged" or "refused".
        off: Errors of poses over their deviations, root mean square.
        millimetres: Largest error of a position.
        seconds: Processor time.
        words: Reasons, or remarks.
    """

    status: str
    off: float
    millimetres: float
    seconds: float
    words: str

    @property
    def is_met(self) -> bool:
        """Whether the error was found, or did no harm."""
        return self.status != "converged" or self.off <= WITHIN


def outcome(of: Scene, log: Measurements | None = None) -> Outcome:
    """Calibrates from a log, spoilt or clean."""
    began = time.process_time()
    try:
        fit = cdpr.calibrate(of.robot, of.log if log is None else log, **of.options)
    except CdprError as problem:
        return Outcome("refused", np.nan, np.nan, time.process_time() - began, str(problem))
    took, result = time.process_time() - began, fit.result
    errors = [pose_error(X, Y) for X, Y in zip(of.poses, result.stations.poses(), strict=True)]
    off = np.array(errors)[:, ::-1] / np.where(result.pose_std > 0.0, result.pose_std, np.inf)
    words = fit.misfit or tuple(w for w in fit.remarks if "not used" not in w)
    return Outcome(
        result.status, float(np.sqrt(np.mean(np.max(off, axis=1) ** 2))),
        1e3 * max(distance for distance, _ in errors), took, "; ".join(words[:2]),
    )  # fmt: skip


HANGPRINTER = Path(__file__).parent / "hangprinter4" / "samples.csv"


def recorded(robot: Robot, path: Path, **options: object) -> Scene:
    """A recorded log; its own calibration is the truth."""
    log = read_measurements(path, [cable.name for cable in robot.cables])
    found = cdpr.calibrate(robot, log, **options)
    return Scene(robot, log, found.result.stations.poses(), dict(options))


def hangprinter() -> Scene:
    """The recorded series of a Hangprinter 4."""
    return recorded(
        load_robot("hangprinter_4"), HANGPRINTER, zero=RigidTransform(), sigmas={"place": 1e-6},
        unknown=("exit_points", "common_drum_radius", "D.drum_radius", "tracker.[xyz]"),
    )  # fmt: skip


SIMULATED = ("tracked4", "tracked6", "tracked8", "blind4", "blind6", "blind8")


def clean(number: int, series: int = 99) -> tuple[str, Scene]:
    """A clean log: sigmas stated half to four times the noise, 8 to 40 rows, single outliers.

    Args:
        number: Of the log.
        series: Of logs; another has other poses, noise and outliers.
    """
    random = np.random.default_rng([number, series])
    name = SIMULATED[number % len(SIMULATED)]
    count = int(random.choice([8, 12, 20, 40]))
    factors = {key: 2.0 ** random.uniform(-1, 2) for key in vars(NOISE)}
    stated = {
        key: value * factors[key]
        for key, value in vars(NOISE).items()
        if value is not None and key not in ("lengths_share", "tensions_share", "off_plane")
    }
    one = scene(name, count, seed=number % 7 + 7 * (series - 99), sigmas=stated)
    log, hit = one.log, int(random.integers(0, 3))
    lengths = log.lengths.copy()
    for _ in range(hit):
        row, cable = int(random.integers(1, count)), int(random.integers(lengths.shape[1]))
        lengths[row, cable] += random.choice([-1, 1]) * random.uniform(0.005, 0.1)
    words = f"{name}, {count} rows, {hit} outliers"
    return words, replace(one, log=replace(log, lengths=lengths))


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clean", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="")
    parser.add_argument("--robot")
    parser.add_argument("--log", type=Path)
    asked = parser.parse_args()
    if asked.clean:
        alarms = 0
        for number in range(asked.clean):
            words, one = clean(number, 99 + asked.seed)
            said = outcome(one)
            alarms += said.status != "converged"
            if said.status != "converged" or said.off > WITHIN:
                print(f"{number}: {words}: {said.status}, {said.off:.2f}: {said.words}", flush=True)
        print(f"{alarms} false alarms in {asked.clean} clean logs")
        return
    scenes = {name: lambda name=name: scene(name, seed=asked.seed) for name in SIMULATED}
    scenes["hangprinter_4"] = hangprinter
    if asked.log:
        scenes = {asked.log.stem: lambda: recorded(load_robot(asked.robot), asked.log)}
    missed = 0
    for name, made in scenes.items():
        if asked.only and asked.only not in name:
            continue
        one = made()
        for words, log in [("clean", None), *attacks(one.log, 1 + asked.seed)]:
            said = outcome(one, log)
            missed += not said.is_met
            print(
                f"{name:13} {words:36} {said.status:10} {said.off:6.1f} {said.millimetres:7.1f} mm "
                f"{said.seconds:5.1f} s  {'' if said.is_met else 'MISSED '}{said.words[:110]}",
                flush=True,
            )
    print(f"{missed} attacks missed")


if __name__ == "__main__":
    main()
