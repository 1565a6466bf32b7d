"""`calibrate`, `identify` and `calibrate-camera`: what they write and say, and what they refuse."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.fits.robots import calibrated_robot
from cdpr_drake.calibration.measurements import (
    simulated_corners,
    simulated_lengths,
    simulated_swivels,
)
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_dynamics import dynamic_model
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.typed_yaml import dump_typed
from cdpr_drake.systems.diagrams.beliefs import believed_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.vision.apriltags import TagTarget
from tests.analyses.fits.attack import HANGPRINTER
from tests.analyses.fits.logs import (
    MOTION_NOISE,
    POSES,
    ROBOT,
    START,
    TAGS,
    TRUE,
    length_columns,
    pushed_columns,
    tracked_columns,
    write_motion,
)
from tests.cli.commands import answer, ended, refuse, run, told, write_log
from tests.identification import logs as motions
from tests.models.formats.foreign_files import KLIPPER, MASLOW, REPRAP
from tests.vision.boards import board_image, board_poses, make_board

# Robots from trackers, cameras, winches and a recorded series.

SIGMA = ("--sigma", "lengths=1e-4,place=5e-4,turn=1e-3")
CALIBRATE = ("calibrate", "acrobot_small", "log.csv", "--out", "out")


@pytest.fixture(scope="module")
def tracked():
    return tracked_columns(1)


def test_a_tracker_calibrates_and_scenarios_believe_it(here, tracked, capsys):
    shifts = 0.004 * np.random.default_rng(2).standard_normal((8, 3))
    nominal = load_robot("acrobot_small")
    for cable, shift in zip(nominal.cables, shifts, strict=True):
        cable.exit_point = cable.exit_point + shift
    (here / "nominal.yaml").write_text(dump_typed(nominal))
    write_log(here / "log.csv", tracked)
    out = here / "out"
    words = ("calibrate", "nominal.yaml", "log.csv", *SIGMA, "--next=4", "--out", "out")
    said = told(capsys, *words, "--unknown", "exit_points")
    assert said["status"] == "converged"
    assert {p.name for p in out.iterdir()} >= {
        "robot.yaml", "results.json", "calibration.png", "correlation.png", "next_poses.csv",
    }  # fmt: skip
    assert len(said["next_poses"]["poses"]) == 4
    std = np.array([p["std"] for p in said["parameters"]])
    scenario = load_scenario("acrobot_pbvs", [f"perturbations.believed_robot={out / 'robot.yaml'}"])
    believed = believed_robot(scenario, ROBOT).cables.p_WA
    errors = (believed - TRUE.cables.p_WA).T.ravel()
    assert np.max(np.abs(errors) / std) < 5.0
    assert np.sqrt(np.mean(errors**2)) < 1e-3  # twice the tracker's noise; it was 3.3 mm


@pytest.mark.usefixtures("no_room_for_pictures")
def test_figures_that_fail_cost_nothing_else(here, tracked, capsys):
    write_log(here / "log.csv", tracked)
    code, _, err = run(capsys, *CALIBRATE, *SIGMA)
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
    said = told(
        capsys, *CALIBRATE, "--unknown", "exit_points", "--prior", "exit_points=0.005",
        "--sigma", "lengths=1e-4", "--tag-size", "0.06", "--image-size", "640x480",
    )  # fmt: skip
    assert len(said["gauge"]) == 4
    assert said["residuals_over_sigma"] == pytest.approx(1.0, abs=0.15)
    errors = [p["change"] / p["std"] for p in said["parameters"] if "exit" in p["name"]]
    assert np.max(np.abs(errors)) < 5.0  # they began where they truly are


def test_swivels_of_the_other_sign_end_with_code_six(here, capsys):
    random = np.random.default_rng(4)
    columns = length_columns(simulated_lengths(TRUE, POSES, START, 2e-4, random)[:6])
    angles = -simulated_swivels(TRUE, POSES[:6], 2e-3, random)
    columns |= {f"C{i + 1}_swivel_rad": angles[:, i] for i in range(8)}
    columns |= {f"C{i + 1}_torque_nm": np.ones(6) for i in range(2)}
    write_log(here / "log.csv", columns)
    said = told(
        capsys, *CALIBRATE, "--no-rest", "--unknown", "C1.length_offset",
        "--sigma", "lengths=2e-4,swivels=3e-3", "--start", "0.15,0.1,0.2,15,5,5", code=6,
    )  # fmt: skip
    assert (said["status"], said["misfit_factor"]) == ("misfit", 3.0)
    dropped = said["residuals"]["swivel angles"]["dropped"]
    words = f"{dropped} of 48 swivel angles do not fit: sign or zero?"
    assert any(words in why for why in said["misfit"])
    worst = said["largest_residuals"][0]
    assert set(worst) == {"row", "measurement", "residual", "unit", "sigmas"}
    assert f"row {worst['row']}, {worst['measurement']}, off by " in said["misfit"][-1]
    assert f" {worst['unit']}, " in said["misfit"][-1]
    assert any(words.startswith("not used: C1_torque_nm, C2_t") for words in said["remarks"])
    assert "Calibrated: misfit" in load_robot(here / "out" / "robot.yaml").assumptions


def test_what_a_log_cannot_tell_is_refused_and_nothing_written(here, tracked, capsys):
    write_log(here / "log.csv", {name: values[:1] for name, values in tracked.items()})
    said = refuse(capsys, *CALIBRATE, "--unknown=C3.exit_point.z,C3.length_offset")
    assert "cannot be told from C3's" in said
    assert [path.name for path in here.iterdir()] == ["log.csv"]


def test_a_tracker_out_of_sync_is_named_and_can_be_put_right(here, capsys):
    time = np.linspace(0.0, 6.0, 121)

    def pose(t):
        place = np.array([0.1 * np.sin(t), 0.1 * np.cos(1.3 * t), 0.3 + 0.05 * np.sin(0.7 * t)])
        return pose_from_angles(place, 0.1 * np.sin(np.array([1.1, 0.8, 0.5]) * t))

    columns = tracked_columns(5, [pose(t) for t in time], [pose(t - 0.2) for t in time])
    write_log(here / "log.csv", {"time_s": time} | columns)
    command = (*CALIBRATE, *SIGMA, "--unknown", "exit_points")
    words = refuse(capsys, *command)
    assert "s late" in words
    shift = float(words.rpartition("--tracker-late ")[2])
    assert shift == pytest.approx(0.2, abs=5e-3)
    assert told(capsys, *command, "--tracker-late", shift)["status"] == "converged"


def test_what_a_robot_file_cannot_hold_is_said():
    class Result:
        model = replace(TRUE, common_length_scale=1.01)
        names = ("C1.length_offset", "C1.length_scale", "common_length_scale")
        status = "converged"

    robot, left = calibrated_robot(ROBOT, Result())
    assert len(left) == 3
    assert robot.winch.drum_radius == pytest.approx(1.01 * ROBOT.winch.drum_radius)


def test_a_hangprinter_is_calibrated_from_its_recorded_series(here, capsys):
    said = told(
        capsys, "calibrate", "hangprinter_4", HANGPRINTER, "--zero", "home",
        "--unknown", "exit_points,common_drum_radius,D.drum_radius,tracker.[xyz]",
        "--sigma", "place=1e-6", "--bound", "tracker.[xyz]=0.001", "--hold-out", "8-9",
        "--keep-outliers", "--out", "out",
    )  # fmt: skip
    assert (said["status"], said["poses"]) == ("converged", 42)
    assert said["at_bounds"] == {"tracker.x": pytest.approx(1e-3)}
    held, rows = said["held_out"], [8, 9]
    assert held["compared_rows"] == rows
    assert held["fitted_rows"] == [k for k in range(1, 45) if k not in rows]
    assert held["distance_largest_m"] < 0.02
    assert (here / "out" / "rows.png").exists()


LINES = {
    "maslow.yaml": ("tlX: {}\n", "    # tlX: standard deviation "),
    "config.g": ("A{}:", "; A x: standard deviation "),
    "printer.cfg": ("anchor_x: {}\n", "# anchor_x: standard deviation "),
}
"""A coordinate of the first cable in files of firmwares, and the comment on it."""


@pytest.mark.parametrize("name", LINES)
def test_owners_get_lines_for_their_configuration(here, capsys, name):
    """What is fitted comes back from the file; a robot by another file is asked for it."""
    content = {"maslow.yaml": MASLOW, "config.g": REPRAP, "printer.cfg": KLIPPER}[name]
    (here / name).write_text(content)
    believed = load_robot(name)
    write_log(here / "log.csv", pushed_columns(believed))
    said = told(capsys, "calibrate", name, "log.csv", "--out", "out")
    machine = said["machine"]
    text = (here / "out" / machine["file"]).read_text()
    assert text == machine["text"]
    fitted, again = load_robot("out/robot.yaml"), load_robot(f"out/{machine['file']}")
    for cable, other in zip(fitted.cables, again.cables, strict=True):
        np.testing.assert_allclose(other.exit_point, cable.exit_point, atol=1e-12)
    line, comment = LINES[name]
    change, first = said["parameters"][0]["change"], believed.cables[0].exit_point[0]
    assert line.format(1e3 * (first + change)) in text
    assert f"{comment}{1e3 * said['parameters'][0]['std']:.2g} mm\n" in text
    assert "Of a calibration: converged." in text
    words = answer(capsys, "calibrate", "out/robot.yaml", "log.csv", "--export", machine["format"])
    assert f"Configuration for {machine['format']}, in {machine['file']}:" in words
    assert "not written: " in words
    assert comment in words


# Masses, inertia and friction from a motion.


def motion(**how):
    return motions.log(span=4.0, **MOTION_NOISE, **how)


@pytest.fixture(scope="module")
def motion_logs(tmp_path_factory):
    """A log that is fitted, and another one."""
    folder = tmp_path_factory.mktemp("logs")
    other = write_motion(folder / "b.csv", *motion(seed=1, turn=0.7, move=-0.8))
    return write_motion(folder / "a.csv", *motion()), other


IDENTIFY = ("identify", "acrobot_large", "--no-pulleys", "--out", "out")


def test_a_log_identifies_and_another_one_validates(here, motion_logs, capsys):
    log, other = motion_logs
    said = told(capsys, *IDENTIFY, log, "--validate", other)
    out = here / "out"
    assert said == json.loads((out / "results.json").read_text())
    assert (out / "validation.png").exists()
    assert said["status"] == "optimal"
    true, mass = motions.TRUE, said["parameters"][0]
    assert mass["name"] == "mass"
    assert abs(mass["value"] - true.mass) < 4.0 * mass["std"]
    # A motion that was not fitted is explained as well as the one that was.
    inside, outside = said["fitted_log"], said["log_not_fitted"]
    for what in ("force_n", "moment_nm"):
        assert outside["identified"][what] < 1.3 * inside["identified"][what]
        assert outside["identified"][what] < 0.2 * outside["believed"][what]
    # The file is a robot that can be believed in.
    model = dynamic_model(load_robot(str(out / "robot.yaml")))
    assert model.mass == pytest.approx(mass["value"])
    np.testing.assert_allclose(model.center_of_mass, true.center_of_mass, atol=1e-3)
    np.testing.assert_allclose(model.inertia, true.inertia, atol=3e-3)


@pytest.mark.usefixtures("no_room_for_pictures")
def test_a_fit_that_misses_its_noise_ends_with_6_and_names_where(here, capsys):
    """Also where figures fail."""
    time, poses, tensions = motions.log(span=2.0, **MOTION_NOISE)
    tensions[:, 3] *= 1.5  # as one sensor shows it
    code, words, err = run(capsys, *IDENTIFY, write_motion(here / "log.csv", time, poses, tensions))
    assert code == 6
    assert "validation.png: not written: " in err
    assert "No space left" in err
    said = json.loads((here / "out/results.json").read_text())
    assert said["status"] == "misfit"
    assert said["residuals_over_sigma"] > said["misfit_factor"] == 3.0
    most = said["largest_residuals"][0]
    assert 0.0 <= most["time_s"] <= 2.0
    assert most["equation"].startswith(("moment about ", "force along "))
    assert most["unit"] in ("N", "N m")
    assert most["sigmas"] > 3.0
    times = [one["time_s"] for one in said["largest_residuals"]]
    assert len(times) == len(set(times)) == 5
    assert any(words.startswith("misfit: residuals are") for words in said["remarks"])
    assert "Identified: misfit" in (here / "out/robot.yaml").read_text()
    words = " ".join(words.split())
    for word in ("acrobot_large: misfit", "Largest residuals", most["equation"]):
        assert word in words


# Cameras from drawn images.

K = np.array([[520.0, 0.0, 331.2], [0.0, 518.0, 236.4], [0.0, 0.0, 1.0]])
LENS = np.array([-0.28, 0.09, 0.0012, -0.0008, 0.0])
FOCAL = 0.005  # share of the focal length; of eight drawn images
BOARD = ("--board", "charuco", "--squares", "9x7", "--size", "0.035")


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    """Files of drawn images, the last without a board."""
    folder, board = tmp_path_factory.mktemp("boards"), make_board("charuco")
    poses = board_poses(board, 10, 0.45, spread=0.35)
    drawn = [board_image(board, K, LENS, (640, 480), pose) for pose in poses]
    drawn.append(np.full((480, 640), 128, np.uint8))
    files = [str(folder / f"board_{k}.png") for k in range(10)] + [str(folder / "empty.png")]
    for path, image in zip(files, drawn, strict=True):
        cv2.imwrite(path, image)
    return files


@pytest.fixture(scope="module")
def calibrated(images, tmp_path_factory):
    """The folder that the command writes, and its numbers."""
    out = tmp_path_factory.mktemp("calibrated") / "camera"
    assert ended("calibrate-camera", *images, *BOARD, "--out", out) == 0
    return out, json.loads((out / "results.json").read_text(encoding="utf-8"))


def test_images_become_a_camera_that_scenarios_take(calibrated):
    out, numbers = calibrated
    values = {row["name"]: row["value"] for row in numbers["parameters"]}
    assert values["fx"] == pytest.approx(520.0, rel=FOCAL)
    assert values["fy"] == pytest.approx(518.0, rel=FOCAL)
    assert all(row["std"] > 0.0 for row in numbers["parameters"])
    assert [row["unit"] for row in numbers["parameters"]] == ["px"] * 4 + ["-"] * 5
    assert numbers["fitted_rms_px"] < 0.3
    assert numbers["held_out_rms_px"] < 0.5
    assert [row["role"] for row in numbers["images"]].count("held out") == 2
    assert any("empty.png" in words for words in numbers["remarks"])
    assert (out / "camera.png").stat().st_size > 10_000
    file = str(out / "camera.yaml")
    pinhole = load_camera(file).pinhole(640, 480)
    for name in ("fx", "fy", "cx", "cy"):
        assert getattr(pinhole, name) == pytest.approx(values[name], abs=1e-9)
    assert pinhole.distortion.coefficients[:5] == pytest.approx(
        [values[name] for name in ("k1", "k2", "p1", "p2", "k3")], abs=1e-15
    )
    assert load_scenario("acrobot_pbvs", [f"camera.model={file}"]).camera.model == file


SAME = 1e-3
"""Of standard deviations. OpenCV adds up in parallel, so that its results change in the seventh
digit from call to call; another set of images would change them by whole deviations."""


def test_pictures_give_what_the_command_writes_of_files(images, calibrated):
    pictures = [cv2.imread(name) for name in images]
    fit = cdpr.calibrate_camera(pictures, squares=(9, 7), size=0.035, name="mine", rate=25.0)
    assert fit.folder is None
    assert (fit.model.name, fit.model.rate_hz) == ("mine", 25.0)
    assert "held out" in repr(fit)
    assert len(fit.tables()) == 4
    rows = calibrated[1]["parameters"]
    apart = [abs(u.value - row["value"]) / u.std for u, row in zip(fit.unknowns, rows, strict=True)]
    assert max(apart) < SAME


def test_what_gives_no_camera_is_refused(images, tmp_path, capsys):
    cv2.imwrite(str(tmp_path / "other.png"), np.full((100, 100), 128, np.uint8))
    for files, more, words in (
        (images[:3], (), "images: found the board in 3; accepted: at least 5"),
        ([images[0], tmp_path / "other.png"], (), "other.png: found 100 x 100 pixels"),
        ([tmp_path / "nothing.png"], (), "nothing.png: found no image"),
        (images[:5], ("--hold-out", "0.8"), "--hold-out: found 0.8"),
    ):
        command = ("calibrate-camera", *files, *BOARD, *more, "--out", tmp_path / "no")
        assert words in refuse(capsys, *command)
        assert not (tmp_path / "no").exists()


# A complete fit and its own command.


def again(capsys, command, out, file):
    """The command twice more: without one of its figures, and with another input.

    Numbers are read again, among them the processor time of the first command.
    """
    picture = next(out.glob("*.png"))
    picture.unlink()
    said = told(capsys, *command, "--out", out)
    assert said == json.loads((out / "results.json").read_text())
    assert picture.exists()
    assert answer(capsys, *command, "--out", out).count("results: ") == 1
    content = file.read_bytes()
    changed = content + b"\n" if file.suffix == ".png" else content[: content.rfind(b"\n", 0, -1)]
    file.write_bytes(changed)
    assert f"{out.name}: holds other results: " in refuse(capsys, *command, "--out", out)
    file.write_bytes(content)
    return said


def test_a_complete_calibration_answers_its_own_command(here, tracked, capsys):
    write_log(here / "log.csv", tracked)
    command = (*CALIBRATE[:3], *SIGMA, "--unknown", "exit_points")
    first = told(capsys, *command, "--out", "out")
    assert again(capsys, command, here / "out", here / "log.csv") == first


def test_a_complete_identification_answers_its_own_command(here, motion_logs, capsys):
    log, other = (here / name for name in ("a.csv", "b.csv"))
    for path, source in zip((log, other), motion_logs, strict=True):
        path.write_text(Path(source).read_text())
    command = (*IDENTIFY[:3], log, "--validate", other)
    first = told(capsys, *command, "--out", "out")
    assert again(capsys, command, here / "out", other) == first


def test_a_complete_camera_answers_its_own_command(images, calibrated, capsys):
    out, numbers = calibrated
    command = ("calibrate-camera", *images, *BOARD)
    assert again(capsys, command, out, Path(images[3])) == numbers
