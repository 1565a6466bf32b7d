"""Random problems, the same by number: robots that ship or are made here, poses, options."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

COUNT = 1000
"""Problems in all."""

BATCH = 25
"""Problems of one golden file, which one process answers."""

SEED = 20261123


PLANES = {"planar": 0.3}
"""Height of the plane of planar robots that do not move at z = 0 [m]."""


@dataclass(frozen=True)
class Problem:
    """A command whose answer is kept.

    Attributes:
        arguments: Words behind `cdpr`; robots that are made here are files in the working folder.
        files: Texts of files by name.
        out: Folder that it writes, whose results are kept as well; None where it prints all.
        texts: Whether all files that it writes are text, and results.
    """

    arguments: tuple[str, ...]
    files: dict[str, str]
    out: str | None = None
    texts: bool = False


@dataclass(frozen=True)
class _Robot:
    """A robot as problems need it: name or file, text of the file, box of its poses [m], weight."""

    name: str
    text: str | None
    lower: np.ndarray
    upper: np.ndarray
    mass: float
    cables: int
    motion: str

    def files(self) -> dict[str, str]:
        return {} if self.text is None else {self.name: self.text}


def _shipped(rng: np.random.Generator, known: list[dict]) -> _Robot:
    """A robot of `cdpr robots --json`, with the inner half of its frame."""
    facts = known[int(rng.integers(len(known)))]
    lower, upper = (np.array(corner, float) for corner in facts["frame_m"])
    inset = 0.2 * (upper - lower)
    if facts["motion"].startswith("2T"):  # all poses in one plane
        lower[2] = upper[2] = PLANES.get(facts["name"], 0.0)
        inset[2] = 0.0
    return _Robot(
        facts["name"], None, lower + inset, upper - inset, float(facts["platform_mass_kg"]),
        int(facts["cables"]), str(facts["motion"]),
    )  # fmt: skip


def _random_robot(rng: np.random.Generator, number: int) -> _Robot:
    """Six to ten cables from near the edges of a frame to near the corners of a box."""
    count = int(rng.integers(6, 11))
    size = rng.uniform(1.0, 6.0, 3)
    box = rng.uniform(0.05, 0.2, 3) * size
    corners = rng.choice([-0.5, 0.5], (count, 3))
    corners[:8] = [
        [x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)
    ][:count]  # fmt: skip
    exits = corners * size * rng.uniform(0.85, 1.0, (count, 3)) + [0.0, 0.0, 0.5 * size[2]]
    if rng.random() < 0.5:  # suspended
        exits[:, 2] = size[2] * rng.uniform(0.9, 1.0, count)
    anchors = rng.permutation(corners) * box
    mass = float(rng.uniform(0.5, 40.0))
    low = 0.0 if rng.random() < 0.3 else float(rng.uniform(0.0, 0.2) * mass)
    radius = float(rng.choice([0.004, 0.02, 0.05]))
    lines = [
        f"name: made_{number:04d}",
        "platform:",
        f"  mass: {mass:.4f}",
        f"  size: {_row(box)}",
        "cable: {youngs_modulus: 1.0e11, diameter: 0.003, linear_density: 0.01, "
        "retardation_time: 1.0e-4}",
        f"pulley: {{radius: {radius}}}",
        "winch: {drum_radius: 0.04, gear_ratio: 10.0, motor_speed_rpm: 3000.0}",
        f"tension_bounds: {{lower: {low:.4f}, upper: {mass * rng.uniform(5.0, 60.0):.4f}}}",
        f"frame: {{lower: {_row(-0.5 * size + [0, 0, 0.5 * size[2]])}, "
        f"upper: {_row(0.5 * size + [0, 0, 0.5 * size[2]])}}}",
        f"home: {{position: [0.0, 0.0, {0.5 * size[2]:.4f}]}}",
        "cables:",
        *(
            f"  - {{name: C{k + 1}, exit_point: {_row(a)}, anchor_point: {_row(b)}}}"
            for k, (a, b) in enumerate(zip(exits, anchors, strict=True))
        ),
    ]
    half = 0.3 * size
    middle = np.array([0.0, 0.0, 0.5 * size[2]])
    return _Robot(
        f"made_{number:04d}.yaml", "\n".join(lines) + "\n", middle - half, middle + half, mass,
        count, "3R3T",
    )  # fmt: skip


def _row(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.4f}" for value in values) + "]"


def _words(values: np.ndarray) -> str:
    return ",".join(f"{value:.4f}" for value in values)


def _pose(rng: np.random.Generator, robot: _Robot, angle: float = 20.0) -> str:
    place = rng.uniform(robot.lower, robot.upper)
    turn = rng.uniform(-angle, angle, 3) * (rng.random() < 0.6)
    if robot.motion.startswith("2T"):
        turn[:2] = 0.0
        turn[2] *= robot.motion == "2T1R"
    elif robot.motion == "3T":
        turn[:] = 0.0
    return _words(np.concatenate([place, turn]))


def _load(rng: np.random.Generator, robot: _Robot) -> list[str]:
    """Limits, mass and wrench, each now and then."""
    more = []
    if rng.random() < 0.4:
        more += ["--limits", _words(robot.mass * np.array([rng.uniform(0, 1), rng.uniform(5, 40)]))]
    if rng.random() < 0.3:
        more += ["--mass", f"{robot.mass * rng.uniform(0.3, 3.0):.4f}"]
    if rng.random() < 0.3:
        wrench = rng.normal(size=6) * robot.mass * np.array([0.3, 0.3, 0.3, 3.0, 3.0, 3.0])
        more += [f"--wrench={_words(wrench)}"]
    return more


def _tension(rng: np.random.Generator, robot: _Robot) -> list[str]:
    return ["tension", robot.name, f"--pose={_pose(rng, robot)}", "--method", "all",
            *_load(rng, robot)]  # fmt: skip


def _static(rng: np.random.Generator, robot: _Robot) -> list[str]:
    model = str(rng.choice(["inextensible", "elastic", "kelvin_voigt", "catenary"]))
    bare = ["--no-pulleys"] * bool(rng.random() < 0.3)
    return ["static", robot.name, f"--pose={_pose(rng, robot)}", "--cable-model", model, *bare]


def _grid(rng: np.random.Generator, robot: _Robot, points: int) -> str:
    """Few points inside the robot's box."""
    parts = []
    for low, high in zip(robot.lower, robot.upper, strict=True):
        one, two = np.sort(rng.uniform(low, high, 2))
        step = max((two - one) / (points - 1), 1e-3)
        count = points if high > low else 1
        parts.append(f"{one:.4f}:{one + (count - 0.5) * step:.4f}:{step:.4f}")
    return ",".join(parts)


