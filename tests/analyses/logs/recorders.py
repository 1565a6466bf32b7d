"""Small files as recorders write them, made from one motion that the tests know."""

from __future__ import annotations

import numpy as np

EXITS = np.array([[3.0, 0.0, 0.0], [3.0, 0.0, 2.3], [0.0, 0.0, 2.3], [0.0, 0.0, 0.0]])

MOTIVE_SHIFT = 1.25
"""By how much Motive's clock is behind the controller's [s]."""


def positions(t):
    """A point on a wall, shape (k, 3) [m]."""
    x = 1.5 + 0.5 * np.sin(0.9 * t) + 0.25 * np.sin(2.3 * t + 0.4) * np.cos(0.3 * t)
    z = 1.15 + 0.4 * np.cos(1.1 * t) + 0.2 * np.sin(2.9 * t)
    return np.column_stack([x, np.zeros(len(t)), z])


def lengths(p):
    """Of four cables, shape (k, 4) [m]."""
    return np.linalg.norm(p[:, None] - EXITS, axis=2)


def gtgraffiti(count=1200, rate=100.0):
    """A controller's log: text without times."""
    t = np.arange(count) / rate
    lines = []
    for p, row in zip(positions(t), lengths(positions(t)), strict=True):
        cables = "\t|\t".join(f"0 8 {-value:.4f} 0.0000" for value in row)
        lines.append(f"2: {p[0]:.4f} {p[2]:.4f} - 0.0000 0.0000\t|\t{cables}\t|\t0")
    lines.insert(500, "START TRAJECTORY")
    return "\n".join([*lines, "2: 1.4"]) + "\n"


def motive(count=1500, rate=120.0, units=None, bodies=("Sled",)):
    """A tracker's take with y upwards: p_M = (-y, z, -x) of W, so that W has axes -z, -x, y."""
    t = np.arange(count) / rate
    p = positions(t + MOTIVE_SHIFT)
    p_M = np.column_stack([-p[:, 1], p[:, 2], -p[:, 0]])
    settings = f"Format Version,1.1,Take Name,take,Rotation Type,Quaternion,Length Units,{units}"
    settings = settings if units else settings.partition(",Length")[0]
    kinds, names, parts, axes = [], [], [], []
    for name in bodies:
        kinds += ["Rigid Body"] * 8
        names += [name] * 8
        parts += ["Rotation"] * 4 + ["Position"] * 3 + ["Error Per Marker"]
        axes += [*"XYZW", *"XYZ", ""]
    kinds += ["Marker"] * 3
    names += ["Corner 1"] * 3
    parts += ["Position"] * 3
    axes += [*"XYZ"]
    factor = {"Millimeters": 1e3, None: 1.0}.get(units, 1.0)
    lines = [settings, ""]
    lines += [",," + ",".join(row) for row in (kinds, names, ["id"] * len(kinds), parts)]
    lines.append("Frame,Time," + ",".join(axes))
    for k in range(count):
        body = [0.0, 0.0, 0.0, 1.0, *(factor * p_M[k]), 0.0002] if k % 97 else [""] * 8
        cells = [k, f"{t[k]:.6f}", *(body * len(bodies)), -0.1 * factor, 0.0, 0.0]
        lines.append(",".join(str(cell) for cell in cells))
    return "\n".join(lines) + "\n"


def grab(count=60):
    """Raw lines of four actuators and an inclinometer, every 100 ms, with a gap."""
    lines = []
    for k in range(count):
        t = 10.0 + 0.1 * k + (5.0 if k > 30 else 0.0)
        for i in range(4):
            length, tension = 0.1 * i + 0.001 * k, 50.0 + i + 0.1 * k
            lines.append(
                f"3,{t:.3f},{i},9,{1000 * k},5,0,{length:.6f},0.0,{tension:.3f},55,"
                f"{k},0,{0.01 * k:.5f}"
            )
        lines.append(f"5,{t:.3f},{0.1 * k:.4f},1.5,-0.2")
        if k % 7 == 0:
            lines.append(f"6,{t:.3f},0,0,0")
    return "\n".join(lines) + "\n"


MOTOR_ANGLES = np.array([[0.0, -0.07, 0.0, 0.0], [-4834.5, 7431.3, -1079.4, 1309.7],
                         [8813.5, -9838.2, 2856.0, 2158.2]])  # fmt: skip

POINTS = np.array([[-0.5, -0.6, 0.0], [-266.1, -284.4, 0.5]])


def hangprinter_script():
    """Arrays as the calibration script has them."""
    motors = "\n".join(f"  [{', '.join(map(str, row))}, ]," for row in MOTOR_ANGLES.tolist())
    points = "\n".join(f"  [{', '.join(map(str, row))}]," for row in POINTS.tolist())
    return (
        "import numpy as np\n# motor_pos_samp = np.array([[1, 2]])\n"
        f"xyz_of_samp = np.array(\n[\n{points}\n# [1, 2, 3],\n])\n"
        f"motor_pos_samp = np.array([\n{motors}\n])\n"
        "force_samp = np.array([\n[13.7, 14.5, 14.1, 12.5],\n])\n"
    )


def hangprinter_columns():
    """The same as CSV."""
    header = "motor_A_deg,motor_B_deg,motor_C_deg,motor_D_deg,x_mm,y_mm,z_mm"
    rows = []
    for k, motors in enumerate(MOTOR_ANGLES.tolist()):
        points = POINTS[k].tolist() if k < len(POINTS) else ["", "", ""]
        rows.append(",".join(str(cell) for cell in [*motors, *points]))
    return "\n".join([header, *rows]) + "\n"


def columns(separator=",", decimal=".", ending="\n"):
    """Columns with units in their headers."""
    header = ["time_ms", "C1_length_mm", "C2_length_mm", "F1_N", "note_number"]
    rows = [[10.0 * k, 1000.5 + k, 2000.25 - k, 40.0 + k, k] for k in range(20)]
    lines = [separator.join(header)]
    lines += [separator.join(f"{cell:.3f}".replace(".", decimal) for cell in row) for row in rows]
    return ending.join(lines) + ending


def maslow(count=8):
    """The log of a Maslow's calibration: its list grows, and goes to the log each time."""
    poses = [[2300.5 + 7 * k, 923.4 + 11 * k, 1733.87 - 5 * k, 2801.87 - 3 * k]
             for k in range(count)]  # fmt: skip
    lines = ["[MSG:INFO: Calibration started]"]
    for rows in (poses[:3], poses):
        belts = "".join(
            f"{{bl:{bl:.2f},   br:{br:.2f},   tr:{tr:.2f},   tl:{tl:.2f}}},"
            for bl, br, tr, tl in rows
        )
        lines += ["$/Maslow_tlX=0.0", f"CLBM:[{belts}]"]
    return "\n".join(lines) + "\n"


def ros(count=6):
    """What rostopic echo -p writes of a tracker, times in ns."""
    header = "%time,field.header.seq,field.header.stamp,field.header.frame_id"
    header += ",field.pose.position.x,field.pose.position.y,field.pose.position.z"
    header += ",field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z"
    header += ",field.pose.orientation.w"
    start = 1732800000000000000
    rows = [
        f"{start + 10_000_000 * k + 300},{k},{start + 10_000_000 * k},world,{0.1 * k:g},1,2,0,0,0,1"
        for k in range(count)
    ]
    return "\n".join([header, *rows]) + "\n"
