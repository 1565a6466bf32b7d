"""What of a result is kept: all but what is no result, and arrays as digests."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.frame.folder import LOCK

NOT_RESULTS = {
    r"(^|/)versions(/|$)": "versions of packages",
    r"(^|/)cdpr_drake$": "version and hash of the sources",
    r"(^|/)(commit|code|code_version)$": "state of the sources",
    r"(^|/)((wall|planning|sets)_time(_s)?|realtime_factor)$": "time that it took",
    r"(^|/)(seconds|processor_seconds|(kernel_)?microseconds)$": "time that it took",
    r"(^|/)(workers|processors|cores|threads)$": "count of processors",
    r"(^|/)(folder|out|path|results|log_file|host)$": "places on this machine",
}
"""Keys that are no results, as expressions for paths of keys with / between, and why."""

PLACES = re.compile(r"(?:/[^/\s\"':;,()]+){2,}/?")
"""Absolute paths in words."""


def strip(found: Any, key: str = "") -> Any:
    """A result of JSON without `NOT_RESULTS`, absolute paths in words as <path>."""
    if isinstance(found, dict):
        paths = {name: f"{key}/{name}" if key else str(name) for name in found}
        return {
            str(name): strip(value, paths[name])
            for name, value in found.items()
            if not any(re.search(pattern, paths[name]) for pattern in NOT_RESULTS)
        }
    if isinstance(found, list):
        return [strip(value, f"{key}/{number}") for number, value in enumerate(found)]
    return PLACES.sub("<path>", found) if isinstance(found, str) else found


def without_words(found: Any) -> Any:
    """A result of JSON with all texts empty, where words may change, but not how many."""
    if isinstance(found, dict):
        return {name: without_words(value) for name, value in found.items()}
    if isinstance(found, list):
        return [without_words(value) for value in found]
    return "" if isinstance(found, str) else found


TEXTS = (".cfg", ".g", ".md", ".py", ".sdf", ".urdf", ".wcrfx", ".xml", ".yaml")
"""Endings of files for users and other tools, whose lines are kept."""


def text_lines(folder: Path) -> dict[str, list[str]]:
    """Lines of `TEXTS` in a folder by the names of files, but for lines that name a command."""
    return {
        file.name: [
            strip(line)
            for line in file.read_text(encoding="utf-8").splitlines()
            if "cdpr " not in line
        ]
        for file in sorted(folder.iterdir())
        if file.suffix in TEXTS
    }


def digest(array: Any) -> dict[str, Any]:
    """A digest that tells one changed bit, and numbers that tell how large a change is."""
    values = np.ascontiguousarray(array)
    told: dict[str, Any] = {
        "dtype": str(values.dtype),
        "shape": list(values.shape),
        "sha256": hashlib.sha256(values.tobytes()).hexdigest(),
    }
    if values.dtype.kind in "biuf" and values.size:
        numbers = values.astype(float).ravel()
        known = numbers[np.isfinite(numbers)]
        told["unknown"] = int(numbers.size - known.size)
        if known.size:
            told |= {
                "mean": float(np.mean(known)),
                "least": float(np.min(known)),
                "largest": float(np.max(known)),
                "last": float(known[-1]),
            }
    return told


def digests(file: Path) -> dict[str, Any]:
    """Digests of the arrays in an .npz file, by name; those of `NOT_RESULTS` are left out."""
    with np.load(file, allow_pickle=False) as arrays:
        names = [
            name
            for name in sorted(arrays.files)
            if not any(re.search(pattern, name) for pattern in NOT_RESULTS)
        ]
        return {name: _digest_or_text(arrays[name], name) for name in names}


def _digest_or_text(array: Any, name: str) -> Any:
    """A digest; of one text that is JSON, what of it is a result."""
    if array.dtype.kind == "U" and array.size == 1:
        try:
            return strip(json.loads(str(array.item())), name)
        except ValueError:
            pass
    return digest(array)


def read_results(folder: Path, texts: bool = False) -> dict[str, Any]:
    """What a command wrote: JSON files stripped, arrays as digests, and names of all files.

    Args:
        folder: Where it did.
        texts: Whether other files are text, whose lines are kept.
    """
    kept: dict[str, Any] = {}
    for file in sorted(folder.iterdir()):
        if file.name in ("results.json", "summary.json"):
            kept[file.name] = strip(json.loads(file.read_text(encoding="utf-8")))
        elif file.suffix == ".npz":
            kept[file.name] = digests(file)
        elif texts:
            kept[file.name] = strip(file.read_text(encoding="utf-8").splitlines())
    files = {file.name for file in folder.iterdir() if file.is_file()} - {LOCK}
    kept["files"] = sorted(files)
    return kept
