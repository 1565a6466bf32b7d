"""Texts as recorders write them: a table of what is read of them, and a table of refusals."""

import re

import numpy as np
import pytest

from cdpr_drake.analyses.fits.tags import read_tags
from cdpr_drake.analyses.logs.dialects import read_log
from cdpr_drake.analyses.logs.log import Facts
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.errors import CalibrationError, LogFileError
from cdpr_drake.geometry.poses import pose_from_angles
from tests.analyses.logs import recorders

CABLES, TOLD, NAN = ("C1", "C2"), Facts(units={"length": "m"}, rate=100.0), np.nan

READ_NS = 1e-9
"""Times of ROS are whole nanoseconds [s]."""

HEADERS = (
    "C1_length_m,C2_length_m", "l1,l2", "L_1 [m], L_2 [m]", "cable1_length,cable2_length",
    "length_c1_m,length_c2_m", "length_0,length_1", "1_length_m,2_length_m",
    "measured_lengths_C1_m,measured_lengths_C2_m",
)  # fmt: skip

BELTS = "CLBM:[{bl:1,   br:2,   tr:3,   tl:4}]"

K, ROWS = np.arange(20), np.arange(40)

OLDER = {f"C{i + 1}_length_m": 0.5 + 0.1 * i + 0.001 * ROWS for i in range(4)}
PULLS = {f"C{i + 1}_tension_n": 29.0 + i + 0.0 * ROWS for i in range(4)}
SWIVELS = {f"C{i + 1}_swivel_rad": 0.01 * ROWS for i in range(4)}
STAMPS = {"time_s": 627.023 + 0.01 * ROWS}
"""What older recorders of GRAB wrote, with tensions or without."""

READ = [
    *((recorders.columns(*signs),
       {"time_s": 0.01 * K, "C1_length_m": 1.0005 + 1e-3 * K, "C2_length_m": 2.00025 - 1e-3 * K,
        "C1_tension_n": 40.0 + K, "note_number": K}, "")
      for signs in ((",", ".", "\n"), (";", ",", "\r\n"), ("\t", ".", "\r"), (";", ".", "\n"))),
    (recorders.grab_older(11), STAMPS | OLDER | SWIVELS, "8 lines that came up to 2.5 ms"),
    (recorders.grab_older(12), STAMPS | OLDER | PULLS | SWIVELS, "8 lines that came up to 2.5 ms"),
    *((f"{header}\n1.5,2.5\n", {"C1_length_m": [1.5], "C2_length_m": [2.5]}, "")
      for header in HEADERS),
    *((f"l1,l2\n1,{nothing}\n2,3\n", {"C1_length_m": [1, 2], "C2_length_m": [NAN, 3]}, "")
      for nothing in ("nan", "NA", "null", "", "-")),
    ("0.1 0.2 0.3 0.4\n0.5 0.6 0.7 0.8\n",
     {"C1_length_m": [0.1, 0.5], "C2_length_m": [0.2, 0.6], "C1_swivel_rad": [0.3, 0.7],
      "C2_swivel_rad": [0.4, 0.8]}, "no header: lengths"),
    ("time,C1_length_m\n2024-11-28T12:00:00,0\n2024-11-28T12:00:00.050,1\n2024-11-28T12:00:01,2\n",
     {"time_s": [0, 0.05, 1], "C1_length_m": [0, 1, 2]}, "times count from 2024-11-28T12:00:00"),
    ("time,C1_length_m\n1732800000.5,0\n1732800000.75,1\n1732800001.5,2\n",
     {"time_s": [0, 0.25, 1], "C1_length_m": [0, 1, 2]}, "times count from the first row"),
    ('"t","tl_length_in","tr_length_in","tl_force_lbf","tr_force_kgf"\n'
     '"0","2,326.5","1","10","1"\n"1","1","2","NA","null"\n',
     {"time_s": [0, 1], "tl_length_m": [59.0931, 0.0254], "tr_length_m": [0.0254, 0.0508],
      "tl_tension_n": [44.482216152605, NAN], "tr_tension_n": [9.80665, NAN]}, ""),
    ("C1_length_m,C2_length_cubit\n1,2\n", {"C1_length_m": [1], "C2_length_cubit": [2]},
     "kept as it is: C2_length_cubit, cubit is no unit that is known"),
    # A run's own log: lengths that winches count, and of the cables' paths, once refused.
    ("time_s,X_WP.x_m,lengths.C1_m,lengths.C2_m,unstrained_lengths.C1_m,unstrained_lengths.C2_m\n"
     "0,0.5,1.1,1.2,1.05,1.15\n0.1,0.6,1.1,1.2,1.06,1.16\n",
     {"time_s": [0, 0.1], "x_m": [0.5, 0.6], "C1_length_m": [1.05, 1.06],
      "C2_length_m": [1.15, 1.16]}, ": lengths.C1_m, lengths.C2_m"),
    (f"{BELTS}\n{BELTS.replace('bl:1', 'bl:5')}\n",
     {f"{belt}_length_m": [1e-3 * k, 1e-3 * (5 if k == 1 else k)]
      for k, belt in enumerate(("bl", "br", "tr", "tl"), 1)}, ""),
    ('[{"bl": 529.12, "br": 533.25, "tr": 533.14, "tl": 535.13},\n]\n',
     {"bl_length_m": [0.52912], "br_length_m": [0.53325], "tr_length_m": [0.53314],
      "tl_length_m": [0.53513]}, ""),
]  # fmt: skip


