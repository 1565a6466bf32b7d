"""The checks of a built site find what is wrong with a small one.

The site itself is built and looked at by `.ci/run`, which takes a minute.
"""

import re

import pytest

from tests.chromium import cleared
from tests.docs.built_site import axe_problems, page_problems, search_problems
from tests.docs.test_pages import PAGES

GOOD = (
    '<p id="here">Tensions <code>#!math \\dot s</code> <math><mi>s</mi></math>'
    '<a href="#here">a</a> <a href="b.html#there">b</a> <a href="https://drake.mit.edu">c</a></p>'
)
OTHER = '<h1 id="there">Other</h1><a href="a.html">back</a>'

RESULTS = """
<div class="md-search-result__meta"></div><ul></ul><script>
const word = new URLSearchParams(location.search).get("q"), all = ["tension", "tensions"];
const found = all.filter(entry => entry.includes(word));
document.querySelector("ul").innerHTML =
  found.map(entry => `<li class="md-search-result__item">${entry}</li>`).join("");
document.querySelector("div").innerText = ANSWER;
</script>
"""


SCHEMES = """<!doctype html><html lang="en"><title>a</title><style>
:root {color-scheme: light dark} h1 {background: #fff; color: #000}
@media (prefers-color-scheme: dark) {h1 {background: #111; color: DARK}}
</style><main><h1>Tensions</h1></main></html>
"""
"""A page in two schemes."""


def site(folder, text):
    (folder / "a.html").write_text(text)
    (folder / "b.html").write_text(OTHER)
    return list(page_problems(folder))


def test_a_good_site_has_no_problem(tmp_path):
    assert site(tmp_path, GOOD) == []


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<p>as #!math \\dot s there</p>", "language of a code span"),
        ("<p>the matrix $\\Pi$ of</p>", "LaTeX"),
        ("<p>x_{WP} is</p>", "LaTeX"),
        ("<p>``` python</p>", "a fence"),
        ("<p>see [that](b.md)</p>", "a link"),
        ("<p>see [rooms][cdpr_drake.cables]</p>", "a reference"),
        ("<p>::: cdpr_drake.cables</p>", "a reference"),
        ("<p>a **word**</p>", "bold face"),
        ("<p>| a | | --- |</p>", "a table"),
        ("<p>===== ======= port unit</p>", "a table"),
        ('<a href="c.html">c</a>', "which is not there"),
        ('<a href=".">all</a>', "which is not there"),
        ('<img src="c.png">', "which is not there"),
        ('<a href="#nowhere">c</a>', "no such place"),
        ('<a href="b.html#nowhere">c</a>', "no such place"),
        ('<script src="https://unpkg.com/shim"></script>', "from a network"),
        ("<math><mo>&#x2A0C;</mo></math>", "equation with '⨌'"),
    ],
)
def test_each_problem_is_found(tmp_path, text, words):
    problems = site(tmp_path, text)
    assert all(problem.startswith("a.html: ") for problem in problems)
    assert any(words in problem for problem in problems)


def test_an_empty_folder_is_no_site(tmp_path):
    assert list(page_problems(tmp_path)) != []


@pytest.mark.parametrize(
    ("answer", "patience", "words"),
    [("`${found.length} found`", None, None), ("``", 1.0, "no answer"),
     ("found.splice(0) && `No match`", None, None)],
)  # fmt: skip
def test_the_search_is_asked(started_browser, tmp_path, answer, patience, words):
    (tmp_path / "index.html").write_text(RESULTS.replace("ANSWER", answer))
    wait = {} if patience is None else {"patience": patience}
    with cleared(started_browser) as browser:
        problems = list(search_problems(tmp_path, browser, {"tension": 2}, **wait))
        more = list(search_problems(tmp_path, browser, {"tension": 3}, **wait))
    assert len(problems) == (words is not None)
    assert all(words in problem for problem in problems)
    assert len(more) == 1


def test_axe_is_asked_about_both_schemes(started_browser, tmp_path):
    with cleared(started_browser) as browser:
        for dark in ("#ddd", "#333"):
            (tmp_path / "a.html").write_text(SCHEMES.replace("DARK", dark))
            problems = list(axe_problems(tmp_path, browser, ["a.html"]))
            assert [words.partition(": h1")[0] for words in problems] == (
                [] if dark == "#ddd" else ["a.html, dark: color-contrast"]
            )


@pytest.mark.parametrize("page", PAGES, ids=[page.stem for page in PAGES])
def test_languages_stand_in_code_spans(page):
    text = re.sub(r"`[^`]*`", "", page.read_text(encoding="utf-8"))
    assert "#!" not in text
