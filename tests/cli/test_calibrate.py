"""`cdpr calibrate`: robots from trackers, cameras, winches and a recorded series."""

from pathlib import Path

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.fits.robots import calibrated_robot, calibration_model
from cdpr_drake.calibration.guesses import with_tags
from cdpr_drake.calibration.measurements import (
    simulated_corners,
    simulated_lengths,
    simulated_poses,
    simulated_swivels,
)
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.beliefs import believed_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.vision.apriltags import TagTarget
from tests.analyses.fits.logs import ROBOT, poses
from tests.cli.commands import refuse, run, told, write_log

TAGS = {
    k: pose_from_angles(np.array([x, y, 0.0]), np.zeros(3))
    for k, (x, y) in enumerate([(-0.15, -0.1), (-0.15, 0.1), (0.1, -0.1), (0.1, 0.1)])
}
TRUE = with_tags(calibration_model(ROBOT, "onboard"), TAGS)
POSES = poses(20)
START = Point(TRUE, Stations.at(POSES[:1])).numbers[0, :, 0]


def length_columns(readings):
    return {f"C{i + 1}_length_m": readings[:, i] for i in range(8)}


def pose_columns(poses):
    rows = np.array([pose_row(X) for X in poses])
    return dict(zip(("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m"), rows.T, strict=True))


@pytest.fixture(scope="module")
def tracked():
    random = np.random.default_rng(1)
    readings = simulated_lengths(TRUE, POSES, START, 1e-4, random)
    return length_columns(readings) | pose_columns(simulated_poses(POSES, 1e-3, 5e-4, random))


SIGMA = ("--sigma", "lengths=1e-4,place=5e-4,turn=1e-3")
ASKED = ("calibrate", "acrobot_small", "log.csv", "--out", "out")


def test_a_tracker_calibrates_and_scenarios_believe_it(here, tracked, capsys):
    shifts = 0.004 * np.random.default_rng(2).standard_normal((8, 3))
    nominal = load_robot("acrobot_small")
    for cable, shift in zip(nominal.cables, shifts, strict=True):
        cable.exit_point = cable.exit_point + shift
    (here / "nominal.yaml").write_text(yaml_dump_typed(nominal))
    write_log(here / "log.csv", tracked)
    out = here / "out"
    words = ("calibrate", "nominal.yaml", "log.csv", *SIGMA, "--next=4", "--out", "out")
    found = told(capsys, *words, "--unknown", "exit_points")
    assert found["status"] == "converged"
    assert {p.name for p in out.iterdir()} >= {
        "robot.yaml", "results.json", "calibration.png", "correlation.png", "next_poses.csv",
    }  # fmt: skip
    assert len(found["next_poses"]["poses"]) == 4
    std = np.array([p["std"] for p in found["parameters"]])
    scenario = load_scenario("acrobot_pbvs", [f"perturbations.believed_robot={out / 'robot.yaml'}"])
    believed = believed_robot(scenario, ROBOT).cables.p_WA
    errors = (believed - TRUE.cables.p_WA).T.ravel()
    assert np.max(np.abs(errors) / std) < 5.0
    assert np.sqrt(np.mean(errors**2)) < 1e-3  # twice the tracker's noise; it was 3.3 mm


@pytest.mark.usefixtures("no_room_for_pictures")
def test_figures_that_fail_cost_nothing_else(here, tracked, capsys):
    write_log(here / "log.csv", tracked)
    code, _, err = run(capsys, *ASKED, *SIGMA)
    assert code == 3
    assert "calibration.png: not written: " in err
    assert "No space left on device" in err
    assert "The data is complete in out" in err
    assert {path.name for path in (here / "out").iterdir()} >= {"robot.yaml", "results.json"}
    assert not list((here / "out").rglob("*png*"))


def test_the_camera_alone_calibrates(here, capsys):
    random = np.random.default_rng(3)
    pinhole = load_camera("ids_kowa").pinhole(640, 480)
    uv = simulated_corners(TRUE, POSES, {k: TagTarget(k, 0.06) for k in TAGS}, pinhole, 0.2, random)
    columns = length_columns(simulated_lengths(TRUE, POSES, START, 1e-4, random))
    columns |= {
        f"tag{t}_{a}{c + 1}_px": uv[:, t, c, k]
        for t in TAGS
        for c in range(4)
        for k, a in enumerate("uv")
    }
    write_log(here / "log.csv", columns)
    found = told(
        capsys, *ASKED, "--unknown", "exit_points", "--prior", "exit_points=0.005",
        "--sigma", "lengths=1e-4", "--tag-size", "0.06", "--image-size", "640x480",
    )  # fmt: skip
    assert len(found["gauge"]) == 4
    assert found["residuals_over_sigma"] == pytest.approx(1.0, abs=0.15)
    errors = [p["change"] / p["std"] for p in found["parameters"] if "exit" in p["name"]]
    assert np.max(np.abs(errors)) < 5.0  # they began where they truly are


