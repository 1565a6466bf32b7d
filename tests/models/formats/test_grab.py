"""Robots of GRAB's tools: pulleys on the platform, and files that are not strict JSON."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cdpr_drake import models
from cdpr_drake.errors import RobotFileError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.formats.reading import read_json
from tests.models.formats import foreign_files as files

EXACT = 1e-12


def grab_length(A_W, D_P, k_P, r, X_WP):
    """Length from D over the pulley to A as GRAB's kinematics has it, in P [m].

    With u from D to A across k: tan(psi / 2) = k'DA / s + sqrt(1 - 2 r / s + (k'DA / s)^2), where
    s = u'DA, and psi the angle that the pulley leaves of half a turn.
    """
    DA = X_WP.inverse().multiply(A_W) - D_P
    across = DA - k_P * (k_P @ DA)
    u, s = across / np.linalg.norm(across), np.linalg.norm(across)
    slope = k_P @ DA / s
    psi = 2.0 * np.arctan(slope + np.sqrt(1.0 - 2.0 * r / s + slope**2))
    n = u * np.cos(psi) + k_P * np.sin(psi)
    return np.linalg.norm(DA - r * (u + n)) + r * (np.pi - psi)


def test_pulleys_on_the_platform(tmp_path):
    imported = models.import_robot(files.grab_on_board(tmp_path))
    robot = imported.robot
    cables = robot.cable_set()
    np.testing.assert_allclose(cables.p_WA, files.EXITS, atol=EXACT)
    np.testing.assert_allclose(cables.p_PB, files.ANCHORS, atol=EXACT)
    np.testing.assert_array_equal(cables.pulley_radius, 0.0)
    np.testing.assert_allclose(cables.anchor_pulley_radius, files.RADIUS)
    k = np.array([files.AXES[i % 4] for i in range(8)]).T
    np.testing.assert_allclose(cables.anchor_swivel_axis, k, atol=EXACT)
    X_WP = pose_from_angles(files.HOME, files.ANGLES)
    expected = [
        grab_length(A, D, axis, files.RADIUS, X_WP)
        for A, D, axis in zip(files.EXITS.T, files.ANCHORS.T, k.T, strict=True)
    ]
    np.testing.assert_allclose(cable_paths(X_WP, cables).lengths, expected, atol=EXACT)
    assert robot.winch.drum_radius == 0.03
    assert {"cables[].anchor_pulley_radius", "winch.drum_radius"} <= set(imported.completed.given)
    assert "pulley.radius" not in imported.completed.assumed


def test_what_is_not_kept_is_named(tmp_path):
    remarks = models.import_robot(files.grab_on_board(tmp_path)).completed.remarks
    (rest,) = [words for words in remarks if words.startswith("Keys that were not kept")]
    assert rest == (
        "Keys that were not kept: h, l0, rotation_parametrization, swivel0, transmission_ratio, "
        "vers_i_loc."
    )
    imported = models.import_robot(files.grab_on_board(tmp_path, drums=(0.06, 0.08)))
    assert any("Drums differ" in words for words in imported.completed.remarks)
    assert "winch.drum_radius" in imported.completed.assumed


@pytest.mark.parametrize("key", ["ext_force_loc", "ext_torque_loc", "ext_moments_loc"])
def test_a_load_on_the_platform_is_named_and_none_is_not(key, tmp_path):
    path = files.grab_on_board(tmp_path)
    text = path.read_text()
    said = f"platform.{key} is a load and was not kept."
    for load, kept in (([0.0, 0.0, -5.0], False), ([0.0, 0.0, 0.0], True)):
        path.write_text(text.replace('"platform": {', f'"platform": {{"{key}": {load}, '))
        assert (said not in models.import_robot(path).completed.remarks) == kept
    path.write_text(text.replace('"platform": {', f'"platform": {{"{key}": [1.0, 2.0], '))
    with pytest.raises(RobotFileError, match=rf"platform\.{key}: found "):
        models.import_robot(path)


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("pos_OA_glob", "pos_OD_glob", "pos_OD_glob and pos_PD_loc"),
        ("pos_PD_loc", "pos_PA_loc", "pos_PA_loc and pos_OA_glob"),
        ("pos_PD_loc", "point", "pos_OA_glob"),
        ("pos_OA_glob", "point", "pos_PD_loc"),
    ],
)
def test_points_of_a_cable_belong_together(old, new, found, tmp_path):
    path = files.grab_on_board(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(RobotFileError) as caught:
        models.load_robot(str(path))
    assert str(caught.value) == (
        f"{path}: actuator[0]: found {found}; accepted: pos_OD_glob and pos_PA_loc of a pulley on "
        "the frame, or pos_OA_glob and pos_PD_loc of one on the platform"
    )


FLAT = {
    "ONE_R_TWO_T": (
        [[-1.0, 0.2, 1.0], [1.0, 0.2, 1.0], [1.0, 0.2, -1.0], [-1.0, 0.2, -1.0]],
        [[-0.1, 0.1, 0.1], [0.1, 0.1, 0.1], [0.1, 0.1, -0.1], [-0.1, 0.1, -0.1]],
    ),
    "TWO_T": (
        [[-1.0, -1.0, 0.5], [1.0, -1.0, 0.5], [1.0, 1.0, 0.5], [-1.0, 1.0, 0.5]],
        [[0.0, 0.0, 0.1]] * 4,
    ),
    "THREE_T": (
        [[-1.0, -1.0, 2.5], [1.0, -1.0, 2.5], [1.0, 1.0, 2.5], [-1.0, 1.0, 2.5]],
        [[0.0, 0.0, 0.1]] * 4,
    ),
}


def flat_robot(folder, pattern, points):
    """The path of a robot without pulleys."""
    cables = [
        {"pos_OD_glob": A, "pos_PA_loc": B, "vers_k": [0, 0, 1]}
        for A, B in zip(*points, strict=True)
    ]
    path = folder / "flat.json"
    content = {"motion_pattern": pattern, "cable": cables, "platform": {"mass": 2.0}}
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize(
    ("pattern", "rows", "along", "at"),
    [("ONE_R_TWO_T", (1, 3, 5), 1, 0.1), ("TWO_T", (3, 4), 2, 0.5), ("THREE_T", (3, 4, 5), 2, 0)],
)
def test_motion_patterns(pattern, rows, along, at, tmp_path):
    """A platform in a plane keeps the distance at which its cables lie in that plane."""
    imported = models.import_robot(flat_robot(tmp_path, pattern, FLAT[pattern]))
    robot = imported.robot
    assert robot.motion_type().rows == rows
    if len(rows) < 3 or 1 in rows:
        assert robot.home.position[along] == pytest.approx(at)
    assert not any("motion_pattern" in words for words in imported.completed.remarks)
    X_WP, cables = robot.home.transform(), robot.cable_set()
    ends = X_WP.multiply(cables.p_PB) - cables.p_WA
    if robot.motion_type().is_plane:
        np.testing.assert_allclose(ends[along], 0.0, atol=EXACT)


@pytest.mark.parametrize(
    ("pattern", "points"),
    [("ONE_R_TWO_T", FLAT["THREE_T"]), ("HOP", FLAT["THREE_T"]), (3, FLAT["TWO_T"])],
)
def test_motion_patterns_that_do_not_fit_are_told(pattern, points, tmp_path):
    points = ([*points[0][:3], [-1.0, 1.0, 2.0]], points[1])
    imported = models.import_robot(flat_robot(tmp_path, pattern, points))
    assert imported.robot.motion == "3R3T"
    words = f"motion_pattern {pattern} was read as a free body, 3R3T."
    assert words in imported.completed.remarks


def test_names_of_the_first_files(tmp_path):
    """Files of the first years turn words round: pos_glob_D, pos_loc_A, pos_loc_G."""
    path = files.grab(tmp_path, old=True)
    expected = models.load_robot(str(path))
    names = {
        "pos_D_glob": "pos_glob_D", "pos_A_loc": "pos_loc_A", "pos_G_loc": "pos_loc_G",
        "inertia_mat_G_loc": "inertia_mat_loc_G",
    }  # fmt: skip
    text = path.read_text()
    for old, new in names.items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    robot = models.load_robot(str(path))
    np.testing.assert_array_equal(robot.exit_points(), expected.exit_points())
    np.testing.assert_array_equal(robot.anchor_points(), expected.anchor_points())
    np.testing.assert_array_equal(robot.center_of_mass(), expected.center_of_mass())
    np.testing.assert_array_equal(robot.platform.inertia, expected.platform.inertia)


@pytest.mark.parametrize(
    ("word", "value"),
    [("0.", 0.0), ("-0.", 0.0), (".5", 0.5), ("-.25", -0.25), ("2.e1", 20.0), (".5E-1", 0.05)],
)
def test_numbers_with_digits_on_one_side_of_the_point(word, value, tmp_path):
    path = tmp_path / "toy.json"
    path.write_text(f'{{"a": "0. and .5, ]",\n"b": [1.5, {word},\n{word}], "c": -1.25e-3, "d": 7}}')
    content, remarks = read_json(path)
    assert content == {"a": "0. and .5, ]", "b": [1.5, value, value], "c": -0.00125, "d": 7}
    assert remarks == [
        f"Numbers that strict JSON refuses were read: 2, the first {word} in line 2."
    ]


@pytest.mark.parametrize(
    "text", ['{"a": 1.5, "b": [1e5, -0.25]}', '[".5", "1.", "a, ]"]', '"0."', "[1.5e-7, 10]"]
)
def test_strict_json_is_read_as_it_is(text, tmp_path):
    path = tmp_path / "toy.json"
    path.write_text(text)
    assert read_json(path) == (json.loads(text), [])


@pytest.mark.parametrize("word", ["..5", "1..", "0.x", "x.5", "1.2.3", ".", "-.", "00.", "+.5"])
def test_what_is_no_number_stays_wrong(word, tmp_path):
    path = tmp_path / "toy.json"
    path.write_text(f"[1,\n {word}]")
    with pytest.raises(RobotFileError, match=":2: does not parse as JSON"):
        read_json(path)


def test_a_robot_with_such_numbers_says_so(tmp_path):
    path = files.grab(tmp_path)
    text = path.read_text()
    assert "[-2.0]" in text
    path.write_text(text.replace("[-2.0]", "[-2.]"))
    imported = models.import_robot(path)
    np.testing.assert_allclose(imported.robot.exit_points(), files.EXITS[:, :3], atol=EXACT)
    numbers, commas = imported.completed.remarks[:2]
    assert numbers.startswith("Numbers that strict JSON refuses were read: 2, the first -2. in")
    assert commas.startswith("Commas before a closing bracket were let pass: 2, the first in")


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("toy.json", '{"robot": {}, "cables": []}', "an object with robot, cables"),
        ("toy.json", "{}", "an object without keys"),
        ("toy.json", "[1, 2]", "an array"),
        ("toy.json", '"words"', "a string"),
        ("toy.json", "3", "a number"),
        ("toy.json", "true", "true or false"),
        ("toy.json", "null", "null"),
        ("toy.yaml", "robot: {}", "a mapping with robot"),
        ("toy.yaml", "[1, 2]", "a sequence"),
        ("toy.yaml", "words", "text"),
    ],
)
def test_another_document_is_told_in_the_words_of_its_format(name, text, found, tmp_path):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(RobotFileError) as caught:
        models.import_robot(path)
    accepted = {
        ".json": "an object with the object platform and the list actuator or cable",
        ".yaml": "a mapping with points and platform",
    }
    assert str(caught.value) == (f"{path}: top: found {found}; accepted: {accepted[path.suffix]}")


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("{2020-01-01: 3}", "{datetime.date(2020, 1, 1): 3}"),
        ("[1, null, yes]", "[1, null, true]"),
        ("{x: [1, {y: a}]}", '{"x": [1, {"y": "a"}]}'),
    ],
)
def test_values_of_yaml_that_json_does_not_have_are_told_too(words, found, tmp_path):
    path = files.gazebo(tmp_path)
    text = path.read_text()
    assert "mass: 2.5" in text
    path.write_text(text.replace("mass: 2.5", f"mass: {words}"))
    with pytest.raises(RobotFileError) as caught:
        models.load_robot(str(path))
    assert f"platform.mass: found {found}; accepted: a finite number" in str(caught.value)


def test_an_alias_of_yaml_that_contains_itself_is_refused_by_the_reader(tmp_path):
    path = files.gazebo(tmp_path)
    text = path.read_text()
    assert "mass: 2.5" in text
    path.write_text(text.replace("mass: 2.5", "mass: &a [*a]"))
    with pytest.raises(RobotFileError) as caught:
        models.load_robot(str(path))
    assert str(caught.value) == (
        f"{path}:6: found an alias within what it names; accepted: aliases of what has ended"
    )


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"mass": 2.5', '"mass": null', "platform.mass: found nothing; accepted: a finite number"),
        ('"mass": 2.5', '"mass": true', "platform.mass: found true; accepted: a finite number"),
        (
            '"mass": 2.5',
            '"mass": {"a": [1]}',
            'platform.mass: found {"a": [1]}; accepted: a finite',
        ),
        ('"radius": 0.03', '"radius": -1', "radius: found -1.0; accepted: at least 0 [m]"),
        ("[[0.0], [0.0], [1.0]]", "[[0.0], [0.0], [2.0]]", "pulley.vers_k_loc: found [0.0, 0.0"),
        ('"winch": {', '"winch": [], "other": {', "actuator[0].winch: found []; accepted: an"),
        ('"drum_diameter": 0.06', '"drum_diameter": 0', "drum_diameter: found 0.0; accepted: ab"),
    ],
)
def test_values_are_told_as_the_file_has_them(old, new, message, tmp_path):
    path = files.grab_on_board(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(RobotFileError) as caught:
        models.load_robot(str(path))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
