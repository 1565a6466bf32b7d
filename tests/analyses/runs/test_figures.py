"""Figures and numbers of subjects: titles, units, legends, and that they are what the log says."""

from dataclasses import replace
from functools import partial
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs import servo_figures, subjects
from cdpr_drake.analyses.runs.sensing import SENSING, reading_figure
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.calibration.identifiability import FRAMES
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.sensor_catalogue import load_tension_sensor
from cdpr_drake.sections.adaptation.geometry_learner import (
    ADAPTATION,
    ADAPTATION_PARTS,
    DOUBTED,
    LEARNT,
    LEARNT_SIGMA,
    OPEN_FRAMES,
)
from cdpr_drake.sections.adaptation.report import (
    SUBJECTS,
    adaptation_numbers,
    doubts,
    true_offsets,
)
from cdpr_drake.sections.pan_tilt.report import pan_tilt_numbers
from cdpr_drake.sections.pan_tilt.section import ENCODERS, IMAGE, JOINTS
from cdpr_drake.sections.pan_tilt.section import FOUND as TURNED_FOUND
from cdpr_drake.sections.perception import report as perception
from cdpr_drake.sections.perception.section import (
    DepthSettings,
    OdometrySettings,
    PanTiltSettings,
    RangeSettings,
)
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.sensors.sensor_kinds import SensorSettings
from cdpr_drake.systems.sensors.sensor_settings import InertialSettings, SensorSuite
from cdpr_drake.trajectories.pose_trajectory import SteadyMotion
from tests.analyses.runs.run_by_hand import (
    ESTIMATE_OFF,
    ESTIMATE_TURNED,
    FOUND,
    SEEN,
    run_by_hand,
)
from tests.figure_faults import figure_faults

SHORT = ("camera.kind=projected", "integration.engine=compiled")


def drawn_of(run, *subjects):
    """Figures of subjects of a run, by name."""
    applying = [subject for subject in subjects if subject.applies(run)]
    return {name: draw for subject in applying for name, draw in subject.drawn(run).items()}


def by_hand(log, **more):
    """A run with a log by hand; titles are their words."""
    return SimpleNamespace(log=log, title=str, **more)


# Every run of a visual servo.


@pytest.fixture(scope="module")
def run():
    return ServoRun(load_scenario("planar_pbvs", [*SHORT, "duration=0.4"])).simulate()


def changed(run, **quantities):
    """The run with other quantities in its log."""
    again = ServoRun(run.scenario)
    again.log, again.built = {**run.log, **quantities}, run.built
    return again


def curves(quantity):
    return partial(servo_figures.cable_curves_figure, quantity=quantity)


@pytest.mark.parametrize("draw", [
    servo_figures.image_path_figure, servo_figures.error_figure,
    servo_figures.platform_path_figure, curves("cable_velocities"), curves("lengths"),
    curves("tensions"),
])  # fmt: skip
def test_axes_have_units(run, draw):
    figure = draw(run)
    assert figure_faults(figure) == []
    title = figure.get_suptitle()
    assert "planar_pbvs" in title
    assert run.scenario.title in title.replace("\n", " ")
    for axes in figure.axes:
        labels = [axes.get_ylabel()]
        if labels == ["slack cable"]:  # a row a cable, by their names
            labels = []
        if axes.xaxis.get_tick_params()["labelbottom"]:  # else it shares the axis below
            labels.append(axes.get_xlabel())
        if hasattr(axes, "get_zlabel"):
            labels.append(axes.get_zlabel())
        assert all("[" in label for label in labels), labels


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_no_panel_is_empty(run):
    """An open loop has no feature error, and a target may never be found."""
    figure = servo_figures.error_figure(changed(run, gain=0.0 * run.log["gain"]))
    assert figure_faults(figure) == []
    assert [len(axes.lines) for axes in figure.axes] == [1, 1]
    assert "no feature was controlled" in figure.get_suptitle()
    figure = servo_figures.image_path_figure(changed(run, found=0.0 * run.log["found"]))
    assert figure_faults(figure) == []
    (image,) = figure.axes
    assert legend(image) == ["desired"]
    assert "never found" in figure.get_suptitle()
    cables = curves("tensions")(run).axes[0]
    assert legend(cables)[:4] == ["C1", "C2", "C3", "C4"]


