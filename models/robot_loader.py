"""Finds, reads and checks robot files, and puts robots elsewhere.

`load_robot` reads one by name or path. Further functions give the same robot somewhere else:
shifted in the world (`moved_robot`), seen from a turned world (`turned_robot`), or with its file in
another folder (`portable_robot`).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import behaving_cables
from cdpr_drake.cables.models import CABLE_MODELS, check_model
from cdpr_drake.errors import CableModelError, Problems, RobotFileError, why_not_read
from cdpr_drake.geometry.motion_type import across
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.models.exit_points import MARK, check_rail, split_name
from cdpr_drake.models.formats.file_kinds import SUFFIXES, is_foreign
from cdpr_drake.models.materials import check_materials
from cdpr_drake.models.mechanism_files import (
    MECHANISM_FILE,
    is_mechanism,
    is_mechanism_text,
    shipped_mechanism,
    single_platform,
)
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_schema import SHAPE_INERTIA, Robot
from cdpr_drake.models.shapes import FITS, check_shapes
from cdpr_drake.schema.input_files import (
    input_bytes,
    input_text,
    input_there,
    inputs_held,
    made_of_input,
)
from cdpr_drake.schema.typed_yaml import closest, dump_typed, load_typed, parse_typed

_FOLDER = Path(__file__).parent / "robots"

LARGEST_LENGTH = 1e4
"""Of frames, platforms and points [m]; cables of kilometres are what has been built."""

SHORTEST_CABLE = 1e-3
"""A cable shorter than this [m] at the home pose counts as an exit point on an anchor point."""

ALIGNED = 1e-9
"""How far a turn, or a point of a beam relative to its reach, may be off an axis."""

_HEIGHT = "a height for robots in a horizontal plane, null for others"

TRIANGLE_ROUNDING = 1e-15
"""Moments of inertia of a plate meet the triangle inequality exactly, up to rounding."""


def robot_names() -> tuple[str, ...]:
    """Names of the robots that come with the package."""
    return tuple(sorted(path.parent.name for path in _FOLDER.glob("*/robot.yaml")))


def robot_file(name: str) -> Path:
    """The file of a robot: a name of `robot_names()`, or the path of a file or folder.

    Coordinates of exit points on rails may follow, as in `name@C1=0.3`; they do not change it. A
    folder has a `robot.yaml`, or is a CASPR model; files of other tools are told by their
    endings, `ROBOT_SUFFIXES`. It may be that of a mechanism, which `load_mechanism` reads.

    Raises:
        RobotFileError: There is no such robot; says which exist.
    """
    name, _ = split_name(name)
    path = Path(name)
    # One look at the folder and not into each robot's: repeated runs ask again and again.
    is_ours = name in os.listdir(_FOLDER) and (_FOLDER / name / "robot.yaml").is_file()
    held = inputs_held()
    if not is_ours and held is not None and held.knows(path):  # a folder's file, read before
        return path
    if not is_ours and os.path.isdir(path):  # also of a name that is too long
        for own in (path / "robot.yaml", path / MECHANISM_FILE):
            if own.is_file():
                return own
        if any("bod" in child.name.lower() for child in path.glob("*.[xX][mM][lL]")):
            return path
    if name.lower().endswith(SUFFIXES):
        if not input_there(path):
            raise RobotFileError(f"{path}: there is no such robot file")
        return path
    if not is_ours:
        mechanism = shipped_mechanism(name)
        if mechanism is not None:
            return mechanism
        file = path.suffix or "/" in name
        hint = f"; the path of a robot file has to end in {', '.join(SUFFIXES)}" if file else ""
        known = "cdpr robots lists the names" if file else closest(name, robot_names())
        if not file and input_there(Path(f"{name}.yaml")):
            known = f"did you mean {name}.yaml?"
        raise RobotFileError(f"robot {name!r} is unknown; {known}{hint}")
    return _FOLDER / name / "robot.yaml"


def robot_text(name: str, asks: str = "robot_text") -> str:
    """The robot file of a robot as YAML, also where its file is one of another tool.

    Args:
        name: As for `load_robot`.
        asks: What asks, for the refusal of mechanisms.

    Raises:
        RobotFileError: Unknown robot, its file cannot be read, or is that of a mechanism.
    """
    path, (_, rails) = robot_file(name), split_name(name)
    if is_foreign(path):
        content = _foreign_content(path)
    else:
        try:
            content = input_text(path)
        except (OSError, UnicodeDecodeError) as problem:
            raise RobotFileError(f"{path}: cannot be read: {why_not_read(problem)}") from problem
        if is_mechanism_text(content):
            raise single_platform(path, asks)
    if not rails:
        return content
    robot = parse_robot(content, path)
    _put_on_rails(robot, rails, path)
    return dump_typed(robot)


def _foreign_content(path: Path) -> str:
    """The robot file that the file of another tool makes, as YAML; imports all readers."""
    from cdpr_drake.models.formats.assumptions import complete_draft
    from cdpr_drake.models.formats.detection import read_foreign

    return made_of_input(path, lambda: complete_draft(read_foreign(path)).yaml())


def load_robot(name: str | Path, asks: str = "load_robot") -> Robot:
    """Reads a robot by name or by path, also from a file of another tool.

    What a foreign file lacks is assumed, and stands in the robot's `assumptions`. Exit points on
    rails are where the file says, or where the name does, as in `name@C1=0.3,C2=-0.1` [m].

    Args:
        name: A name of `robot_names()`, or the path of a file or folder.
        asks: What asks, for the refusal of mechanisms.

    Raises:
        RobotFileError: Unknown robot, or the file does not describe a possible one, or a mechanism.
    """
    name = str(name)
    path, (_, rails) = robot_file(name), split_name(name)
    if is_foreign(path):
        robot = parse_robot(_foreign_content(path), path)
    else:
        if is_mechanism(path):
            raise single_platform(path, asks)
        robot = load_typed(Robot, path, error=RobotFileError)
        if not rails:
            _check(robot, path)
    if rails:
        _put_on_rails(robot, rails, path)
    return robot


def names_mechanism(name: Robot | Mechanism | str | Path) -> bool:
    """Whether this is a mechanism, or its name or path; also False where there is no such file."""
    if not isinstance(name, str | Path):
        return isinstance(name, Mechanism)
    try:
        return is_mechanism(robot_file(str(name)))
    except RobotFileError:
        return False


def as_robot(robot: Robot | str | Path, asks: str = "load_robot") -> Robot:
    """A robot that is given as itself, or by name or path as `load_robot` takes it.

    Args:
        robot: The robot.
        asks: What asks, for the refusal of mechanisms.

    Raises:
        RobotFileError: As `load_robot`, or it is something else.
    """
    if isinstance(robot, Robot):
        return robot
    if isinstance(robot, str | Path):
        return load_robot(robot, asks)
    if isinstance(robot, Mechanism):
        raise single_platform(robot.name, asks)
    raise RobotFileError(
        f"robot: found a {type(robot).__name__}; accepted: a name, a path or a Robot"
    )


@contextmanager
def robot_reference(robot: Robot | str | Path, asks: str = "load_robot") -> Iterator[str]:
    """A name or path by which `load_robot` finds a robot inside the block.

    That of a Robot is a file of its own, which goes with the block.

    Raises:
        RobotFileError: It is a Mechanism; `asks` is what asks.
    """
    if isinstance(robot, Mechanism):
        raise single_platform(robot.name, asks)
    if not isinstance(robot, Robot):
        yield str(robot)
        return
    with TemporaryDirectory() as folder:
        path = Path(folder) / "robot.yaml"
        path.write_text(dump_typed(robot), encoding="utf-8")
        input_bytes(path)  # what other processes are sent
        yield str(path)


def _put_on_rails(robot: Robot, rails: dict[str, float], path: Path) -> None:
    """Puts exit points to coordinates by the names of cables, and checks the robot then."""
    on_rails = {cable.name: cable.rail for cable in robot.cables if cable.rail is not None}
    for name, at in rails.items():
        if name not in on_rails:
            accepted = ", ".join(on_rails) or "none, since its file gives no cables[].rail"
            raise RobotFileError(
                f"{path}: {MARK}{name}: found no rail of that cable; accepted: {accepted}"
            )
        on_rails[name].at = at
    _check(robot, path)


def parse_robot(content: str, path: Path) -> Robot:
    """A robot from the text of a robot file.

    Args:
        content: YAML.
        path: The file that messages name.

    Raises:
        RobotFileError: The text does not describe a possible robot.
    """
    if is_mechanism_text(content):
        raise single_platform(path, "a robot file")
    robot = parse_typed(Robot, content, path, error=RobotFileError)
    _check(robot, path)
    return robot


def _check(robot: Robot, path: Path) -> None:
    """What no single field can tell."""

    problems = Problems(RobotFileError)

    def fail(field: str, found: object, accepted: str) -> None:
        problems.add(f"{path}: {field}: found {found}; accepted: {accepted}")

    bounds = robot.tension_bounds
    if bounds.lower >= bounds.upper:
        fail("tension_bounds", f"lower {bounds.lower:g}, upper {bounds.upper:g}", "lower < upper")
    friction = robot.winch.friction
    if friction is not None and friction.static < friction.coulomb:
        fail(
            "winch.friction.static",
            f"{friction.static:g}",
            f"at least coulomb = {friction.coulomb:g} [N m]",
        )
    if np.any(robot.frame.lower >= robot.frame.upper):
        fail(
            "frame",
            f"lower {_words(robot.frame.lower)}, upper {_words(robot.frame.upper)}",
            "lower < upper",
        )
    _check_sizes(robot, fail)
    _check_motion(robot, fail)
    if not robot.cables:
        fail("cables", "none", "at least one cable")
    slack, m = robot.slack_readings, len(robot.cables)
    if slack is not None and len(slack) != m:
        fail("slack_readings", f"{len(slack)} numbers", f"one for each of the {m} cables [N]")
    _check_inertia(robot, fail)

    if not np.any(robot.gravity_direction):
        fail("gravity_direction", _words(robot.gravity_direction), "a direction, not zero")
    names = [cable.name for cable in robot.cables]
    for index, name in enumerate(names):
        if name in names[:index]:
            fail(f"cables[{index}].name", f"{name} twice", "each name once")
    _check_winches(robot, fail)
    axes = {"pulley.swivel_axis": robot.pulley.swivel_axis} | {
        f"cables[{index}].swivel_axis": cable.swivel_axis
        for index, cable in enumerate(robot.cables)
        if cable.swivel_axis is not None
    }
    axes |= {
        f"cables[{index}].anchor_swivel_axis": cable.anchor_swivel_axis
        for index, cable in enumerate(robot.cables)
        if cable.anchor_swivel_axis is not None
    }
    if robot.platform_pulley is not None:
        axes["platform_pulley.swivel_axis"] = robot.platform_pulley.swivel_axis
    for key, axis in axes.items():
        if not np.any(axis):
            fail(key, _words(axis), "a direction, not zero")
    rails = [check_rail(index, cable.rail, fail) for index, cable in enumerate(robot.cables)]
    if all(rails):  # else exit points make no sense
        _check_exits(robot, fail)
    if robot.cameras:
        _check_cameras(robot, path, problems)
    platform = robot.platform
    with problems.collected():
        check_shapes(
            path, platform.shape, robot.frame.beams,
            box=(robot.box_center(), np.asarray(platform.size, float)),
            mass=platform.mass if platform.inertia_of == SHAPE_INERTIA else None,
        )  # fmt: skip
    problems.raise_any()
    if robot.cable_model is not None:
        cables = robot.cable_set()
        if CABLE_MODELS[robot.cable_model].sags:
            cables = behaving_cables(cables, robot.cable_behaviour())
        try:
            check_model(robot.cable_model, cables)
        except CableModelError as problem:
            raise RobotFileError(f"{path}: cable_model: {problem}") from problem


def _check_exits(robot: Robot, fail: Callable[[str, object, str], None]) -> None:
    """Refuses exit points that lie on anchor points at the home pose, compared in W."""
    X_WP, exits = robot.home.transform(), robot.exit_points()
    for index, cable in enumerate(robot.cables):
        ends = exits[:, index : index + 1], cable.anchor_point[:, None]
        if cable_lengths(X_WP, *ends)[0] < SHORTEST_CABLE:
            fail(
                f"cables[{index}] ({cable.name})",
                f"exit point {_words(exits[:, index])} on "
                f"anchor point {_words(cable.anchor_point)} at home",
                f"points at least {SHORTEST_CABLE:g} m apart there",
            )


def _check_cameras(robot: Robot, path: Path, problems: Problems) -> None:
    """Refuses cameras of the same name, of no catalogue, or of a wrong file; resolves the files."""
    from cdpr_drake.models.camera_files import CAMERA_SUFFIXES, camera_names, resolved_camera

    mounts = [mount.name for mount in robot.cameras]
    for index, mount in enumerate(robot.cameras):
        place, named = f"{path}: cameras[{index}]", mount.name
        if named in mounts[:index]:
            problems.add(f"{place}.name: found {named} twice; accepted: each name once")
        mount.model = resolved_camera(mount.model, path.parent)
        if mount.model.lower().endswith(CAMERA_SUFFIXES):
            from cdpr_drake.models.camera_catalogue import load_camera

            with problems.collected():
                load_camera(mount.model)
        elif mount.model not in camera_names():
            accepted = "one of " + ", ".join(camera_names()) + ", or the path of a camera file"
            problems.add(f"{place}.model: found {mount.model}; accepted: {accepted}")


def _check_motion(robot: Robot, fail: Callable[[str, object, str], None]) -> None:
    """Refuses a platform, a plane or a line that its motion type cannot have."""
    if robot.axis is not None and (robot.motion in ("3T", "3R3T") or not np.any(robot.axis)):
        fail("axis", _words(robot.axis), f"null for {robot.motion}" if np.any(robot.axis) else
             "a direction, not zero, or null")  # fmt: skip
        return
    motion = robot.motion_type()
    level = motion.is_plane and np.array_equal(motion.axis, (0.0, 0.0, 1.0))
    if robot.motion == "2T1R" and level and robot.plane_height is None:
        fail("plane_height", None, _HEIGHT)
    elif robot.plane_height is not None and not level:
        fail("plane_height", robot.plane_height, _HEIGHT)
    elif level and robot.plane_height is None:
        robot.plane_height = float(robot.home.position[2])
    if motion.num_turns == 1:
        R = robot.home.transform().rotation().matrix()
        if np.linalg.norm(R @ motion.axis - motion.axis) > ALIGNED:
            fail("home.angles_deg", _words(robot.home.angles_deg),
                 f"a turn about the plane's normal {_words(np.array(motion.axis))}")  # fmt: skip
    if motion.is_point:
        _check_point(robot, fail)
    common = robot.platform_pulley
    radii = [0.0 if common is None else common.radius]
    radii += [cable.anchor_pulley_radius or 0.0 for cable in robot.cables]
    own = [cable.pulley_radius or 0.0 for cable in robot.cables]
    if robot.pulley.arm > 0.0 and max(*radii, robot.pulley.radius, *own) > 0.0:
        fail("pulley.arm", f"{robot.pulley.arm:g} with pulleys", "0, or no pulleys at either end")
    if max(radii) > 0.0 and (motion.is_point or robot.motion == "2R3T"):
        fail("platform_pulley", f"pulleys at the platform of {robot.motion}",
             "none there, since a cable over one pulls beside Po or the beam")  # fmt: skip
    rubs = robot.platform.hysteresis is not None
    if rubs and (motion.is_point or robot.motion == "2R3T"):
        fail("platform.hysteresis", f"a section for {robot.motion}",
             "null, or a body in space or in a plane: 3R3T, 2T1R, 1R2T")  # fmt: skip
    if robot.motion == "2R3T":
        _check_beam(robot, np.array(motion.axis), fail)


def _check_point(robot: Robot, fail: Callable[[str, object, str], None]) -> None:
    """A point mass is held in Po."""
    what = f"Po, 0 0 0, of a point mass, {robot.motion}"
    for index, cable in enumerate(robot.cables):
        if np.any(cable.anchor_point):
            fail(f"cables[{index}].anchor_point", _words(cable.anchor_point), what)
    if np.any(robot.center_of_mass()):
        fail("platform.center_of_mass", _words(robot.center_of_mass()), f"null, or {what}")


def _check_beam(robot: Robot, axis: Array, fail: Callable[[str, object, str], None]) -> None:
    """A beam is held on its axis, and turns about it as any body of revolution."""
    where = f"the beam's axis, through Po along {_words(axis)}"
    points = {f"cables[{k}].anchor_point": c.anchor_point for k, c in enumerate(robot.cables)}
    reach = max(float(np.linalg.norm(point)) for point in points.values()) if points else 0.0
    points["platform.center_of_mass"] = robot.center_of_mass()
    for key, point in points.items():
        if np.linalg.norm(np.cross(axis, point)) > ALIGNED * max(reach, 1e-6):
            fail(key, _words(point), f"a point of {where}")
    inertia = _about_center(robot)
    if np.linalg.norm(np.cross(axis, inertia @ axis)) <= ALIGNED * np.trace(inertia):
        e, f = across(axis).T
        if abs(e @ inertia @ e - f @ inertia @ f) + abs(e @ inertia @ f) <= ALIGNED * np.trace(
            inertia
        ):
            return
    fail("platform.inertia", "one that differs about the beam",
         f"that of a body of revolution about {_words(axis)}; its spin does not count")  # fmt: skip


def _about_center(robot: Robot) -> Array:
    """Rotational inertia about the centre of mass, axes of P, shape (3, 3) [kg m^2]."""
    given = robot.platform.inertia
    if given is None:
        x, y, z = np.square(robot.platform.size)
        return robot.platform.mass / 12.0 * np.diag([y + z, x + z, x + y])
    xx, yy, zz, xy, xz, yz = given
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _check_sizes(robot: Robot, fail: Callable[[str, object, str], None]) -> None:
    """Refuses numbers that no robot has, and a home pose outside the frame."""
    lower, upper = robot.frame.lower, robot.frame.upper
    lengths = {
        "frame.lower": lower,
        "frame.upper": upper,
        "platform.size": robot.platform.size,
        "home.position": robot.home.position,
    }
    for index, cable in enumerate(robot.cables):
        lengths[f"cables[{index}].exit_point"] = cable.exit_point
        lengths[f"cables[{index}].anchor_point"] = cable.anchor_point
    for key, values in lengths.items():
        if np.any(np.abs(values) > LARGEST_LENGTH):
            fail(key, _words(values), f"at most {LARGEST_LENGTH:g} [m]")
    gravity = robot.gravity
    check_materials(robot.cable, [cable.material for cable in robot.cables], fail)
    for key, value, most, unit in (
        ("platform.mass", robot.platform.mass, 1e7, "kg"),
        ("gravity", gravity, 1e3, "m/s^2"),
        ("tension_bounds.upper", robot.tension_bounds.upper, 1e9, "N"),
        ("pulley.radius", robot.pulley.radius, LARGEST_LENGTH, "m"),
    ):
        if value > most:
            fail(key, f"{value:g}", f"at most {most:g} [{unit}]")
    if np.any(lower >= upper):  # that is said already
        return
    smallest = float(np.min(upper - lower))
    if robot.frame.beam is not None and robot.frame.beam > smallest:
        fail("frame.beam", f"{robot.frame.beam:g}", f"at most {smallest:g} [m], the frame's width")
    home, (lower, upper) = robot.home.position, robot.frame.bounds()
    if np.any(home < lower) or np.any(home > upper):
        fail("home.position", _words(home), f"within the frame, {_words(lower)} to {_words(upper)}")


def point_notes(robot: Robot) -> list[str]:
    """Remarks on exit points outside a given frame, anchor points outside the platform's box."""
    half, center = np.asarray(robot.platform.size, float) / 2.0, robot.box_center()
    low, high = center - half, center + half
    boxes = {
        "exit points": (robot.exit_points(), *robot.frame.bounds(), "the frame"),
        "anchor points": (robot.anchor_points(), low, high, "the platform's box"),
    }
    notes = []
    for what, (points, lower, upper, where) in boxes.items():
        off = np.maximum(lower[:, np.newaxis] - points, points - upper[:, np.newaxis]).max(axis=0)
        slack = FITS * float(np.max(robot.frame.upper - robot.frame.lower))
        names = [cable.name for cable, d in zip(robot.cables, off, strict=True) if d > slack]
        if names:
            notes.append(
                f"{what} of {', '.join(names)}: up to {off.max():.3g} m outside {where}, "
                f"{_words(lower)} to {_words(upper)} m"
            )
    return notes


def _check_winches(robot: Robot, fail: Callable[[str, object, str], None]) -> None:
    """Cables on one winch run by the same length at the same turn of its drum."""
    if not robot.cables:
        return
    diameters, leaders = robot.diameters(), robot.winch_groups().leaders()
    for index, leader in enumerate(leaders):
        if diameters[index] != diameters[leader]:
            fail(
                f"cables[{index}].material.diameter",
                f"{diameters[index]:g} on the winch {robot.cables[index].winch}",
                f"{diameters[leader]:g} [m], that of {robot.cables[leader].name} on the same winch",
            )


def _check_inertia(robot: Robot, fail: object) -> None:
    inertia = robot.platform.inertia
    if inertia is None:
        return
    xx, yy, zz, xy, xz, yz = inertia
    moments = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if moments[0] <= 0.0 or moments[0] + moments[1] < moments[2] * (1.0 - TRIANGLE_ROUNDING):
        assert callable(fail)
        fail(
            "platform.inertia",
            _words(inertia),
            "positive principal moments, none larger than the sum of the other two",
        )


def _words(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
