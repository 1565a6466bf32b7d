"""G-code as shops and printers write it: lines, arcs and feeds, as a path of the platform.

X, Y, Z are Po in W, A, B, C the angles of R = Rx(A) Ry(B) Rz(C) [deg]; lengths are millimetres
until G20, coordinates absolute until G91. G0 and G1 are straight lines, G2 and G3 arcs, clockwise
and counterclockwise as seen from the tip of the third axis, in the plane of G17, G18 or G19,
helices where that axis moves, with a centre (I, J, K) or a radius R. F is a speed of Po in lengths
a minute, of G1 to G3. What moves no platform is left out by name.

Source: Kramer, Proctor and Messina, The NIST RS274NGC Interpreter, Version 3, NIST IR 6556, 2000:
sections 3.5 (arcs), 3.8 (order of execution), 3.5.18 (G92). Beyond it: printers' E words, their
M codes with words of their own, and whole circles without an end, as LinuxCNC and Marlin read them.
"""

from __future__ import annotations

import re
from collections import Counter
from math import atan2, hypot, inf, isfinite, isnan, nan, pi, sqrt
from pathlib import Path

import numpy as np

from cdpr_drake.errors import DataFileError
from cdpr_drake.trajectories.curved_path import Arc, Move

AXES = "XYZABC"  # words of coordinates: lengths in the file's unit, then angles [deg]

PLANES = {17.0: (0, 1, 2), 18.0: (2, 0, 1), 19.0: (1, 2, 0)}
"""First, second and third axis of the planes of arcs, right-handed."""

OFFSETS = "IJK"  # words of an arc's centre along x, y, z

IDLE = {
    4.0: "dwell", 10.0: "retraction", 11.0: "retraction undone", 15.0: "polar coordinates off",
    29.0: "bed levelling", 40.0: "cutter compensation off", 49.0: "tool length offset off",
    54.0: "first coordinate system", 61.0: "exact path", 61.1: "exact stop", 64.0: "path blending",
    69.0: "rotation off", 80.0: "motion off", 94.0: "feed a minute", 97.0: "spindle speed",
    98.0: "return level", 99.0: "return level",
}  # fmt: skip
"""G codes that do not change where a path leads, and are left out."""

M_CODES = {
    0: "stop", 1: "optional stop", 2: "end of program", 3: "spindle on", 4: "spindle on, backwards",
    5: "spindle off", 6: "tool change", 7: "mist on", 8: "coolant on", 9: "coolant off",
    17: "motors on", 18: "motors off", 30: "end of program", 48: "overrides on",
    49: "overrides off", 73: "progress", 82: "extruder absolute", 83: "extruder relative",
    84: "motors off", 104: "nozzle temperature", 106: "fan on", 107: "fan off",
    109: "wait for the nozzle", 117: "message", 140: "bed temperature", 190: "wait for the bed",
    201: "largest accelerations", 203: "largest speeds", 204: "accelerations", 205: "jerk",
    220: "speed share", 221: "flow share", 400: "wait for moves",
}  # fmt: skip
"""M codes by name, where many write the same; all are left out."""

END = {2.0, 30.0}  # M codes after which nothing is read

SHARED = 10.0
"""M codes from here on, but M30, own the other words of their line, as printers write them."""

OTHER = {
    "S": "spindle speed", "T": "tool", "E": "extruder", "P": "parameter", "Q": "parameter",
    "H": "parameter", "D": "parameter", "L": "parameter",
}  # fmt: skip
"""Letters that move no platform."""

PARAMETERS = "PQHDL"  # letters that belong to a code that is left out

RADII = {1e-3: 2e-6, 0.0254: 5.08e-6}
"""By how much the distances of an arc's start and end from its centre may differ: 0.002 mm, or
0.0002 inch (NIST IR 6556, 3.5.3.2), by the unit [m]."""

SAME = 1e-9  # points of an arc that are closer are one: a whole circle [m]

_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*")
_COMMENT = re.compile(r"\([^)]*\)|;.*$")
_CHECKSUM = re.compile(r"\*\s*\d+\s*$")
_MESSAGE = re.compile(r"^(?:N\s*\d+\s*)?M\s*(117|118|23|28)\b.*$")

