"""Tables of poses and G-code: arcs by their circles, planes, units, offsets, feeds, remarks."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.planning.path_files import read_path
from cdpr_drake.analyses.planning.path_plan import plan_path
from cdpr_drake.errors import DataFileError
from tests.analyses.planning.plan_command import run, undrawn

__all__ = ["undrawn"]

ROUNDING = 1e-9  # of metres that are written with 9 digits behind the point in millimetres
HEAD = "G21 G90 G17\nG0 X0 Y0 Z300\n"


@pytest.fixture
def read(tmp_path):
    """Reads a path from words of a file."""

    def reader(words, name="part.ngc"):
        (tmp_path / name).write_text(words)
        return read_path(tmp_path / name)

    return reader


def places(path):
    return np.array([X.translation() for X in path.poses])


def last_arc(path):
    """Start, end and arc of the last move [m]."""
    return *places(path)[-2:], path.moves[-1].arc


def test_a_table_of_poses(read):
    poses = read("# mine\nx,y,z,phi,theta,psi\n0,0,1,0,0,0\n1,2,3,0,0,90\n", "a.csv").poses
    np.testing.assert_allclose(poses[1].translation(), [1, 2, 3])
    turned = poses[1].rotation().matrix()[:2, :2]
    np.testing.assert_allclose(turned, [[0, -1], [1, 0]], atol=1e-12)
    assert len(read("0,0,1\n\n0,0,2\n0,1,2\n", "b.csv").poses) == 3


def test_lines_of_g_code(read):
    path = read(
        "%\n(a square) G21 G90\nG0 X0 Y0 Z300 ; begin\nN20 G1 X100 F1200\nY100 A2.5\n"
        "G91 X-100\nG20 G90 X0 Y0 Z11.811024\nM30\n"
    )
    corners = [[0, 0, 0.3], [0.1, 0, 0.3], [0.1, 0.1, 0.3], [0, 0.1, 0.3], [0, 0, 0.3]]
    np.testing.assert_allclose(places(path), corners, atol=1e-6)
    assert path.poses[2].rotation().matrix()[2, 1] == pytest.approx(np.sin(np.radians(2.5)))
    assert path.remarks == ("M30 (end of program) left out: 1",)
    assert path.moves[1].speed == pytest.approx(0.02)


@pytest.mark.parametrize(("plane", "axes", "letters"), [
    ("G17", [0, 1], "XYIJZ"), ("G18", [2, 0], "ZXKIY"), ("G19", [1, 2], "YZJKX"),
])  # fmt: skip
@pytest.mark.parametrize(("code", "sign"), [("G2", -1.0), ("G3", 1.0)])
def test_random_arcs_lie_on_their_circle_by_centre_and_by_radius(
    read, plane, axes, letters, code, sign
):
    rng = np.random.default_rng(int(plane[1:]) + int(code[1:]))
    a, b, i, j, c = letters
    for _ in range(40):
        radius, first = rng.uniform(5.0, 200.0), rng.uniform(-np.pi, np.pi)
        angle, rise = sign * rng.uniform(0.2, 6.0), rng.uniform(-20.0, 20.0)
        center = rng.uniform(-100.0, 100.0, 2)
        begin, target = (
            center + radius * np.array([np.cos(at), np.sin(at)]) for at in (first, first + angle)
        )
        to = center - begin
        by_radius = radius if abs(angle) <= np.pi else -radius
        for words in (f"{i}{to[0]:.9f} {j}{to[1]:.9f}", f"R{by_radius:.9f}"):
            start, end, arc = last_arc(read(
                f"G21 G90 {plane}\nG0 X0 Y0 Z0\nG0 {a}{begin[0]:.9f} {b}{begin[1]:.9f} {c}7\n"
                f"{code} {a}{target[0]:.9f} {b}{target[1]:.9f} {c}{7.0 + rise:.9f} {words}\n"
            ))  # fmt: skip
            np.testing.assert_allclose(arc.angle, angle, atol=1e-6)
            np.testing.assert_allclose(arc.center[axes], 1e-3 * center, atol=1e-8)
            assert arc.axis[3 - sum(axes)] == 1.0
            length = 1e-3 * np.hypot(radius * angle, rise)
            assert arc.length(start, end) == pytest.approx(length, rel=1e-6)
            points = np.array([arc.at(start, end, share)[0] for share in np.linspace(0, 1, 7)])
            away = np.linalg.norm((points - arc.center)[:, axes], axis=1)
            np.testing.assert_allclose(away, 1e-3 * radius, atol=1e-8)
            np.testing.assert_allclose(points[-1], end, atol=1e-8)


def test_whole_circles_and_helices(read):
    path = read(HEAD + "G3 I50 F600\nG2 X0 Y0 Z310 I0 J20\n")
    circle, helix = path.moves
    assert (circle.arc.angle, helix.arc.angle) == pytest.approx((2 * np.pi, -2 * np.pi))
    assert circle.speed == pytest.approx(0.01)
    start, end, arc = last_arc(path)
    assert arc.length(start, end) == pytest.approx(np.hypot(2 * np.pi * 0.02, 0.01))


def test_units_and_relative_coordinates(read):
    path = read(
        "G20 G90 G0 X1 Y1 Z10\nG91 F6\nG1 X1\nG3 X1 Y1 I0 J1 F60\nG21 G90 F1200 G1 X0 Y0\nG1 X5\n"
    )
    inches = places(path) / 0.0254
    np.testing.assert_allclose(inches[:4], [[1, 1, 10], [2, 1, 10], [3, 2, 10], [0, 0, 10]])
    # A feed is in the unit that holds before its line.
    speeds = np.array([move.speed for move in path.moves]) / 0.0254
    np.testing.assert_allclose(speeds, [0.1, 1, 20, 20])
    centered = read(HEAD + "G90.1 G0 X10\nG3 X0 Y10 I0 J0\n")
    np.testing.assert_allclose(last_arc(centered)[2].center[:2], 0.0, atol=ROUNDING)


@pytest.mark.parametrize(("words", "x", "y"), [
    ("G1 X10\nG92 X0 Y5 E0\nG1 X10 Y5\nG92.1\nG1 X10 Y10\nG92.3\nG1 X10\n",
     [0, 10, 20, 10], [0, 0, 0, 10]),
    ("G92 X100\nG92.2\nG1 X10\nG92.3\nG1 X110\n", [0, 10, 10], [0, 0, 0]),
])  # fmt: skip
def test_offsets_of_coordinates(read, words, x, y):
    np.testing.assert_allclose(1e3 * places(read(HEAD + words))[:, :2], np.transpose([x, y]))


PRINTER = """; a printer's file
M140 S60 ; bed
M104 S200
G28 ; home
G1 Z15.0 F6000
M117 Printing part one
G92 E0
G1 X10 Y10 Z0.3 F9000
N12 G1 X40 E5.2 F1800*71
G3 X50 Y20 I0 J10 E1.4
/G1 X60
M106 S255 X3
G10
G4 P200
T0
M84
M30
%
G1 X900
"""


def test_a_printers_file_is_read_and_what_is_left_out_is_named(read):
    path = read(PRINTER)
    assert len(path.poses) == 4
    assert [move.arc is not None for move in path.moves] == [False, True, False]
    assert [move.speed for move in path.moves] == pytest.approx([0.03] * 3)
    assert path.remarks == tuple(f"{words} left out: {count}" for words, count in (
        ("/ (block delete, taken as off)", 1), ("E words (extruder)", 3), ("G10 (retraction)", 1),
        ("G28 (home)", 1), ("G4 (dwell)", 1), ("M104 (nozzle temperature)", 1),
        ("M106 (fan on)", 1), ("M117 (message)", 1), ("M140 (bed temperature)", 1),
        ("M30 (end of program)", 1), ("M84 (motors off)", 1), ("T words (tool)", 1),
        ("lines after the end of the program", 1),
        ("motions before X, Y and Z are known", 1),
    ))  # fmt: skip


@pytest.mark.parametrize(
    ("name", "words", "refusal"),
    [
        ("a.csv", "x,y\n1,2\n", "line 1: found the columns x, y"),
        ("a.csv", "0,0,1\n0,0\n", "line 2: .* accepted: 3 finite"),
        ("a.csv", "0,0,1\n0,nan,1\n", "line 2"),
        ("a.csv", "0,0,1\n", "found 1 poses"),
        ("a.csv", b"\xff\xfe\x00", "cannot be read as text"),
        ("none.csv", None, "no such file"),
        ("a.txt", "", "accepted: .csv, .gcode"),
        ("a.nc", "G0 X0 Y0 Z0\nG5 X1 Y1 I1\n", "line 2: found G5; accepted: straight"),
        ("a.nc", "G0 X0 Y0\n", "line 1: Z is not known"),
        ("a.nc", "X0 Y0\n", "line 1: found coordinates before"),
        ("a.nc", "G0 X0 X1\n", "X twice"),
        ("a.nc", "G0 !\n", "found '!'"),
        ("a.nc", "G0 X1 Q3\n", "the word Q3"),
        ("a.nc", "G2 X0 Y0 Z10 I5\n", "found G2 as the first motion"),
        ("a.nc", HEAD + "G2 X10 Y0\n", "line 3: found neither R nor a centre"),
        ("a.nc", HEAD + "G2 X10 Y0 I5 R5\n", "found both R and a centre"),
        ("a.nc", HEAD + "G2 X10 Y0 R4\n", "found R4 for an end 10 away; accepted: at least 5"),
        ("a.nc", HEAD + "G2 R4\n", "found R and no way"),
        ("a.nc", HEAD + "G2 X10 Y0 I4\n", "a centre 4 from the start and 6 from the end"),
        ("a.nc", HEAD + "G18 G2 X10 Z300 J4\n", "found J in the plane G18"),
        ("a.nc", HEAD + "G2 X10 Y0 I0\n", "a centre 0 from the start"),
        ("a.nc", HEAD + "G1 X10 I5\n", "found I with G1"),
        ("a.nc", HEAD + "G1 G2 X10 I5\n", "found G1 and G2; accepted: one motion"),
        ("a.nc", HEAD + "G1 X10 F0\n", "found F0; accepted: a feed above 0"),
        ("a.nc", HEAD + "G41 X10\n", "found G41"),
        ("a.nc", HEAD + "G55 X10\n", "found G55"),
        ("a.nc", HEAD + "G93 G1 X10 F2\n", "found G93"),
        ("a.nc", HEAD + "#1=5\n", "no parameters"),
        ("a.nc", HEAD + "G10 L2 P1 X5\n", "found G10 L2"),
        ("a.nc", HEAD + "G1 X5\nG28\nG1 X9 Y9 Z9\n", "line 5: found a motion after G28"),
        ("a.nc", HEAD + "G1 X5\nG28 X0\nG1 Y9\n", "line 5: X is not known there"),
        ("a.nc", HEAD + "G1 X5 U3\n", "found the word U3"),
    ],
)
def test_wrong_files_are_named_with_their_line(tmp_path, name, words, refusal):
    file = tmp_path / name
    if words is not None:
        file.write_bytes(words if isinstance(words, bytes) else words.encode())
    with pytest.raises(DataFileError, match=refusal):
        read_path(file)


SLOT = """G21 G90
G0 X-100 Y-50 Z300
G1 X100 F6000
G3 X100 Y50 I0 J50 F3000
G1 X-100 F12000
G3 X-100 Y-50 R50
M5
M30
"""


@pytest.fixture
def slot(tmp_path):
    file = tmp_path / "slot.nc"
    file.write_text(SLOT)
    return file


@pytest.mark.parametrize("corners", ["blend", "rest", "smooth"])
def test_feeds_are_speeds_of_their_pieces(slot, corners):
    fed, free = (
        plan_path("acrobot_large", slot, limits=(1.0, 60.0), feeds=feeds, corners=corners,
                  stations=300) for feeds in (True, False)
    )  # fmt: skip
    samples, path = fed.samples, fed.solution.path
    way = np.linalg.norm(path.points(samples.parameters)[:, 10:13], axis=1) * samples.speeds
    most = path.largest_speeds(samples.parameters)
    assert set(np.unique(most)) == {0.1, 0.05, 0.2}
    assert np.max(way / most) < 1.0 + 2e-3
    assert np.max(samples.uses[:, 3]) == pytest.approx(np.max(way / most))
    assert np.mean(samples.active()["speed of Po"]) > 0.5
    assert free.solution.duration < 0.8 * fed.solution.duration
    assert free.solution.path.speeds is None
    assert (len(path.rests) == 3) == (corners == "rest")


@pytest.mark.usefixtures("undrawn")
def test_the_command_says_what_a_file_has(slot, tmp_path, capsys):
    code, out, err = run(
        capsys, "acrobot_large", "--path", str(slot), "--limits", "1,60", "--corners", "blend",
        "--stations", "100", "--no-track", "--json", "--out", str(tmp_path / "out"),
    )  # fmt: skip
    arguments = json.loads(out)["arguments"]
    assert (code, arguments["arcs"], arguments["feeds"]) == (0, 2, True)
    assert arguments["feed_range_m_s"] == pytest.approx([0.05, 0.2])
    assert "M5 (spindle off) left out: 1" in err.replace("\n", " ")
