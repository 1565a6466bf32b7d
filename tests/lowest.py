"""Writes tests/lowest.txt: the lowest version of every dependency that users install.

Extras of developers, `docs` and `test`, are not among them, but for what runs tests.

    python -m tests.lowest          writes it
    python -m tests.lowest --check  exit code 1 where it is not what pyproject.toml says

`.ci/run` installs these versions into a fresh environment and runs a few tests there.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent
LISTED = ROOT / "tests" / "lowest.txt"
HEAD = "# From pyproject.toml by python -m tests.lowest: each lower bound as the version to try.\n"

FOR_DEVELOPERS = ("docs", "test")
RUN_TESTS = ("pytest>", "hypothesis>")

REQUIREMENT = re.compile(r"(?P<name>[\w-]+)(\[[\w,]+\])?(>=(?P<lower>[\w.]+))?(,<[\w.]+)?")


def lowest() -> str:
    """A line for each dependency, also of the extras, and for what runs tests.

    Raises:
        ValueError: A dependency has no lower bound, or two.
    """
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = list(project["dependencies"])
    for extra, requirements in project["optional-dependencies"].items():
        runs_tests = [each for each in requirements if each.startswith(RUN_TESTS)]
        wanted += runs_tests if extra in FOR_DEVELOPERS else requirements
    found: dict[str, str] = {}
    for requirement in wanted:
        parts = REQUIREMENT.fullmatch(requirement)
        if parts is None or parts["lower"] is None:
            raise ValueError(f"{requirement}: found no lower bound; accepted: name>=version")
        if found.setdefault(parts["name"].lower(), parts["lower"]) != parts["lower"]:
            raise ValueError(f"{requirement}: found two lower bounds; accepted: one")
    return HEAD + "".join(f"{name}=={lower}\n" for name, lower in sorted(found.items()))


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        sys.exit(LISTED.read_text(encoding="utf-8") != lowest())
    LISTED.write_text(lowest(), encoding="utf-8")
