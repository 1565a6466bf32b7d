"""Commands on files of measurements and motions: fits, logs, replays, plans, designs.

`make` writes their input files once, into the golden folder; `compare` reads the same files.
"""

from __future__ import annotations

from pathlib import Path

INPUTS = "inputs"
"""Folder of the input files inside the golden folder."""

SIGMA = "--sigma lengths=1e-4,place=5e-4,turn=1e-3"
CHARUCO = " ".join(f"charuco_{k}.png" for k in range(8))
CHESSBOARD = " ".join(f"chessboard_{k}.png" for k in range(8))
BOARD = "--squares 9x7 --size 0.035"
LARGE = "--from 0,0,0.2 --to 0.1,-0.1,0.3"

QUESTIONS = {
    "calibrate/tracked": f"calibrate acrobot_small tracked.csv {SIGMA} --unknown exit_points",
    "calibrate/nominal": (
        f"calibrate nominal.yaml tracked.csv {SIGMA} --unknown exit_points --next 4"
    ),
    "calibrate/outliers": f"calibrate nominal.yaml outliers.csv {SIGMA} --hold-out 4",
    "calibrate/late": f"calibrate acrobot_small late.csv {SIGMA} --unknown exit_points",
    "calibrate/late-tracker": (
        f"calibrate acrobot_small late.csv {SIGMA} --unknown exit_points --tracker-late 0.2"
    ),
    "calibrate/scaled": f"calibrate acrobot_small scaled.csv {SIGMA} --unknown exit_points",
    "calibrate/swivels": (
        "calibrate acrobot_small swivels.csv --no-rest --unknown C1.length_offset "
        "--sigma lengths=2e-4,swivels=3e-3"
    ),
    "calibrate/hangprinter": (
        "calibrate hangprinter_4 samples.csv --zero home --sigma place=1e-6 --unknown "
        "exit_points,common_drum_radius,D.drum_radius,tracker.[xyz] --bound tracker.[xyz]=0.001 "
        "--hold-out 8-9 --keep-outliers"
    ),
    "calibrate/campaign": "calibrate-campaign acrobot_sensors --poses 8 --next 3",
    "identify/motion": "identify acrobot_large motion.csv --validate motion_2.csv --no-pulleys",
    "identify/pulleys": "identify acrobot_large motion.csv",
    "identify/free": (
        "identify-swings believed.yaml swings.csv --stretches 0:2.39 --hold-out 3.39:5.78"
    ),
    "identify/campaign": "identify-campaign acrobot_computed_torque",
    "calibrate-camera/charuco": f"calibrate-camera {CHARUCO} empty.png --board charuco {BOARD}",
    "calibrate-camera/chessboard": (
        f"calibrate-camera {CHESSBOARD} --board chessboard {BOARD} --model rational --keep-outliers"
    ),
    "import-log/controller": "import-log gtgraffiti.txt --rate 100",
    "import-log/joined": (
        "import-log gtgraffiti.txt --rate 100 --unit length=m --with motive.csv --axes=-z,-x,y"
    ),
    "import-log/tracker": "import-log motive_mm.csv --axes=-z,-x,y",
    "import-log/grab": "import-log grab.log --cables A,B,C,D --from 11 --until 12 --every 2",
    "import-log/script": "import-log hangprinter.py --unit force=N",
    "import-log/angles": "import-log hangprinter.csv",
    "import-log/columns": "import-log columns.csv",
    "import-log/decimal-comma": "import-log columns_de.csv",
    "import-log/tracked": "import-log tracked.csv --robot acrobot_small",
    "import-log/no-rate": "import-log gtgraffiti.txt",
    "replay/lengths": "replay replay.csv --robot gt_graffiti",
    "replay/frame": "replay replay.csv --robot gt_graffiti --fit-frame --follow",
    "plan/waypoints": "plan acrobot_large --waypoints 0,0,0.2;0.1,-0.1,0.3 --limits 1,60",
    "plan/no-pulleys": (
        "plan acrobot_large --waypoints 0,0,0.2;0.1,-0.1,0.3 --limits 1,60 --no-pulleys "
        "--corners blend"
    ),
    "plan/g-code": "plan acrobot_large --path square.gcode --limits 1,60 --corners rest",
    "plan/too-fast": "plan acrobot_large --waypoints 0,0,0.2;0.1,-0.1,0.3 --limits 1,2",
    "plan/free": f"plan acrobot_large --free {LARGE} --knots 6 --limits 1,60",
    "plan/stream": "plan maslow_4 --path sheet.gcode --stream 20",
    "design/evolution": (
        "design acrobot_large --parameters design.yaml --generations 2 --boxes 200"
    ),
    "design/slopes": "design acrobot_large --goal capacity-margin --search slopes --quick",
}
"""Words behind `cdpr` by the name of the golden file; input files by their names in `INPUTS`."""

SQUARE = "G90 G21\nG0 X0 Y0 Z200 F3000\nG1 X80 F1200\nG1 Y80\nG2 X0 Y0 I-40 J-40\n"
SHEET = "G90 G21\nG0 X1200 Y600 Z0 F2000\nG1 X1300 F1500\nG1 Y700\nG1 X1200\nG1 Y600\n"