def test_swivels_of_the_other_sign_end_with_code_six(here, capsys):
    random = np.random.default_rng(4)
    columns = length_columns(simulated_lengths(TRUE, POSES, START, 2e-4, random)[:6])
    angles = -simulated_swivels(TRUE, POSES[:6], 2e-3, random)
    columns |= {f"C{i + 1}_swivel_rad": angles[:, i] for i in range(8)}
    columns |= {f"C{i + 1}_torque_nm": np.ones(6) for i in range(2)}
    write_log(here / "log.csv", columns)
    found = told(
        capsys, *ASKED, "--no-rest", "--unknown", "C1.length_offset",
        "--sigma", "lengths=2e-4,swivels=3e-3", "--start", "0.15,0.1,0.2,15,5,5", code=6,
    )  # fmt: skip
    assert found["status"] == "misfit"
    assert any("of 48 swivel angles do not fit: sign or zero?" in why for why in found["misfit"])
    assert set(found["largest_residuals"][0]) == {
        "row", "measurement", "residual", "unit", "sigmas",
    }  # fmt: skip
    assert any(words.startswith("not used: C1_torque_nm, C2_t") for words in found["remarks"])
    assert "Calibrated: misfit" in load_robot(here / "out" / "robot.yaml").assumptions


def test_what_a_log_cannot_tell_is_refused_and_nothing_written(here, tracked, capsys):
    write_log(here / "log.csv", {name: values[:1] for name, values in tracked.items()})
    said = refuse(capsys, *ASKED, "--unknown=C3.exit_point.z,C3.length_offset")
    assert "cannot be told from C3's" in said
    assert [path.name for path in here.iterdir()] == ["log.csv"]


def test_a_tracker_out_of_sync_is_named_and_can_be_put_right(here, capsys):
    random, time = np.random.default_rng(5), np.linspace(0.0, 6.0, 121)

    def pose(t):
        return pose_from_angles(
            np.array([0.1 * np.sin(t), 0.1 * np.cos(1.3 * t), 0.3 + 0.05 * np.sin(0.7 * t)]),
            0.1 * np.sin(np.array([1.1, 0.8, 0.5]) * t),
        )

    readings = simulated_lengths(TRUE, [pose(t) for t in time], START, 1e-4, random)
    late = simulated_poses([pose(t - 0.2) for t in time], 1e-3, 5e-4, random)
    columns = {"time_s": time} | length_columns(readings) | pose_columns(late)
    write_log(here / "log.csv", columns)
    asked = (*ASKED, *SIGMA, "--unknown", "exit_points")
    words = refuse(capsys, *asked)
    assert "s late" in words
    shift = float(words.rpartition("--tracker-late ")[2])
    assert shift == pytest.approx(0.2, abs=5e-3)
    assert told(capsys, *asked, "--tracker-late", shift)["status"] == "converged"


def test_what_a_robot_file_cannot_hold_is_said():
    class Result:
        model = TRUE
        names = ("C1.length_offset", "C1.length_scale")
        status = "converged"

    _, left = calibrated_robot(ROBOT, Result())
    assert len(left) == 2


def test_a_hangprinter_is_calibrated_from_its_recorded_series(here, capsys):
    series = Path(__file__).parents[1] / "analyses/fits/hangprinter4/samples.csv"
    found = told(
        capsys, "calibrate", "hangprinter_4", series, "--zero", "home", "--sigma", "place=1e-6",
        "--unknown", "exit_points,common_drum_radius,D.drum_radius,tracker.[xyz]",
        "--bound", "tracker.[xyz]=0.001", "--hold-out", "8-9", "--keep-outliers", "--out", "out",
    )  # fmt: skip
    assert (found["status"], found["poses"]) == ("converged", 42)
    assert found["at_bounds"] == {"tracker.x": pytest.approx(1e-3)}
    assert found["held_out"]["compared_rows"] == [8, 9]
    assert (here / "out" / "rows.png").exists()
