"""Random wrong input for `fuzz_inputs`: what a user's files and options may look like.

A case is a command line with the files that it reads. Everything follows from one generator of
random numbers, so that a case is known by its seed and its number.
"""

from __future__ import annotations

import base64
import json
import os
import random
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import yaml

from cdpr_drake.formats.robot_exchange import export_robot
from tests.analyses.logs import recorders
from tests.fuzz_damage import (
    CATALOGUES,
    ROBOT_SCENARIOS,
    ROBOTS,
    ROOT,
    SCENARIOS,
    change,
    change_bytes,
    change_text,
    change_tree,
)

WORDS = [
    "", " ", "nan", "inf", "-inf", "1e300", "-1e300", "-0", "0", "-1", "1e-320", "1_0", "0x10",
    "1,2", "0,0,0.2", "0,0,0.2,0,0,0", ",,", "1;2;3", "nan,nan,nan", "1e300,0,0", "0,0,inf",
    "999999999999999999999999", "1e9", "x" * 3000, "é" * 200, "a\nb", "\t", "$x$", "[bold]", "--",
    "-x", "../..", "/", ".", "/proc/x", "all", "none", "true", "robot.yaml", "1:2",
    "0:0", "5:1", "a=b", "=", "duration=", "duration=nan", "stop=null", "seed=1e300", "cables=[]",
    "controller.lambda_0=1.5=2", "x.y.z=1", "robot=robot.yaml", "\u0661", "½", "\udcff", "2.5d",
    "seed=" + "9" * 5000, "target=" + "[" * 500, "seed=!!int ''", "n" * 300 + ".yaml",
    "\x1b[31mred", "camera.kind=[projected]", "target={}", "r_A=0.01",
    "r_A=nan", "r_A=1e300", "d_theta_bp=9",
    "1,1,1", "0,0,0", "1e9,1e9,1e9", "-0.1:0.1:1e-12,1,1", "0:0.2:0.1,1,1", "0.1:-0.1:1,1,1",
]  # fmt: skip
"""What may stand where an option's value belongs."""

OUTPUTS = [
    "new", "new/deeper/still", "thesis", "thesis/new", "link", "broken", "loop", "notes.txt",
    "notes.txt/new", ".", "..", "../other", "../new", "mine", "sealed/new", "thesis/..", "x" * 300,
    "link/new", "é\u202e", "a\nb", ".hidden", "-", " ", "mine/", "./mine/../mine", "/", "/proc/new",
    "new\tname", "scenario.yaml", "../work", "fifo",
]  # fmt: skip
"""Results folders: new ones, foreign ones, files, links, what is above; `mine` is the program's."""


@dataclass
class Case:
    """One command line, and what lies around it.

    Attributes:
        arguments: Of `cdpr`.
        files: Contents by name, below the working folder.
        kinds: Names of files that are something else: "missing", "folder", "sealed", "loop",
            "dangling", "fifo", "link".
        catalogue: Folder below the working one that takes the place of a catalogue, or empty.
        pictures: Whether figures are drawn.
        words: What was changed.
    """

    arguments: list[str]
    files: dict[str, bytes] = field(default_factory=dict)
    kinds: dict[str, str] = field(default_factory=dict)
    catalogue: str = ""
    pictures: bool = False
    words: str = ""


def draw_case(seed: int, number: int) -> Case:
    """The case of that number."""
    rng = random.Random(f"{seed}:{number}")
    case = rng.choice(KINDS)(rng)
    case.pictures = rng.random() < 0.1
    return case


def _file_kind(rng: random.Random) -> str:
    """What a named file may be in place of a file; mostly it is one."""
    if rng.random() < 0.95:
        return ""
    return rng.choice(["missing", "folder", "sealed", "loop", "dangling", "fifo", "link"])


def _with_file(rng: random.Random, name: str, path: Path, arguments: list[str]) -> Case:
    content, words = change(rng, path)
    kind = _file_kind(rng)
    case = Case(arguments, {name: content}, words=f"{path.parent.name}/{path.name}: {words} {kind}")
    if kind:
        case.kinds[name] = kind
    return case


