"""Who misspells a name of anything is told the one that was probably meant."""

import pytest

from cdpr_drake.errors import accepted_names
from tests.cli.test_cli import run

MISSPELT = {
    "tension caroca --method closed_from": "closed_form",
    "tension carcoa": "caroca",
    "static acrobot_large --cable-model elastc": "elastic",
    "workspace caroca --kind statc": "static",
    "design acrobot_large --goal surives": "survives",
    "stability caroca --verdict sampeld": "sampled",
    "export acrobot_large --format urdff": "urdf",
    "schema sceanrio": "scenario",
    "bench tensoin": "tension",
    "new contoller mine": "controller",
    "examples lerning": "learning",
    "study stability-range": "stability-ranges",
    "simulate acrobot_pvbs": "acrobot_pbvs",
    "simulate --set camera.kind=projcted": "projected",
    "check caroac": "caroca",
    "tensoin": "tension",
}


@pytest.mark.parametrize(("words", "meant"), MISSPELT.items())
def test_the_name_that_was_meant_is_told(words, meant, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, *words.split())
    told = (out + err).lower().replace("'", "")
    assert code == 2
    assert f"did you mean {meant}?" in told or f"did you mean {meant}, " in told
    assert not list(tmp_path.iterdir())


def test_names_that_are_not_close_are_only_listed():
    assert accepted_names("xyz", ("pbvs", "ibvs")) == "accepted: pbvs, ibvs"
    assert accepted_names("pvbs", ("pbvs", "ibvs")) == "did you mean pbvs? accepted: pbvs, ibvs"
