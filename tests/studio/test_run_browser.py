"""A run in a real browser: live plots, camera and scene, and what the end of the server leaves."""

import json

from tests.chromium import cleared, complaints, wait_for
from tests.studio.run_page import FRAMES, press, text_of, write_scenario
from tests.studio.served import LONGEST_START, served

NEAR = {"position: 0.0003": "position: 0.27", "rotation_deg: 0.5": "rotation_deg: 60.0"}
"""A goal that the run comes to within a second of simulated time."""

CAMERA = "(document.querySelector('.cdpr-camera img') || {}).naturalWidth > 100"
INK = """(() => {
    const canvas = document.querySelector('.cdpr-plot canvas');
    const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    let blue = 0;
    for (let k = 0; k < pixels.length; k += 4)
        blue += pixels[k + 3] > 128 && pixels[k + 2] > pixels[k] + 100;
    return blue;
})()"""
"""Pixels of the first curve, which is blue, in the first chart."""


def test_a_run_converges_before_the_eyes_and_another_one_ends_with_the_server(
    tmp_path, started_browser
):
    folder = tmp_path / "work"
    folder.mkdir()
    scenario = write_scenario(folder, **NEAR)
    window = 1280, 1000
    with cleared(started_browser, window) as page, served(folder, str(scenario)) as (address, _):
        page.get(address)
        press(page, "Run")
        wait_for(page, "document.querySelector('[aria-label=duration]') !== null")
        press(page, "Start")
        wait_for(page, f"{FRAMES}[1] > 3", LONGEST_START)
        wait_for(page, CAMERA)
        wait_for(page, f"{text_of('.cdpr-outcome')} === 'converged'")
        wait_for(page, f"{text_of('.cdpr-state')} === 'finished'")
        wait_for(page, f"{INK} > 50")
        assert not complaints(page)
        done = folder / "runs" / "acrobot_pbvs"
        assert json.loads((done / "summary.json").read_text())["outcome"] == "converged"
        page.execute_script("document.querySelector('.cdpr-run .q-checkbox').click()")
        press(page, "Start")
        wait_for(page, f"{text_of('.cdpr-state')} === 'paused'", LONGEST_START)
        page.refresh()
        wait_for(page, f"{text_of('.cdpr-state')} === 'paused' && {FRAMES}[1] > 0")
    left = json.loads((folder / "runs" / "acrobot_pbvs-2" / "summary.json").read_text())
    assert left["outcome"] == "interrupted"