def _home(path: Path) -> str:
    tree = yaml.safe_load(path.read_text(encoding="utf-8"))["home"]
    return ",".join(str(x) for x in [*tree["position"], *tree.get("angles_deg", [0, 0, 0])])


def robot_file(rng: random.Random) -> Case:
    """A robot file for a question."""
    path = rng.choice(ROBOTS)
    pose = ["--pose", _home(path)]
    arguments = rng.choice([
        ["tension", "robot.yaml", *pose],
        ["tension", "robot.yaml", *pose, "--method", "all", "--json"],
        ["static", "robot.yaml", *pose],
        ["static", "robot.yaml", *pose, "--cable-model", "catenary", "--json"],
        ["view", "robot.yaml", "--html", "page.html"],
        ["view", "robot.yaml"],
        stability("robot.yaml", "sampled"),
        stability("robot.yaml", "certified"),
    ])  # fmt: skip
    return _with_file(rng, "robot.yaml", path, list(arguments))


def stability(robot: str, verdict: str) -> list[str]:
    """A small question about stability."""
    return ["stability", robot, "--grid", "1,1,1", "--draws", "2", "--searches", "1", "--pieces",
            "2", "--verdict", verdict, "--workers", "1", "--out", "found"]  # fmt: skip


def _simulate(path: Path, *more: str) -> list[str]:
    tension = "kind: tension_control" in path.read_text(encoding="utf-8")
    camera = [] if tension else ["--camera", "projected"]
    return ["simulate", "scenario.yaml", "--duration", "0.03", *camera, *more]


def scenario_file(rng: random.Random) -> Case:
    """A scenario file."""
    path = rng.choice(SCENARIOS)
    return _with_file(rng, "scenario.yaml", path, _simulate(path))


def scenario_of_robot(rng: random.Random) -> Case:
    """A good scenario with a bad robot."""
    path = rng.choice(ROBOT_SCENARIOS)
    tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    robot = next(file for file in ROBOTS if file.parent.name == tree["robot"])
    case = _with_file(rng, "robot.yaml", robot, _simulate(path))
    case.files["scenario.yaml"] = yaml.safe_dump(tree | {"robot": "robot.yaml"}).encode()
    return case


def catalogue_file(rng: random.Random) -> Case:
    """A bad camera or sensor in the catalogue."""
    kind = rng.choice(list(CATALOGUES))
    files, bad = CATALOGUES[kind], rng.choice(CATALOGUES[kind])
    folder = files[0].parent if kind == "cameras" else files[0].parent.parent
    name = {"cameras": "acrobot_pbvs", "sensors": "acrobot_sensors"}[kind]
    if bad.parent.name in ("range", "imu", "depth"):
        name = "acrobot_perception"
    if bad.stem in ("astra", "mt4018"):
        name = "acrobot_eye_to_hand"
    path = next(file for file in SCENARIOS if file.stem == name)
    content, words = change(rng, bad)
    case = Case(_simulate(path), {"scenario.yaml": path.read_bytes()}, catalogue=kind)
    case.files |= {f"{kind}/{one.relative_to(folder)}": one.read_bytes() for one in files}
    case.files[f"{kind}/{bad.relative_to(folder)}"] = content
    case.words = f"{bad.name}: {words}"
    return case


def bounds_file(rng: random.Random) -> Case:
    """A bad file of perturbation bounds."""
    tree = {"source": "x", "r_bp": 0.03, "d_theta_bp_deg": 3.0, "r_pc": 0.01, "r_A": 0.005}
    words = change_tree(rng, tree)
    content = yaml.safe_dump(tree).encode()
    if rng.random() < 0.4:
        content, words = change_bytes(rng, content)
    case = Case([*stability("acrobot_small", "sampled"), "--bounds", "bounds.yaml"])
    case.files, case.words, kind = {"bounds.yaml": content}, words, _file_kind(rng)
    if kind:
        case.kinds["bounds.yaml"] = kind
    return case


# Files of other tools, logs, bodies and meshes

