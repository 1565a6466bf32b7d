"""Figures of runs: titles, units, legends, and that they draw what the log says."""

from functools import partial
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs import sections, servo_figures
from cdpr_drake.analyses.runs.adaptation import LEARNT_POINTS
from cdpr_drake.analyses.runs.sensing import SENSING, reading_figure
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.sensor_catalogue import load_tension_sensor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.estimators.geometry_learner import (
    ADAPTATION,
    ADAPTATION_PARTS,
    LEARNT,
    LEARNT_SIGMA,
)
from cdpr_drake.systems.sensors.sensor_kinds import SensorSettings
from cdpr_drake.systems.sensors.sensor_settings import (
    DepthSettings,
    InertialSettings,
    OdometrySettings,
    PanTiltSettings,
    RangeSettings,
    SensorSuite,
)
from cdpr_drake.trajectories.pose_trajectory import SteadyMotion
from tests.figure_faults import figure_faults

SHORT = ("camera.kind=projected", "integration.engine=compiled")


def drawn_of(run, *subjects):
    """Figures of sections of a run, by name."""
    run.sections, run.main_figures = subjects, dict
    return ServoRun.figures(run)


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


# Motors and sensors.


@pytest.fixture(scope="module")
def sensors():
    overrides = [*SHORT, "duration=0.6", "winches.kind=motor"]
    return ServoRun(load_scenario("acrobot_sensors", overrides)).simulate()


def errors(axes):
    return np.array([line.get_ydata() for line in axes.get_lines()])


def test_errors_of_readings_are_those_at_the_instant_of_the_reading(sensors):
    figures = drawn_of(sensors, sections.MOTORS, *SENSING)
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
        log, depth_image=image, built=SimpleNamespace(motion=motion),
        scenario=SimpleNamespace(sensors=SUITE),
    ), *SENSING)  # fmt: skip


@pytest.mark.parametrize(("rows", "value"), [(1, np.inf), (700, 1.5), (3, -np.inf)])
def test_all_are_drawn_whatever_is_read(rows, value):
    drawn = looking(rows, value, np.full((3, 4), value))
    assert set(drawn) == {"scan_fan", "scan_one", "imu", "depth", "pan_tilt", "odometry"}
    drawn["depth of a recovered run"] = looking(rows, value, None)["depth"]
    for name, draw in drawn.items():
        if rows == 1 or name.startswith(("scan", "depth")):  # which have gaps
            draw().draw_without_rendering()


def test_the_scale_of_colours_is_apart_from_the_panel_beside_it():
    """And so are their labels, as they are drawn into a file."""
    drawn = looking(20, 1.5, np.full((240, 320), 1.5))
    for name in ("depth", "scan_fan"):
        figure = drawn[name]()
        assert figure_faults(figure) == []
        scale = next(axes for axes in figure.axes if axes.get_ylabel() == "distance [m]")
        end, begin = (axes.yaxis.label.get_window_extent() for axes in (scale, figure.axes[1]))
        assert begin.x0 - end.x1 > LABELS_APART * figure.dpi, name


# What was learnt.

PANELS_APART = 0.1
"""Between a panel and the label of the next one [inch]."""


def test_no_legend_hides_numbers_that_rise_early_and_labels_are_as_long_as_axes():
    robot, time = load_robot("acrobot_small"), np.linspace(0.0, 8.0, 81)
    cables, m = robot.cable_set(), len(robot.cables)
    truth = np.concatenate([cables.p_WA.T.ravel(), cables.p_PB.T.ravel(), np.zeros(m)])
    log = {
        "time": time,
        LEARNT: truth + 0.0117 * np.exp(-time)[:, None],
        LEARNT_SIGMA: np.full((81, 7 * m), 0.01),
        ADAPTATION: np.outer(1.0 - np.exp(-3.0 * time), np.full(len(ADAPTATION_PARTS), 20.0)),
    }
    figure = drawn_of(by_hand(log, robot=robot), LEARNT_POINTS)["adaptation"]()
    assert figure_faults(figure) == []
    errors = [figure.axes[k].lines[1].get_ydata() for k in (0, 1, 3, 4)]
    np.testing.assert_allclose(errors, np.tile(11.7 * np.exp(-time), (4, 1)), rtol=1e-9)
    for row in np.reshape(figure.axes, (2, 3)):
        for axes in row:
            assert axes.yaxis.label.get_window_extent().height < axes.bbox.height
        for left, right in pairwise(row):
            begin = right.yaxis.label.get_window_extent().x0
            assert begin - left.bbox.x1 > PANELS_APART * figure.dpi