KINDS = (
    ["--kind", "static"], ["--kind", "wrench-closure"], ["--kind", "statically-stable"],
    ["--kind", "singularity-free"], ["--kind", "interference-free", "--clearance", "0.01"],
    ["--kind", "static,collision-free"], ["--kind", "static,wrench-closure"],
)  # fmt: skip
MEASURES = ("capacity-margin", "tension-factor", "payload", "stiffness", "frequency", "dexterity",
            "clearance")  # fmt: skip


def _workspace(rng: np.random.Generator, robot: _Robot) -> list[str]:
    chosen = int(rng.integers(len(KINDS) + 2))
    if chosen < len(KINDS):
        kind = KINDS[chosen]
    elif chosen == len(KINDS):
        kind = ["--kind", "wrench-feasible", "--force", f"{robot.mass * rng.uniform(0.1, 3):.3f}",
                "--moment", f"{robot.mass * rng.uniform(0.0, 0.1):.4f}"]  # fmt: skip
    else:
        kind = ["--kind", "dynamic", "--acceleration", _words(rng.uniform(0.1, 3.0, 2))]
    turned = _words(rng.uniform(-15, 15, 3) * (rng.random() < 0.5))
    measure = ["--measure", str(rng.choice(MEASURES))] if rng.random() < 0.4 else []
    return ["workspace", robot.name, *kind, *measure, "--grid", _grid(rng, robot, 3),
            f"--orientation={turned}", *_load(rng, robot), "--workers", "1"]  # fmt: skip