FOREIGN = (
    ("acrobot_small", "sdf", ".sdf"), ("acrobot_small", "sdf-drake", ".sdf"),
    ("acrobot_small", "urdf", ".urdf"), ("acrobot_small", "mjcf", ".xml"),
    ("acrobot_small", "wcrfx", ".wcrfx"), ("acrobot_small", "gazebo-yaml", ".yaml"),
    ("hangprinter_4", "klipper", ".cfg"), ("hangprinter_4", "reprapfirmware", ".g"),
    ("maslow_4", "maslow", ".yaml"),
)  # fmt: skip
"""Robots in other tools' formats: the robot, the format, the ending."""


@lru_cache
def _foreign(robot: str, written: str) -> bytes:
    return next(iter(export_robot(robot, written).values())).encode()


@lru_cache
def _folder_of(written: str) -> dict[str, bytes]:
    return {name: text.encode() for name, text in export_robot("acrobot_small", written).items()}


def foreign_file(rng: random.Random) -> Case:
    """A robot of another tool."""
    command = rng.choice([["check"], ["import"], ["tension"]])
    more = ["--out", "new"] if command == ["import"] else []
    if rng.random() < 0.1:
        files = dict(_folder_of("caspr"))
        name = rng.choice(sorted(files))
        files[name], words = change_text(rng, files[name], ".xml")
        bodies = next(one for one in sorted(files) if "bod" in one)
        return Case([*command, bodies, *more], files, words=f"{name}: {words}")
    if rng.random() < 0.15:
        content, words = change_text(rng, json.dumps(GRAB).encode(), ".json")
        return Case([*command, "robot.json", *more], {"robot.json": content}, words=words)
    robot, written, ending = rng.choice(FOREIGN)
    content, words = change_text(rng, _foreign(robot, written), ending)
    name = f"bad{ending}"
    return Case([*command, name, *more], {name: content}, words=f"{written}: {words}")


GRAB = {
    "platform": {"mass": 2.0, "inertia_matrix": [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]},
    "actuators": [{"active": True, "cable": {"L0": 1.0}, "winch": {"drum_diameter": 0.1},
                   "pulley": {"pos_OD_glob": [x, y, 2.0], "pos_PA_loc": [x / 9, y / 9, 0.0]}}
                  for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1))],
}  # fmt: skip

LOGS = {
    "motive": lambda: recorders.motive(40, units="Millimeters"),
    "gtgraffiti": lambda: recorders.gtgraffiti(600),
    "grab": recorders.grab,
    "hangprinter script": recorders.hangprinter_script,
    "hangprinter columns": recorders.hangprinter_columns,
    "columns": recorders.columns,
    "tabs": lambda: recorders.columns("\t", ","),
}
"""Logs of recorders."""


def log_file(rng: random.Random) -> Case:
    """A log of a machine or tracker."""
    kind = rng.choice(list(LOGS))
    content, words = change_text(rng, LOGS[kind]().encode(), ".csv")
    more = ["--rate", "100"] if kind == "gtgraffiti" else []
    out = rng.choice([[], ["--out", "new.csv"]])
    return Case(["import-log", "log.csv", *more, *out], {"log.csv": content},
                words=f"{kind}: {words}")  # fmt: skip


MECHANISMS = sorted((ROOT / "models" / "robots").glob("*/mechanism.yaml"))

OBJ = b"v -0.05 -0.05 -0.04\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.04\n" + (
    b"f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
)

GLTF = json.dumps({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,"
                 + base64.b64encode(struct.pack("9f", 0, 0, 0, 0.1, 0, 0, 0, 0.1, 0)).decode()}],
}).encode()  # fmt: skip


def body_file(rng: random.Random) -> Case:
    """A mechanism's bodies, or its own file."""
    folder = rng.choice(MECHANISMS).parent
    files = {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*")
             if file.is_file() and file.suffix in (".yaml", ".urdf", ".sdf", ".xml")}  # fmt: skip
    name = rng.choice(sorted(files))
    files[name], words = change_text(rng, files[name], Path(name).suffix)
    return Case(["check", "mechanism.yaml"], files, words=f"{folder.name}/{name}: {words}")


