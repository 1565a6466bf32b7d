"""Small files of other tools, made from numbers that the tests know."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.models.formats.tree_files import Cable, Link, Model

EXITS = np.array(
    [
        [-2.0, 1.5, 2.0], [2.0, 1.5, 2.1], [2.0, -1.5, 2.2], [-2.0, -1.5, 2.3],
        [-2.1, 1.5, 0.0], [2.0, 1.6, 0.1], [2.0, -1.5, 0.2], [-2.0, -1.7, 0.3],
    ]
).T  # fmt: skip
ANCHORS = np.array(
    [
        [-0.06, 0.06, 0.05], [0.06, 0.06, 0.05], [0.06, -0.06, 0.05], [-0.06, -0.06, 0.05],
        [-0.06, 0.07, -0.05], [0.06, 0.05, -0.05], [0.07, -0.06, -0.05], [-0.05, -0.06, -0.05],
    ]
).T  # fmt: skip
"""Eight points of the world and of the platform, no two alike, shape (3, 8) [m]."""

MASS, COM, INERTIA = (
    2.5,
    np.array([0.01, -0.02, 0.03]),
    np.array([0.1, 0.2, 0.25, 0.01, 0.0, -0.02]),
)
HOME = np.array([0.2, -0.1, 1.1])
ANGLES = np.array([0.1, -0.2, 0.3])
"""Of R = Rx Ry Rz [rad]."""


def edited(folder: Path, *pairs: tuple[str, str]) -> None:
    """Replaces words wherever they are in the files of a folder; each must be somewhere."""
    for old, new in pairs:
        paths = [path for path in folder.iterdir() if old in path.read_text(encoding="utf-8")]
        assert paths, old
        for path in paths:
            text = path.read_text(encoding="utf-8").replace(old, new)
            path.write_text(text, encoding="utf-8")


def words(values) -> str:
    return " ".join(repr(float(value)) for value in values)


def caspr(
    folder: Path,
    *,
    joint: str = "SPATIAL_EULER_XYZ",
    q: str | None = None,
    reference: str = "joint",
    pulley: bool = False,
    links: int = 1,
    name: str = "toy",
    points: tuple[np.ndarray, np.ndarray] = (EXITS, ANCHORS),
) -> Path:
    """Writes bodies and cables, from points of the world to those of the body, shape (3, m) each.

    Returns:
        The bodies' file.
    """
    q = words([*HOME, *ANGLES]) if q is None else q
    link = Link(joint, q, name="Toy", mass=f"{MASS}", com=words(COM), inertia=words(INERTIA))
    cables, shift = [], COM if reference == "com" else np.zeros(3)
    for k, (A, B) in enumerate(zip(points[0].T, points[1].T, strict=True)):
        base = (
            f"<base_rotating_pulley><fixed_location>{words(A)}</fixed_location>"
            f"<pulley_radius>{0.04 + 0.001 * k}</pulley_radius>"
            "<cable_entry_vector>0 1 1</cable_entry_vector></base_rotating_pulley>"
        )
        ends = [base if pulley else (0, words(A)), (1, words(B - shift))]
        limits = f"<force_min>{k}</force_min><force_max>{700 + k}</force_max>"
        cables.append(Cable(ends, f"cable {k + 1}", reference, properties=limits))
    model = Model([link] * links, cables, {"first": []}, name, "second", "-3 3 -3 3 0 3")
    return model.write(folder)


def wirex(folder: Path) -> Path:
    """Writes a wcrfx file whose swivel axes are along y."""
    frame = 'a11="1" a21="0" a31="0" a12="0" a22="0" a32="-1" a13="0" a23="1" a33="0"'
    chains = "".join(
        f'<chain id="{k + 1}" winchtype="W"><base x="{A[0]}" y="{A[1]}" z="{A[2]}" {frame} '
        f'radius="0.1"/><platform x="{B[0]}" y="{B[1]}" z="{B[2]}"/></chain>'
        for k, (A, B) in enumerate(zip(EXITS.T, ANCHORS.T, strict=True))
    )
    path = folder / "toy.wcrfx"
    path.write_text(
        f"""<models version="0.31"><robot name="Toy 1" motionpattern="3R3T">
        <geometry>{chains}</geometry><platform mass="{MASS}">
        <inertiatensor Ixx="14"/><centerofgravity x="0.01" y="-0.02" z="0.03"/></platform></robot>
        <cable name="c" elasticity="1.1e11" radius="0.003" breaking_load="40000" damping="1"
        weight="0.023" minimum_load="5"/>
        <winch name="W"><cable f_max="720" max_velocity="2"/><motor inertia="0.0015"
        angular_velocity="6000" gear_ratio="3"/><drum r_drum="0.1"/></winch></models>""",
        encoding="utf-8",
    )
    return path


def column(values) -> str:
    """A column as GRAB's files have it."""
    return "[" + ", ".join(f"[{float(value)!r}]" for value in values) + "]"