def words_of(question: str, inputs: Path) -> list[str]:
    """Words of a question, with the paths of its input files."""
    return [
        str(inputs / word) if (inputs / word).is_file() else word
        for word in QUESTIONS[question].split()
    ]


def write_inputs(folder: Path) -> None:
    """Writes all input files, with the generators of the tests."""
    import cv2
    import numpy as np

    from cdpr_drake.calibration import measurements
    from cdpr_drake.geometry.poses import pose_from_angles
    from cdpr_drake.models.robot_loader import load_robot
    from cdpr_drake.schema.typed_yaml import dump_typed
    from tests.analyses.fits import logs, swings
    from tests.analyses.logs import recorders, test_replay
    from tests.cli import test_fits
    from tests.cli.commands import write_log
    from tests.identification.logs import log
    from tests.vision.boards import board_image, board_poses, make_board

    def lengths(poses: list, deviation: float, seed: int) -> np.ndarray:
        return measurements.simulated_lengths(
            logs.TRUE, poses, logs.START, deviation, np.random.default_rng(seed)
        )

    def tracked(poses: list, seen: list, seed: int) -> dict[str, np.ndarray]:
        noisy = measurements.simulated_poses(seen, 1e-3, 5e-4, np.random.default_rng(seed + 1))
        readings = logs.length_columns(lengths(poses, 1e-4, seed))
        return readings | logs.pose_columns(noisy)

    def pose(t: float) -> object:
        place = np.array([0.1 * np.sin(t), 0.1 * np.cos(1.3 * t), 0.3 + 0.05 * np.sin(0.7 * t)])
        return pose_from_angles(place, 0.1 * np.sin(t * np.array([1.1, 0.8, 0.5])))

    poses = logs.POSES
    columns = tracked(poses, poses, 1)
    write_log(folder / "tracked.csv", columns)
    jumps = np.random.default_rng(9)
    write_log(folder / "outliers.csv", {
        name: values + 0.02 * ((jumps.uniform(size=len(values)) < 0.06) & ("length" in name))
        for name, values in columns.items()
    })  # fmt: skip
    write_log(folder / "scaled.csv", {
        name: values * (1.05 if "length" in name else 1.0) for name, values in columns.items()
    })  # fmt: skip
    time = np.linspace(0.0, 6.0, 121)
    late = tracked([pose(t) for t in time], [pose(t - 0.2) for t in time], 5)
    write_log(folder / "late.csv", {"time_s": time} | late)
    angles = -measurements.simulated_swivels(logs.TRUE, poses[:10], 2e-3, np.random.default_rng(4))
    swivels = logs.length_columns(lengths(poses, 2e-4, 3)[:10])
    swivels |= {f"C{k + 1}_swivel_rad": angles[:, k] for k in range(8)}
    write_log(folder / "swivels.csv", swivels)
    nominal = load_robot("acrobot_small")
    for cable, shift in zip(
        nominal.cables, 0.004 * np.random.default_rng(2).standard_normal((8, 3)), strict=True
    ):
        cable.exit_point = cable.exit_point + shift
    texts = {
        "nominal.yaml": dump_typed(nominal),
        "gtgraffiti.txt": recorders.gtgraffiti(),
        "motive.csv": recorders.motive(),
        "motive_mm.csv": recorders.motive(units="Millimeters"),
        "grab.log": recorders.grab(),
        "hangprinter.py": recorders.hangprinter_script(),
        "hangprinter.csv": recorders.hangprinter_columns(),
        "columns.csv": recorders.columns(),
        "columns_de.csv": recorders.columns(";", ",", "\r\n"),
        "square.gcode": SQUARE,
        "sheet.gcode": SHEET,
        "design.yaml": "exit_points: {reach: [0.1, 0.1, 0.1]}\ngoals: [{name: static}]\n"
        "poses: {counts: [3, 3, 2]}\npopulation: 4\n",
        "samples.csv": Path(swings.__file__).with_name("hangprinter4").joinpath("samples.csv")
        .read_text(encoding="utf-8"),
    }  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="")
    noise = logs.MOTION_NOISE
    logs.write_motion(folder / "motion.csv", *log(span=4.0, **noise))
    other = log(span=4.0, seed=1, turn=0.7, move=-0.8, **noise)
    logs.write_motion(folder / "motion_2.csv", *other)
    swings.write(folder / "swings.csv")
    swings.believed_file(folder)
    test_replay.written(folder, test_replay.OFFSETS).replace(folder / "replay.csv")
    for kind in ("charuco", "chessboard"):
        board = make_board(kind)
        for k, place in enumerate(board_poses(board, 8, 0.45, spread=0.35)):
            picture = board_image(board, test_fits.K, test_fits.LENS, (640, 480), place)
            cv2.imwrite(str(folder / f"{kind}_{k}.png"), picture)
    cv2.imwrite(str(folder / "empty.png"), np.full((480, 640), 128, np.uint8))
