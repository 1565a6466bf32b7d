"""The servoing thesis' control stability workspaces as data: appendix A.5, and 3.3.3 to 3.4.2.

Shares are in per cent of the full workspace. Tables A.9, A.11, A.13, A.15, A.16 and A.18 are known
here only by what the text of chapter 3 says of them; where the text gives a volume, the share is
that volume over the full one.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import yaml


@dataclass(frozen=True)
class PublishedTable:
    """One table: how the workspace shrinks as one bound grows and the others stay at the baseline.

    Attributes:
        name: Its number.
        robot: Name of the robot here.
        scheme: Visual servoing scheme.
        rows: Bound [m, deg] and published share [%] by the name of the bound, in the order of
            printing; angles have names that end in _deg.
        complete: Whether the table is printed in full; otherwise rows are quoted from the text.
        full: Full area or volume [m^2, m^3].
    """

    name: str
    robot: str
    scheme: str
    rows: dict[str, dict[float, float]]
    complete: bool
    full: float

    @property
    def title(self) -> str:
        """Words for headings."""
        part = "" if self.complete else ", rows quoted in the text"
        return f"{self.name}: {self.scheme} on {self.robot}{part}"


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

TABLES = tuple(
    PublishedTable(**table)
    for table in yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text(encoding="utf-8"))
)
"""All tables of which numbers are known; A.16, IBVS on the small platform, is not among them."""
