"""Each recipe of CONTRIBUTING.md is all there is to it: followed in a copy, everything knows the
toy, and the rules of the house hold."""

import os
import re
import subprocess
import sys

import pytest

from tests.recipes.steps import RECIPES, ROOT, TEMPLATES, files_of, follow, mirror, steps_of

MOST_FILES = 3

RULES = ("tests/test_architecture.py", "tests/test_packaging.py")
"""Tests of the whole, which are asked of the copy."""

ABOUT_THE_PROJECT = (
    "not readme and not links and not citation and not changelog and not folder_says and not hook"
    " and not any_wing"
)
"""What of these needs no copy, or starts a process, which has the modules of the project."""

OF_ONE_ROOM = "face_holds or public_name or every_room"
"""What of these is asked of rooms one by one: here of those that a recipe touches."""


def touched_rooms():
    """Packages of the project's folders in which recipes put something."""
    folders = {name.rpartition("/")[0] for recipe in RECIPES for name in files_of(recipe)}
    names = {folder.replace("/", ".") for folder in folders if not folder.startswith("tests/")}
    return sorted(f"cdpr_drake.{name.removeprefix('cdpr_drake.')}" for name in names)


@pytest.mark.parametrize("recipe", RECIPES)
def test_a_recipe_names_its_files_and_there_are_few(recipe):
    """A test beside the tests of the room, and in the steps the tables with their files."""
    files = files_of(recipe)
    assert 2 <= len(files) <= MOST_FILES
    steps = steps_of(recipe)
    for name in files:
        rows = TEMPLATES / recipe / f"{name}.rows"
        if rows.exists():
            table = re.search(r"^(\w+) = ", rows.read_text(), re.MULTILINE)[1]
            assert f"`{table}`" in steps
            assert re.search(rf"`[\w/]*{name.rpartition('/')[2]}`", steps), name
        elif name.startswith("tests/"):
            assert "A test" in steps
        else:
            folder = re.search(r"`([\w/]+)/my_\w+\.py`", steps)[1]
            assert name.rpartition("/")[0] == folder
    assert sum(name.startswith("tests/") for name in files) == 1


def test_there_is_a_template_for_each_and_for_no_other():
    assert {path.name for path in TEMPLATES.iterdir()} == set(RECIPES)


def test_all_of_them_followed(tmp_path):
    """In one process, whose modules are those of the copy where a recipe has touched them."""
    copy = tmp_path / "copy"
    mirror(copy)
    tests = [str(path) for recipe in RECIPES for path in follow(recipe, copy)]
    for name in RULES:
        (copy / name).parent.mkdir(exist_ok=True)
        (copy / name).write_text((ROOT / name).read_text())
    rules = [str(copy / name) for name in RULES]
    words = [sys.executable, str(ROOT / "tests/recipes/run_in_copy.py"), str(copy), "-q"]
    words += ["-p", "no:cacheprovider", "-p", "no:xdist", "--import-mode=append"]
    rooms = " or ".join(f"[{room}]" for room in touched_rooms())
    asked = f"{ABOUT_THE_PROJECT} and (not ({OF_ONE_ROOM}) or {rooms})"
    words += [f"--rootdir={copy}", "-k", asked, *tests, *rules]
    path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        words, cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True
    )
    print(done.stdout[-5000:], done.stderr[-2000:])  # seen where it fails
    assert done.returncode == 0
    assert int(re.search(r"(\d+) passed", done.stdout)[1]) > len(RECIPES)