def _certified(rng: np.random.Generator, robot: _Robot) -> list[str]:
    kinds = ("static", "wrench-closure", "interference-free")
    return ["workspace", robot.name, "--kind", str(rng.choice(kinds)), "--certify", "--boxes",
            str(int(rng.integers(20, 300))), "--grid", _grid(rng, robot, 2), "--workers", "1",
            *(["--exit-error", f"{rng.uniform(0, 0.01):.4f}"] if rng.random() < 0.5 else []),
            *_load(rng, robot)]  # fmt: skip


def _hull(rng: np.random.Generator, robot: _Robot) -> list[str]:
    seen_from = _words(0.5 * (robot.lower + robot.upper))
    return ["workspace", robot.name, f"--hull={seen_from}", "--rays", "100", "--grid",
            _grid(rng, robot, 2), "--workers", "1", *_load(rng, robot)]  # fmt: skip


def _equilibria(rng: np.random.Generator, robot: _Robot) -> list[str]:
    place = _words(rng.uniform(robot.lower, robot.upper))
    taut = sorted(rng.choice(robot.cables, min(3, robot.cables), replace=False))
    names = ",".join(f"C{number + 1}" for number in taut)
    return ["equilibria", robot.name, f"--position={place}", "--taut", names]


def _stability(rng: np.random.Generator, robot: _Robot) -> list[str]:
    scheme = str(rng.choice(["pbvs", "pbvs-line", "2.5d", "ibvs"]))
    return ["stability", robot.name, "--scheme", scheme, "--verdict", "sampled", "--grid",
            _grid(rng, robot, 2), "--draws", "20", "--workers", "1"]  # fmt: skip


FORMATS = ("sdf", "sdf-drake", "urdf", "mjcf", "wcrfx", "caspr", "gazebo-yaml")


def _export(rng: np.random.Generator, robot: _Robot) -> list[str]:
    return ["export", robot.name, "--format", str(rng.choice(FORMATS))]


Asker = Callable[[np.random.Generator, _Robot], list[str]]

MIX: tuple[tuple[Asker, int, bool], ...] = (
    (_tension, 18, False), (_static, 9, False), (_workspace, 10, True), (_certified, 4, True),
    (_hull, 2, True), (_equilibria, 3, False), (_stability, 1, True), (_export, 3, True),
)  # fmt: skip
"""Who asks, how many of 50 problems, and whether the answer is a folder."""

_ROUND = [(ask, writes) for ask, count, writes in MIX for _ in range(count)]
assert COUNT % len(_ROUND) == 0


def problem(number: int, known: list[dict]) -> Problem:
    """Problem `number` of 0 to `COUNT` - 1; `known` is what `cdpr robots --json` prints."""
    rng = np.random.default_rng([SEED, number])
    ask, writes = _ROUND[(7 * number) % len(_ROUND)]
    with_camera = [facts for facts in known if facts.get("cameras")]
    if ask is _stability:
        robot = _shipped(rng, with_camera)
    elif rng.random() < 0.5:
        robot = _shipped(rng, known)
    else:
        robot = _random_robot(rng, number)
    arguments = [*ask(rng, robot), *(["--out", "out"] if writes else []), "--json"]
    return Problem(tuple(arguments), robot.files(), "out" if writes else None, ask is _export)


def write_files(asked: Problem, folder: Path) -> None:
    """Writes the files of a problem."""
    for name, text in asked.files.items():
        (folder / name).write_text(text, encoding="utf-8")


def read_robots(text: str) -> list[dict]:
    """What `cdpr robots --json` printed, in the order of names.

    Raises:
        SystemExit: A robot has lost a key that problems are made from.
    """
    needed = {"name", "frame_m", "platform_mass_kg", "cables", "motion"}
    robots = sorted(json.loads(text), key=lambda facts: str(facts["name"]))
    for facts in robots:
        if missing := needed - set(facts):
            raise SystemExit(f"cdpr robots --json: {facts['name']} has no {sorted(missing)}")
    return robots
