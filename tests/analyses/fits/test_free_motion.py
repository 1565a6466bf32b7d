"""Identification from free motion: motions by Drake's plant, frequencies, refusals."""

import json

import numpy as np
import pytest
from pydrake.math import RigidTransform
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.calibration.free_motion import SMALL, steps_within
from cdpr_drake.analyses.calibration.free_motion_balance import PULLED
from cdpr_drake.analyses.calibration.free_motion_model import FREE_GROUPS, FreeMotionModel
from cdpr_drake.analyses.calibration.free_motion_sensor import earlier
from cdpr_drake.analyses.calibration.free_motion_start import StartCoordinates
from cdpr_drake.analyses.fits.swings import dominant_frequency, identify_swings
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.cli.app import main
from cdpr_drake.errors import IdentificationError, StoppedError
from cdpr_drake.models.robot_loader import load_robot
from tests.analyses.fits import swings
from tests.messages import printed

SIGMAS = 4.0
"""Standard errors by which a value may be off: one of 23 by 3 happens now and then."""

PREDICTED_TURN, PREDICTED_PLACE = 0.01, 2e-3
"""Of a held-out stretch [rad, m]: five times the noise of turns, which its first state has."""

HERMITE_TOLERANCE = 5e-6
"""h^4 / 384 of a fourth derivative of 9^4, twice."""

FREQUENCY_TOLERANCE = 0.015
"""Share of a dominant frequency: 1.6 s tell 0.6 Hz apart, noise moves the peak by some 0.02 Hz."""


