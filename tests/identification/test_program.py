from dataclasses import replace

import numpy as np
import pytest
from pydrake.solvers import Solve

from cdpr_drake.errors import IdentificationError
from cdpr_drake.identification.program import IdentificationProgram
from cdpr_drake.identification.regressor import pseudo_inertia
from cdpr_drake.identification.samples import sample_motion, sample_winches
from tests.identification.logs import BANDWIDTH, CABLES, RATE, TRUE, believed, log, samples

PLATFORM = ("mass", "center_of_mass", "inertia")
NOISE = {"tension": 0.3, "place": 1e-4, "angle": 2e-4}
EXACT = 1e-4
"""What smoothing to 8 Hz takes of a motion of 1 Hz, over the parameters' typical sizes."""


def program(of, unknown=PLATFORM, **how):
    made = IdentificationProgram(believed(), unknown, **how)
    made.AddMotion(of)
    return made


@pytest.fixture(scope="module")
def noisy():
    return samples(**NOISE)


def test_an_exact_log_gives_the_body_back():
    made = program(samples(span=4.0))
    found = made.Solve()
    typical = np.array([p.size for p in made.layout.parameters])
    off = (found.values - made.layout.values(TRUE.vector())) / typical
    assert np.max(np.abs(off)) < EXACT
    assert found.status == "optimal"


def test_drakes_solver_finds_the_same(noisy):
    made = program(noisy)
    found = made.Solve(outliers=False)
    again = IdentificationProgram(found.model, PLATFORM)  # weights of the same masses
    again.AddMotion(noisy)
    prog = again.prog()
    solved = Solve(prog)
    assert solved.is_success()
    theta = solved.GetSolution(prog.decision_variables()) * again.layout.typical
    assert np.max(np.abs(again.layout.values(theta) - found.values) / found.std) < 1e-2


def test_what_no_body_has_is_not_found():
    """Hardly any turning: inertia alone would come out negative."""
    rough = samples(turn=0.05, span=4.0, tension=3.0, place=1e-4, angle=2e-4)
    made = program(rough)
    made.AddPrior("inertia", 0.034)
    free = made.equations.least_squares(made.terms, False)
    assert np.linalg.eigvalsh(pseudo_inertia(free.point.theta[:10]))[0] < 0.0
    found = made.Solve(outliers=False)
    assert np.linalg.eigvalsh(pseudo_inertia(found.model.inertial()))[0] > -1e-7
    assert "pseudo-inertia" in found.active[0]
    assert found.solver != "least squares"


def test_spikes_do_not_count(noisy):
    time, poses, tensions = log(**NOISE)
    tensions[100::97, 3] += 40.0
    poses[333, 5] += 0.05
    of = sample_motion(time, poses, tensions, CABLES, BANDWIDTH)
    assert of.dropped == len(tensions[100::97]) + 1
    clean, found = program(noisy).Solve(), program(of).Solve()
    assert np.max(np.abs(found.values - clean.values) / clean.std) < 1.0


def test_a_known_centre_is_kept_and_the_rest_is_found(noisy):
    made = IdentificationProgram(
        believed(center_of_mass=TRUE.center_of_mass, inertia=TRUE.inertia), ("mass",)
    )
    made.AddMotion(noisy)
    found = made.Solve()
    assert found.names == ("mass",)
    assert found.values[0] == pytest.approx(TRUE.mass, abs=4.0 * found.std[0])
    np.testing.assert_allclose(found.model.center_of_mass, TRUE.center_of_mass, atol=1e-12)
    np.testing.assert_allclose(found.model.inertia, TRUE.inertia, atol=1e-12)


@pytest.mark.parametrize("group", ["mass", "center_of_mass", "inertia"])
def test_what_is_sure_beforehand_is_kept(group):
    """A prior of a millionth of what is typically unknown: what the log says is nothing to it."""
    made = program(samples(span=3.0, **NOISE))
    made.AddPrior(group, {"mass": 1e-6, "center_of_mass": 1e-8, "inertia": 1e-8}[group])
    found = made.Solve(outliers=False)
    mine = [k for k, name in enumerate(found.names) if name.split(".")[0] == group]
    if group == "inertia":  # about Po, as its prior is
        off = found.model.inertial()[4:] - believed().inertial()[4:]
        assert np.max(np.abs(off)) < 1e-4
    else:
        np.testing.assert_allclose(found.values[mine], found.before[mine], atol=1e-4)


def test_a_log_without_rotation_says_what_it_cannot_tell():
    made = program(samples(turn=0.0, span=4.0, **NOISE))
    with pytest.raises(IdentificationError, match=r"inertia .* cannot be told.*no rotation"):
        made.Solve()
    assert "mass cannot" not in " ".join(made.FindUnidentifiable())
    at_rest = program(samples(turn=0.0, move=0.0, span=4.0, **NOISE))
    assert "centre of mass along z" in " ".join(at_rest.FindUnidentifiable())


