"""What CASPR's files say in less common ways: lists, old elements, limits, order of attachments."""

from __future__ import annotations

import numpy as np
import pytest

from cdpr_drake import models
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.formats.caspr import caspr_models, read_caspr
from tests.models.formats import foreign_files as files

EXACT = 1e-12
BODIES, CABLES = "toy_bodies.xml", "toy_cables.xml"


def changed(folder, name, *pairs):
    """Replaces words in one of the files of a toy, each of which must be there."""
    path = folder / name
    text = path.read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")


def refusal(folder):
    with pytest.raises(RobotFileError) as caught:
        read_caspr(folder / BODIES)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_rows_of_a_list_that_are_no_models_are_passed_over(tmp_path):
    listed = tmp_path / "list.csv"
    listed.write_text(
        "name,folder,bodies,cables\n"
        "half,/half/,half_bodies.xml,half_cables.txt,t.xml\n"
        "other half,/half/,half_bodies.txt,half_cables.xml,t.xml\n"
        "short,/short/,short_bodies.xml\n"
        " Toy , /toys/ , toy_bodies.xml,toy_cables.xml\n"
    )
    # A file's name must end in .xml; space before and after it does not count.
    assert caspr_models(listed) == {
        "Toy": (tmp_path / "toys" / "toy_bodies.xml", tmp_path / "toys" / "toy_cables.xml")
    }
    listed.write_text("name,folder\n")
    with pytest.raises(RobotFileError, match="rows: found none of a model"):
        caspr_models(listed)


def test_a_list_needs_the_name_of_one_of_its_models(tmp_path):
    listed = tmp_path / "list.csv"
    listed.write_text("Toy,/,toy_bodies.xml,toy_cables.xml\n")
    files.caspr(tmp_path)
    assert read_caspr(listed, "TOY").name == "toy"
    for model, found in ((None, "nothing"), ("Boat", "Boat")):
        with pytest.raises(RobotFileError, match=f"model: found {found}; accepted: Toy"):
            read_caspr(listed, model)


def test_the_joint_of_older_files(tmp_path):
    path = files.caspr(tmp_path)
    whole = (
        f'<joint type="SPATIAL_EULER_XYZ" q_initial="{files.words([*files.HOME, *files.ANGLES])}"/>'
    )
    changed(tmp_path, BODIES, (whole, "<joint_type> spatial_euler_xyz </joint_type>"))
    draft = read_caspr(path)
    assert draft.motion == "3R3T"
    assert draft.home_position is None
    changed(tmp_path, BODIES, (" spatial_euler_xyz ", " "))
    assert "link_rigid: found no joint" in refusal(tmp_path)
    changed(tmp_path, BODIES, ("<joint_type> </joint_type>", ""))
    assert "link_rigid: found no joint" in refusal(tmp_path)


ANY, NONE = "-3.15 -3.15 -3.15", "3.15 3.15 3.15"


@pytest.mark.parametrize(
    ("low", "high", "frame"),
    [
        (f"-1 -2 0 {ANY}", f"1 2 3 {NONE}", ([-1, -2, 0], [1, 2, 3])),
        (f"-1 0 0 {ANY}", f"1 0 3 {NONE}", None),  # one axis does not move
        (f"-1 -9999 0 {ANY}", f"1 9999 3 {NONE}", None),  # none that anybody has built
        (f"-1e9 -1e9 0 {ANY}", f"-1 -2 3 {NONE}", None),
        (f"-1 -2 0 {ANY}", None, None),
        (None, f"1 2 3 {NONE}", None),
    ],
)
def test_limits_of_the_joint_are_the_frame(low, high, frame, tmp_path):
    """Where they are none of a robot, the range that is displayed is."""
    path = files.caspr(tmp_path)
    limits = "".join(
        f' {key}="{words}"' for key, words in (("q_min", low), ("q_max", high)) if words
    )
    changed(tmp_path, BODIES, ('"/>\n      <physical>', f'"{limits}/>\n      <physical>'),
            ("<location>0 0 0<", "<location>0.1 0.2 0.3<"))  # fmt: skip
    draft = read_caspr(path)
    expected = ([-3, -3, 0], [3, 3, 3]) if frame is None else np.add(frame, [0.1, 0.2, 0.3])
    np.testing.assert_allclose((draft.frame_lower, draft.frame_upper), expected)
    np.testing.assert_allclose(draft.home_position, files.HOME + np.array([0.1, 0.2, 0.3]))
    assert any("limits of the joint" in words for words in draft.remarks) == (frame is not None)


def test_two_limits_are_too_few_for_a_frame(tmp_path):
    path = files.caspr(tmp_path, joint="P_XZ", q="0.1 1.2")
    changed(
        tmp_path, BODIES, ('q_initial="0.1 1.2"', 'q_initial="0.1 1.2" q_min="-1 0" q_max="1 2"')
    )
    np.testing.assert_allclose(read_caspr(path).frame_lower, [-3, -3, 0])


