"""The study of slack in pictures: statements can fail; its quick form draws real images."""

from dataclasses import replace

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.seen_slack import STUDY


def made_up(case, seed, wrong=False):
    return {
        "slack": 4, "taut": 4, "hits": 1 if wrong else 4, "false_slack": int(wrong), "unseen": 0,
        "unseen_slack": 0, "rms_m": 1e-3, "largest_m": 2e-3, "squares": 9.0 if wrong else 1.0,
        "largest_sigmas": 2.0,
    }  # fmt: skip


def wrong(case, seed):
    return made_up(case, seed, wrong=True)


def results(measured):
    return replace(STUDY, measure=measured)(True, StudySession(workers=1))


def test_statements_tell_good_eyes_from_bad():
    assert {one.verdict for one in results(made_up).statements} == {"confirmed"}
    assert {one.verdict for one in results(wrong).statements} == {"not confirmed"}


def test_quick_form_draws_images_and_finds_cables(tmp_path):
    """Few images: what they say is what the full form says, but for the spread of so few."""
    found = results(STUDY.measure)
    rows = found.runs
    assert sum(rows["slack"]) + sum(rows["taut"]) == 8 * len(rows)
    assert sum(rows["hits"]) > 0.8 * (sum(rows["slack"]) - sum(rows["unseen_slack"]))
    assert sum(rows["false_slack"]) == 0
    found.write(tmp_path)
    assert (tmp_path / "seen_slack.png").is_file()
