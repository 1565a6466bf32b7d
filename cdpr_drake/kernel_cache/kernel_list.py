"""Which kernels commands need, in which order, and whether they are there already."""

from __future__ import annotations

import functools
import hashlib
import os
import platform
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from cdpr_drake.kernel_cache.folder import state_of_sources

LIST = Path(__file__).parent / "kernels.tsv"
"""A line for each group, a name; then one for each kernel, called before calling: its name, the
numbers of those that it calls and of the groups that need it, and the types of its arguments."""


@dataclass(frozen=True)
class ListedKernel:
    """A kernel for some types of arguments.

    Attributes:
        number: Its place in the list: whoever needs it first comes first, called before calling.
        name: Module and function, as `geometry.pulley_kernel:tangent`.
        calls: Numbers of the listed kernels that it is compiled with.
        groups: Numbers of the groups that need it.
        signature: Types of its arguments as an expression of numba's names, as `f8[:,::1], i8,`.
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

    def types(self) -> tuple[Any, ...]:
        """Types of its arguments, as numba has them.

        Raises:
            ImportError, AttributeError, NameError: A class that is named is no longer there.
        """
        names = {**vars(import_module("numba.core.types")), "Named": _named}
        found: tuple[Any, ...] = eval(f"({self.signature})", names)  # from this package's own file
        return found


def _named(module: str, name: str, *types: Any) -> Any:
    """The type of a NamedTuple of this package."""
    base = import_module("numba.core.types").BaseTuple
    return base.from_types(types, getattr(import_module(module), name))


@functools.cache
def _read() -> tuple[tuple[str, ...], tuple[ListedKernel, ...]]:
    """Groups and kernels."""
    lines = [line.split("\t") for line in LIST.read_text(encoding="utf-8").splitlines()]
    kernels = []
    for number, (name, calls, groups, words) in enumerate(line for line in lines if len(line) > 1):
        called, asking = (frozenset(map(int, numbers.split())) for numbers in (calls, groups))
        kernels.append(ListedKernel(number, name, called, asking, words))
    return tuple(line[0] for line in lines if len(line) == 1), tuple(kernels)


def group_names() -> tuple[str, ...]:
    """What kernels are listed for, see `cli.process`."""
    return _read()[0]


def needed_kernels(groups: Collection[str]) -> list[ListedKernel]:
    """Kernels that some groups need, in the order of the list; unknown groups need none."""
    names, kernels = _read()
    numbers = {names.index(group) for group in groups if group in names}
    return [kernel for kernel in kernels if kernel.groups & numbers]


def missing_kernels(groups: Collection[str]) -> int:
    """How many kernels of some groups were never compiled and kept, by the names of files.

    numba is not imported for it, so that kernels of the same name for other arguments count as one.
    """
    folder = Path(os.environ.get("NUMBA_CACHE_DIR", ""))
    there = {path.name.rpartition("-")[0] for path in folder.glob("*/*.nbi")}
    names = {kernel.name for kernel in needed_kernels(groups)}
    return sum(name.rpartition(".")[2].replace(":", ".") not in there for name in names)


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
    hashed = hashlib.sha256(f"{group} {platform.node()} {state_of_sources()}".encode())
    hashed.update(LIST.read_bytes())
    folder = Path(os.environ.get("NUMBA_CACHE_DIR", ""))
    return folder / f"complete-{hashed.hexdigest()[:16]}"