def mesh_file(rng: random.Random) -> Case:
    """A mesh of a platform."""
    name, data = rng.choice([("body.obj", OBJ), ("body.gltf", GLTF)])
    content, words = change_text(rng, data, ".json" if name.endswith("gltf") else ".obj")
    tree = yaml.safe_load(ROBOTS[2].read_text(encoding="utf-8"))
    tree["platform"]["shape"] = {"kind": "mesh", "file": name}
    files = {"robot.yaml": yaml.safe_dump(tree).encode(), name: content}
    return Case(["check", "robot.yaml"], files, words=f"{name}: {words}")


# Other files that commands take

OTHERS: list[tuple[str, str, bytes]] = [
    (
        "import-log log.csv --mapping map.yaml",
        "map.yaml",
        b"columns: [time_ms, C1_length_mm, C2_length_mm, '', '']\nskip_rows: 1\nseparator: ','\n",
    ),
    (
        "plan acrobot_large --path path.csv --limits 1,60",
        "path.csv",
        b"x,y,z,phi,theta,psi\n0,0,0.2,0,0,0\n0.1,-0.1,0.3,0,0,0\n",
    ),
    (
        "plan acrobot_large --path path.gcode --limits 1,60 --corners rest",
        "path.gcode",
        b"G90 G21\nG0 X0 Y0 Z200 F3000\nG1 X80 F1200\nG1 Y80\nG2 X0 Y0 I-40 J-40\n",
    ),
    (
        "plan acrobot_large --waypoints 0,0,0.2;0.1,0,0.3 --resist push.yaml",
        "push.yaml",
        b"box: [0.02, 0.02, 0.02, 2, 2, 1]\n",
    ),
    (
        "workspace acrobot_large --kind wrench-feasible --grid 2,2,1 --wrench-set push.yaml",
        "push.yaml",
        b"vertices: [[0, 0, 0, 5, 0, 0], [0, 0, 0, -5, 0, 0]]\n",
    ),
    (
        "reconfigure acrobot_large --rails rails.yaml --poses 0.2,0.1,0.3",
        "rails.yaml",
        b"rails:\n- {cables: [C1, C2], axis: [0, 0, 1], lower: -0.4, upper: 0.1}\n",
    ),
    (
        "design acrobot_large --parameters design.yaml --generations 2",
        "design.yaml",
        b"exit_points: {reach: [0.1, 0.1, 0.1]}\nmirrors: [{axis: x, pairs: [C1-C8, C2-C7]}]\n"
        b"goals: [{name: static}]\nposes: {counts: [3, 3, 2]}\npopulation: 4\n",
    ),
]
"""Words, the file that is bad, and what a good one says."""


def other_file(rng: random.Random) -> Case:
    """A path, a mapping of columns, wrenches, rails, parameters of a design."""
    words, name, data = rng.choice(OTHERS)
    content, done = change_text(rng, data, Path(name).suffix)
    case = Case(words.split(), {name: content}, words=f"{name}: {done}")
    if name == "map.yaml":
        case.files["log.csv"] = LOGS["columns"]().encode()
    kind = _file_kind(rng)
    if kind:
        case.kinds[name] = kind
    return case


def asked_of_robot(rng: random.Random) -> Case:
    """A bad robot file for what writes another one, and for poses of rest."""
    path = rng.choice(ROBOTS)
    tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    place = ",".join(str(x) for x in tree["home"]["position"])
    words = rng.choice([
        ["new", "scenario", "mine", "--robot", "robot.yaml"],
        ["new", "robot", "mine", "--from", "robot.yaml"],
        ["export", "robot.yaml", "--format", "urdf", "--out", "new"],
        ["equilibria", "robot.yaml", "--position", place],
        ["check", "robot.yaml"],
    ])  # fmt: skip
    return _with_file(rng, "robot.yaml", path, words)