TURNS = np.radians(recorders.MOTOR_ANGLES).T
SERIES = dict(zip((f"{letter}_motor_angle_rad" for letter in "ABCD"), TURNS, strict=True))
SERIES |= {"x_m": [-5e-4, -0.2661, NAN], "y_m": [-6e-4, -0.2844, NAN], "z_m": [0, 5e-4, NAN]}
SCRIPT = recorders.hangprinter_script()
FORCES = {f"raw_force_{letter}": [force, NAN, NAN]
          for letter, force in zip("ABCD", (13.7, 14.5, 14.1, 12.5), strict=True)}  # fmt: skip
PULLED = {name.replace("raw_force_", "") + "_tension_n": row for name, row in FORCES.items()}
ALONG, GONE = recorders.gtgraffiti(40), [NAN] * 39

PARTLY = [
    (SCRIPT, Facts(), SERIES | FORCES, "unit of the forces is not stated: kept as raw_force"),
    (SCRIPT, Facts(units={"force": "n"}), SERIES | PULLED, "forces': 'n, as told"),
    (SCRIPT.replace("[-4834.5", "[--4834.5").replace("-1079.4", "- 1079.4"), Facts(),
     {"A_motor_angle_rad": np.abs(TURNS[0]), "C_motor_angle_rad": TURNS[2]}, "deg by the format"),
    (recorders.hangprinter_columns(), Facts(), SERIES, "mm by the format"),
    (recorders.maslow(), Facts(),
     {f"{belt}_length_m": 1e-3 * (first + step * np.arange(8)) for belt, first, step in
      (("bl", 2300.5, 7), ("br", 923.4, 11), ("tr", 1733.87, -5), ("tl", 2801.87, -3))}, "belts"),
    # Times of the sender; of the recorder where the sender's are 0, without a clock.
    (recorders.ros(), Facts(), {"time_s": 0.01 * np.arange(6), "x_m": 0.1 * np.arange(6)},
     "%time worse"),
    (re.sub(r",\d+,\d{19},world", ",0,0,w", recorders.ros()), Facts(),
     {"time_s": 0.01 * np.arange(6)}, "field.header.frame_id left out"),
    ("time,C1_length\n0,1000\n1,1001\n", Facts(), {"C1_length_m": [1000, 1001]},
     "since neither header nor user says another"),
    ("time,C1_length\n0,1000\n1,1001\n", Facts(units={"length": "mm"}),
     {"C1_length_m": [1, 1.001]}, "mm, as told"),
    (ALONG.replace("- 0.0000 0.0000", "- 1.5000 0.0000", 1), TOLD,
     {"commanded_x_m": [1.5, *GONE], "commanded_z_m": [0.0, *GONE]}, "0, 0 is none"),
    (ALONG.replace("- 0.0000 0.0000", "- 1,500.0 0.0000", 1), TOLD,
     {"commanded_x_m": [1500.0, *GONE]}, "last line, 42, is cut off"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "facts", "columns", "words"), PARTLY)
def test_a_text_has_these_columns_and_words_among_others(text, facts, columns, words, write):
    log = read_log(write("log.txt", text), facts)
    for name, values in columns.items():
        np.testing.assert_allclose(log.frame[name], values, rtol=1e-12, atol=READ_NS)
    fates = [f"{row.header} {row.fate}" for row in log.ledger.itertuples()]
    assert words in f"{log.units} {log.remarks} {fates}"