def stretched(of, stiffness):
    """Unstrained lengths, as winches of elastic cables count them, and the cables."""
    T, EA = np.full(8, 4e-3), stiffness
    soft = replace(TRUE, stiffness=EA, retardation=T, offset=np.linspace(-0.02, 0.02, 8))
    first, second = of.tension_rates
    y = of.tensions - T * first + T**2 * second
    # l = l0 (1 + y / EA) + offset, solved for what is counted.
    return soft, (of.lengths - soft.offset) / (1.0 + y / EA)


@pytest.mark.parametrize("common", [(), ("stiffness", "damping")])
def test_stiffness_and_damping_of_cables(common):
    of = samples()
    soft, counted = stretched(of, np.full(8, 4000.0) if common else np.linspace(3000.0, 5000.0, 8))
    start = believed(stiffness=np.linspace(7000.0, 9000.0, 8), retardation=np.full(8, 1e-3))
    made = IdentificationProgram(start, ("stiffness", "damping"), common=common)
    made.AddCableLengths(of, counted)
    found = made.Solve()
    np.testing.assert_allclose(found.model.stiffness, soft.stiffness, rtol=1e-6)
    np.testing.assert_allclose(found.model.retardation, soft.retardation, rtol=1e-4)
    np.testing.assert_allclose(found.model.offset, soft.offset, atol=1e-8)
    assert len(found.names) == (10 if common else 24)


def test_noisy_stiffness_is_within_what_is_said_of_it(noisy):
    soft, counted = stretched(noisy, np.linspace(3000.0, 5000.0, 8))
    start = believed(stiffness=np.full(8, 8000.0), retardation=soft.retardation)
    made = IdentificationProgram(start, ("stiffness",))
    counted = counted + 5e-5 * np.random.default_rng(5).standard_normal(counted.shape)
    made.AddCableLengths(noisy, counted)
    found = made.Solve()
    off = (found.model.stiffness - soft.stiffness) / found.std[:8]
    assert np.sqrt(np.mean(off**2)) < 2.0


SMOOTHED = 5e-3
"""What smoothing at 6 Hz leaves of friction of winches that turn at a third of a hertz."""


def winding(excess, noise):
    """Winches that turn to and fro with friction, and torques that overcome it."""
    random, time = np.random.default_rng(2), np.arange(0.0, 8.0, 1.0 / RATE)
    ratio, J = np.full(2, 0.004), 3e-5
    phase = 2.0 * time[:, None] + np.array([0.0, 0.7])
    l0 = 1.0 + 0.05 * np.sin(phase)
    w = 0.1 * np.cos(phase) / ratio
    w_dot = -0.2 * np.sin(phase) / ratio
    t = 20.0 + 5.0 * np.cos(3.0 * time)[:, None] * np.ones(2)
    coulomb, viscous = np.array([0.02, 0.03]), np.array([1e-4, 2e-4])
    dry = coulomb + excess * np.exp(-np.abs(w) / 5.0)
    torques = J * w_dot - ratio * t + np.sign(w) * dry + viscous * w
    torques += noise * random.standard_normal(torques.shape)
    how = {"bandwidth": 6.0, "least_speed": 1.0, "stribeck_speed": 5.0}
    return sample_winches(time, l0, t, torques, ratio=ratio, inertia=J, **how), coulomb, viscous


@pytest.mark.parametrize("noise", [0.0, 2e-3])
@pytest.mark.parametrize("unknown", [("friction",), ("friction", "static_friction")])
def test_friction_of_winches(unknown, noise):
    """Means over stretches are of what friction depends on, not of the speed alone."""
    excess, start, half = 0.01, believed(), np.array([0.1, 0.1])
    kept, coulomb, viscous = winding(excess, noise)
    two = replace(
        start, names=("C1", "C2"), stiffness=start.stiffness[:2], offset=np.zeros(2),
        retardation=start.retardation[:2], coulomb=half, static=half + excess,
        viscous=np.zeros(2), stribeck_speed=5.0,
    )  # fmt: skip
    made = IdentificationProgram(two, unknown)
    made.AddWinches(kept)
    found = made.Solve()
    for name, true in (("coulomb", coulomb), ("viscous", viscous), ("static", coulomb + excess)):
        std = np.array([s for n, s in zip(found.names, found.std, strict=True) if name in n])
        if len(std):
            off = np.abs(getattr(found.model, name) - true)
            assert np.all(off < (4.0 * std if noise else SMOOTHED * true)), name
            assert np.all(std < 0.2 * true), name


@pytest.mark.parametrize(
    ("unknown", "common", "words"),
    [
        ((), (), "found nothing"),
        (("weight",), (), "found 'weight'"),
        (("mass",), ("mass",), "common: found mass"),
        (("stiffness", "damping"), ("damping",), "both or neither"),
        (("mass",), (), "measurements: found none"),
    ],
)
def test_impossible_requests_are_refused(unknown, common, words):
    with pytest.raises(IdentificationError, match=words):
        IdentificationProgram(believed(), unknown, common=common).Solve()