@pytest.mark.parametrize(
    ("words", "frame"),
    [
        ('display_range="-3 3 -3 3 0 3">', True),
        ("><display_range>-3 3 -3 3 0 3</display_range>", True),
        ('display_range="-3 3 -3 3 3 3">', False),
        ('display_range="">', False),
        (">", False),
    ],
)
def test_the_range_that_is_displayed(words, frame, tmp_path):
    path = files.caspr(tmp_path)
    changed(tmp_path, BODIES, ('display_range="-3 3 -3 3 0 3">', words))
    draft = read_caspr(path)
    assert (draft.frame_lower is not None) == frame
    if frame:
        np.testing.assert_allclose((draft.frame_lower, draft.frame_upper), [[-3, -3, 0], [3] * 3])


def test_a_range_of_five_numbers_is_refused(tmp_path):
    files.caspr(tmp_path)
    changed(tmp_path, BODIES, ("-3 3 -3 3 0 3", "-3 3 -3 3 0"))
    assert "display_range: found -3 3 -3 3 0; accepted: 6 finite numbers" in refusal(tmp_path)


@pytest.mark.parametrize("reference", ["joint", "com"])
def test_points_of_the_world_are_relative_to_the_world(reference, tmp_path):
    """`attachment_reference` is of the link only."""
    draft = read_caspr(files.caspr(tmp_path, reference=reference))
    np.testing.assert_allclose(draft.exit_points(), files.EXITS, atol=EXACT)
    np.testing.assert_allclose(draft.anchor_points(), files.ANCHORS, atol=EXACT)


def attachment(link, point):
    return f"<attachment><link>{link}</link><location>{files.words(point)}</location></attachment>"


ONE, TWO, END = np.array([1.0, 0.0, 2.0]), np.array([2.0, 0.5, 1.0]), np.array([0.1, 0.2, 0.0])


@pytest.mark.parametrize(
    ("chain", "leaves"),
    [
        ([(0, ONE), (1, END)], ONE),
        ([(1, END), (0, ONE)], ONE),
        ([(0, ONE), (0, TWO), (1, END)], TWO),
        ([(1, END), (0, ONE), (0, TWO)], ONE),
        ([(1, END)], "[1]"),
        ([(0, ONE)], "[0]"),
        ([(0, ONE), (1, END), (1, TWO)], "[0, 1, 1]"),
        ([(0, ONE), (1, END), (0, TWO)], "[0, 1, 0]"),
    ],
)
def test_the_order_of_attachments(chain, leaves, tmp_path):
    """A cable leaves the frame from the point of the world that is next to the body."""
    path = files.caspr(tmp_path)
    old = attachment(0, files.EXITS[:, 0]) + attachment(1, files.ANCHORS[:, 0])
    changed(tmp_path, CABLES, (old, "".join(attachment(*item) for item in chain)))
    if isinstance(leaves, str):
        assert f"cable 1: found attachments to links {leaves}; accepted" in refusal(tmp_path)
        return
    draft = read_caspr(path)
    np.testing.assert_array_equal(draft.cables[0].exit_point, leaves)
    np.testing.assert_array_equal(draft.cables[0].anchor_point, END)
    runs = [words for words in draft.remarks if "runs over 2 points" in words]
    assert len(runs) == (len(chain) == 3)


def test_a_link_that_is_neither_world_nor_body(tmp_path):
    files.caspr(tmp_path)
    changed(tmp_path, CABLES, ("<link>1</link>", "<link>2</link>"))
    assert "cable 1, attachment 2, link: found 2; accepted: 0, the world, or" in refusal(tmp_path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("<pulley_radius>0.04</pulley_radius>", "<pulley_radius>-0.01</pulley_radius>"),
        ("<cable_entry_vector>0 1 1<", "<cable_entry_vector>0 0 0<"),
    ],
)
def test_pulleys_that_cannot_be(old, new, tmp_path):
    files.caspr(tmp_path, pulley=True)
    changed(tmp_path, CABLES, (old, new))
    assert "cable 1, attachment 1: found radius" in refusal(tmp_path)


def test_a_pulley_without_radius_is_a_point(tmp_path):
    files.caspr(tmp_path, pulley=True)
    changed(tmp_path, CABLES, ("<pulley_radius>0.04<", "<pulley_radius>0<"))
    cable = read_caspr(tmp_path / BODIES).cables[0]
    assert cable.pulley_radius == 0.0
    np.testing.assert_allclose(cable.swivel_axis, np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0))


@pytest.mark.parametrize(
    ("name", "short"),
    [("cable 3", "C3"), ("Cable_3", "C3"), ("3", "C3"), ("cable a", "cable a"), ("C3b", "C3b")],
)
def test_names_of_cables_are_short(name, short, tmp_path):
    files.caspr(tmp_path)
    changed(tmp_path, CABLES, ('name="cable 3"', f'name="{name}"'))
    assert read_caspr(tmp_path / BODIES).cables[2].name == short


