"""Which kernels commands need, in which order, and whether they are there already."""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import sys
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

LIST = Path(__file__).parent / "kernels.tsv"
"""A line for each group, a name; then one for each kernel: its number, name, the numbers of those
that it calls, the numbers of the groups that need it, and the types of its arguments."""

PACKAGE = Path(__file__).parent.parent


@dataclass(frozen=True)
class ListedKernel:
    """A kernel for some types of arguments.

    Attributes:
        number: Its place in the list: whoever needs it first comes first, called before calling.
        name: Module and function, as `geometry.pulley_kernel:tangent`.
        calls: Numbers of the listed kernels that it is compiled with.
        groups: Numbers of the groups that need it.
        signature: Types of its arguments as words.
    """

    number: int
    name: str
    calls: frozenset[int]
    groups: frozenset[int]
    signature: str

    def dispatcher(self) -> Any:
        """The compiled function.

        Raises:
            ImportError, AttributeError: There is none of that name any more.
        """
        module, _, function = self.name.partition(":")
        return getattr(import_module(f"cdpr_drake.{module}"), function)


@functools.cache
def _read() -> tuple[tuple[str, ...], tuple[ListedKernel, ...]]:
    """Groups and kernels."""
    groups, kernels = [], []
    for line in LIST.read_text(encoding="utf-8").splitlines():
        fields = line.split("\t")
        if len(fields) == 1:
            groups.append(line)
            continue
        number, name, calls, needed_by, signature = fields
        called, asking = (frozenset(map(int, words.split())) for words in (calls, needed_by))
        kernels.append(ListedKernel(int(number), name, called, asking, signature))
    return tuple(groups), tuple(kernels)


def group_names() -> tuple[str, ...]:
    """What kernels are listed for, see `cli.process`."""
    return _read()[0]


def needed_kernels(groups: Collection[str]) -> list[ListedKernel]:
    """Kernels that some groups need, in the order of the list; unknown groups need none."""
    names, kernels = _read()
    numbers = {names.index(group) for group in groups if group in names}
    return [kernel for kernel in kernels if kernel.groups & numbers]


def is_complete(groups: Collection[str]) -> bool:
    """Whether all kernels of these groups have been compiled for these sources, on this machine."""
    return all(_marker(group).is_file() for group in groups)


def note_complete(groups: Collection[str]) -> None:
    """Notes that all kernels of these groups are in the cache folder; in vain on a full disk."""
    with suppress(OSError):
        for group in groups:
            _marker(group).touch()


def _marker(group: str) -> Path:
    """An empty file whose name stands for all that decides whether a kernel fits."""
    hashed = hashlib.sha256(f"{group} {sys.version} {platform.node()}".encode())
    for path in _files(group):
        with suppress(OSError):
            stat = path.stat()
            hashed.update(f"{path} {stat.st_size} {stat.st_mtime_ns}\n".encode())
    folder = Path(os.environ.get("NUMBA_CACHE_DIR", ""))
    return folder / f"complete-{hashed.hexdigest()[:16]}"


@functools.cache
def _files(group: str) -> list[Path]:
    """The list, and the sources of what a group needs."""
    modules = {kernel.name.partition(":")[0] for kernel in needed_kernels([group])}
    return [LIST, *(PACKAGE / f"{name.replace('.', '/')}.py" for name in sorted(modules))]
