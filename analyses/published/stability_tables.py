"""The servoing thesis' control stability workspaces as data: appendix A.5, and 3.3.3 to 3.4.2.

Shares are in per cent of the full workspace. Tables A.9, A.11, A.13, A.15, A.16 and A.18 are known
here only by what the text of chapter 3 says of them; where the text gives a volume, the share is
that volume over the full one.
"""

from __future__ import annotations

from dataclasses import dataclass


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

ACROBOT, PLANAR, CAROCA = 1.014, 0.92, 82.33

TABLES = (
    PublishedTable(
        "A.8", "planar", "pbvs",
        {
            "r_bp": {0.03: 95.4, 0.05: 84.1, 0.10: 36.5, 0.15: 0.0},
            "d_theta_bp_deg": {3: 95.4, 5: 94.5, 10: 93.0, 20: 85.6, 30: 74.7, 50: 0.0},
            "r_pc": {0.01: 95.4, 0.03: 93.4, 0.05: 93.3, 0.10: 92.9, 0.20: 92.3},
            "d_theta_pc_deg": {3: 95.4, 5: 95.1, 10: 94.5, 20: 93.6, 30: 91.7, 50: 75.4},
            "r_A": {
                0.005: 95.4, 0.01: 92.3, 0.02: 85.1, 0.03: 74.3, 0.04: 59.9, 0.05: 42.1,
                0.06: 17.2, 0.08: 0.0,
            },
            "r_B": {
                0.005: 95.4, 0.01: 92.3, 0.02: 85.9, 0.03: 79.2, 0.04: 62.8, 0.05: 44.0,
                0.06: 13.2, 0.08: 0.0,
            },
            "r_s": {
                0.01: 95.4, 0.05: 94.5, 0.10: 92.7, 0.20: 92.4, 0.30: 89.0, 0.40: 87.4, 0.50: 82.3,
            },
        },
        True, PLANAR,
    ),
    PublishedTable(
        "A.9", "acrobot_small", "pbvs",
        {"r_bp": {0.03: 86.3}, "r_B": {0.005: 86.3, 0.02: 38.6, 0.03: 9.0}},
        False, ACROBOT,
    ),
    PublishedTable(
        "A.10", "acrobot_large", "pbvs",
        {
            "r_bp": {
                0.03: 87.0, 0.05: 82.5, 0.10: 73.2, 0.20: 59.1, 0.25: 53.2, 0.30: 48.3, 0.50: 29.1,
                0.60: 19.8, 0.70: 10.8,
            },
            "d_theta_bp_deg": {3: 87.0, 5: 84.5, 10: 75.5, 20: 57.1, 30: 37.6, 40: 10.9, 50: 0.0},
            "r_pc": {0.01: 87.0, 0.03: 86.7, 0.05: 86.7, 0.10: 86.7, 0.20: 86.6},
            "d_theta_pc_deg": {3: 87.0, 5: 86.6, 10: 86.3, 20: 84.9, 30: 75.6, 40: 59.8, 50: 0.0},
            "r_A": {
                0.005: 87.0, 0.01: 75.2, 0.02: 66.7, 0.03: 56.4, 0.04: 45.5, 0.05: 34.3, 0.1: 0.3,
            },
            "r_B": {
                0.005: 87.0, 0.01: 74.3, 0.02: 61.0, 0.03: 44.0, 0.04: 24.1, 0.05: 6.9, 0.1: 0.0,
            },
        },
        True, ACROBOT,
    ),
    PublishedTable(
        "A.11", "acrobot_fully_constrained", "pbvs",
        {
            "r_bp": {0.10: 34.3, 0.25: 4.9},
            "d_theta_bp_deg": {20: 45.4},
            "r_pc": {0.01: 97.1, 0.20: 96.9},
        },
        False, ACROBOT,
    ),
    PublishedTable(
        "A.12", "caroca", "pbvs",
        {
            "r_bp": {
                0.03: 76.6, 0.05: 72.3, 0.10: 64.4, 0.20: 52.3, 0.25: 48.2, 0.30: 43.5, 0.50: 29.7,
                0.60: 24.3, 0.70: 19.2, 0.80: 14.9, 0.90: 11.4, 1.00: 8.4,
            },
            "d_theta_bp_deg": {3: 76.6, 5: 67.6, 10: 42.1, 20: 8.9, 30: 0.003, 40: 0.0},
            "r_pc": {
                0.01: 76.6, 0.03: 76.5, 0.05: 76.5, 0.10: 75.6, 0.20: 75.3, 0.30: 73.9, 0.40: 73.3,
                0.50: 71.9,
            },
            "d_theta_pc_deg": {3: 76.6, 5: 75.55, 10: 72.9, 20: 43.5, 30: 6.8, 40: 0.0},
            "r_A": {
                0.005: 76.6, 0.01: 73.5, 0.02: 71.4, 0.03: 69.1, 0.04: 66.4, 0.05: 63.6, 0.1: 48.8,
                0.2: 4.6, 0.3: 0.0,
            },
            "r_B": {
                0.005: 76.6, 0.01: 73.0, 0.02: 69.9, 0.03: 66.2, 0.04: 62.2, 0.05: 56.6, 0.1: 30.3,
                0.2: 20.9, 0.3: 9.6, 0.4: 4.5,
            },
        },
        True, CAROCA,
    ),
    PublishedTable(
        "A.13", "acrobot_small", "2.5d",
        {"r_A": {0.05: 47.6, 0.1: 0.0}, "r_B": {0.02: 14.5}},
        False, ACROBOT,
    ),
    PublishedTable(
        "A.14", "acrobot_large", "2.5d",
        {
            "r_bp": {
                0.03: 89.9, 0.05: 87.4, 0.10: 78.0, 0.20: 60.0, 0.25: 51.1, 0.30: 43.9, 0.50: 11.1,
                0.60: 0.0,
            },
            "d_theta_bp_deg": {3: 89.9, 5: 88.4, 10: 81.8, 20: 52.9, 30: 0.03, 40: 0.0},
            "r_pc": {0.01: 89.9, 0.03: 89.6, 0.05: 89.4, 0.10: 88.6, 0.20: 87.8},
            "d_theta_pc_deg": {3: 89.9, 5: 89.8, 10: 89.5, 20: 88.1, 30: 83.9, 40: 59.4, 50: 0.0},
            "r_A": {
                0.005: 89.9, 0.01: 86.9, 0.02: 82.9, 0.03: 77.7, 0.04: 73.2, 0.05: 67.1, 0.1: 40.2,
            },
            "r_B": {0.005: 89.9, 0.01: 85.5, 0.02: 66.5, 0.03: 20.6, 0.04: 0.0},
        },
        True, ACROBOT,
    ),
    PublishedTable(
        "A.15", "caroca", "2.5d",
        {
            "r_bp": {0.03: 94.0, 1.00: 30.0},
            "r_pc": {0.20: 94.0, 0.30: 76.4, 0.40: 0.0},
            "r_A": {0.1: 84.6, 0.2: 8.4},
        },
        False, CAROCA,
    ),
    PublishedTable(
        "A.17", "acrobot_large", "ibvs",
        {
            "r_bp": {
                0.03: 90.5, 0.05: 88.8, 0.10: 80.5, 0.20: 69.3, 0.25: 65.2, 0.30: 58.9, 0.50: 38.9,
                0.60: 29.4, 0.70: 20.1,
            },
            "d_theta_bp_deg": {3: 90.5, 5: 89.9, 10: 87.3, 20: 75.0, 30: 61.7, 40: 39.8, 50: 5.6},
            "r_pc": {0.01: 90.5, 0.03: 90.5, 0.05: 90.5, 0.10: 90.5, 0.20: 90.4},
            "d_theta_pc_deg": {3: 90.5, 5: 90.5, 10: 90.5, 20: 90.3, 30: 90.0, 40: 89.6, 50: 88.8},
            "r_A": {
                0.005: 90.5, 0.01: 88.2, 0.02: 86.9, 0.03: 80.7, 0.04: 75.5, 0.05: 70.8, 0.1: 47.4,
            },
            "r_B": {
                0.005: 90.5, 0.01: 88.4, 0.02: 84.4, 0.03: 74.6, 0.04: 60.3, 0.05: 41.5, 0.1: 0.0,
            },
        },
        True, ACROBOT,
    ),
    PublishedTable(
        "A.18", "caroca", "ibvs",
        {"d_theta_bp_deg": {50: 4.6}, "d_theta_pc_deg": {3: 94.0, 30: 94.0, 50: 91.7}},
        False, CAROCA,
    ),
)  # fmt: skip
"""All tables of which numbers are known; A.16, IBVS on the small platform, is not among them."""
