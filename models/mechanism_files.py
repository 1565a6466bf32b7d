"""Which files are those of mechanisms, and what says that only robots of one platform are taken."""

from __future__ import annotations

from pathlib import Path

import yaml

from cdpr_drake.errors import RobotFileError
from cdpr_drake.schema.input_files import input_size, input_text, input_there
from cdpr_drake.schema.yaml_files import MOST_BYTES, YamlTextError, compose_yaml

MECHANISM_FILE = "mechanism.yaml"
"""Name of the file in a folder that holds a mechanism."""

MECHANISM_KEY = "mechanism"
"""Key at the top of a file that robots of one platform do not have."""

SCENARIO_KEY = "kind"
"""Key at the top of a scenario that moves a mechanism; mechanisms do not have it."""

TAKEN_BY = (
    "cdpr check, static, tension, view, export to caspr, and scenarios of kind mechanism; "
    "solve_static, solve_tensions"
)
"""What takes mechanisms, for messages."""

_FOLDER = Path(__file__).parent / "robots"


def mechanism_names() -> tuple[str, ...]:
    """Names of the mechanisms that come with the package; `robot_names` has the robots."""
    return tuple(sorted(path.parent.name for path in _FOLDER.glob(f"*/{MECHANISM_FILE}")))


def shipped_mechanism(name: str) -> Path | None:
    """The file of a mechanism that comes with the package; None: there is none of that name."""
    return _FOLDER / name / MECHANISM_FILE if name in mechanism_names() else None


def is_mechanism_text(content: str) -> bool:
    """Whether YAML has the key of mechanisms at its top; what does not parse has it not."""
    if MECHANISM_KEY not in content or len(content) > MOST_BYTES:
        return False
    try:
        root = compose_yaml(content)
    except YamlTextError:
        return False
    keys = {key.value for key, _ in root.value} if isinstance(root, yaml.MappingNode) else set()
    return MECHANISM_KEY in keys and SCENARIO_KEY not in keys


def is_mechanism(path: Path) -> bool:
    """Whether a file is that of a mechanism; what cannot be read is not."""
    try:
        if not input_there(path) or input_size(path) > MOST_BYTES:
            return False
        return is_mechanism_text(input_text(path))
    except (OSError, UnicodeDecodeError):
        return False


def single_platform(file: Path | str, asks: str) -> RobotFileError:
    """What is said where a mechanism is given to what takes robots of one platform only.

    Args:
        file: The mechanism's file, or its name.
        asks: What asks, as in "a scenario" or "cdpr workspace".
    """
    return RobotFileError(
        f"{file}: found a mechanism, cables between frames of a plant; accepted by {asks}: a robot "
        f"with one platform; mechanisms are taken by {TAKEN_BY}"
    )