@pytest.mark.parametrize(("text", "columns", "words"), READ)
def test_a_text_has_these_columns_and_remarks(text, columns, words, write):
    log = read_log(write("log.txt", text), Facts(robot_cables=CABLES))
    assert list(log.frame) == list(columns)
    for name, values in columns.items():
        np.testing.assert_allclose(log.frame[name], values, rtol=1e-13)
    assert words in "; ".join(log.remarks)
    assert bool(words) == bool(log.remarks)


HALF = np.radians(15.0)
TAG = ",".join(f"tag7_{axis}{corner}_px" for corner in range(1, 5) for axis in "uv")

MEASURED = [
    ("C1_length_m,roll_deg,pitch_deg,yaw_deg\n1,10,20,30\n1,,,\n", "tilts",
     [np.radians([10.0, 20.0, 30.0]), [NAN] * 3]),
    ("C1_length_m,pitch_rad\n1,0.2\n", "tilts", [[NAN, 0.2, NAN]]),
    (f"C1_length_m,qw,qx,qy,qz\n1,{np.cos(HALF)},{np.sin(HALF)},0,0\n", "tilts",
     [[2.0 * HALF, 0.0, 0.0]]),
    ("C1_length_m,phi_deg,theta_deg,psi_deg\n1,0,0,40\n", "tilts", [[0, 0, np.radians(40.0)]]),
    ("C1_length_m,E_length_m\n1,2\n", "lengths", [[1.0, 2.0]]),
    (f"{TAG}\n1,2,3,4,5,6,7,8\n", "corners", np.arange(1.0, 9.0).reshape(1, 4, 2)),
]  # fmt: skip


@pytest.mark.parametrize(("text", "field", "values"), MEASURED)
def test_a_text_is_bound_to_two_cables(text, field, values, write):
    """Rotations without a position are inclinations; cables of other names go by their order."""
    log = read_measurements(write("log.csv", text), CABLES)
    table = log.corners[7] if field == "corners" else getattr(log, field)
    np.testing.assert_allclose(table, values, atol=1e-12)
    assert log.poses is None
    assert ("E_length_m" in text) == ("E is C2" in "; ".join(log.remarks))


def test_units_separators_and_gaps(write):
    header = "time_ms;l1_mm;tension_1 (kN);C2_swivel_deg;x_mm;y_mm;z_mm;phi_deg;theta_deg;psi_deg;n"
    text = f"# robot\n{header}\n0;1,5;0,1;90;1;2;3;0;0;90;7\n10;;;;;;;;;;\n"
    log = read_measurements(write("log.csv", text), CABLES)
    np.testing.assert_allclose(log.time, [0.0, 0.01])
    np.testing.assert_allclose(log.lengths, [[0.0015, NAN], [NAN, NAN]])
    assert (log.tensions[0, 0], log.swivels[0, 1]) == (100.0, pytest.approx(np.pi / 2))
    expected = pose_from_angles(np.array([0.001, 0.002, 0.003]), np.array([0, 0, np.pi / 2]))
    assert log.poses[0].IsNearlyEqualTo(expected, 1e-12)
    assert log.poses[1] is None
    assert log.remarks == ("columns not read: n",)


@pytest.mark.parametrize(("header", "row"), [
    ("qw,qx,qy,qz", f"{np.cos(0.15):.15f},0,0,{np.sin(0.15):.15f}"), ("phi,theta,psi", "0,0,0.3"),
    ("rx,ry,rz", "0,0,0.3"), ("roll,pitch,yaw", "0,0,0.3"),
])  # fmt: skip
def test_rotations_of_every_kind_agree(header, row, write):
    log = read_measurements(write("log.csv", f"x,y,z,{header}\n1,2,3,{row}\n"), CABLES)
    expected = pose_from_angles(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 0.3]))
    assert log.poses[0].IsNearlyEqualTo(expected, 1e-9)


def test_tags_with_and_without_a_place(write):
    header = "tag,size_mm,x_m,y_m,z_m,phi_deg,theta_deg,psi_deg"
    tags = read_tags(write("tags.csv", f"{header}\n3,60,1,0,0,0,0,0\n4,50,,,,,,\n"))
    assert tags[3][0] == pytest.approx(0.06)
    assert tags[3][1].translation()[0] == 1.0
    assert tags[4][:2] == (pytest.approx(0.05), None)
    with pytest.raises(CalibrationError, match="size > 0"):
        read_tags(write("tags.csv", "tag,size_m\n3,0\n"))


BOUND = Facts()
"""Read as measurements of two cables."""