@pytest.mark.parametrize(("rows", "begins"), [((5, 9), 0.1), ((0, 9), 0.02), ((0, 0), None)])
def test_times_without_the_target_are_shaded_and_said(run, rows, begins):
    """Not before the first image: 0.02 s of every run were shaded once, too narrow to be seen."""
    gain = run.log["gain"].copy()
    gain[slice(*rows)] = 0.0
    figure = servo_figures.error_figure(changed(run, gain=gain))
    assert figure_faults(figure) == []
    axes = figure.axes[0]
    assert ("target not seen" in legend(axes)) == (begins is not None)
    ends = [(shade.get_x(), shade.get_x() + shade.get_width()) for shade in axes.patches]
    assert ends == ([] if begins is None else [pytest.approx((begins, 0.18))])


def test_what_is_drawn_of_a_run_by_hand_is_what_its_log_says():
    hand, moving = run_by_hand(), run_by_hand("acrobot_moving_tag")
    error = servo_figures.error_figure(hand)
    for panel, values in zip(
        error.axes[-2:], (1e3 * ESTIMATE_OFF, np.degrees(ESTIMATE_TURNED)), strict=True
    ):
        np.testing.assert_allclose(panel.lines[0].get_ydata(), values, atol=1e-6)
    off = servo_figures.image_path_figure(moving).axes[1].lines[0].get_ydata()
    goal = moving.image_path[2][1]  # a line is not the ideal one
    np.testing.assert_allclose(off, np.linalg.norm(SEEN[FOUND] - goal, axis=1))
    outside = run_by_hand("acrobot_eye_to_hand")
    for run, point, line in ((hand, "target, Oo", True), (outside, "camera, Co", False)):
        axes = servo_figures.platform_path_figure(run).axes[0]
        paths = {each.get_label(): len(each.get_data_3d()[0]) for each in axes.lines}
        assert paths[point] == 1
        assert ("camera, straight line" in paths) == line


# Motors and sensors.


def errors(axes):
    return np.array([line.get_ydata() for line in axes.get_lines()])


def test_errors_of_readings_are_those_at_the_instant_of_the_reading():
    sensors = ServoRun(
        load_scenario("acrobot_sensors", [*SHORT, "duration=0.6", "winches.kind=motor"])
    ).simulate()
    figures = drawn_of(sensors, subjects.MOTORS, *SENSING)
    assert list(figures) == ["motor_torques", "readings"]
    figure = figures["readings"]()
    panels = {axes.get_ylabel().split(",")[0]: axes for axes in figure.axes}
    assert list(panels) == ["tension", "length", "tracker", "metrology"]
    assert "What the sensors read beyond the truth" in figure.get_suptitle()
    vlu850 = load_tension_sensor("vlu850")
    tension = errors(panels["tension"])
    assert len(tension) == 8
    assert np.max(np.abs(tension)) < vlu850.accuracy + 5.0 * vlu850.repeatability
    # The tensions themselves change by far more from row to row.
    assert np.max(np.abs(np.diff(sensors.log["tensions"], axis=0))) > 3.0 * vlu850.accuracy
    micrometres = 1e6 * np.pi / 65536 * 0.0041
    assert np.max(np.abs(errors(panels["length"]))) < micrometres * (1.0 + 1e-3)
    metrology = errors(panels["metrology"])  # of an accuracy of 0.1 mm
    assert 0.05 < np.min(metrology) < np.max(metrology) < 0.2
    torques = figures["motor_torques"]()
    assert "Torques of the motors and of their friction" in torques.get_suptitle()
    assert [len(axes.get_lines()) for axes in torques.axes] == [8, 10]
    assert all("[N m]" in axes.get_ylabel() for axes in torques.axes)


HELD = np.array([0.0, 0.0, 0.0, 0.2, 0.2, 0.4, 0.4, 0.6, 0.6, 0.8, 0.8])
"""Readings every 0.2 s of a ramp that is logged before each reading."""


