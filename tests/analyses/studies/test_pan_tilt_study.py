"""The study of turning cameras: statements can fail, tables and figure are written."""

from dataclasses import replace

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.pan_tilt import LOWER, STUDY, TILT, TURN, TURNED, UPPER, start


def made_up(case, seed, wrong=False):
    """Joints keep what the fixed camera does not see from every second start; or contrary."""
    turned = case.keys["camera"] == TURNED
    good = (turned or seed % 2 == 0) != (wrong and turned) or (wrong and not turned)
    return {
        "outcome": "converged" if good else "target_lost", "error_m": 5e-4 if good else 0.3,
        "error_rad": 0.01, "seen_at_start": good, "first_seen_s": 0.5 if good or turned else None,
        "unseen_s": 0.0 if good else 1.0, "kept": good, "converged": good,
        "median_off_px": 5.0 if turned else None, "largest_deg": 30.0 if turned else None,
        "encoder_deg": 0.1 if turned else None,
    }  # fmt: skip


def wrong(case, seed):
    return made_up(case, seed, wrong=True)


def results(measured):
    return replace(STUDY, measure=measured)(True, StudySession(workers=1))


def test_statements_tell_good_joints_from_bad():
    assert {one.verdict for one in results(made_up).statements} == {"confirmed"}
    assert {one.verdict for one in results(wrong).statements} == {"not confirmed"}


def test_tables_and_figure(tmp_path):
    found = results(made_up)
    assert len(found.tables()) > 0
    found.write(tmp_path)
    assert (tmp_path / "pan_tilt.png").is_file()


def test_starts_are_where_they_are_said_to_be():
    for seed in range(50):
        position, angles = start(seed)
        assert all(a <= p <= b for a, p, b in zip(LOWER, position, UPPER, strict=True))
        assert all(abs(a) <= b for a, b in zip(angles, (TILT, TILT, TURN), strict=True))