RADIUS, AXES = 0.03, ((0.0, 0.0, 1.0), (0.0, -0.6, 0.8), (0.0, 0.0, -1.0), (0.6, 0.0, -0.8))
"""Of pulleys on the platform: radius [m], and k in P of the cables in turn."""


def grab_on_board(folder: Path, *, drums: tuple[float, ...] = (0.06,)) -> Path:
    """Writes a JSON file of a robot whose winches and pulleys are on the platform."""
    items = ", ".join(
        f'{{"active": true, "pulley": {{"transmission_ratio": 1e-05, "radius": {RADIUS}, '
        f'"swivel0": 1, "pos_OA_glob": {column(A)}, "vers_i_loc": {column([1, 0, 0])}, '
        f'"vers_k_loc": {column(AXES[k % 4])}}}, "winch": {{"l0": 1, "pos_PD_loc": {column(B)}, '
        f'"drum_diameter": {drums[k % len(drums)]}, "h": 0.05}}}}'
        for k, (A, B) in enumerate(zip(EXITS.T, ANCHORS.T, strict=True))
    )
    path = folder / "toy.json"
    path.write_text(
        f'{{"motion_pattern": "THREE_R_THREE_T", "actuator": [{items}], '
        f'"platform": {{"mass": {MASS}, "gravity_axis": [[0], [0], [1]], '
        f'"pos_PG_loc": {column(COM)}, "rotation_parametrization": "TAIT_BRYAN"}}}}',
        encoding="utf-8",
    )
    return path


def grab(folder: Path, *, old: bool = False, tilt: bool = False, count: int = 3) -> Path:
    """Writes a JSON file with a trailing comma and one cable that is not active."""
    k_axis = column([0.0, 0.6, 0.8])
    items = []
    for k, (A, B) in enumerate(zip(EXITS.T[: count + 1], ANCHORS.T[: count + 1], strict=True)):
        if old:
            items.append(
                f'{{"pos_D_glob": {column(A)}, "pos_A_loc": {column(B)}, "vers_k": {k_axis}, '
                f'"swivel_pulley_r": 0.02, "l0": 1}},'
            )
        else:
            active = "false" if k == count else "true"
            items.append(
                f'{{"active": {active}, "pulley": {{"radius": {0.02 + 0.001 * k}, "pos_OD_glob": '
                f'{column(A)}, "vers_k": {k_axis}}}, "winch": {{"pos_PA_loc": {column(B)}}}}},'
            )
    axis = column([0.0, np.sin(0.02), np.cos(0.02)] if tilt else [0.0, 0.0, 1.0])
    com, key = ("pos_G_loc", "cable") if old else ("pos_PG_loc", "actuator")
    path = folder / "toy.json"
    path.write_text(
        f'{{"{key}": [{"".join(items)}], "platform": {{"mass": {MASS}, "gravity_axis": {axis}, '
        f'"{com}": {column(COM)}, "inertia_mat_G_loc": [[0.1, 0.01, 0], [0.01, 0.2, -0.02], '
        "[0, -0.02, 0.25]],}}",
        encoding="utf-8",
    )
    return path


def gazebo(folder: Path, *, fork: bool = False, world_points: bool = False) -> Path:
    """Writes the simulator's YAML, in the schema of the fork or with platform points in W."""
    anchors = ANCHORS + HOME[:, np.newaxis] if world_points else ANCHORS
    points = "\n".join(
        f"  - {{frame: {A.tolist()}, platform: {B.tolist()}}}"
        for A, B in zip(EXITS.T, anchors.T, strict=True)
    )
    shape = (
        "lower: [-0.1, -0.1, -0.06], upper: [0.1, 0.1, 0.08]" if fork else "size: [0.2, 0.2, 0.12]"
    )
    inertia = (
        "inertial: {xx: 0.1, yy: 0.2, zz: 0.25, xy: 0.01, xz: 0, yz: -0.02}"
        if fork
        else f"inertia: {INERTIA.tolist()}"
    )
    text = f"""cable: {{mass: 0.001, radius: 0.005}}
frame: {{color: Grey, lower: [-2, -2, 0], radius: 0.02, type: box, upper: [2.2, 2, 2.5]}}
joints:
  actuated: {{damping: 1, effort: 1000, min: 5, velocity: 10}}
  passive: {{damping: 0.01, effort: 100, velocity: 10}}
platform: {{mass: {MASS}, {inertia}, position: {{rpy: [0, 0, 0], xyz: {HOME.tolist()}}}, {shape}}}
points:
{points}
"""
    if fork:
        text = "controllers: {}\nmodel:\n" + "".join(f"  {line}\n" for line in text.splitlines())
    path = folder / "toy.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def mjcf(folder: Path) -> Path:
    """Writes MJCF in degrees with a class of sites, whose platform is a free body."""
    exits = "".join(f'<site name="A{k}" pos="{words(A)}"/>' for k, A in enumerate(EXITS.T))
    anchors = "".join(f'<site name="B{k}" pos="{words(B)}"/>' for k, B in enumerate(ANCHORS.T))
    tendons = "".join(
        f'<spatial name="t{k}" width="0.002"><site site="A{k}"/><site site="B{k}"/></spatial>'
        for k in range(8)
    )
    motors = "".join(f'<motor tendon="t{k}" forcerange="-{500 + k} -1"/>' for k in range(8))
    path = folder / "toy.xml"
    path.write_text(
        f"""<mujoco><compiler angle="degree" autolimits="true"/><option gravity="0 0 -9.8"/>
        <worldbody>{exits}<body name="box" pos="{words(HOME)}" euler="0 0 30"><freejoint/>
        <inertial pos="{words(COM)}" mass="{MASS}" fullinertia="{words(INERTIA)}"/>
        <geom type="box" size="0.1 0.1 0.06" contype="0" conaffinity="0"/>{anchors}</body>
        </worldbody><tendon>{tendons}</tendon><actuator>{motors}</actuator></mujoco>""",
        encoding="utf-8",
    )
    return path


