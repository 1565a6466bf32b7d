"""Files of other tools that are wrong are refused in one line, by their path and what is wrong."""

import pytest

from cdpr_drake import formats, models
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.caspr import read_caspr
from cdpr_drake.formats.detection import read_foreign
from cdpr_drake.formats.mechanism_exchange import import_mechanism
from tests.models.formats.foreign_files import (
    ANCHORS,
    EXITS,
    KLIPPER,
    caspr,
    edited,
    gazebo,
    grab,
    grab_on_board,
    klipper,
    maslow,
    reprap,
    saved,
    sdformat,
    wirex,
    words,
)
from tests.models.formats.rich_files import HEAVY, SDF, SLIDER, hung, joined, slid, urdf
from tests.models.formats.tree_files import two_link

pytestmark = pytest.mark.usefixtures("in_this_process")


def toy(**changes):
    return lambda folder: caspr(folder, **changes)


def attachment(link, point):
    return f"<attachment><link>{link}</link><location>{words(point)}</location></attachment>"


def chain(*links):
    """The first cable of the toy with attachments to other links."""
    old = attachment(0, EXITS[:, 0]) + attachment(1, ANCHORS[:, 0])
    return old, "".join(attachment(link, [0.1 * k, 0.2, 1.0]) for k, link in enumerate(links))


def top(found, accepted):
    return f"top: found {found}; accepted: {accepted}"


JSON_TOP = "an object with the object platform and the list actuator or cable"
YAML_TOP = "a mapping with points and platform"
TOGETHER = (
    "; accepted: pos_OD_glob and pos_PA_loc of a pulley on the frame, or pos_OA_glob and "
    "pos_PD_loc of one on the platform"
)
WHOLE = f'<joint type="SPATIAL_EULER_XYZ" q_initial="{words([0.2, -0.1, 1.1, 0.1, -0.2, 0.3])}"/>'
MASS, PULLEY = '"mass": 2.5', toy(pulley=True)
FIRST = '<cable_set id="first"></cable_set>'
SETS = (FIRST, ""), ("cable_set ", "set "), ("cable_set>", "set>")
BALL = '<joint name="holds" type="ball"><parent>gantry</parent><child>platform</child></joint>'

