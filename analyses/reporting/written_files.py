"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MARKER = ".cdpr_drake.json"
"""File by which this program knows results folders that it wrote."""


def _umask() -> int:
    """The mask of new files; the system tells it only to those who change it."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


_UMASK = _umask()


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A new file to write to, which gets its name when the block ends; what was there stays till
    then.

    Nobody can foresee its name, and it is no link, as a folder may be open to others; it has the
    ending, which tells the format.

    Raises:
        OSError: It cannot be written, for instance on a full disk; nothing is left behind.
    """
    handle, name = tempfile.mkstemp(prefix=".part-", suffix=f"-{path.name}", dir=path.parent)
    part = Path(name)
    try:
        os.fchmod(handle, 0o666 & ~_UMASK)
        os.close(handle)
        yield part
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