def spans_words(spans):
    """Stretches as options take them."""
    return ",".join(f"{a:.6g}:{b:.6g}" for a, b in spans)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The command on two fitted swings and one that is held out: exit code, JSON and folder.

    Of what is fitted the first 0.8 s are enough.
    """
    folder = tmp_path_factory.mktemp("swings")
    spans = swings.write(folder / "log.csv", (0, 1, 2))
    believed = swings.believed_file(folder)
    fitted = spans_words((first, first + 0.8) for first, _ in spans[:2])
    args = ["identify-swings", believed, str(folder / "log.csv"), "--stretches", fitted]
    args += ["--hold-out", spans_words(spans[2:]), "--out", str(folder / "out"), "--lead", "0.8"]
    args += ["--sigma", f"turn={swings.NOISE['turn']},tension={swings.NOISE['tension']}", "--json"]
    with pytest.raises(SystemExit) as ended:
        main(args)
    return ended.value.code, json.loads((folder / "out/results.json").read_text()), folder


def test_a_swing_by_the_plant_tells_the_platform_and_its_cables(found):
    code, said, folder = found
    assert code == 0
    assert said["status"] == "optimal"
    # Sigmas are those of the noise; what the model is asked late for is interpolated.
    assert 0.9 < said["residuals_over_sigma"] < 1.1
    assert not any("before it settled" in words for words in said["remarks"])
    true = {
        "mass": 14.1, "all.stiffness": 4e10 * np.pi * 1e-6, "all.retardation_time": 0.004,
        "drag.force": swings.DRAG[0], "drag.moment": swings.DRAG[1],
        "sensor.late": swings.LATE, "sensor.heading": swings.HEADING,
    }  # fmt: skip
    robot = swings.true_robot()
    true |= {f"center_of_mass.{a}": x for a, x in zip("xyz", (0.008, -0.004, 0.155), strict=True)}
    names = ("xx", "yy", "zz", "xy", "xz", "yz")
    true |= {f"inertia.{a}": float(x) for a, x in zip(names, robot.platform.inertia, strict=True)}
    by_name = {one["name"]: one for one in said["parameters"]}
    for name, value in true.items():
        one = by_name[name]
        assert abs(one["value"] - value) < SIGMAS * one["std"], (name, one, value)
    for name, share in (("mass", 0.05), ("all.stiffness", 0.05), ("inertia.zz", 0.05)):
        assert by_name[name]["value"] == pytest.approx(true[name], rel=share)
    identified = load_robot(str(folder / "out/robot.yaml"))
    assert identified.platform.mass == pytest.approx(by_name["mass"]["value"])
    np.testing.assert_allclose(
        identified.cable_set().stiffness, by_name["all.stiffness"]["value"], rtol=1e-9
    )
    assert (folder / "out/held_out.png").exists()
    assert (folder / "out/unexplained.png").exists()
    for one in said["fitted"] + said["held_out"]:
        assert one["unexplained"]["force_n"] < PULLED * 14.1 * 9.80665
    assert not any("neither cables nor weight" in words for words in said["remarks"])


def test_a_held_out_swing_is_predicted(found):
    _, said, _ = found
    (one,) = said["held_out"]
    assert one["turn_rms_rad"] < PREDICTED_TURN
    assert one["position_rms_m"] < PREDICTED_PLACE
    assert one["frequencies"]
    for each in one["frequencies"]:
        assert abs(each["off"]) < FREQUENCY_TOLERANCE
    # The model as it was believed has other modes; what was found has the true ones.
    assert abs(said["modes_before_hz"][0] / said["modes_hz"][0] - 1.0) > 0.02


def test_what_cables_pull_at_first_stays_while_their_lengths_are_sought():
    robot = swings.BELIEVED
    start = RigidTransform([0.01, -0.02, 0.45])
    model = FreeMotionModel.of(robot, start, FREE_GROUPS, True, False)
    near = np.array([0.2, -0.1, 0.3, 0.02, 0.01, -0.03, 1.0, -2.0, 0.5, 0.1, 0.2, 0.0])
    at = StartCoordinates.about(model, near)
    assert at.pulls.shape == (4, 4)
    assert at.free.shape == (6, 2)
    vector = model.before()
    y = at.of(vector, near)
    np.testing.assert_allclose(at.moved(vector, y), near, atol=1e-12)
    longer = vector.copy()
    longer[: len(robot.cables)] *= 1.03
    longer[model.names.index("all.stiffness")] *= 1.2
    moved = at.moved(longer, y)
    assert np.linalg.norm(moved[3:6] - near[3:6]) > 0.02

    def tensions(vector, moved):
        return model.run(vector, moved, 2, 0.01)[1][0]

    still = np.concatenate([near[:6], np.zeros(6)])
    np.testing.assert_allclose(at.of(longer, moved), y, rtol=0.0, atol=1e-9)
    pulled = tensions(vector, still)
    again = tensions(longer, np.concatenate([moved[:6], np.zeros(6)]))
    assert np.min(pulled) > 0.0
    # Stiffness times stretch stays; a cable 3 % longer pulls as much less for it.
    np.testing.assert_allclose(again * 1.03, pulled, rtol=1e-9)


def test_what_stiffening_cables_pull_at_first_stays_while_it_is_sought():
    start = RigidTransform([0.01, -0.02, 0.45])
    model = FreeMotionModel.of(swings.BELIEVED, start, (*FREE_GROUPS, "stiffening"), True, False)
    near = np.array([0.2, -0.1, 0.3, 0.02, 0.01, -0.02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    vector, k = model.before(), model.names.index("all.stiffening")
    vector[k] = 2e-3
    at = StartCoordinates.about(model, near)
    # A pose in which every cable pulls: from coordinates, as a search would come to it.
    y = at.of(model.before(), near)
    y[: at.pulls.shape[1]] = at.pulls.T @ np.array([1.0, 1.3, 0.8, 1.1])
    moved = at.moved(vector, y)
    np.testing.assert_allclose(at.of(vector, moved), y, rtol=0.0, atol=1e-9)
    pulled = model.run(vector, moved, 2, 0.01)[1][0]
    assert np.min(pulled) > 0.0
    stiffer = vector.copy()
    stiffer[k] = 8e-3
    again = model.run(stiffer, at.moved(stiffer, y), 2, 0.01)[1][0]
    np.testing.assert_allclose(again, pulled, rtol=1e-9)


def test_states_a_time_earlier_are_those_of_the_motion():
    step, late, w = 0.02, 0.013, np.array([0.3, -1.2, 0.8])
    t = np.arange(60) * step

    def states(time):
        angle = np.sin(9.0 * time)[:, None]
        q = Rotation.from_rotvec(angle * w / 2.0).as_quat()[:, [3, 0, 1, 2]]
        p = np.column_stack([np.cos(9.0 * time), 0.0 * time, time])
        spin = 9.0 * np.cos(9.0 * time)[:, None] * w / 2.0
        v = np.column_stack([-9.0 * np.sin(9.0 * time), 0.0 * time, 1.0 + 0.0 * time])
        return np.hstack([q, p, spin, v])

    turns, places = earlier(states(t), step, late)
    true = states(t - late)
    off = turns.inv() * Rotation.from_quat(true[:, [1, 2, 3, 0]])
    assert np.max(off[1:].magnitude()) < HERMITE_TOLERANCE
    assert np.max(np.abs(places[1:] - true[1:, 4:7])) < HERMITE_TOLERANCE


def test_steps_for_slopes_stay_within_bounds():
    """A retardation time near zero would become negative, which no cable has."""
    x, least, largest = np.array([[1e-7, 0.5, 1.0], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    down, up = steps_within(x, least, largest)
    assert down == pytest.approx([1e-7, SMALL, SMALL])
    assert up == pytest.approx([SMALL, SMALL, 0.0])
    assert np.all(x - down >= least)
    assert np.all(x + up <= largest)


def test_dominant_frequency_is_that_of_a_sine():
    t = np.arange(300) / 50.0
    for f in (0.83, 1.9, 7.3):
        values = 3.0 + np.exp(-0.2 * t) * np.sin(2.0 * np.pi * f * t + 0.3)
        assert dominant_frequency(t, values) == pytest.approx(f, rel=2e-3)


REFUSED = [
    (
        ["--stretches", "5"],
        "--stretches: found '5'; accepted: first:last, the first below the last",
    ),
    (["--stretches", "2:1"], "--stretches: found '2:1'; accepted: first:last"),
    (["--stretches", "0:90"], "stretch: found 0:90; accepted: 0.5 s or more within 0 to 2.39 s"),
    (["--unknown", "friction"], "unknown: found 'friction'; accepted of a free"),
    (["--lead", "-1"], "--lead: found -1; accepted: > 0 [s]"),
    (["--prior", "turn=1"], "--prior: found 'turn'; accepted: of what is"),
    (["--sigma", "turns=1"], "--sigma: found 'turns'; did you mean turn?"),
]


@pytest.mark.parametrize(("options", "words"), REFUSED)
def test_what_cannot_be_is_said_in_one_line(tmp_path, capsys, options, words):
    swings.write(tmp_path / "log.csv", (0,))
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as ended:
        main(["identify-swings", "irma4u", str(tmp_path / "log.csv"), *options, "--out", str(out)])
    said = printed(capsys).err
    assert ended.value.code == 2
    assert words in said
    assert not out.exists()


def test_a_search_stops_between_two_steps(tmp_path):
    swings.write(tmp_path / "log.csv", (0,))
    done, asked = [], iter([False] * 3)
    follow = Follow(lambda now: done.append(now.what), stop=lambda: next(asked, True))
    with pytest.raises(StoppedError):
        identify_swings("irma4u", tmp_path / "log.csv", stretches=[(0.0, 1.0)], follow=follow)
    assert done[1:] == 2 * ["first 0.6 s of each stretch"]


def test_winches_that_turn_and_a_mass_without_tensions_are_refused(tmp_path):
    path = tmp_path / "log.csv"
    lengths = np.linspace(1.9, 1.95, 240)[:, None]
    swings.write(path, (0,), lengths)
    with pytest.raises(IdentificationError, match=r"C1: found its length changing by 0\.0"):
        identify_swings("irma4u", path, stretches=[(0.0, 2.0)])
    lines = [",".join(row.split(",")[:4]) for row in path.read_text().splitlines()]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(IdentificationError, match="without which a free motion does not tell the"):
        identify_swings("irma4u", path, unknown="mass", stretches=[(0.0, 2.0)])