@pytest.mark.parametrize(("settings", "values"), [
    (SensorSettings(), np.linspace(0.0, 1.0, 11)),
    (SensorSettings(tension="vlu850", tension_rate=5.0), HELD),
])  # fmt: skip
def test_readings_are_compared_with_the_truth_of_their_time(settings, values):
    settings.log = ["tension"]
    times, robot = np.linspace(0.0, 1.0, 11), load_robot("acrobot_small")
    columns = np.ones(len(robot.cables))
    log = {
        "time": times, "tensions": np.outer(times, columns),
        "measured_tensions": np.outer(values, columns),
    }  # fmt: skip
    scenario = SimpleNamespace(sensors=settings)
    figure = reading_figure(by_hand(log, robot=robot, scenario=scenario))
    np.testing.assert_allclose(errors(figure.axes[0]), 0.0, atol=1e-12)


# Figures of sensors that look around draw gaps, too, without a warning.

LABELS_APART = 0.2
"""Between a label and the next one that belongs to another panel [inch]."""

SUITE = SensorSuite(
    range_sensors=[
        RangeSettings(name="fan", type="hokuyo", beams=5),
        RangeSettings(name="one", type="beam"),
    ],
    imu=InertialSettings(), depth=DepthSettings(), pan_tilt=PanTiltSettings(),
    odometry=OdometrySettings(),
)  # fmt: skip


def looking(rows, value, image):
    """Figures of a run in which all sensors that look around read one value."""
    sizes = {"scan_fan": (5, value), "scan_one": (1, value), "depth_row": (4, value),
             "specific_force": (3, 1.0), "angular_velocity": (3, 1.0), "imu_biases": (6, 1.0),
             "pan_tilt_angles": (2, 0.2), "pan_tilt_encoders": (2, 0.2)}  # fmt: skip
    log = {name: np.full((rows, size), level) for name, (size, level) in sizes.items()}
    log["time"] = 0.1 * np.arange(rows)
    log["X_WO_odometry"] = np.tile([1.0, 0, 0, 0, 0.1, 0.2, 0.3], (rows, 1))
    motion = SteadyMotion(RigidTransform(), np.zeros(3), np.zeros(3))
    return drawn_of(by_hand(
        log, at_end={"depth_image": image}, built=SimpleNamespace(motion=motion),
        scenario=SimpleNamespace(sensors=SUITE),
    ), *SENSING, *perception.SUBJECTS)  # fmt: skip


@pytest.mark.parametrize(("rows", "value"), [(1, np.inf), (700, 1.5), (3, -np.inf)])
def test_all_are_drawn_whatever_is_read(rows, value):
    drawn = looking(rows, value, np.full((3, 4), value))
    assert set(drawn) == {"scan_fan", "scan_one", "imu", "depth", "pan_tilt", "odometry"}
    drawn["depth of a recovered run"] = looking(rows, value, None)["depth"]
    for name, draw in drawn.items():
        if rows == 1 or name.startswith(("scan", "depth")):  # which have gaps
            draw().draw_without_rendering()


def test_scans_are_seen_from_above_and_scales_are_apart_from_the_panel_beside_them():
    """And so are their labels, as they are drawn into a file."""
    drawn = looking(20, 1.5, np.full((240, 320), 1.5))
    for name in ("depth", "scan_fan"):
        figure = drawn[name]()
        assert figure_faults(figure) == []
        scale = next(axes for axes in figure.axes if axes.get_ylabel() == "distance [m]")
        end, begin = (axes.yaxis.label.get_window_extent() for axes in (scale, figure.axes[1]))
        assert begin.x0 - end.x1 > LABELS_APART * figure.dpi, name
    ahead, left = figure.axes[1].lines[0].get_data()  # a fan ahead, from the right to the left
    assert np.argmax(ahead) == 2
    assert left[0] < left[2] == 0.0 < left[-1]
    np.testing.assert_allclose(np.hypot(ahead, left), 1.5)
    odometry = drawn["odometry"]().axes[1].lines[0].get_ydata()
    np.testing.assert_allclose(odometry, 1e3 * np.linalg.norm([0.1, 0.2, 0.3]))


