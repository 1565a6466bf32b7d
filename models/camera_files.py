"""Where cameras are found: names of the catalogue, and paths of files. Reads no camera."""

from __future__ import annotations

from pathlib import Path

from cdpr_drake.schema.input_files import input_there

CAMERA_FOLDER = Path(__file__).parent / "cameras"
"""Of the catalogue."""

CAMERA_SUFFIXES = (".yaml", ".yml", ".xml")
"""Of files of cameras; what ends otherwise is a name of the catalogue."""


def camera_names() -> tuple[str, ...]:
    """Names of the cameras of the catalogue."""
    return tuple(sorted(path.stem for path in CAMERA_FOLDER.glob("*.yaml")))


def resolved_camera(name: str, folder: Path) -> str:
    """A camera's name, or the absolute path of its file: in a folder, if it is there, else as it is
    found from the working folder."""
    if not name.lower().endswith(CAMERA_SUFFIXES):
        return name
    beside = folder / name
    return str((beside if input_there(beside) else Path(name)).absolute())
