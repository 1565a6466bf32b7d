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
    n = len(bodies)
    kinds = ["Rigid Body"] * 8 * n + ["Marker"] * 3
    names = [name for name in bodies for _ in range(8)] + ["Corner 1"] * 3
    body = ["Rotation"] * 4 + ["Position"] * 3 + ["Error Per Marker"]
    parts, axes = body * n + ["Position"] * 3, [*"XYZW", *"XYZ", ""] * n + [*"XYZ"]
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
        lines += [
            f"3,{t:.3f},{i},9,{1000 * k},5,0,{0.1 * i + 0.001 * k:.6f},0.0,{50.0 + i + 0.1 * k:.3f}"
            f",55,{k},0,{0.01 * k:.5f}"
            for i in range(4)
        ]
        lines.append(f"5,{t:.3f},{0.1 * k:.4f},1.5,-0.2")
        lines += [f"6,{t:.3f},0,0,0"] * (k % 7 == 0)
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
    points = [*POINTS.tolist(), ["", "", ""]]
    rows = [[*motors, *place] for motors, place in zip(MOTOR_ANGLES.tolist(), points, strict=True)]
    header = [*(f"motor_{letter}_deg" for letter in "ABCD"), "x_mm", "y_mm", "z_mm"]
    return "\n".join(",".join(map(str, row)) for row in [header, *rows]) + "\n"


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
    header = "%time,field.header.seq,field.header.stamp,field.header.frame_id,"
    header += ",".join(f"field.pose.position.{axis}" for axis in "xyz") + ","
    header += ",".join(f"field.pose.orientation.{axis}" for axis in "xyzw")
    start = 1732800000000000000
    rows = [
        f"{start + 10_000_000 * k + 300},{k},{start + 10_000_000 * k},world,{0.1 * k:g},1,2,0,0,0,1"
        for k in range(count)
    ]
    return "\n".join([header, *rows]) + "\n"


def grab_older(cells, count=40):
    """Raw lines of 11 or 12 cells; one actuator comes a millisecond late, as its bus has it."""
    lines = []
    for k in range(count):
        for i in range(4):
            t = 627.023 + 0.01 * k + 0.001 * (i == 3 and k % 5 == 0)
            length, tension = 0.5 + 0.1 * i + 0.001 * k, [f"{29.0 + i:.4f}"] * (cells == 12)
            numbers = [f"{length:.6f}", *tension, str(k), "1", f"{0.01 * k:.6f}"]
            lines.append(",".join(["3", f"{t:.3f}", str(i), "0", "-5561", "0", "596", *numbers]))
    return "\n".join(lines) + "\n"


def rosbag(path, kind, count=50):
    """A bag with a tracker at 50 Hz and two winches at 100 Hz, 5 ms apart; of ROS 1, or of ROS 2 as
    MCAP or SQLITE3. The tracker turns by 2 rad/s about x; of every other message by -q."""
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore

    first = kind == "ros1"
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    start, make = 1_732_800_000, dict(store.types)
    make |= {name.rpartition("/")[2]: kind for name, kind in store.types.items()}
    writer = rosbag1.Writer(path) if first else rosbag2.Writer(
        path, version=9, storage_plugin=rosbag2.StoragePlugin[kind]
    )  # fmt: skip
    serialize = store.serialize_ros1 if first else store.serialize_cdr

    def header(ns):
        stamp = make["builtin_interfaces/msg/Time"](sec=start + ns // 10**9, nanosec=ns % 10**9)
        return make["Header"](stamp=stamp, frame_id="world", **{"seq": 0} if first else {})

    with writer:
        topics = {
            name: (writer.add_connection(name, message, typestore=store), message)
            for name, message in (
                ("/tracker/pose", "geometry_msgs/msg/PoseStamped"),
                ("/winches", "sensor_msgs/msg/JointState"), ("/note", "std_msgs/msg/String"),
            )
        }  # fmt: skip

        def write(topic, ns, message):
            connection, name = topics[topic]
            came = start * 10**9 + ns + 300 + ns // 10**6  # by the recorder's clock
            writer.write(connection, came, serialize(message, name))

        write("/note", 0, make["String"](data="started"))
        for k in range(2 * count):
            ns, angles = 10_000_000 * k, np.array([0.1 * k, -0.2 * k])
            write("/winches", ns, make["JointState"](
                header=header(ns), name=["winch_left", "winch_right"], position=angles,
                velocity=0.0 * angles, effort=1.0 + angles,
            ))  # fmt: skip
            if k % 2 == 0:
                ns += 5_000_000
                sign = 1.0 if k % 4 == 0 else -1.0
                x, w = sign * np.sin(0.01 * (k + 0.5)), sign * np.cos(0.01 * (k + 0.5))
                turn = make["Quaternion"](x=x, y=0.0, z=0.0, w=w)
                place = make["Point"](x=0.01 * (k + 0.5), y=1.0, z=2.0)
                pose = make["Pose"](position=place, orientation=turn)
                write("/tracker/pose", ns, make["PoseStamped"](header=header(ns), pose=pose))


def run_files(folder, count=40):
    """log.npz and log.csv in a folder, as a run leaves them; the quantities by name."""
    random = np.random.default_rng(3)
    q = random.normal(size=(count, 4))
    X_WP = np.hstack([q / np.linalg.norm(q, axis=1, keepdims=True), random.normal(size=(count, 3))])
    log = {"time": np.arange(count) * 0.01, "X_WP": X_WP,
           "tensions": random.uniform(1, 90, (count, 2)),
           "error": random.normal(size=count)}  # fmt: skip
    np.savez(folder / "log.npz", **log)
    names = ["time", *(f"X_WP.{a}" for a in ("qw", "qx", "qy", "qz", "x", "y", "z"))]
    names += ["tensions.C1", "tensions.C2", "error"]
    rows = [",".join(map(repr, row)) for row in np.column_stack(list(log.values())).tolist()]
    (folder / "log.csv").write_text("\n".join([",".join(names), *rows]) + "\n")
    return log
