"""The log of a run: rows on disk while it grows, checkpoints beside it, and files at the end.

Whatever ends a process costs the rows of the last seconds at most. A checkpoint holds the state of
the run: the same command goes on from it, and gives the same numbers.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import time
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CheckpointError, OutputFolderError, StoppedError
from cdpr_drake.schema.json_text import load_json

Log = Mapping[str, Array]
"""Times "time", shape (n,) [s], and quantities by name, shape (n, size)."""

PARTS, LAYOUT, CHECKPOINT = "log.parts", "layout.json", "checkpoint.npz"
"""Folder of a log that grows, and in it the widths of its quantities and the last checkpoint."""

MOST_ROWS = 2000
"""Rows in memory at most, but for those of one piece of a run."""

LONGEST_WAIT = 2.0
"""Time after which rows go to disk however few they are [s]."""

CHECKPOINT_WAIT = 10.0
"""Time between two checkpoints [s]."""


class DiskLog(Mapping[str, Array]):
    """A log in files of 8-byte numbers, one a quantity; each look at a quantity reads its file."""

    def __init__(self, folder: Path, rows: int | None = None) -> None:
        """Opens the rows that are whole in all files, or cuts the files after a number of rows.

        Raises:
            OutputFolderError: There is no log that can be read.
            CheckpointError: There are fewer rows.
        """
        self.folder = folder
        try:
            self._sizes: dict[str, int | None] = load_json((folder / LAYOUT).read_text())
            whole = [self._file(n).stat().st_size // (8 * (s or 1)) for n, s in self._sizes.items()]
        except (OSError, ValueError, TypeError, AttributeError) as problem:
            raise OutputFolderError(f"{folder}: no log that can be read: {problem}") from problem
        self.rows = min(whole) if rows is None else rows
        if min(whole) < self.rows:
            raise CheckpointError(
                f"{folder}: found {min(whole)} rows of the log; accepted: the {self.rows} of its "
                "checkpoint at least"
            )
        if rows is not None:
            for name, size in self._sizes.items():
                os.truncate(self._file(name), rows * 8 * (size or 1))

    @classmethod
    def create(cls, folder: Path, first: Log) -> DiskLog:
        """A log that begins with these rows, in the place of an earlier one."""
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for name in first:
            (folder / f"{name}.f8").touch()
        sizes = {name: None if rows.ndim == 1 else rows.shape[1] for name, rows in first.items()}
        (folder / LAYOUT).write_text(json.dumps(sizes) + "\n")
        log = cls(folder)
        log.append(first)
        return log

    def append(self, rows: Log) -> None:
        """Writes more rows of the same quantities."""
        for name, values in rows.items():
            with self._file(name).open("ab") as file:
                file.write(np.ascontiguousarray(values, "<f8").tobytes())
        self.rows += len(rows["time"])

    def block(self, name: str, start: int, stop: int) -> Array:
        """Rows of a quantity from `start` to before `stop`."""
        size, stop = self._sizes[name], min(stop, self.rows)
        width = size or 1
        count = max(stop - start, 0) * width
        values = np.fromfile(self._file(name), "<f8", count, offset=8 * start * width)
        if len(values) < count:
            raise OSError(f"{self._file(name)}: shorter than it was")
        return values if size is None else values.reshape(-1, size)

    def _file(self, name: str) -> Path:
        return self.folder / f"{name}.f8"

    def __getitem__(self, name: str) -> Array:
        """All rows of a quantity."""
        return self.block(name, 0, self.rows)

    def __iter__(self) -> Iterator[str]:
        return iter(self._sizes)

    def __len__(self) -> int:
        return len(self._sizes)


class StoredLog(Mapping[str, Array]):
    """The log of a file `log.npz`; each look at a quantity opens the file and reads it."""

    def __init__(self, path: Path) -> None:
        """Reads the names; raises OSError, ValueError or BadZipFile if that is no such file."""
        self._path = path
        with np.load(path, allow_pickle=False) as stored:
            self._names = tuple(stored.files)

    def __getitem__(self, name: str) -> Array:
        """All rows of a quantity.

        Raises:
            OutputFolderError: The file is damaged.
        """
        if name not in self._names:
            raise KeyError(name)
        try:
            with np.load(self._path, allow_pickle=False) as stored:
                values: Array = stored[name]
        except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as problem:
            words = f"{self._path.parent}: {self._path.name} cannot be read: {problem}"
            raise OutputFolderError(words) from problem
        return values

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def log_block(log: Log, name: str, start: int, stop: int) -> Array:
    """Rows of a quantity from `start` to before `stop`, without reading the others."""
    return log.block(name, start, stop) if isinstance(log, DiskLog) else log[name][start:stop]


class Recorded(Protocol):
    """A source of rows, with a state that may be arrays."""

    def rows(self) -> int:
        """Number of rows in memory."""

    def take_rows(self) -> Log:
        """Returns the rows in memory, and forgets them."""

    def state_arrays(self) -> dict[str, Array] | None:
        """The state by names; None if it is more than arrays."""

    def restore_state(self, arrays: Mapping[str, Array]) -> None:
        """Replaces the state; raises ValueError if the arrays are of another source."""


class Recorder:
    """Moves rows of a run from memory to a folder, and keeps checkpoints there.

    Attributes:
        earlier: Time that earlier processes took up to the checkpoint [s]; None: the run begins.
    """

    def __init__(self, source: Recorded, folder: Path | None, checkpoints: bool) -> None:
        """Puts the source where the folder's checkpoint is, if there is one.

        Args:
            source: The source.
            folder: Where the log grows; None: rows stay in memory.
            checkpoints: False if no state is kept.

        Raises:
            CheckpointError: The checkpoint is damaged, or of another run.
        """
        self._source, self._folder, self._checkpoints = source, folder, checkpoints
        self._log: DiskLog | None = None
        self._logged = -np.inf
        self.earlier: float | None = None
        self._moved = self._saved = self._began = time.perf_counter()
        if folder is not None and checkpoints and (folder / CHECKPOINT).is_file():
            self._restore(folder)

    def _restore(self, folder: Path) -> None:
        try:
            with np.load(folder / CHECKPOINT, allow_pickle=False) as stored:
                arrays = dict(stored)
            rows, earlier = int(arrays.pop("rows")), float(arrays.pop("wall_time"))
            self._source.restore_state(arrays)
        except (OSError, ValueError, KeyError, zipfile.BadZipFile, zlib.error) as problem:
            raise CheckpointError(
                f"{folder / CHECKPOINT}: cannot be used: {problem}; add overwrite to begin anew"
            ) from problem
        self._log = DiskLog(folder, rows)
        self._logged = float(self._log.block("time", rows - 1, rows)[0])
        self._began, self.earlier = self._began - earlier, earlier

    def __call__(self) -> None:
        """Moves rows and keeps a checkpoint, if it is time; raises OSError on a full disk."""
        if self._folder is None:
            return
        now = time.perf_counter()
        if now - self._moved >= LONGEST_WAIT or self._source.rows() >= MOST_ROWS:
            self._move()
            self._moved = now
        if now - self._saved >= CHECKPOINT_WAIT:
            self.save()

    def finish(self) -> Log:
        """The whole log.

        Raises:
            StoppedError: It has no row.
        """
        if self._folder is None:
            return self._source.take_rows()
        self._move()
        if self._log is None:
            raise StoppedError("stopped; nothing was simulated")
        return self._log

    def save(self) -> None:
        """Moves rows and replaces the checkpoint."""
        state = self._source.state_arrays() if self._folder and self._checkpoints else None
        if state is None:
            return
        self._move()
        assert self._log is not None
        part = self._log.folder / f".{CHECKPOINT}"
        self._saved = time.perf_counter()
        with part.open("wb") as file:
            about: Any = {"rows": self._log.rows, "wall_time": self._saved - self._began}
            np.savez(file, allow_pickle=False, **about, **state)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, self._log.folder / CHECKPOINT)

    def _move(self) -> None:
        assert self._folder is not None
        if self._source.rows() == 0:
            return
        rows = self._source.take_rows()
        if rows["time"][0] <= self._logged:  # a simulator that goes on logs where it stands
            rows = {name: values[1:] for name, values in rows.items()}
        self._logged = -np.inf
        if self._log is None:
            self._log = DiskLog.create(self._folder, rows)
        elif len(rows["time"]) > 0:
            self._log.append(rows)


_WRENCH = ("mx_nm", "my_nm", "mz_nm", "fx_n", "fy_n", "fz_n")
_ELLIPSE = (("u", "px"), ("v", "px"), ("n20_", "px2"), ("n11_", "px2"), ("n02_", "px2"))
_POSE = ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m")
_PARTS = {
    "platform_velocity": ("wx_rad_s", "wy_rad_s", "wz_rad_s", "vx_m_s", "vy_m_s", "vz_m_s"),
    "found": ("flag",), "gain": ("per_s",), "feasible": ("flag",), "failures": ("count",),
    "servo_mode": ("image_flag", "switches", "l_pose", "l_image", "pose_bound", "image_bound"),
    "quality": ("deviation_px", "correlation", "share", "points", "followed"),
    "desired_wrench": _WRENCH, "applied_wrench": _WRENCH,
    "contact_force": ("x_n", "y_n", "z_n"), "contact_count": ("count",),
}  # fmt: skip
_PER_CABLE = {
    "cable_velocities": "m_s", "tensions": "n", "lengths": "m", "unstrained_lengths": "m",
    "slack": "flag", "surplus_lengths": "m", "measured_tensions": "n", "measured_lengths": "m",
    "tension_corrections": "m_s", "tension_thresholds": "n", "applied_torques": "nm",
    "friction_torques": "nm", "broken": "flag",
}  # fmt: skip


def column_names(log: Log, names: Mapping[str, Sequence[str] | str]) -> list[str]:
    """Names of the columns of `log.csv`, each ending in its unit, if it has one.

    Args:
        log: The log.
        names: Of "cables", of "error" of features, and of the numbers of further quantities; or
            the unit of a quantity with a number for each cable.
    """
    columns, named = ["time_s"], {**_PARTS, **_PER_CABLE, **names}
    for quantity in log:
        if quantity == "time":
            continue
        size = log_block(log, quantity, 0, 1).shape[1]
        known = named.get(quantity, ())
        if isinstance(known, str):
            endings = [f"{cable}_{known}" for cable in names["cables"]]
        elif quantity.startswith("X_"):
            endings = list(_POSE)
        elif quantity.endswith("corners_px"):
            endings = [f"{axis}{k}_px" for k in range(size // 2) for axis in "uv"]
        elif quantity == "ellipses_px":
            endings = [f"{part}{k}_{unit}" for k in (0, 1) for part, unit in _ELLIPSE]
        else:
            endings = list(known or map(str, range(size)))
        assert len(endings) == size
        columns += [f"{quantity}.{part}" for part in endings]
    return columns


def write_log(folder: Folder, log: Log, names: Mapping[str, Sequence[str] | str]) -> None:
    """Writes `log.npz`, an array a quantity, and `log.csv`, a column a number, piece by piece."""
    with folder.file("log.npz") as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as arrays:
        for name in log:
            with arrays.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, log[name], allow_pickle=False)
    with folder.file("log.csv") as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(column_names(log, names))
        for start in range(0, len(log["time"]), MOST_ROWS):
            rows = [log_block(log, name, start, start + MOST_ROWS) for name in log]
            writer.writerows(np.column_stack(rows).tolist())


def spread(values: Array) -> dict[str, float | None]:
    """Largest and mean of values, shape (n,); None where there are none."""
    if len(values) == 0:
        return {"max": None, "mean": None}
    return {"max": float(np.max(values)), "mean": float(np.mean(values))}