# name -> (what writes the file, changes of words in it, what the refusal says)
FILES = {
    "no XML": (caspr, [("</links>", "")], "is not well-formed XML"),
    "joint space": (toy(joint="R_Z", q="0"), [], "joint space, no cable robot"),
    "two bodies": (toy(links=2), [], "2 bodies"),
    "no body": (toy(links=0), [], "link_rigid: found 0 bodies"),
    "two coordinates": (toy(q="1 2"), [], "6 finite numbers"),
    "coordinates of letters": (toy(q="a b c d e f"), [], "finite number"),
    "blank joint": (caspr, [(WHOLE, "<joint_type> </joint_type>")], "link_rigid: found no joint"),
    "no joint": (caspr, [(WHOLE, "")], "link_rigid: found no joint"),
    "range of five": (caspr, [("-3 3 -3 3 0 3", "-3 3 -3 3 0")],
                      "display_range: found -3 3 -3 3 0; accepted: 6 finite numbers"),
    "body alone": (caspr, [chain(1)], "cable 1: found attachments to links [1]; accepted"),
    "world alone": (caspr, [chain(0)], "cable 1: found attachments to links [0]; accepted"),
    "body twice": (caspr, [chain(0, 1, 1)], "found attachments to links [0, 1, 1]; accepted"),
    "world round": (caspr, [chain(0, 1, 0)], "found attachments to links [0, 1, 0]; accepted"),
    "link 2": (caspr, [("<link>1</link>", "<link>2</link>")],
               "cable 1, attachment 2, link: found 2; accepted: 0, the world, or"),
    "negative pulley": (PULLEY, [("<pulley_radius>0.04<", "<pulley_radius>-0.01<")],
                        "cable 1, attachment 1: found radius"),
    "pulley's way": (PULLEY, [("<cable_entry_vector>0 1 1<", "<cable_entry_vector>0 0 0<")],
                     "cable 1, attachment 1: found radius"),
    "no set": (caspr, SETS, "cable_set: found none; accepted: at least one"),
    "no quaternion": (toy(joint="SPATIAL_QUATERNION", q="0.2 -0.1 1.1 0 0 0 0"), [],
                      "accepted: a quaternion that is not zero"),
    "mass TODO": (wirex, [('mass="2.5"', 'mass="TODO"')], "platform.mass: found TODO"),
    "mass tag": (gazebo, [("mass: 2.5", "mass: <mass>")], "platform.mass: found <mass>"),
    "flat size": (gazebo, [("[0.2, 0.2, 0.12]", "[0.2, 0.2]")], "3 finite numbers"),
    "date in YAML": (gazebo, [("mass: 2.5", "mass: {2020-01-01: 3}")],
                     "mass: found {datetime.date(2020, 1, 1): 3}; accepted: a finite number"),
    "words in YAML": (gazebo, [("mass: 2.5", "mass: [1, null, yes]")], "found [1, null, true]; ac"),
    "nested YAML": (gazebo, [("mass: 2.5", "mass: {x: [1, {y: a}]}")],
                    'found {"x": [1, {"y": "a"}]}; accepted: a finite number'),
    "endless alias": (gazebo, [("mass: 2.5", "mass: &a [*a]")],
                      "toy.yaml:6: found an alias within what it names; accepted: aliases of what"
                      " has ended"),
    "NaN": (grab, [(MASS, '"mass": NaN')], "platform.mass: found nan"),
    "no JSON": (grab, [(MASS, '"mass": ')], "does not parse as JSON"),
    "null": (grab_on_board, [(MASS, '"mass": null')],
             "platform.mass: found nothing; accepted: a finite number"),
    "true": (grab_on_board, [(MASS, '"mass": true')],
             "platform.mass: found true; accepted: a finite number"),
    "object": (grab_on_board, [(MASS, '"mass": {"a": [1]}')],
               'platform.mass: found {"a": [1]}; accepted: a finite'),
    "negative radius": (grab_on_board, [('"radius": 0.03', '"radius": -1')],
                        "radius: found -1.0; accepted: at least 0 [m]"),
    "long axis": (grab_on_board, [("[[0.0], [0.0], [1.0]]", "[[0.0], [0.0], [2.0]]")],
                  "pulley.vers_k_loc: found [0.0, 0.0"),
    "list for object": (grab_on_board, [('"winch": {', '"winch": [], "other": {')],
                        "actuator[0].winch: found []; accepted: an"),
    "no drum": (grab_on_board, [('"drum_diameter": 0.06', '"drum_diameter": 0')],
                "drum_diameter: found 0.0; accepted: ab"),
    "frame with winch": (grab_on_board, [("pos_OA_glob", "pos_OD_glob")],
                         f"actuator[0]: found pos_OD_glob and pos_PD_loc{TOGETHER}"),
    "winch with frame": (grab_on_board, [("pos_PD_loc", "pos_PA_loc")],
                         f"actuator[0]: found pos_PA_loc and pos_OA_glob{TOGETHER}"),
    "exit alone": (grab_on_board, [("pos_PD_loc", "point")],
                   f"actuator[0]: found pos_OA_glob{TOGETHER}"),
    "anchor alone": (grab_on_board, [("pos_OA_glob", "point")],
                     f"actuator[0]: found pos_PD_loc{TOGETHER}"),
    **{f"load {key}": (grab_on_board, [('"platform": {', f'"platform": {{"{key}": [1.0, 2.0], ')],
                       f"platform.{key}: found ")
       for key in ("ext_force_loc", "ext_torque_loc", "ext_moments_loc")},
    **{f"number {word}": (saved("toy.json", f"[1,\n {word}]"), [], ":2: does not parse as JSON")
       for word in ("..5", "1..", "0.x", "x.5", "1.2.3", ".", "-.", "00.", "+.5")},
    **{f"JSON of {found}": (saved("toy.json", text), [], top(found, JSON_TOP)) for text, found in [
        ('{"robot": {}, "cables": []}', "an object with robot, cables"),
        ("{}", "an object without keys"), ("[1, 2]", "an array"), ('"words"', "a string"),
        ("3", "a number"), ("true", "true or false"), ("null", "null")]},
    **{f"YAML of {found}": (saved("toy.yaml", text), [], top(found, YAML_TOP)) for text, found in [
        ("robot: {}", "a mapping with robot"), ("[1, 2]", "a sequence"), ("words", "text")]},
    "no frames": (sdformat, [('name="B_', 'name="Q_')], "accepted: frames exit_NAME"),
    "delta": (klipper, [("winch", "delta")], "kinematics: found delta; accepted: winch"),
    "no anchor": (klipper, [("anchor_y: 1000\n", "")], "stepper_b.anchor_y: found nothing"),
    "gear": (klipper, [("51:4", "51")], "gear_ratio: found 51; accepted: motor:drum"),
    "two winches": (saved("a.cfg", KLIPPER.partition("[stepper_c]")[0]), [],
                    "found 2 winches; accepted: at least 3"),
    "no sections": (saved("a.cfg", "no sections"), [], "sections: found"),
    "mover": (klipper, [("[extruder]", "[winch]\nmover_weight: 0\n[extruder]")],
              "winch.mover_weight: found 0; accepted: above 0"),
    "other machine": (reprap, [("K6", "K3")], "M669 K: found 3.0; accepted: 6"),
    "flat anchor": (reprap, [("B1312.5:", "B")],
                    "M669 B: found 1270.9:-162.2; accepted: x:y:z"),
    "anchor 5": (reprap, [("N4", "N5")], "found anchors A, B, C, D and N 5"),
    "radii": (reprap, [("R65.0:65.0:65.0:", "R65.0:")], "M666 R: found 2 numbers"),
    "build-up": (reprap, [("Q0.0", "Q-1")], "M666 Q: found -1.0; accepted: at least 0"),
    "large build-up": (reprap, [("Q0.0", "Q900")], "M666 Q: found 900.0; accepted: so little that"),
    "lines": (reprap, [("Q0.0", "Q.1"), ("O1:", "O2:")], "M666 O: found 2:1:1:1; acc"),
    "no machine": (saved("a.g", "G28\n"), [], "M669: found nothing"),
    "wide": (maslow, [("trX: 3600.0", "trX: wide")], "trX: found wide; accepted: a fin"),
    "perhaps": (maslow, [("true", "perhaps")], "Maslow_vertical: found perhaps"),
    "ball": (saved("rich.sdf", SDF.replace("<plugin", f"{BALL}<plugin")), [], "ball_rpy joint hol"),
    "heavy slide": (urdf(slid(HEAVY, "prismatic")), [],
                    "link slider: found 3 kg between the joints"),
    "turning slide": (urdf(slid(SLIDER, "revolute")), [], "joint second"),
    "revolute": (urdf(joined("revolute")), [], "revolute joint moves"),
    "continuous": (urdf(joined("continuous")), [], "revolute joint moves"),
    "welded": (urdf(joined("fixed")), [], "fixed joint moves"),
    "moved exit": (urdf(joined("floating")), [('"e0" type="fixed"', '"e0" type="continuous"')],
                   "exit_C0 ... revolute joint e0 ... mechanism file"),
    "moved anchor": (urdf(joined("floating")), [('"a0" type="fixed"', '"a0" type="continuous"')],
                     "anchor_C0 ... revolute joint a0 ... mechanism file"),
}  # fmt: skip

