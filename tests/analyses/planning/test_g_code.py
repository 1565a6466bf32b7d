"""G-code: arcs by their circles, planes, units, offsets, feeds, and what is left out by name."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.planning.g_code import parse_g_code
from cdpr_drake.analyses.planning.path_files import read_path
from cdpr_drake.analyses.planning.path_plan import plan_path
from cdpr_drake.errors import DataFileError
from tests.analyses.planning.plan_command import WRITES, run, undrawn

ROUNDING = 1e-9  # of metres that are written with 9 digits behind the point in millimetres
HEAD = "G21 G90 G17\nG0 X0 Y0 Z300\n"


def parsed(tmp_path, words, height=None):
    file = tmp_path / "part.ngc"
    file.write_text(words)
    return parse_g_code(file, words.splitlines(), height)


def last(code):
    """Start, end and arc of the last move [m]."""
    return np.array(code.places[-2][:3]), np.array(code.places[-1][:3]), code.moves[-1].arc


def arc_word(rng, plane, clockwise):
    """A random arc: words by centre and by radius, its centre, angle and ends in a plane [mm]."""
    letters = {"G17": "XYIJZ", "G18": "ZXKIY", "G19": "YZJKX"}[plane]
    radius, first = rng.uniform(5.0, 200.0), rng.uniform(-np.pi, np.pi)
    angle = rng.uniform(0.2, 6.0) * (-1.0 if clockwise else 1.0)
    center = rng.uniform(-100.0, 100.0, 2)
    start, end = (
        center + radius * np.array([np.cos(a), np.sin(a)]) for a in (first, first + angle)
    )
    rise = rng.uniform(-20.0, 20.0)
    begin = f"G0 {letters[0]}{start[0]:.9f} {letters[1]}{start[1]:.9f} {letters[4]}7\n"
    to = f"{letters[0]}{end[0]:.9f} {letters[1]}{end[1]:.9f} {letters[4]}{7.0 + rise:.9f}"
    i, j = center - start
    by_center = f"{letters[2]}{i:.9f} {letters[3]}{j:.9f}"
    by_radius = f"R{radius if abs(angle) <= np.pi else -radius:.9f}"
    return begin, to, by_center, by_radius, (center, radius, angle, rise)


@pytest.mark.parametrize("plane", ["G17", "G18", "G19"])
@pytest.mark.parametrize("code", ["G2", "G3"])
def test_arcs_by_centre_and_by_radius_are_one_and_lie_on_their_circle(tmp_path, plane, code):
    rng = np.random.default_rng(int(plane[1:]) + int(code[1:]))
    axes = {"G17": (0, 1, 2), "G18": (2, 0, 1), "G19": (1, 2, 0)}[plane]
    for _ in range(40):
        begin, to, by_center, by_radius, (center, radius, angle, rise) = arc_word(
            rng, plane, code == "G2"
        )
        found = []
        for words in (by_center, by_radius):
            start, end, arc = last(
                parsed(tmp_path, f"G21 G90 {plane}\nG0 X0 Y0 Z0\n{begin}{code} {to} {words}\n")
            )
            found.append(arc)
            np.testing.assert_allclose(arc.angle, angle, atol=1e-6)
            np.testing.assert_allclose(arc.center[list(axes[:2])], 1e-3 * center, atol=1e-8)
            assert arc.axis[axes[2]] == 1.0
            length = 1e-3 * np.hypot(radius * angle, rise)
            assert arc.length(start, end) == pytest.approx(length, rel=1e-6)
            for share in np.linspace(0.0, 1.0, 7):
                p = arc.at(start, end, share)[0]
                away = np.hypot(*(p - arc.center)[list(axes[:2])])
                assert away == pytest.approx(1e-3 * radius, abs=1e-8)
            np.testing.assert_allclose(arc.at(start, end, 1.0)[0], end, atol=1e-8)
        assert found[0].angle == pytest.approx(found[1].angle, abs=1e-6)


def test_g2_is_clockwise_seen_from_the_tip_of_the_third_axis(tmp_path):
    """From (1, 0) round 0 a quarter clockwise to (0, -1): in XY, in ZX and in YZ."""
    for plane, start, end, center, middle in (
        ("G17", "X10 Y0", "X0 Y-10", "I-10", [1, -1, 0]),
        ("G18", "Z10 X0", "Z0 X-10", "K-10", [-1, 0, 1]),
        ("G19", "Y10 Z0", "Y0 Z-10", "J-10", [0, 1, -1]),
    ):
        code = parsed(tmp_path, f"{plane} G0 X0 Y0 Z0\nG0 {start}\nG2 {end} {center}\n")
        a, b, arc = last(code)
        assert arc.angle == pytest.approx(-np.pi / 2)
        there = arc.at(a, b, 0.5)[0]
        np.testing.assert_allclose(there, 0.01 * np.sqrt(0.5) * np.array(middle), atol=ROUNDING)


def test_whole_circles_and_helices(tmp_path):
    code = parsed(tmp_path, HEAD + "G3 I50 F600\nG2 X0 Y0 Z310 I0 J20\n")
    circle, helix = code.moves
    assert (circle.arc.angle, helix.arc.angle) == pytest.approx((2 * np.pi, -2 * np.pi))
    assert circle.speed == pytest.approx(0.01)
    a, b, arc = last(code)
    assert arc.length(a, b) == pytest.approx(np.hypot(2 * np.pi * 0.02, 0.01))


def test_units_and_relative_coordinates(tmp_path):
    code = parsed(
        tmp_path,
        "G20 G90 G0 X1 Y1 Z10\nG91 F6\nG1 X1\nG3 X1 Y1 I0 J1 F60\nG21 G90 F1200 G1 X0 Y0\nG1 X5\n",
    )
    places = np.array(code.places)[:, :3] / 0.0254
    np.testing.assert_allclose(places[:4], [[1, 1, 10], [2, 1, 10], [3, 2, 10], [0, 0, 10]])
    # A feed is in the unit that holds before its line.
    speeds = [move.speed for move in code.moves]
    np.testing.assert_allclose(speeds, [0.1 * 0.0254, 0.0254, 20 * 0.0254, 20 * 0.0254])
    absolute = parsed(tmp_path, HEAD + "G90.1 G0 X10\nG3 X0 Y10 I0 J0\n")
    np.testing.assert_allclose(last(absolute)[2].center[:2], 0.0, atol=ROUNDING)


def test_offsets_of_coordinates(tmp_path):
    words = HEAD + "G1 X10\nG92 X0 Y5 E0\nG1 X10 Y5\nG92.1\nG1 X10 Y10\nG92.3\nG1 X10\n"
    places = np.array(parsed(tmp_path, words).places)[:, :2]
    np.testing.assert_allclose(1e3 * places, [[0, 0], [10, 0], [20, 0], [10, 10], [10, 10]][:4])
    kept = HEAD + "G92 X100\nG92.2\nG1 X10\nG92.3\nG1 X110\n"
    places = np.array(parsed(tmp_path, kept).places)[:, 0]
    np.testing.assert_allclose(1e3 * places, [0, 10, 110 - 100])


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
M84 X Y
M30
G1 X900
"""