Place = list[float]


def parse_g_code(path: Path, lines: list[str], height: float | None) -> GCode:
    """Reads lines of G-code; the path begins where X, Y and Z are all known.

    Args:
        path: The file, for messages.
        lines: Its lines.
        height: z where the file gives none [m]; None: it must.

    Raises:
        DataFileError: A line is not accepted; names it.
    """
    code = GCode(path, height)
    for code.number, line in enumerate(lines, 1):
        code.read(line)
    if not code.places and code.early:
        raise DataFileError(code.early)
    return code


class GCode:
    """What lines of G-code have set so far, and the path that came of it.

    Attributes:
        places: x, y, z [m], phi, theta, psi [deg], one after the other.
        moves: How it goes from each to the next.
    """

    def __init__(self, path: Path, height: float | None) -> None:
        """For lines of a file; as `parse_g_code`."""
        self.path, self.number = path, 0
        self.unit, self.absolute, self.centers_absolute = 1e-3, True, False
        self.motion: float | None = None
        self.plane, self.feed, self.ended = 17.0, inf, False
        unknown = nan if height is None else height
        self.place: Place = [nan, nan, unknown, 0.0, 0.0, 0.0]
        self.offset, self.suspended = [0.0] * 6, [0.0] * 6
        self.places: list[Place] = []
        self.moves: list[Move] = []
        self.left_out: Counter[str] = Counter()
        self.early, self.lost = "", False

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was left out, once each, with how often."""
        return tuple(f"{words} left out: {count}" for words, count in sorted(self.left_out.items()))

    def refuse(self, found: str, accepted: str) -> DataFileError:
        """A refusal of the present line."""
        return DataFileError(
            f"{self.path}: line {self.number}: found {found}; accepted: {accepted}"
        )

    def refuse_word(self, letter: str, value: float) -> DataFileError:
        """A refusal of a word of the present line."""
        return self.refuse(
            f"the word {letter}{value:g}",
            "G0 to G3, X, Y, Z, A, B, C, I, J, K, R, F, N, and M, S, T, E, which are left out",
        )

    def read(self, line: str) -> None:
        """One line, in the order of NIST IR 6556, 3.8: feed, modes, offsets, motion, end."""
        rest = _COMMENT.sub("", line).strip().upper()
        if self.ended:
            if rest.strip(" %\t"):
                self.left_out["lines after the end of the program"] += 1
            return
        if rest.startswith("/"):
            self.left_out["/ (block delete, taken as off)"] += 1
            rest = rest[1:].strip()
        if rest == "%" or not rest:
            return
        if (text := _MESSAGE.match(rest)) is not None:
            self._leave_out_m(float(text[1]))
            return
        codes, words = self._words(rest)
        if "F" in words:
            self._set_feed(words.pop("F"))
        m_codes = [value for letter, value in codes if letter == "M"]
        g_codes = [value for letter, value in codes if letter == "G"]
        if any(code >= SHARED and code not in END for code in m_codes) and not g_codes:
            words = {}
        self._set_modes(g_codes, words)
        for letter in [letter for letter in words if letter in OTHER]:
            value = words.pop(letter)
            if letter in PARAMETERS and not m_codes:
                raise self.refuse_word(letter, value)
            self.left_out[f"{letter} words ({OTHER[letter]})"] += 1
        if any(letter in AXES or letter in "IJKR" for letter in words):
            self._go(words)
        for code in m_codes:
            self._leave_out_m(code)
            self.ended = self.ended or code in END

    def _words(self, rest: str) -> tuple[list[tuple[str, float]], dict[str, float]]:
        """Codes G and M of a line, and its other words but N, each letter once."""
        rest = _CHECKSUM.sub("", rest)
        codes: list[tuple[str, float]] = []
        words: dict[str, float] = {}
        while rest:
            match = _WORD.match(rest)
            if match is None:
                raise self.refuse(
                    f"{rest[:40]!r}",
                    "words such as G1 X10.5; no parameters, expressions or O words",
                )
            letter, value = match[1], float(match[2])
            rest = rest[match.end() :]
            if letter in "GM":
                codes.append((letter, value))
            elif letter in words:
                raise self.refuse(f"{letter} twice", "once")
            elif letter in AXES or letter in OTHER or letter in "FIJKR":
                words[letter] = value
            elif letter != "N":
                raise self.refuse_word(letter, value)
        return codes, words

    def _set_feed(self, value: float) -> None:
        if not value > 0.0:
            raise self.refuse(f"F{value:g}", "a feed above 0")
        self.feed = value * self.unit / 60.0  # in the unit before this line, as 3.8 says

    def _set_modes(self, codes: list[float], words: dict[str, float]) -> None:
        motions = [code for code in codes if code in (0.0, 1.0, 2.0, 3.0)]
        if len(motions) > 1:
            raise self.refuse(f"G{motions[0]:g} and G{motions[1]:g}", "one motion a line")
        for code in codes:
            if code in (20.0, 21.0):
                self.unit = 0.0254 if code == 20.0 else 1e-3
            elif code in (90.0, 91.0):
                self.absolute = code == 90.0
            elif code in (90.1, 91.1):
                self.centers_absolute = code == 90.1
            elif code in PLANES:
                self.plane = code
            elif code in motions:
                self.motion = code
        for code in codes:
            if code in (28.0, 30.0):
                self._go_home(code, words)
            elif code in (92.0, 92.1, 92.2, 92.3):
                self._set_offset(code, words)
            elif code in IDLE:
                self._idle(code, words)
            elif code not in (*motions, *PLANES, 20.0, 21.0, 90.0, 91.0, 90.1, 91.1):
                raise self.refuse(
                    f"G{code:g}",
                    "straight lines and arcs, G0 to G3, planes G17 to G19, units G20 and G21, "
                    "coordinates G90, G91, G90.1, G91.1, G92, and what moves no platform",
                )

    def _idle(self, code: float, words: dict[str, float]) -> None:
        """A code that is left out, with the words that belong to it."""
        if code in (10.0, 11.0) and "L" in words:
            raise self.refuse(f"G{code:g} L{words['L']:g}", "no tables of coordinate systems")
        for letter in [letter for letter in words if letter in "PQSLHD" or code == 29.0]:
            del words[letter]
        self.left_out[f"G{code:g} ({IDLE[code]})"] += 1

    def _go_home(self, code: float, words: dict[str, float]) -> None:
        """Where a machine's home is, no file says: the axes are not known afterwards."""
        self.left_out[f"G{code:g} (home)"] += 1
        named = [k for k in range(6) if AXES[k] in words]
        for k in named or range(3):
            self.place[k] = nan
        words.clear()
        self.lost = bool(self.places)

    def _set_offset(self, code: float, words: dict[str, float]) -> None:
        """G92: the place where Po is gets these coordinates; .1 and .2: no longer, .3: again."""
        if code == 92.0:
            for k, letter in enumerate(AXES):
                if letter not in words:
                    continue
                value = words.pop(letter) * (self.unit if k < 3 else 1.0)
                if isnan(self.place[k]):
                    self.place[k] = value + self.offset[k]
                else:
                    self.offset[k] = self.place[k] - value
            if words.pop("E", None) is not None:
                self.left_out["E words (extruder)"] += 1
            return
        if code == 92.2:
            self.suspended = list(self.offset)
        elif code == 92.1:
            self.suspended = [0.0] * 6
        self.offset = list(self.suspended) if code == 92.3 else [0.0] * 6

    def _go(self, words: dict[str, float]) -> None:
        """A motion in the mode that holds."""
        if self.motion is None:
            raise self.refuse("coordinates before any G0 or G1", "after one")
        target = list(self.place)
        for letter, value in words.items():
            if letter not in AXES:
                continue
            k = AXES.index(letter)
            scaled = value * self.unit if k < 3 else value
            target[k] = scaled + (self.offset[k] if self.absolute else self.place[k])
        unknown = [AXES[k] for k in range(6) if not isfinite(target[k])]
        if unknown:
            self._before_the_path(target, ", ".join(unknown))
            return
        if self.lost:
            raise self.refuse("a motion after G28 or G30", "these before or after all motions")
        move = Move(speed=inf if self.motion == 0.0 else self.feed)
        if self.motion in (2.0, 3.0):
            move = Move(self._arc(target, words), self.feed)
        elif stray := [letter for letter in "IJKR" if letter in words]:
            raise self.refuse(f"{stray[0]} with G{self.motion:g}", "with G2 and G3")
        if not self.places:
            self.places.append(target)
        elif move.arc is not None or target != self.place:
            self.places.append(target)
            self.moves.append(move)
        self.place = target

    def _before_the_path(self, target: Place, unknown: str) -> None:
        """A motion with coordinates that nobody knows yet is not on the path."""
        refusal = (
            f"{self.path}: line {self.number}: {unknown} is not known there; accepted: a first "
            "move to X, Y and Z"
        )
        if self.places or self.motion in (2.0, 3.0):
            raise DataFileError(refusal)
        self.early = self.early or refusal
        self.left_out["motions before X, Y and Z are known"] += 1
        self.place = target

    def _arc(self, target: Place, words: dict[str, float]) -> Arc:
        """Centre, axis and angle of G2 or G3 to a target."""
        if not self.places:
            raise self.refuse(f"G{self.motion:g} as the first motion", "G0 or G1 to its start")
        first, second, third = PLANES[self.plane]
        clockwise = self.motion == 2.0
        a, b = self.place[first], self.place[second]
        da, db = target[first] - a, target[second] - b
        chord = hypot(da, db)
        offsets = [k for k in range(3) if OFFSETS[k] in words]
        if third in offsets:
            raise self.refuse(f"{OFFSETS[third]} in the plane G{self.plane:g}", "a centre in it")
        if ("R" in words) == bool(offsets):
            raise self.refuse(
                "both R and a centre" if offsets else "neither R nor a centre", "one of them"
            )
        if "R" in words:
            u, v = self._middle(words["R"] * self.unit, chord, (da, db), clockwise)
        else:
            u, v = (self._offset(words, k) for k in (first, second))
            self._check_radii(hypot(u, v), hypot(da - u, db - v))
        turn = atan2(db - v, da - u) - atan2(-v, -u)
        if chord < SAME:
            turn = -2.0 * pi if clockwise else 2.0 * pi
        elif clockwise:
            turn -= 2.0 * pi * np.ceil(turn / (2.0 * pi))
        else:
            turn -= 2.0 * pi * np.floor(turn / (2.0 * pi))
        center, axis = np.zeros(3), np.zeros(3)
        center[first], center[second], center[third] = a + u, b + v, self.place[third]
        axis[third] = 1.0
        return Arc(center, axis, float(turn))

    def _offset(self, words: dict[str, float], k: int) -> float:
        """The centre along an axis, from the start [m]."""
        if OFFSETS[k] not in words:
            return 0.0
        value = words[OFFSETS[k]] * self.unit
        return value + self.offset[k] - self.place[k] if self.centers_absolute else value

    def _middle(
        self, radius: float, chord: float, to: tuple[float, float], clockwise: bool
    ) -> tuple[float, float]:
        """The centre of an arc by its radius, from the start [m]; R < 0: the longer way round."""
        if chord < SAME:
            raise self.refuse("R and no way", "an end that is not the start, or a centre")
        square = radius**2 - 0.25 * chord**2
        if sqrt(max(-square, 0.0)) > 0.0 and 0.5 * chord > abs(radius) + RADII[self.unit]:
            raise self.refuse(
                f"R{abs(radius) / self.unit:g} for an end {chord / self.unit:g} away",
                f"at least {0.5 * chord / self.unit:g}",
            )
        aside = sqrt(max(square, 0.0)) / chord
        if clockwise != (radius < 0.0):  # to the right of the way
            aside = -aside
        return 0.5 * to[0] - aside * to[1], 0.5 * to[1] + aside * to[0]

    def _check_radii(self, start: float, end: float) -> None:
        if start < SAME or abs(start - end) > RADII[self.unit]:
            raise self.refuse(
                f"a centre {start / self.unit:.6g} from the start and {end / self.unit:.6g} from "
                "the end of an arc",
                f"the same above 0, to {RADII[self.unit] / self.unit:.2g}",
            )

    def _leave_out_m(self, code: float) -> None:
        name = M_CODES.get(int(code))
        self.left_out[f"M{code:g}{f' ({name})' if name else ''}"] += 1
