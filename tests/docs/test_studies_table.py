"""The guide's table of studies has every study of the catalogue, and nothing else."""

import re
from pathlib import Path

from cdpr_drake.analyses.studies.catalogue import STUDIES

GUIDE = Path(__file__).parents[2] / "docs" / "guides" / "studies.md"


def named():
    """Names in the first column, endings such as `-ibvs` put behind the first of their row."""
    for line in GUIDE.read_text(encoding="utf-8").splitlines():
        if line.startswith("| `") and "`cdpr study`" not in line:
            first, *others = re.findall(r"`([^`]+)`", line.split("|")[1])
            yield first
            yield from (f"{first}{other}" if other.startswith("-") else other for other in others)


def test_the_table_names_every_study():
    cases = {f"case-{number}" for number in range(1, 11)}  # "`case-1` to `case-10`"
    assert {*named(), *cases} == set(STUDIES)