def test_numbers_of_a_camera_on_joints_are_those_of_the_log():
    """The target is in the image at 1 s and from 4 s on, pan at its limit from 1 s to 4 s."""
    joints = np.radians([[0.0, 0.0], [30.0, 0.0], [30.0, 5.0], [10.0, 5.0]])
    off = np.radians([[0.3, 0.0], [-0.3, 0.2], [0.3, 0.0], [-0.3, 0.2]])
    seen = [[0.0, 0.0], [303.0, 204.0], [0.0, 0.0], [300.0, 212.0]]
    log = {
        "time": np.array([0.0, 1.0, 2.0, 4.0]), JOINTS: joints,
        ENCODERS: joints + off, TURNED_FOUND: np.array([[0.0], [1.0], [0.0], [1.0]]),
        IMAGE: np.tile(seen, (1, 4)) + np.array([1.0, 2, -1, 2, -1, -2, 1, -2]),
    }  # fmt: skip
    limits = {"lower_deg": [-30.0, -30.0], "upper_deg": [30.0, 30.0], "counts_per_turn": 4096}
    run = by_hand(
        log, built=SimpleNamespace(pinhole=SimpleNamespace(cx=300.0, cy=200.0)),
        scenario=SimpleNamespace(camera=SimpleNamespace(pan_tilt=SimpleNamespace(**limits))),
    )  # fmt: skip
    numbers = pan_tilt_numbers(run)
    assert numbers.pop("off_center_px") == pytest.approx({"median": 8.5, "end": 12.0})
    expected = {
        "first_seen_s": 1.0, "unseen_after_s": 2.0, "largest_angles_deg": [30.0, 5.0],
        "at_limits_s": 3.0, "encoder_error_deg": [0.3, 0.2 / np.sqrt(2.0)],
    }  # fmt: skip
    assert numbers == {key: pytest.approx(value) for key, value in expected.items()}
    log[TURNED_FOUND] = np.zeros((4, 1))
    blind = pan_tilt_numbers(run)
    assert [blind[key] for key in ("first_seen_s", "unseen_after_s")] == [None, None]


# What was learnt.

PANELS_APART = 0.1
"""Between a panel and the label of the next one [inch]."""


ROBOT = load_robot("acrobot_small")
CABLES, M = ROBOT.cable_set(), len(ROBOT.cables)
POINTS = np.concatenate([CABLES.p_WA.T.ravel(), CABLES.p_PB.T.ravel()])


def learning(errors, sigma, **parts):
    """A log of points and of offsets of 2 cm that are learnt with errors [m]."""
    rows = len(errors)
    values = dict.fromkeys(ADAPTATION_PARTS, 0.0) | {"stations": 20.0} | parts
    truth = np.concatenate([POINTS, np.full(M, 0.02)])
    return {
        LEARNT: truth + errors, LEARNT_SIGMA: sigma, DOUBTED: np.zeros((rows, M + 8)),
        ADAPTATION: np.tile(list(values.values()), (rows, 1)), OPEN_FRAMES: np.zeros((rows, 12)),
    }  # fmt: skip


def test_no_legend_hides_numbers_that_rise_early_and_labels_are_as_long_as_axes():
    time, sigma = np.linspace(0.0, 8.0, 81), np.full((81, 7 * M), 0.01)
    sigma[:, [7, 11]] = 0.005  # of two exit points
    falls = np.tile(0.0117 * np.exp(-time)[:, None], (1, 7 * M))
    log = {"time": time, **learning(falls, sigma)}
    log[ADAPTATION] = np.outer(1.0 - np.exp(-3.0 * time), np.full(len(ADAPTATION_PARTS), 20.0))
    figure = drawn_of(by_hand(log, robot=ROBOT), *SUBJECTS)["adaptation"]()
    assert figure_faults(figure) == []
    curves = [figure.axes[k].lines[1].get_ydata() for k in (0, 1, 3, 4)]
    np.testing.assert_allclose(curves, np.tile(11.7 * np.exp(-time), (4, 1)), rtol=1e-9)
    names = [axes.get_ylabel() for axes in figure.axes[:2]]
    assert names == ["C3.exit point.y, error [mm]", "C4.exit point.z, error [mm]"]
    (band,) = figure.axes[0].collections
    assert band.get_datalim(figure.axes[0].transData).y1 == pytest.approx(11.7 + 3.0 * 5.0)
    for row in np.reshape(figure.axes, (2, 3)):
        for axes in row:
            assert axes.yaxis.label.get_window_extent().height < axes.bbox.height
        for left, right in pairwise(row):
            begin = right.yaxis.label.get_window_extent().x0
            assert begin - left.bbox.x1 > PANELS_APART * figure.dpi