ROLL = '<geom name="roll" type="cylinder" size="0.05 0.1" pos="0 0 3"/>'
MESH = '<asset><mesh name="shell" file="nowhere.stl"/></asset>'
SHELL = '<geom type="mesh" mesh="shell"/>'
OTHER = '<body name="q"><joint name="pin" type="free"/><geom size="1"/><site name="z"/></body>'
CAR = (
    '<body name="car" pos="-1 -1 2"><joint name="rides" type="slide"/><geom size="0.1"/>'
    '<site name="w0"/></body>'
)
FREE, ROPE = "<freejoint/>", '<spatial name="t0"><site site="w0"/>'
MUJOCO = {
    "tackle": (hung(), [(ROPE, ROPE.replace("<site", '<pulley divisor="2"/><site', 1))],
               "a pulley of divisor 2"),
    "wrap": (hung(world=ROLL), [(ROPE, ROPE + '<geom geom="roll"/>')], "a wrap round the geom rol"),
    "hinge": (hung(), [(FREE, '<joint name="pin" axis="0 0 1"/>')],
              "hinge joint pin ... mechanism file"),
    "ball": (hung(), [(FREE, '<joint name="pin" type="ball"/>')],
             "ball joint pin ... mechanism file"),
    "no joint": (hung(), [(FREE, "")], "body p without a joint"),
    "car": (hung(), [('<site name="w0" pos="-1 -1 2"/>', CAR)],
            "car (slide joint rides) ... mechanism file"),
    "two bodies": (hung(world=OTHER), [('site="a3"', 'site="z"')],
                   "p (free joint 0), q (free joint pin) ... mechanism file"),
    "mesh that touches": (hung(SHELL, MESH), [], "mesh shell: found no file nowhere.stl"),
    "mesh that weighs": (
        hung(SHELL.replace("/>", ' contype="0" conaffinity="0" mass="1"/>'), MESH), [],
        "mesh shell: found no file nowhere.stl"),
}  # fmt: skip

