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

from dataclasses import dataclass
from pathlib import Path


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