def test_numbers_of_what_was_learnt_are_those_of_the_log():
    """The target is seen from the second row on; of the row before are the true lengths."""
    errors, sigma = np.full((3, 7 * M), 1e-3), np.full((3, 7 * M), 1e-3)
    errors[-1, -M:], sigma[0], sigma[-1, 4] = 4e-3, 0.01, 8e-3
    log, home = learning(errors, sigma, scatter=1.2, models_believed=2.0), ROBOT.home.transform()
    tensions = np.array([5.0, 10.0, 20.0])[:, None] * np.ones(M)
    lengths = cable_paths(home, CABLES).lengths / (1.0 + tensions / CABLES.stiffness)
    log |= {
        "found": np.array([[0.0], [1.0], [1.0]]), "tensions": tensions,
        "unstrained_lengths": lengths + np.array([[0.02], [0.03], [0.04]]),
    }  # fmt: skip
    log[OPEN_FRAMES][-1, 3] = 0.95
    believed = replace(CABLES, p_WA=CABLES.p_WA + 2e-3, p_PB=CABLES.p_PB + 2e-3)
    # The lengths are those of the believed points, here the true ones for a number by hand.
    built = SimpleNamespace(believed=SimpleNamespace(cables=CABLES, X_WP0=home))
    numbers = adaptation_numbers(by_hand(log, robot=ROBOT, built=built))
    expected = {
        "directions": 7 * M, "scatter": 1.2, "models_believed": 2, "points_rms_before_m": 0.0,
        "points_rms_after_m": 1e-3, "offsets_rms_after_m": 4e-3, "largest_error_in_sigmas": 4.0,
        "not_told": ["C2.exit_point.y"], "open_frames": [FRAMES[3]], "doubts": [],
    }  # fmt: skip
    assert {key: numbers[key] for key in expected} == {
        key: pytest.approx(value) if isinstance(value, float) else value
        for key, value in expected.items()
    }
    built.believed.cables = believed
    before = adaptation_numbers(by_hand(log, robot=ROBOT, built=built))["points_rms_before_m"]
    assert before == pytest.approx(2e-3)
    log["found"] = np.zeros((3, 1))
    assert np.all(np.isnan(true_offsets(by_hand(log, built=built))))


@pytest.mark.parametrize(
    ("parts", "dropped", "words"),
    [
        ({}, {}, None),
        ({"stations": 0.0}, {}, "nothing was learnt: no pose counted"),
        ({"refused": 5.0}, {}, "measurements at 5 of 25 poses contradict each other"),
        ({"refused": 1.0}, {}, None),
        ({"scatter": 9.0}, {}, "measurements scatter 3.0 times as much as their standard"),
        ({"surprise": 2.0}, {}, "points are farther from what was believed than"),
        ({"models_rejected": 3.0}, {}, "3 models were rejected by the stability criterion"),
        ({}, {3: 4.0}, "the length of C4 contradicts all else at 4 of 20 poses"),
        ({}, {3: 1.0}, None),  # once may be by chance
        ({"stations": 100.0}, {3: 5.0}, None),  # and so may some of many
        ({}, {M + 5: 2.0}, "corner 3 of the tag in v contradicts all else at 2 of 20 poses"),
    ],
)
def test_doubts_are_said_in_words(parts, dropped, words):
    log = learning(np.zeros((2, 7 * M)), np.ones((2, 7 * M)), **parts)
    log[DOUBTED][-1, list(dropped)] = list(dropped.values())
    said = doubts(log, [cable.name for cable in ROBOT.cables])
    assert len(said) == (words is not None)
    assert words is None or said[0].startswith(words)