MOVED = 'type="R_Y" q_initial="0.3"'
TREES = {
    "helix": ([(MOVED, 'type="HELIX" q_initial="0.3"')],
              "bodies.xml: link 1, joint.type: found HELIX; accepted: R_X"),
    "start": ([('q_initial="0.3"', 'q_initial="0.3 1"')],
              "link 1, joint.q_initial: found 0.3 1; accepted: 1 finite"),
    "limit": ([('q_min="-2.0"', 'q_min="3"')], "link 1, joint.q_min: found 3; accepted: at most"),
    "parent": ([("<num>1</num>", "<num>7</num>")],
               "link 2, parent.num: found 7; accepted: 0, the world, or a link, 1 to 2"),
    "later parent": ([("<num>0</num>", "<num>2</num>")],
                     "link 1, parent.num: found 2; accepted: a link"),
    "number twice": ([('num="2"', 'num="1"')], "link 1, num: found 1; accepted: numbers that are"),
    "number 3": ([('num="2"', 'num="3"')], "link_rigid, num: found [1, 3]; accepted: all of 1"),
    "number 1.5": ([('num="2"', 'num="1.5"')], "link 1.5, num: found 1.5; accepted: a whole"),
    "mass": ([("<mass>1.5</mass>", "<mass>-1</mass>")], "link 1, mass: found -1; accepted"),
    "no mass": ([("<mass>1.5</mass>", "")], "link 1, mass: found nothing; accepted"),
    "inertia's point": ([('ia ref="com"', 'ia ref="end"')],
                        "link 1, inertia.ref: found end; accepted: com or"),
    "moment": ([("<Ixx>0.02</Ixx>", "<Ixx>x</Ixx>")], "link 1, Ixx: found x; accepted: a finite"),
    "axis": ([('q_initial="0.3"', 'q_initial="0.3" axis="1 0 0"')],
             "link 1, joint.axis: found 1 0 0; accepted: an axis of R_AXIS and P_AXIS only"),
    "no axis": ([(MOVED, 'type="R_AXIS" axis="0 0 0" q_initial="0.3"')],
                "link 1, joint.axis: found 0 0 0; accepted: a vector that is not zero"),
    "link": ([("<link>2</link>", "<link>3</link>")],
             "cable 1, attachment 3, link: found 3; accepted: 0, the world, or a link, 1 to 2"),
    "place": ([("<location>0.05 0 0.02<", "<location>1 2<")],
              "cables.xml: cable 1, attachment 2, location: found 1 2; accepted: 3 finite"),
    "reference": ([('reference="com"', 'reference="end"')],
                  "cable 1, attachment_reference: found end; accepted: com or joint"),
    "force": ([("<force_min>1.0<", "<force_min>99<")],
              "cable 1, force_min: found 99; accepted: at most force_max, 60"),
    "no XML": ([("<attachment><link>0</link>", "<winch><link>0</link>")], "is not well-formed"),
    "winch": ([(f"<attachments>{attachment(0, [0.5, 0, 0.1])}".replace("0.0 ", "0 "),
                "<attachments><winch/>")],
              "cable 1, attachment 1: found <winch>; accepted: <attachment>, or as the first one"),
    "stiffness": ([("cable_ideal", "cable_linear_spring")],
                  "cable 1, K: found nothing; accepted"),
}  # fmt: skip


