"""Logs and tables in the formats of other programs: MATLAB's, Parquet, and MCAP."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.arrays import Array
from cdpr_drake.errors import OutputFormatError, install_words

Columns = dict[str, Array]
"""Columns of a table by name, shape (n,) each; numbers or words."""

ALWAYS = ("csv", "npz")
"""Formats in which every run leaves its log."""

LARGEST_MAT = 2**31 - 1
"""A variable of a .mat file of version 5 has at most so many bytes."""


def checked_log_formats(names: Sequence[str]) -> tuple[str, ...]:
    """Formats of logs that are to be written besides `ALWAYS`.

    Args:
        names: Of `ALWAYS` and `LOG_WRITERS`.

    Raises:
        OutputFormatError: One is unknown, or needs what is not installed.
    """
    known = (*ALWAYS, *LOG_WRITERS)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise OutputFormatError(
            f"log_formats: found {unknown[0]!r}; accepted: some of {','.join(known)}"
        )
    for name in names:
        _check_installed(name, "log_formats")
    return tuple(name for name in LOG_WRITERS if name in names)


def log_exports(folder: Path, formats: Sequence[str]) -> Pictures:
    """What writes the log of a results folder in further formats, by the names of the files.

    They read `log.npz`, and the names of columns from `log.csv`, in that folder.
    """
    return {f"log.{name}": partial(LOG_WRITERS[name], folder) for name in formats}


def _log_to_mat(folder: Path, path: Path) -> None:
    """A variable for each quantity of the log, shape (n, size), and `columns`, their names."""
    log, names = _read_log(folder)
    columns = {
        quantity: np.array([name.partition(".")[2] or name for name in of_quantity], object)
        for quantity, of_quantity in names.items()
    }
    _save_mat(path, log | {"columns": columns})


def _log_to_parquet(folder: Path, path: Path) -> None:
    """A column for each number, named as in `log.csv`."""
    log, names = _read_log(folder)
    columns: Columns = {}
    for quantity, values in log.items():
        columns |= dict(zip(names[quantity], values.reshape(len(values), -1).T, strict=True))
    _save_parquet(path, columns)


def _log_to_mcap(folder: Path, path: Path) -> None:
    """A channel for each quantity, and one of the platform's transforms."""
    from cdpr_drake.analyses.reporting.mcap_log import write_mcap

    log, names = _read_log(folder)
    quantities = {
        quantity: (names[quantity], values.reshape(len(values), -1).astype(float))
        for quantity, values in log.items()
        if quantity != "time"
    }
    write_mcap(path, log["time"], quantities, log.get("X_WP"))


LOG_WRITERS: dict[str, Callable[[Path, Path], None]] = {
    "mat": _log_to_mat,
    "parquet": _log_to_parquet,
    "mcap": _log_to_mcap,
}
"""By format: what writes the log of a folder to a path."""


def _read_log(folder: Path) -> tuple[dict[str, Array], dict[str, list[str]]]:
    """The log by quantity, and the names of each quantity's columns."""
    with np.load(folder / "log.npz", allow_pickle=False) as stored:
        log = {quantity: stored[quantity] for quantity in stored.files}
    with (folder / "log.csv").open(newline="", encoding="utf-8") as file:
        header = next(csv.reader(file))
    names: dict[str, list[str]] = {}
    for quantity, values in log.items():
        size = 1 if values.ndim == 1 else values.shape[1]
        names[quantity], header = header[:size], header[size:]
    if header or any(name.partition(".")[0] != q for q in log for name in names[q] if "." in name):
        raise OutputFormatError(f"{folder}: log.npz and log.csv have other columns")
    return log, names


def write_columns(path: Path, columns: Columns) -> None:
    """Writes a table in the format that the ending of the path names.

    Args:
        path: Ends in .csv, .npz, .mat or .parquet. In .mat, what is no letter or digit in a name
            becomes _.
        columns: The table.

    Raises:
        OutputFormatError: Another ending, or Parquet without pyarrow.
    """
    ending = path.suffix.removeprefix(".")
    if ending not in _TABLE_WRITERS:
        raise OutputFormatError(
            f"{path}: found the ending {path.suffix!r}; accepted: .{', .'.join(_TABLE_WRITERS)}"
        )
    _check_installed(ending, str(path))
    with whole_file(path) as part:
        _TABLE_WRITERS[ending](part, columns)


def _save_csv(path: Path, columns: Columns) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def _save_npz(path: Path, columns: Columns) -> None:
    np.savez_compressed(path, allow_pickle=False, **columns)


def _save_table_mat(path: Path, columns: Columns) -> None:
    cells = {name: c.astype(object) if c.dtype.kind == "U" else c for name, c in columns.items()}
    _save_mat(path, {re.sub(r"\W", "_", name): values for name, values in cells.items()})


def _save_mat(path: Path, variables: dict[str, object]) -> None:
    from scipy.io import savemat

    for name, values in variables.items():
        if isinstance(values, np.ndarray) and values.nbytes > LARGEST_MAT:
            raise OutputFormatError(
                f"{path}: {name}: found {values.nbytes / 1e9:.1f} GB; accepted: at most 2 GB"
            )
    savemat(path, variables, do_compression=True, oned_as="column", long_field_names=True)


def _save_parquet(path: Path, columns: Columns) -> None:
    import pyarrow
    from pyarrow import parquet

    parquet.write_table(pyarrow.table(columns), path)


_TABLE_WRITERS: dict[str, Callable[[Path, Columns], None]] = {
    "csv": _save_csv,
    "npz": _save_npz,
    "mat": _save_table_mat,
    "parquet": _save_parquet,
}


def _check_installed(name: str, where: str) -> None:
    package = _NEEDED.get(name)
    if package is not None and find_spec(package) is None:
        raise OutputFormatError(
            f"{where}: {name} needs {package}, which is not installed; {install_words(name)}"
        )


_NEEDED = {"parquet": "pyarrow", "mcap": "mcap"}
"""Packages that formats need beside what is always installed."""
