"""Runs pytest with modules of a copy of the sources: python run_in_copy.py COPY TEST...

Only files that are no links count, and their modules come from the copy; all others come from where
they are, with the kernels that are compiled for them.
"""

import importlib.util
import sys
from importlib.abc import MetaPathFinder
from pathlib import Path

import pytest

TOP = ("models", "systems", "analyses")


class CopyFinder(MetaPathFinder):
    """Finds what a recipe has added or changed."""

    def __init__(self, copy):
        self.copy = copy

    def find_spec(self, name, path=None, target=None):
        """The file in the copy, unless it is a link."""
        first, *rest = name.split(".")
        if first != "cdpr_drake" or not rest:
            return None
        folder = self.copy if rest[0] in TOP else self.copy / "cdpr_drake"
        place = folder.joinpath(*rest)
        for file, within in ((place.with_suffix(".py"), None), (place / "__init__.py", [place])):
            if file.is_file() and not file.is_symlink():
                where = [str(each) for each in within] if within else None
                return importlib.util.spec_from_file_location(
                    name, file, submodule_search_locations=where
                )
        return None


if __name__ == "__main__":
    sys.meta_path.insert(0, CopyFinder(Path(sys.argv[1])))
    sys.exit(pytest.main(sys.argv[2:]))
