"""Prints times and their ratios.

    python -m tests.benchmarks
    python -m tests.benchmarks NAME ...

Without a name it lists the benchmarks. A row is a way to compute, the median of its processor time,
and how many times as fast it is as the way that it is compared with, in the same run.
"""

from __future__ import annotations

import ast
import sys
from importlib import import_module
from pathlib import Path

HELPERS = {"__init__", "__main__", "ratios"}


def benchmarks() -> dict[str, str]:
    """First lines of all benchmarks by name."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    return {
        path.stem: (ast.get_docstring(ast.parse(path.read_text())) or "").partition("\n")[0]
        for path in files
        if path.stem not in HELPERS
    }


def main(names: list[str]) -> None:
    """Runs benchmarks by name, or lists all.

    Raises:
        SystemExit: A name is unknown, or a peer is not installed.
    """
    known = benchmarks()
    unknown = [name for name in names if name not in known]
    if unknown:
        raise SystemExit(f"{unknown[0]}: no such benchmark; accepted: {', '.join(known)}")
    if not names:
        print(*(f"{name:10} {line}" for name, line in known.items()), sep="\n")
    for name in names:
        print(f"{name}: {known[name]}", flush=True)
        try:
            for ratio in import_module(f"tests.benchmarks.{name}").benchmark():
                print(f"  {ratio}", flush=True)
        except ModuleNotFoundError as error:
            raise SystemExit(f"{name}: needs {error.name}: pip install {error.name}") from None


if __name__ == "__main__":
    main(sys.argv[1:])