def log_of_robot(rng: random.Random) -> Case:
    """A bad log for a fit, or for a replay."""
    words = rng.choice([["calibrate", "acrobot_small", "log.csv"], ["identify", "acrobot_small",
                        "log.csv"], ["replay", "log.csv", "--robot", "acrobot_small"]])  # fmt: skip
    names = [f"C{k}_length_m" for k in range(1, 9)] + ["x_m", "y_m", "z_m"]
    rows = [[f"{0.1 * t:.1f}", *(f"{1 + 0.01 * k * t:.4f}" for k in range(11))] for t in range(5)]
    text = "\n".join(",".join(row) for row in [["time_s", *names], *rows]) + "\n"
    content, done = change_text(rng, text.encode(), ".csv")
    return Case([*words, "--out", "new"], {"log.csv": content}, words=done)


# Options

POSE = ["--pose", "0,0,0.2"]
COMMANDS: list[list[str]] = [
    ["simulate", "acrobot_pbvs", "--camera", "projected", "--duration", "0.03", "--out", "new"],
    ["simulate", "acrobot_pbvs", "--camera", "projected", "--duration", "0.03", "--seed", "3",
     "--set", "controller.lambda_0=1.5", "--json"],
    ["simulate", "acrobot_pbvs", "--camera", "projected", "--duration", "0.03", "--seeds", "1",
     "--workers", "1"],
    ["simulate", "planar_computed_torque", "--duration", "0.03", "--set", "seed=3"],
    ["tension", "acrobot_small", *POSE, "--method", "barycenter", "--wrench", "0,0,0,0,0,1",
     "--limits", "1,60", "--mass", "1.5", "--reference", "5", "--length-scale", "0.1"],
    ["tension", "acrobot_small", *POSE, "--plot", "picture.png", "--json"],
    ["static", "acrobot_small", *POSE, "--cable-model", "elastic", "--plot", "picture.png"],
    ["static", "acrobot_small", "--lengths", "1.2,1.2,1.2,1.2,1.2,1.2,1.2,1.2", "--no-pulleys"],
    [*stability("acrobot_small", "sampled"), "--scheme", "ibvs", "--vary", "r_A=0.01",
     "--orientation", "0,0,0", "--limits", "1,60", "--mass", "2", "--wrench", "0,0,0,0,0,1",
     "--seed", "1"],
    [*stability("acrobot_small", "searched"), "--scenario", "acrobot_pbvs"],
    ["study", "tension-methods", "--quick", "--out", "new"],
    ["study", "control-stability", "--quick", "--json", "--out", "new"],
    ["robots", "--json"],
    ["view", "acrobot_small", "--html", "page.html"],
    ["doctor", "--json"],
]  # fmt: skip


def options(rng: random.Random) -> Case:
    """A command line with something wrong in it."""
    words = list(rng.choice(COMMANDS))
    for _ in range(rng.choice([1, 1, 2, 3])):
        at = rng.randrange(len(words) + 1)
        kind = rng.choice(["value"] * 5 + ["drop", "insert", "swap", "again", "cut", "path"])
        if kind == "value" and words:
            values = [k for k, word in enumerate(words) if k and not word.startswith("--")]
            words[rng.choice(values or [0])] = rng.choice(WORDS)
        elif kind == "drop" and words:
            del words[at - 1]
        elif kind == "swap" and words:
            a, b = rng.randrange(len(words)), rng.randrange(len(words))
            words[a], words[b] = words[b], words[a]
        elif kind == "again" and words:
            words += words[at - 1 : at + 1]
        elif kind == "cut" and words:
            words[at - 1] = words[at - 1][: rng.randint(0, 6)]
        elif kind == "path" and words:
            words[at - 1] = rng.choice(
                ["robot.yaml", "thesis", "fifo", "loop", "notes.txt", "link"]
            )
        else:
            words.insert(at, rng.choice([*WORDS, "--overwrite", "--video", "--json", "--help"]))
    return Case(_bounded(words), {"robot.yaml": ROBOTS[2].read_bytes()}, words="options")


