"""The servoing thesis' control stability workspaces as data: tables A.8 to A.18, all 468 rows.

`stability_tables.tsv` has a line per printed row: table, bound, its value, the area or volume of
the workspace, and its share of the full one in per cent, in the digits of the thesis.

Printed numbers that contradict each other; the data are those of the tables:

- 3.3.3 gives 43.4 % at d_theta_pc = 30 deg; A.12 has 43.5 at 20 deg and 6.8 at 30 deg.
- 3.3.4 lets 30 % remain at r_bp = 1 m under 2 1/2 D on CAROCA; A.15 has 35.2 %, and a volume that
  agrees with it.
- 3.5 gives 48.8 % for r_B = 0.1 m; in A.12 that is the share at r_A = 0.1 m, at r_B it is 30.3.
- A.10 has 87.0 % for the baseline's 0.880 m^3, which are 86.8 % of 1.014 m^3 (and 86.7 % for
  0.879 m^3); A.11 has 97.0 % for 0.985 m^3, which are 97.1 %, and 97.0 % (r_pc) as well as 96.9 %
  (d_theta) for 0.983 m^3.
- A.13 has 87.7 % (r_pc) and 87.8 % (d_theta_pc) for 0.889 m^3.
- A.12 has 63.6 % for 52.32 m^3 at r_A = 0.05 m, which are 63.5 %.
- A.15, r_bp = 0.9 m and d_theta_pc = 40 deg: shares are cut, not rounded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple


@dataclass(frozen=True)
class PublishedTable:
    """One table: how the workspace shrinks as one bound grows and the others stay at the baseline.

    Attributes:
        name: Its number.
        robot: Name of the robot here.
        scheme: Visual servoing scheme.
        full: Full area or volume [m^2, m^3].
        rows: Bound [m, deg] and published share [%] by the name of the bound, in the order of
            printing; angles have names that end in _deg.
        volumes: The same with the published area or volume [m^2, m^3].
    """

    name: str
    robot: str
    scheme: str
    full: float
    rows: dict[str, dict[float, float]]
    volumes: dict[str, dict[float, float]]

    @property
    def title(self) -> str:
        """Words for headings."""
        return f"{self.name}: {self.scheme} on {self.robot}"

    @property
    def size(self) -> int:
        """Number of its rows."""
        return sum(map(len, self.rows.values()))


BASELINE_VALUES = {
    "r_bp": 0.03,
    "d_theta_bp_deg": 3.0,
    "r_pc": 0.01,
    "d_theta_pc_deg": 3.0,
    "r_A": 0.005,
    "r_B": 0.005,
    "r_s": 0.01,
}
"""Baseline of every bound [m, deg]; r_s for the planar robot only. Source: 3.3.2, 3.3.3."""

ACROBOT, PLANAR, CAROCA = 1.014, 0.92, 82.33

ABOUT = {
    "A.8": ("planar", "pbvs", PLANAR),
    "A.9": ("acrobot_small", "pbvs", ACROBOT),
    "A.10": ("acrobot_large", "pbvs", ACROBOT),
    "A.11": ("acrobot_fully_constrained", "pbvs", ACROBOT),
    "A.12": ("caroca", "pbvs", CAROCA),
    "A.13": ("acrobot_small", "2.5d", ACROBOT),
    "A.14": ("acrobot_large", "2.5d", ACROBOT),
    "A.15": ("caroca", "2.5d", CAROCA),
    "A.16": ("acrobot_small", "ibvs", ACROBOT),
    "A.17": ("acrobot_large", "ibvs", ACROBOT),
    "A.18": ("caroca", "ibvs", CAROCA),
}
"""Robot, scheme, and full area or volume [m^2, m^3] by table."""


def _tables() -> tuple[PublishedTable, ...]:
    tables = {name: PublishedTable(name, *about, {}, {}) for name, about in ABOUT.items()}
    words = Path(__file__).with_suffix(".tsv").read_text(encoding="utf-8")
    for line in words.splitlines()[1:]:
        name, bound, value, volume, share = line.split("\t")
        tables[name].rows.setdefault(bound, {})[float(value)] = float(share)
        tables[name].volumes.setdefault(bound, {})[float(value)] = float(volume)
    return tuple(tables.values())


TABLES = _tables()
"""All tables, in their order."""

BY_NAME = {table.name: table for table in TABLES}

DIGIT = 0.15
"""Printed shares that differ by less may differ in their last digit alone [points]."""

LENGTH_ROUNDING = 1e-9
"""Lengths that differ by less are the same [m]."""


class ShiftPair(NamedTuple):
    """A printed row of exit points beside one of the platform's place.

    A common shift of all exit points is a shift of the platform the other way. At the baseline of
    the other bounds the errors of r_A = r and a common shift by r are therefore those of
    r_bp = r + 0.025 m.

    Attributes:
        table: Name of their table.
        r_A: Bound on exit points of the first row [m].
        r_bp: Bound on the platform's place of the second [m].
        first: Printed share of the first [%].
        second: Printed share of the second [%].
    """

    table: str
    r_A: float
    r_bp: float
    first: float
    second: float

    @property
    def more(self) -> bool:
        """True if the first leaves more, by more than the last digit."""
        return self.first > self.second + DIGIT

    @property
    def less(self) -> bool:
        """True if the first leaves less, by more than the last digit."""
        return self.first < self.second - DIGIT


def nested_pairs(tables: Sequence[PublishedTable] = TABLES) -> list[ShiftPair]:
    """For each printed r_A the largest printed r_bp whose errors it contains.

    By (3.27) and the spheres of errors of 3.3.1 the row of r_A cannot leave more.
    """
    return [pair for table in tables for pair in _pairs(table, within=True)]


def covering_pairs(tables: Sequence[PublishedTable] = TABLES) -> list[ShiftPair]:
    """For each printed r_A the smallest printed r_bp whose errors contain a common shift by r_A.

    A row of r_A that leaves less has exit points that are not wrong in common.
    """
    return [pair for table in tables for pair in _pairs(table, within=False)]


def _pairs(table: PublishedTable, within: bool) -> list[ShiftPair]:
    spare = BASELINE_VALUES["r_bp"] - BASELINE_VALUES["r_A"]
    choose, sign = (max, 1.0) if within else (min, -1.0)
    shares, pairs = table.rows.get("r_bp", {}), []
    for r_A, share in table.rows.get("r_A", {}).items():
        fitting = [R for R in shares if sign * (R - r_A - spare) <= LENGTH_ROUNDING]
        if fitting:
            r_bp = choose(fitting)
            pairs.append(ShiftPair(table.name, r_A, r_bp, share, shares[r_bp]))
    return pairs


class Step(NamedTuple):
    """A printed row and the next larger value of the same bound, with their shares [%]."""

    table: str
    bound: str
    low: float
    high: float
    first: float
    second: float

    @property
    def rises(self) -> bool:
        """True if the larger bound leaves more, by more than the last digit; (3.27) forbids it."""
        return self.second > self.first + DIGIT


def steps_of(tables: Sequence[PublishedTable] = TABLES) -> list[Step]:
    """Steps from every printed row to the next larger value of its bound."""
    return [
        Step(table.name, bound, low, high, shares[low], shares[high])
        for table in tables
        for bound, shares in table.rows.items()
        for low, high in pairwise(sorted(shares))
    ]