def test_a_printers_file_is_read_and_what_is_left_out_is_named(tmp_path):
    code = parsed(tmp_path, PRINTER.replace("M84 X Y", "M84"))
    assert len(code.places) == 4
    assert [move.arc is not None for move in code.moves] == [False, True, False]
    assert [move.speed for move in code.moves] == pytest.approx([0.03] * 3)
    assert code.remarks == (
        "/ (block delete, taken as off) left out: 1",
        "E words (extruder) left out: 3",
        "G10 (retraction) left out: 1",
        "G28 (home) left out: 1",
        "G4 (dwell) left out: 1",
        "M104 (nozzle temperature) left out: 1",
        "M106 (fan on) left out: 1",
        "M117 (message) left out: 1",
        "M140 (bed temperature) left out: 1",
        "M30 (end of program) left out: 1",
        "M84 (motors off) left out: 1",
        "T words (tool) left out: 1",
        "lines after the end of the program left out: 1",
        "motions before X, Y and Z are known left out: 1",
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("G2 X10 Y0\n", "line 3: found neither R nor a centre"),
        ("G2 X10 Y0 I5 R5\n", "found both R and a centre"),
        ("G2 X10 Y0 R4\n", "found R4 for an end 10 away; accepted: at least 5"),
        ("G2 R4\n", "found R and no way"),
        ("G2 X10 Y0 I4\n", "a centre 4 from the start and 6 from the end"),
        ("G18 G2 X10 Z300 J4\n", "found J in the plane G18"),
        ("G2 X10 Y0 I0\n", "a centre 0 from the start"),
        ("G1 X10 I5\n", "found I with G1"),
        ("G1 G2 X10 I5\n", "found G1 and G2; accepted: one motion"),
        ("G1 X10 F0\n", "found F0; accepted: a feed above 0"),
        ("G41 X10\n", "found G41"),
        ("G55 X10\n", "found G55"),
        ("G93 G1 X10 F2\n", "found G93"),
        ("#1=5\n", "no parameters"),
        ("G10 L2 P1 X5\n", "found G10 L2"),
        ("G1 X5\nG28\nG1 X9 Y9 Z9\n", "line 5: found a motion after G28"),
        ("G1 X5\nG28 X0\nG1 Y9\n", "line 5: X is not known there"),
        ("G1 X5 U3\n", "found the word U3"),
    ],
)
def test_what_is_refused_is_named(tmp_path, words, said):
    with pytest.raises(DataFileError, match=said):
        parsed(tmp_path, HEAD + words)


def test_an_arc_that_comes_first_has_no_start(tmp_path):
    with pytest.raises(DataFileError, match="found G2 as the first motion"):
        parsed(tmp_path, "G2 X0 Y0 Z10 I5\n")


SLOT = """G21 G90
G0 X-100 Y-50 Z300
G1 X100 F6000
G3 X100 Y50 I0 J50 F3000
G1 X-100 F12000
G3 X-100 Y-50 R50
"""


@pytest.mark.parametrize("corners", ["blend", "rest", "smooth"])
def test_feeds_are_speeds_of_their_pieces(tmp_path, corners):
    file = tmp_path / "slot.nc"
    file.write_text(SLOT)
    fed, free = (
        plan_path("acrobot_large", file, limits=(1.0, 60.0), feeds=feeds, corners=corners,
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


def test_the_command_says_what_a_file_has(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(WRITES, undrawn)
    file = tmp_path / "slot.ngc"
    file.write_text(SLOT + "M5\nM30\n")
    code, out, err = run(
        capsys, "acrobot_large", "--path", str(file), "--limits", "1,60", "--corners", "blend",
        "--stations", "100", "--no-track", "--json", "--out", str(tmp_path / "out"),
    )  # fmt: skip
    assert code == 0
    told = json.loads(out)["arguments"]
    assert (told["arcs"], told["feeds"]) == (2, True)
    assert told["feed_range_m_s"] == pytest.approx([0.05, 0.2])
    assert "M5 (spindle off) left out: 1" in err.replace("\n", " ")
    assert read_path(file).moves[1].arc is not None