def test_which_set_of_cables(tmp_path):
    files.caspr(tmp_path)
    path = tmp_path / BODIES
    with pytest.raises(RobotFileError, match="default_cable_set: found third; accepted: one of f"):
        read_caspr(path, cable_set="third")
    assert len(read_caspr(path, cable_set="second").cables) == 8
    changed(tmp_path, CABLES, (' default_cable_set="second"', ""), ('<cable_set id="first"/>', ""))
    draft = read_caspr(path)  # no default: the first
    assert len(draft.cables) == 8
    assert not any("the file also has" in words for words in draft.remarks)
    changed(tmp_path, CABLES, ("cable_set ", "set "), ("cable_set>", "set>"))
    assert "cable_set: found none; accepted: at least one" in refusal(tmp_path)


def test_springs_and_kinds_of_cables_are_told(tmp_path):
    files.caspr(tmp_path)
    changed(tmp_path, CABLES, ('<cable_ideal name="cable 8"', '<cable_passive name="cable 8"'))
    text = (tmp_path / CABLES).read_text()
    head, _, tail = text.rpartition("</cable_ideal>")
    (tmp_path / CABLES).write_text(f"{head}</cable_passive>{tail}")
    draft = read_caspr(tmp_path / BODIES)
    assert [cable.name for cable in draft.cables] == [f"C{k}" for k in range(1, 8)]
    assert "cable 8, a passive spring, was left out." in draft.remarks
    assert not any("of the kind" in words for words in draft.remarks)
    changed(tmp_path, CABLES, ("cable_ideal", "cable_linear_spring"))
    words = "Cables are of the kind cable_linear_spring; their stiffness was not kept."
    assert words in read_caspr(tmp_path / BODIES).remarks


def test_inertia_about_the_joint(tmp_path):
    """Steiner's theorem, by hand: I_com = I_joint - m (|c|^2 1 - c c')."""
    files.caspr(tmp_path)
    changed(tmp_path, BODIES, ('<inertia ref="com">', '<inertia ref="joint">'))
    draft = read_caspr(tmp_path / BODIES)
    x, y, z = files.COM
    shift = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
    np.testing.assert_allclose(draft.inertia, files.INERTIA - files.MASS * np.array(shift))
    assert any(words.startswith("Inertia is given about joint") for words in draft.remarks)


@pytest.mark.parametrize(("scale", "fine"), [(1.0, True), (7.0, True), (0.0, False)])
def test_quaternions_of_any_length_but_zero(scale, fine, tmp_path):
    q = scale * np.array([np.cos(0.2), 0.0, np.sin(0.2), 0.0])
    words = files.words([*files.HOME, *q])
    path = files.caspr(tmp_path, joint="SPATIAL_QUATERNION", q=words)
    if not fine:
        assert "accepted: a quaternion that is not zero" in refusal(tmp_path)
        return
    c, s = np.cos(0.4), np.sin(0.4)
    np.testing.assert_allclose(
        read_caspr(path).R_WP, [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], atol=EXACT
    )


def test_degrees_are_told_by_their_size(tmp_path):
    path = files.caspr(tmp_path, q=f"{files.words(files.HOME)} 0 0 90")
    draft = read_caspr(path)
    np.testing.assert_allclose(draft.R_WP, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=EXACT)
    assert any("degrees" in words for words in draft.remarks)
    path = files.caspr(tmp_path, q=f"{files.words(files.HOME)} 0 0 6.28")
    assert not any("degrees" in words for words in read_caspr(path).remarks)


def test_a_folder_has_one_file_of_bodies(tmp_path):
    files.caspr(tmp_path)
    assert models.load_robot(str(tmp_path)).name == "toy"
    files.caspr(tmp_path, name="other")
    with pytest.raises(RobotFileError, match=r"found other_bodies\.xml, toy_bodies\.xml; accep"):
        read_caspr(tmp_path)
    (tmp_path / "other_cables.xml").unlink()
    with pytest.raises(RobotFileError, match=r"there is no file other_cables\.xml beside"):
        read_caspr(tmp_path / "other_bodies.xml")
    (tmp_path / BODIES).rename(tmp_path / "toy_body_properties.xml")
    (tmp_path / CABLES).rename(tmp_path / "TOY_cable_properties.XML")
    assert len(read_caspr(tmp_path / "toy_body_properties.xml").cables) == 8


@pytest.mark.parametrize("words", ["<Ixy>0.01</Ixy>", "<Ixy/>", "<Ixy> </Ixy>", ""])
def test_products_of_inertia_that_are_not_given_are_zero(words, tmp_path):
    files.caspr(tmp_path)
    changed(tmp_path, BODIES, ("<Ixy>0.01</Ixy>", words))
    expected = files.INERTIA.copy()
    expected[3] = 0.01 if "0.01" in words else 0.0
    np.testing.assert_array_equal(read_caspr(tmp_path / BODIES).inertia, expected)


def test_a_level_plane_lies_where_the_joint_does(tmp_path):
    path = files.caspr(tmp_path, joint="PLANAR_XY", q="0.1 0.2 0.3")
    changed(tmp_path, BODIES, ("<location>0 0 0<", "<location>0.5 0 0.7<"))
    draft = read_caspr(path)
    assert draft.plane_height == 0.7
    np.testing.assert_allclose(draft.home_position, [0.6, 0.2, 0.7])


def test_a_model_without_a_body(tmp_path):
    files.caspr(tmp_path, links=0)
    assert "link_rigid: found 0 bodies" in refusal(tmp_path)