def sdformat(folder: Path) -> Path:
    """Writes SDFormat with named frames, those of the frame relative to another frame."""
    exits = "".join(
        f'<frame name="A_{k}" attached_to="corner">'
        f"<pose>{words(A - [1, 0, 0])} 0 0 0</pose></frame>"
        for k, A in enumerate(EXITS.T)
    )
    anchors = "".join(
        f'<frame name="B_{k}" attached_to="box"><pose>{words(B)} 0 0 0</pose></frame>'
        for k, B in enumerate(ANCHORS.T)
    )
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    inertia = "".join(f"<{key}>{value}</{key}>" for key, value in zip(keys, INERTIA, strict=True))
    path = folder / "toy.sdf"
    path.write_text(
        f"""<sdf version="1.9"><model name="toy"><link name="base"/>
        <joint name="fix" type="fixed"><parent>world</parent><child>base</child></joint>
        <frame name="corner" attached_to="base"><pose>1 0 0 0 0 0</pose></frame>
        <link name="box"><pose>{words(HOME)} 0 0 0</pose><inertial><mass>{MASS}</mass>
        <pose>{words(COM)} 0 0 0</pose><inertia>{inertia}</inertia></inertial>
        <visual name="v"><geometry><box><size>0.2 0.2 0.1</size></box></geometry></visual></link>
        {exits}{anchors}</model></sdf>""",
        encoding="utf-8",
    )
    return path


KLIPPER = """[printer]
kinematics: winch
max_velocity: 300
max_accel: 3000
[include mcu.cfg]
[extruder]
nozzle_diameter: 0.4
""" + "".join(
    f"[stepper_{letter}]\nstep_pin: PF0 # a comment\nrotation_distance: 40\ngear_ratio: 51:4\n"
    f"anchor_x: {x}\nanchor_y: {y}\nanchor_z: {z}\n"
    for letter, (x, y, z) in zip(
        "abcd", [(0, -2000, -100), (2000, 1000, -100), (-2000, 1000, -100), (0, 0, 3000)],
        strict=True,
    )
)  # fmt: skip

REPRAP = """; Hangprinter
M669 K6 N4 A0.0:-1604.5:-114.1 B1312.5:1270.9:-162.2 C-1440.3:741.6:-161.2 D0:0:2345.0 P2000
M666 Q0.0 R65.0:65.0:65.0:65.0 U2:2:2:2 O1:1:1:1 L20:20:20:20 H255:255:255:255 J200:200:200:200
M666 W2.5 S20000 I4:4:4:4 X90:90:90:90 Z3
M92 X100
"""

MASLOW = """Maslow_vertical: true
name: my board
kinematics:
  Cartesian: {}
  MaslowKinematics: {tlX: 100.0, tlY: 2400.0, tlZ: 100.0, trX: 3600.0, trY: 2410.0, trZ: 56.0,
    blX: 0.0, blY: 0.0, blZ: 34.0, brX: 3610.0, brY: 0.0, brZ: 78.0, beltEndExtension: 30.0,
    armLength: 123.4, oddity: 1}
"""


def saved(name: str, text: str):
    """What writes a text to a file of that name in a folder."""

    def write(folder: Path) -> Path:
        path = folder / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


klipper = saved("printer.cfg", KLIPPER)
reprap = saved("config.g", REPRAP)
maslow = saved("maslow.yaml", MASLOW)