def _bounded(words: list[str]) -> list[str]:
    """The words, short of what is right and takes long: rendering, long runs, large sweeps."""
    if words[:1] == ["simulate"]:
        known = {path.stem for path in SCENARIOS}
        tension = any("computed_torque" in word for word in words)
        named = next((word for word in words[1:] if word in known), None)
        if named is None or "--camera" not in words:
            words = [*words, *([] if tension else ["--camera", "projected"])]
        if not any(word.startswith("--duration") for word in words):
            words = [*words, "--duration", "0.03"]
    if words[:1] == ["stability"] and "--grid" not in words:
        words = [*words, "--grid", "1,1,1"]
    if words[:1] == ["stability"] and "--workers" not in words:
        words = [*words, "--workers", "1"]
    return words


def output_folder(rng: random.Random) -> Case:
    """Results folders of all kinds, with and without --overwrite."""
    base = rng.choice([COMMANDS[0][:-1], COMMANDS[3] + ["--out"], COMMANDS[10][:-1],
                       COMMANDS[11][:-1], stability("acrobot_small", "sampled")[:-1],
                       COMMANDS[2] + ["--out"]])  # fmt: skip
    over = ["--overwrite"] if base[0] != "stability" and rng.random() < 0.6 else []
    return Case([*base, rng.choice(OUTPUTS), *over], words="results folder")


def written_file(rng: random.Random) -> Case:
    """Files that a command writes."""
    base = rng.choice([COMMANDS[5][:-2], COMMANDS[6][:-1], COMMANDS[13][:-1]])
    name = rng.choice([*OUTPUTS, "picture.png", "page.html", "a.pdf", "a.xyz", "mine/a.png", "",
                       "thesis/notes.html", "/proc/x.png", "sealed/a.png"])  # fmt: skip
    return Case([*base, name], words="written file")


KINDS: list[Callable[[random.Random], Case]] = [
    *[robot_file] * 5, *[scenario_file] * 6, *[scenario_of_robot] * 2, catalogue_file, bounds_file,
    *[options] * 5, *[output_folder] * 2, written_file, *[foreign_file] * 5, *[log_file] * 2,
    body_file, mesh_file, *[other_file] * 3, *[asked_of_robot] * 2, log_of_robot,
]  # fmt: skip


def lay_out(case: Case, base: Path) -> Path:
    """Makes the world of a case in an empty folder: foreign files, and the working folder.

    Returns:
        The working folder.
    """
    work = base / "work"
    for folder in ("other", "work/thesis", "work/mine", "work/runs/acrobot_pbvs", "work/studies"):
        (base / folder).mkdir(parents=True)
    for name in ("other/notes.txt", "notes.txt", "work/notes.txt", "work/thesis/notes.txt",
                 "work/thesis/notes.html", "work/thesis/summary.json",
                 "work/runs/acrobot_pbvs/notes.txt", "work/.new-work-abcdefgh"):  # fmt: skip
        (base / name).write_text("years of work\n", encoding="utf-8")
    (work / "mine" / ".cdpr_drake.json").write_text('{"program": "cdpr_drake"}\n', encoding="utf-8")
    (work / "mine" / "summary.json").write_text("{}\n", encoding="utf-8")
    (work / "link").symlink_to("thesis")
    (work / "broken").symlink_to("nowhere")
    (work / "loop").symlink_to("loop")
    os.mkfifo(work / "fifo")
    for name, content in case.files.items():
        path = work / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    for name, kind in case.kinds.items():
        path = work / name
        content = path.read_bytes()
        path.unlink()
        if kind == "folder":
            path.mkdir()
        elif kind == "sealed":
            path.write_bytes(content)
            path.chmod(0)
        elif kind == "fifo":
            os.mkfifo(path)
        elif kind in ("loop", "dangling", "link"):
            target = {"loop": path.name, "dangling": "nothing", "link": "thesis/real.yaml"}[kind]
            path.symlink_to(target)
            (work / "thesis" / "real.yaml").write_bytes(content)
    (work / "sealed").mkdir()
    (work / "sealed").chmod(0o500)
    return work