REFUSED = [
    (recorders.motive(), Facts(), "Length Units: found none"),
    (recorders.motive(units="Feet"), Facts(), "Length Units: found Feet"),
    (recorders.motive(bodies=("One", "Two")), TOLD,
     "found 'One' .1484 rows., 'Two' .1484 rows.; accepted: one of them; use body"),
    (recorders.motive().replace("Quaternion", "XYZ"), TOLD, "Rotation Type: found XYZ"),
    (recorders.motive(40).replace("X,Y,Z,W", "W,Y,Z,W", 1), TOLD,
     "Rigid Body 'Sled': found no column Rotation X; accepted: Position X"),
    (recorders.motive(40).replace("Position,Position", "Posing,Posing"), TOLD, "accepted"),
    (recorders.gtgraffiti(), Facts(), "time: found no column of times; accep"),
    (recorders.gtgraffiti().replace("2: 1.9", "2: oh", 1), TOLD, ":.*: found '2: oh"),
    (recorders.grab().replace("3,11.000,2", "3,11.000,1"), TOLD, "actuator 1 twice"),
    (recorders.grab().replace("5,12.000,", "5,12.000,nan,"), TOLD, "found 6 cells"),
    (recorders.grab().replace(",55,", ",inf,", 1), TOLD, "recognises|'inf'"),
    (recorders.columns().replace("1003.500", "x"), TOLD, ":5: C1_length_mm: found 'x'"),
    (recorders.columns().replace("50.000", "20.000"), TOLD, ":7: time: found 0.02 s"),
    (recorders.columns().replace("C2_length", "C1_length"), TOLD, "C1_length_m twice"),
    (recorders.columns().replace(",42.000", ",42.000,1"), TOLD, ":4: found 6 cells"),
    *((recorders.columns().replace("2000.250", number, 1), TOLD,
       ":2: C2_length_mm: found .*accepted: a number up")
      for number in ("1e300", "-1e31", "inf", "1e999999", "9" * 5000)),
    (recorders.hangprinter_script().replace("7431.3", "oh"), TOLD, ":11: motor_pos.*'oh'"),
    (recorders.hangprinter_script() * 2, TOLD, "found 2 times, in lines"),
    ("CLBM:[{bl:1, br:2},{bl:1, tr:2}]", TOLD, "found the belts bl, tr; accepted: bl, br"),
    ("CLBM:[{bl:1, br:x}]", TOLD, "found 'br:x'"), ("CLBM:[]\n", TOLD, "found no belts"),
    ("CLBM:[{bl:1, br:2}]\nCLBM:[{bl:3, bl:4}]", TOLD, ":2: found 'bl:4'"),
    ("", BOUND, "an empty file"), ("# nothing\n\n", BOUND, "found no rows"),
    ("l1,l2\n", BOUND, "a header without rows"), ("l1,l2\n1,inf\n", BOUND, ":2: l2: found 'inf'"),
    ("l1,l2\n1,2\n1,x7\n", BOUND, ":3: l2: found 'x7'"), ("l1,l2\n1,2,3\n", BOUND, "found 3 cells"),
    ("l1,C1_length_m\n1,2\n", BOUND, "twice"), ("a,b\n1,2\n", BOUND, "columns: found a, b"),
    ("1 2 3\n", BOUND, "3 columns of numbers without a header"),
    ("x,y,z,qw,l1\n1,2,3,1,1\n", BOUND, "quaternion: found 1 columns"),
    ("x,y,z,qw,qx,qy,qz\n1,2,3,2,0,0,0\n", BOUND, "quaternion: found length 2"),
    ("x,y,qw,qx,qy,qz\n1,2,1,0,0,0\n", BOUND, "position: found 2 columns"),
    ("t,l1\n0,1\n0,2\n", BOUND, "times that grow"),
    ("tag0_u1,tag0_v1\n1,2\n", BOUND, "2 of 8 coordinates"),
    ("A_length_m,B_length_m,D_length_m\n1,2,3\n", BOUND,
     "cables: found A, B, D; accepted: those of the robot"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "facts", "words"), REFUSED)
def test_what_is_wrong_is_said_in_one_line(text, facts, words, write):
    path = write("log.txt", text)
    with pytest.raises(LogFileError, match=words) as refused:
        read_measurements(path, CABLES, facts) if facts is BOUND else read_log(path, facts)
    message = str(refused.value)
    assert "\n" not in message
    assert "log.txt" in message
    assert "accepted" in message
    assert len(message) <= 500
