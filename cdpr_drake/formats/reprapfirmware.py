"""RepRapFirmware's Hangprinters: the lines M669 K6 and M666 of a config.g.

M669 has the anchors [mm] as A0:-2000:-100 B... and their number N; older ones have the last anchor
as its height alone. M666 has Q build-up factor, R spool radii [mm], U mechanical advantages, O
lines on a spool, L and H teeth of motor and spool gear, J full steps a turn, W mass of the mover
[kg], S stiffness of a line of unit length, E S of the cables [N], I and X least and largest force
[N]. Cables end in one point; lengths count from where that is at the origin. With advantage U a
spool turns U times as far. R is the radius of the middle of the line at the origin, which the
firmware does not correct for its diameter: a drum is half a diameter smaller.

Source: github.com/Duet3D/RepRapFirmware, src/Movement/Kinematics/HangprinterKinematics.cpp
(3.5-dev): Configure, Recalc, MotorPosToLinePos, SpringK.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cdpr_drake.formats.draft import DraftCable, RobotDraft, deviation_lines
from cdpr_drake.models.foreign_text import fail, number, read_text, robot_name

TOOL = "RepRapFirmware Hangprinter"

MM = 1e-3

LETTERS = "ABCDIJKLO"
"""Anchors, and names of the cables."""

LEAST = 3

KIND = "kind"
"""K of one number, the kind of kinematics; K of three is an anchor."""

DIAMETER = 1e-3
"""Of a cable of which only E S is known [m]; E is as that asks."""

_PARAMETER = re.compile(r"([A-Z])\s*(-?[\d.]+(?:[eE][+-]?\d+)?(?::-?[\d.]+(?:[eE][+-]?\d+)?)*)")

_READ = "QRUOLHJWSIX"
"""Parameters of M666 that say something of the robot."""


def read_reprapfirmware(path: Path) -> RobotDraft:
    """Reads a point mass on winches from the lines M669 and M666.

    Raises:
        RobotFileError: The file does not describe one; says where.
    """
    geometry: dict[str, list[float]] = {}
    spools: dict[str, list[float]] = {}
    others: list[str] = []
    for line in read_text(path).splitlines():
        words = line.partition(";")[0].strip().upper()
        found = re.match(r"(?:N\d+\s+)?M(666|669)\b", words)
        if found:
            here = geometry if found[1] == "669" else spools
            here |= _parameters(path, f"M{found[1]}", words[found.end() :])
        elif words:
            others.append(words.split()[0])
    if not any(letter in geometry for letter in LETTERS):
        raise fail(path, "M669", None, "a line M669 K6 A0:-2000:-100 B... with anchors")
    if geometry.get(KIND, [6.0]) != [6.0]:
        raise fail(path, "M669 K", geometry[KIND][0], "6, a Hangprinter")
    names = [letter for letter in LETTERS if letter in geometry]
    count = int(geometry["N"][0]) if "N" in geometry else len(names)
    if names != list(LETTERS[:count]) or count < LEAST:
        raise fail(
            path, "M669", f"anchors {', '.join(names)} and N {count}",
            f"{LEAST} to {len(LETTERS)} in the order {LETTERS}",
        )  # fmt: skip
    draft = RobotDraft(name=robot_name(path.stem), tool=TOOL, title=f"from {path.name}")
    draft.motion, draft.home_position = "3T", np.zeros(3)
    for name in names:
        point = geometry[name]
        if len(point) == 1 and name == names[-1]:
            point = [0.0, 0.0, *point]
        if len(point) != 3:
            raise fail(path, f"M669 {name}", ":".join(f"{x:g}" for x in point), "x:y:z [mm]")
        draft.cables.append(
            DraftCable(name=name, exit_point=MM * np.array(point), anchor_point=np.zeros(3))
        )
    _spools(path, spools, draft)
    rest = sorted(set(geometry) - {KIND, "N", *names})
    if rest:
        draft.remarks.append(f"Parameters of M669 that were not kept: {', '.join(rest)}.")
    if others:
        draft.remarks.append(f"Commands that were not read: {', '.join(dict.fromkeys(others))}.")
    return draft


def _parameters(path: Path, code: str, words: str) -> dict[str, list[float]]:
    rest = _PARAMETER.sub("", words).strip()
    if rest:
        raise fail(path, code, rest, "letters with numbers, as R75.0:75.0:75.0:75.0")
    found = {}
    for m in _PARAMETER.finditer(words):
        values = [number(path, f"{code} {m[1]}", part) for part in m[2].split(":")]
        found[KIND if (code, m[1], len(values)) == ("M669", "K", 1) else m[1]] = values
    return found


def _spools(path: Path, given: dict[str, list[float]], draft: RobotDraft) -> None:
    """What M666 says of spools, gears, mass, stiffness and forces."""
    m = len(draft.cables)
    for letter in _READ:
        values = given.get(letter)
        if values is not None and len(values) not in (1, m):
            raise fail(path, f"M666 {letter}", f"{len(values)} numbers", f"1 or {m}")

    def each(letter: str) -> np.ndarray | None:
        values = given.get(letter)
        return None if values is None else np.broadcast_to(np.array(values, float), m)

    radii, teeth, motor, advantage = (each(letter) for letter in "RHLU")
    for letter, row in (("R", radii), ("H", teeth), ("L", motor), ("U", advantage)):
        if row is not None and np.any(row <= 0.0):
            raise fail(path, f"M666 {letter}", row.min(), "above 0")
    build_up = given.get("Q", [0.0])[0]
    if build_up < 0.0:
        raise fail(path, "M666 Q", build_up, "at least 0")
    if any(values is not None and np.ptp(values) > 0.0 for values in (teeth, motor)):
        draft.remarks.append(
            "Gears differ from cable to cable, for which there is no place here: M666 "
            + " ".join(f"{x}{':'.join(f'{v:g}' for v in given[x])}" for x in "LH" if x in given)
            + "."
        )
    elif teeth is not None and motor is not None:
        draft.gear_ratio = float(teeth[0] / motor[0])
    for k, cable in enumerate(draft.cables):
        cable.mechanical_advantage = None if advantage is None else float(advantage[k])
    if given.get("W", [0.0])[0] > 0.0:
        draft.mass = given["W"][0]
    if given.get("S", [0.0])[0] > 0.0:
        draft.diameter = DIAMETER
        draft.youngs_modulus = given["S"][0] / (0.25 * np.pi * DIAMETER**2)
        draft.remarks.append(
            f"S {given['S'][0]:g} is E S of the cables [N]: written as 1 mm with that stiffness."
        )
    if radii is not None:
        _drums(path, MM * radii, MM * build_up, each("O"), draft)
    low, high = each("I"), each("X")
    for k, cable in enumerate(draft.cables):
        cable.lower = None if low is None else float(low[k])
        cable.upper = None if high is None or high[k] <= 0.0 else float(high[k])
    rest = sorted(set(given) - set(_READ))
    if rest:
        draft.remarks.append(f"Parameters of M666 that were not kept: {', '.join(rest)}.")


def _drums(
    path: Path, radii: np.ndarray, build_up: float, lines: np.ndarray | None, draft: RobotDraft
) -> None:
    """Drums without line, and the line on them, from radii of the line at the origin [m].

    The firmware has r^2 = R^2 + Q O U (what is wound of the cable), that of a spiral of one turn a
    layer of height pi Q O; it goes on below R, where a drum of ours must have line left.
    """
    draft.diameter = draft.diameter or DIAMETER
    first = radii - 0.5 * draft.diameter
    if build_up > 0.0:
        if lines is not None and np.ptp(lines) > 0.0:
            raise fail(path, "M666 O", ":".join(f"{x:g}" for x in lines), "one number for all")
        build_up *= 1.0 if lines is None else float(lines[0])
        longest = max(
            (cable.mechanical_advantage or 1.0) * float(np.linalg.norm(cable.exit_point))
            for cable in draft.cables
        )
        squares = radii**2 - build_up * longest
        if np.any(squares <= (0.5 * draft.diameter) ** 2):
            raise fail(
                path, "M666 Q", build_up / MM,
                "so little that line as long as the way to an anchor fits on the spool",
            )  # fmt: skip
        first = np.sqrt(squares) - 0.5 * draft.diameter
        draft.layers = {"turns": 1.0, "height": np.pi * build_up, "wound": longest}
        draft.remarks.append(
            f"Spools hold {longest:.6g} m more at the origin than the firmware says, which goes on "
            "with R and Q when all is paid out: radii of drums are as much smaller."
        )
    if np.any(first <= 0.0):
        raise fail(path, "M666 R", radii.min() / MM, f"above {0.5 * draft.diameter / MM:g}")
    draft.drum_radius = float(first[0])
    for cable, radius in zip(draft.cables, first.tolist(), strict=True):
        cable.drum_radius = radius


def write_reprapfirmware(draft: RobotDraft) -> str:
    """The lines M669 and M666.

    It holds exit points, drums with their line, mechanical advantages, gear ratio, mass, E S of the
    cables and tension limits.
    """
    stiffness = cable_stiffness(draft.youngs_modulus or 0.0, draft.diameter or 0.0)
    m = len(draft.cables)
    anchors = " ".join(
        f"{letter}{':'.join(_mm(x) for x in cable.exit_point - cable.anchor_point)}"
        for letter, cable in zip(LETTERS, draft.cables, strict=False)
    )
    teeth, motor = _teeth(draft.gear_ratio or 1.0)
    advantages = [cable.mechanical_advantage or 1.0 for cable in draft.cables]
    layers = draft.layers or {"turns": 1.0, "height": 0.0, "wound": 0.0}
    build_up = layers["height"] / (np.pi * layers["turns"])
    home = np.zeros(3) if draft.home_position is None else draft.home_position
    radii = []
    for cable, n in zip(draft.cables, advantages, strict=True):
        own = draft.drum_radius if cable.drum_radius is None else cable.drum_radius
        first = (own or 0.0) + 0.5 * cable.material.get("diameter", draft.diameter or 0.0)
        way = cable.exit_point - cable.anchor_point
        wound = layers["wound"] + n * float(np.linalg.norm(way - home) - np.linalg.norm(way))
        radii.append(first if build_up == 0.0 else np.sqrt(first**2 + build_up * wound))

    def same(value: float) -> str:
        return ":".join([repr(float(value))] * m)

    stds = [
        line
        for letter, cable in zip(LETTERS, draft.cables, strict=False)
        for axis, std in zip("xyz", cable.point_std, strict=True)
        for line in deviation_lines(";", f"{letter} {axis}", std)
    ]
    for letter, cable in zip(LETTERS, draft.cables, strict=False):
        stds += deviation_lines(";", f"R of {letter}", cable.radius_std)
    low = min(cable.lower or 0.0 for cable in draft.cables)
    high = max(cable.upper or 0.0 for cable in draft.cables)
    return (
        "; Hangprinter parameters. Steps, currents and drivers are the machine's own.\n"
        + "".join(f"{line}\n" for line in stds)
        + f"M669 K6 N{m} {anchors}\n"
        f"M666 Q{_mm(build_up)} R{':'.join(map(_mm, radii))} "
        f"U{':'.join(str(round(n)) for n in advantages)} O{':'.join(['1'] * m)} "
        f"L{':'.join([str(motor)] * m)} H{':'.join([str(teeth)] * m)} W{draft.mass!r} "
        f"S{float(stiffness)!r} I{same(low)} X{same(high)}\n"
    )


def cable_stiffness(youngs_modulus: float, diameter: float) -> float:
    """E S of a cable [N]."""
    return float(0.25 * np.pi * diameter**2 * youngs_modulus)


def holds_gear(ratio: float) -> bool:
    """Whether a gear ratio comes back from teeth as it is."""
    teeth, motor = _teeth(ratio)
    return teeth / motor == ratio


def _teeth(ratio: float) -> tuple[int, int]:
    """Teeth of spool and motor gear, whole numbers as the firmware has them."""
    from fractions import Fraction

    found = Fraction(ratio).limit_denominator(1000)
    return max(found.numerator, 1), found.denominator


def _mm(value: float | None) -> str:
    return repr(float(value or 0.0) / MM + 0.0)