def refused(read, folder, path, expected):
    """Its words are found in turn, where dots stand for others between them."""
    with pytest.raises(RobotFileError) as caught:
        read(path)
    message = str(caught.value)
    assert message.startswith(str(folder))
    assert "\n" not in message
    assert len(message) < 500 + len(str(folder))
    rest = message
    for part in expected.split(" ... "):
        assert part in rest
        rest = rest.partition(part)[2]


@pytest.mark.parametrize(("write", "changes", "expected"), FILES.values(), ids=FILES)
def test_refused_file(write, changes, expected, tmp_path):
    path = write(tmp_path)
    edited(tmp_path, *changes)
    refused(read_foreign, tmp_path, path, expected)


@pytest.mark.parametrize(("write", "changes", "expected"), MUJOCO.values(), ids=MUJOCO)
def test_refused_model_of_mujoco(write, changes, expected, tmp_path):
    pytest.importorskip("mujoco")
    test_refused_file(write, changes, expected, tmp_path)


@pytest.mark.parametrize(("changes", "expected"), TREES.values(), ids=TREES)
def test_refused_tree_of_caspr(changes, expected, tmp_path):
    path = two_link().write(tmp_path)
    edited(tmp_path, *changes)
    refused(import_mechanism, tmp_path, path, expected)


def test_the_loader_refuses_with_the_words_of_the_reader(tmp_path):
    path = grab(tmp_path)
    edited(tmp_path, (MASS, '"mass": NaN'))
    refused(models.load_robot, tmp_path, str(path), "platform.mass: found nan")


@pytest.mark.parametrize("read", [models.load_robot, formats.import_robot])
def test_a_mechanism_is_no_robot_with_one_platform(read, tmp_path):
    path = two_link().write(tmp_path)
    refused(read, tmp_path, path, "cdpr import makes a mechanism of it")


@pytest.mark.parametrize(
    ("choice", "expected"),
    [
        ({"cable_set": "first"}, "cable_set first"),
        ({"cable_set": "third"}, "default_cable_set: found third; accepted: one of s"),
    ],
)
def test_sets_of_cables_that_have_none(choice, expected, tmp_path):
    refused(lambda path: read_caspr(path, **choice), tmp_path, caspr(tmp_path), expected)


def test_lists_and_folders_of_several_models(tmp_path):
    listed = tmp_path / "list.csv"
    listed.write_text("Toy,/,toy_bodies.xml,toy_cables.xml\n")
    caspr(tmp_path)
    for model, found in ((None, "nothing"), ("Boat", "Boat")):
        refused(lambda path, model=model: read_caspr(path, model), tmp_path, listed,
                f"model: found {found}; accepted: Toy")  # fmt: skip
    listed.write_text("name,folder\n")
    refused(read_caspr, tmp_path, listed, "rows: found none of a model")
    other = caspr(tmp_path, name="other")
    refused(read_caspr, tmp_path, tmp_path, "found other_bodies.xml, toy_bodies.xml; accep")
    (tmp_path / "other_cables.xml").unlink()
    refused(read_caspr, tmp_path, other, "there is no file other_cables.xml beside")
