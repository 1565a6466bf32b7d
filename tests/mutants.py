"""Random single mutants of rooms, each tried against the tests of its room.

    python -m tests.mutants rooms
    python -m tests.mutants draw drawn.jsonl --count 80 --seed 1 [--room cdpr_drake/statics ...]
    python -m tests.mutants run drawn.jsonl new.jsonl
    python -m tests.mutants run drawn.jsonl old.jsonl --tests ../before
    python -m tests.mutants table drawn.jsonl old.jsonl new.jsonl

A room is a folder of sources whose tests have a folder of the same name. Each room has one of the
mutants that are drawn at least, if there are so many; the others are drawn from all places alike.
`run` copies this tree, takes the tests of another one if asked to, and mutates the copy. A room's
tests, and those elsewhere that import the mutated module, must pass there first; then those that
name the mutated function or module are tried before the others, and the first that fails ends the
trial. A mutant is killed by a test that fails, not by a timeout. The same command goes on where it
was stopped.

numba keeps a compiled caller when only the file of what it calls has changed. So a mutant of a
kernel gets a copy of the kernels without those of all modules that import its own, by any way.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import inspect
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).parent.parent

PACKAGES = ("cdpr_drake", "models", "systems", "analyses")

BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
JOINED = {ast.And: "and", ast.Or: "or"}
EXTREME = ("min", "max")

OTHER = {"+": "-", "-": "+", "*": "/", "/": "*", "<": "<=", "<=": "<", ">": ">=", ">=": ">",
         "==": "!=", "!=": "==", "and": "or", "or": "and", "min": "max", "max": "min"}  # fmt: skip
"""What a word becomes."""

LONGEST = 600.0
"""A trial that takes longer is neither killed nor survived [s]."""

Place = dict[str, Any]
"""room, file, function, line, start and end [byte], old, new."""


def as_python(module: ModuleType, *changes: tuple[str, str]) -> dict[str, Any]:
    """The functions of a module, with some words replaced, not compiled."""
    source = inspect.getsource(module)
    for old, new in changes:
        assert old in source, old
        source = source.replace(old, new)
    names: dict[str, Any] = {"__name__": "mutant"}
    exec(re.sub(r"@njit\(.*\)\n", "", source), names)
    return names


def tests_of(room: str) -> str:
    """Folder of a room's tests: `cdpr_drake/statics` has `tests/statics`."""
    return f"tests/{room.removeprefix('cdpr_drake/')}"


def rooms() -> dict[str, list[Path]]:
    """Sources of each room that has tests of its own."""
    found: dict[str, list[Path]] = {}
    for package in PACKAGES:
        for folder in sorted({path.parent for path in (ROOT / package).rglob("*.py")}):
            room = folder.relative_to(ROOT).as_posix()
            if room != package and (ROOT / tests_of(room)).is_dir() and any(folder.glob("*.py")):
                found[room] = sorted(folder.glob("*.py"))
    if (ROOT / "tests/models").is_dir():
        found["models"] = sorted((ROOT / "models").glob("*.py"))
    return found


def places(path: Path) -> Iterator[Place]:
    """Where a function of a file may be mutated; words of errors and types stay."""
    raw = path.read_bytes()
    begins = [0]
    for line in raw.splitlines(keepends=True):
        begins.append(begins[-1] + len(line))

    def span(node: Any) -> tuple[int, int]:
        return (begins[node.lineno - 1] + node.col_offset,
                begins[node.end_lineno - 1] + node.end_col_offset)  # fmt: skip

    def word(old: str, after: int, before: int) -> tuple[int, int, str, str] | None:
        start = raw.find(old.encode(), after, before)
        return (start, start + len(old), old, OTHER[old]) if start >= 0 else None

    def place(node: ast.AST) -> tuple[int, int, str, str] | None:
        match node:
            case ast.Compare(left, [op, *_], [right, *_]) if type(op) in COMPARED:
                return word(COMPARED[type(op)], span(left)[1], span(right)[0])
            case ast.BinOp(left, op, right) if type(op) in BINARY:
                return word(BINARY[type(op)], span(left)[1], span(right)[0])
            case ast.AugAssign(target, op, value) if type(op) in BINARY:
                return word(BINARY[type(op)], span(target)[1], span(value)[0])
            case ast.BoolOp(op, [first, second, *_]):
                return word(JOINED[type(op)], span(first)[1], span(second)[0])
            case ast.UnaryOp(ast.Not()):
                return span(node)[0], span(node)[0] + 4, "not ", ""
            case ast.Call(ast.Name(name)) if name in EXTREME:
                return word(name, *span(node.func))
            case ast.Constant(value) if type(value) in (int, float):
                start, end = span(node)
                return start, end, raw[start:end].decode(), repr(2 * value + 1 if value else 1)
        return None

    tree = ast.parse(raw)
    left_alone: set[ast.AST] = set()
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef():
                kept = [*node.decorator_list, node.returns, node.args]
            case ast.AnnAssign():
                kept = [node.annotation]
            case ast.Raise() | ast.JoinedStr():
                kept = [node]
            case _:
                kept = []
        left_alone.update(inner for part in kept if part for inner in ast.walk(part))
    seen: set[tuple[int, int]] = set()
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        for node in ast.walk(function):
            found = None if node in left_alone else place(node)
            if found and found[:2] not in seen:
                seen.add(found[:2])
                start, end, old, new = found
                yield {"file": path.relative_to(ROOT).as_posix(), "function": function.name,
                       "line": raw.count(b"\n", 0, start) + 1,
                       "start": start, "end": end, "old": old, "new": new}  # fmt: skip


def draw(out: Path, count: int, seed: int, wanted: list[str]) -> None:
    """Writes mutants, a line each."""
    chance = random.Random(seed)
    all_rooms = rooms()
    unknown = [room for room in wanted if room not in all_rooms]
    if unknown:
        raise SystemExit(f"--room: found {unknown[0]}; accepted: {', '.join(all_rooms)}")
    by_room = {
        room: [{"room": room, **place} for path in all_rooms[room] for place in places(path)]
        for room in wanted or all_rooms
    }
    rest = [place for found in by_room.values() for place in found]
    total = len(rest)
    chosen = [chance.choice(found) for found in by_room.values() if found][:count]
    rest = [place for place in rest if place not in chosen]
    chosen += chance.sample(rest, min(count - len(chosen), len(rest)))
    chosen.sort(key=lambda place: (place["room"], place["file"], place["start"]))
    out.write_text("".join(json.dumps(place) + "\n" for place in chosen))
    print(f"{len(chosen)} of {total} places in {len(by_room)} rooms")


def importers(tree: Path, module: str) -> set[Path]:
    """Files that import a module, by any way, and its own."""
    direct: dict[str, set[str]] = {}
    files = {}
    for package in PACKAGES:
        for path in (tree / package).rglob("*.py"):
            name = ".".join(path.relative_to(tree).with_suffix("").parts)
            name = name if package == "cdpr_drake" else f"cdpr_drake.{name}"
            files[name] = path
            for node in ast.walk(ast.parse(path.read_bytes())):
                if isinstance(node, ast.ImportFrom) and node.module:
                    for one in (node.module, *(f"{node.module}.{a.name}" for a in node.names)):
                        direct.setdefault(one, set()).add(name)
    done, todo = {module}, [module]
    while todo:
        new = direct.get(todo.pop(), set()) - done
        done |= new
        todo += new
    return {files[name] for name in done if name in files}


def kernel_folders(tree: Path, path: Path) -> list[str]:
    """Names that numba gives to the folder of a file's kernels, in this tree."""
    folder = path.parent.relative_to(tree)
    ways = (folder, Path("cdpr_drake", folder))  # packages are linked into cdpr_drake
    hashes = (hashlib.sha1(os.path.join(tree, way).encode()).hexdigest() for way in ways)
    return [f"{folder.name}_{one}" for one in hashes]


class Bench:
    """A copy of this tree with tests of perhaps another one, in which mutants are tried."""

    def __init__(self, tree: Path, tests: Path, cache: Path | None) -> None:
        """Copies them; kernels of this tree that `cache` has need not be compiled again."""
        self.tree, self.cache = tree, tree / ".kernels"
        names = subprocess.run(
            ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True,
            text=True, check=True,
        ).stdout.splitlines()  # fmt: skip
        for name in names:
            if not name.startswith("tests/") and os.path.lexists(ROOT / name):
                (tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, tree / name, follow_symlinks=False)
        shutil.copytree(tests / "tests", tree / "tests", symlinks=True)
        self.cache.mkdir()
        for path in tree.glob("**/*.py") if cache else ():
            for ours, theirs in zip(
                kernel_folders(tree, path), kernel_folders(ROOT, ROOT / path.relative_to(tree)),
                strict=True,
            ):  # fmt: skip
                if (cache / theirs).is_dir() and not (self.cache / ours).exists():
                    shutil.copytree(cache / theirs, self.cache / ours)
        self.passed: set[Path] = set()

    def outcome(self, mutant: Place) -> str:
        """What became of a mutant: survived, killed: by what, or timeout."""
        path, files = self.tree / mutant["file"], self._files(mutant)
        new = [file for file in files if file not in self.passed]
        sound = self._tested(new, self.cache) if new else "survived"
        if sound != "survived":
            return f"not tried: without it {sound}"
        self.passed.update(new)
        raw, times = path.read_bytes(), path.stat()
        kernels = Path(tempfile.mkdtemp(dir=self.tree))
        shutil.copytree(self.cache, kernels, copy_function=os.link, dirs_exist_ok=True)
        if b"njit" in raw:
            module = ".".join(Path(mutant["file"]).with_suffix("").parts)
            module = module if module.startswith("cdpr_drake") else f"cdpr_drake.{module}"
            for one in importers(self.tree, module):
                for folder in kernel_folders(self.tree, one):
                    for kept in (kernels / folder).glob(f"{one.stem}.*"):
                        kept.unlink()
        try:
            path.write_bytes(raw[: mutant["start"]] + mutant["new"].encode() + raw[mutant["end"] :])
            return self._tested(files, kernels)
        finally:
            path.write_bytes(raw)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
            shutil.rmtree(kernels, ignore_errors=True)

    def _files(self, mutant: Place) -> list[Path]:
        """Files of tests, those that are likely to fail first."""
        room = (self.tree / tests_of(mutant["room"])).glob("test_*.py")
        module = ".".join(Path(mutant["file"]).with_suffix("").parts)
        texts = {file: file.read_text() for file in (self.tree / "tests").rglob("test_*.py")}
        named = [file for file, text in texts.items() if f"{module} import" in text]
        return sorted({*room, *named}, key=lambda file: (mutant["function"] not in texts[file],
                                                          file not in named, file))  # fmt: skip

    def _tested(self, files: list[Path], kernels: Path) -> str:
        process = subprocess.Popen(
            [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider",
             *map(str, files)],
            cwd=self.tree, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": str(self.tree), "NUMBA_CACHE_DIR": str(kernels),
                 "PYTHONDONTWRITEBYTECODE": "1"},
        )  # fmt: skip
        try:
            said, _ = process.communicate(timeout=LONGEST)
        except subprocess.TimeoutExpired:
            return "timeout"
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        failed = [row for row in said.splitlines() if row.startswith(("FAILED", "ERROR"))]
        if process.returncode == 0:
            return "survived"
        return f"killed: {failed[0]}" if failed else f"not tried: {said[-300:]}"


def run(drawn: Path, out: Path, tests: Path, cache: Path | None) -> None:
    """Tries those of the drawn ones that have no line in `out` yet."""
    rows = [json.loads(line) for line in drawn.read_text().splitlines()]
    done = len(out.read_text().splitlines()) if out.exists() else 0
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        bench = Bench(Path(folder).resolve(), tests.resolve(), cache)
        for mutant in rows[done:]:
            outcome = bench.outcome(mutant)
            with out.open("a") as kept:
                kept.write(json.dumps({**mutant, "outcome": outcome}) + "\n")
            print(f"{mutant['file']}:{mutant['line']}", outcome[:150], flush=True)


def table(drawn: Path, old: Path, new: Path) -> int:
    """Prints what became of each; 1 if one that the old tests killed is not killed by the new."""
    outcomes = [
        [json.loads(line)["outcome"].partition(":")[0] for line in file.read_text().splitlines()]
        for file in (old, new)
    ]
    rows = [json.loads(line) for line in drawn.read_text().splitlines()]
    for row, before, after in zip(rows, *outcomes, strict=True):
        what = f"`{row['old']}` -> `{row['new']}`"
        lost = "  LOST" if before == "killed" and after != "killed" else ""
        print(f"{row['file']}:{row['line']} {what} | {before} | {after}{lost}")
    killed = [sum(one == "killed" for one in side) for side in outcomes]
    lost = sum(a == "killed" != b for a, b in zip(*outcomes, strict=True))
    print(f"{len(rows)} mutants: old {killed[0]}, new {killed[1]} killed; {lost} lost")
    return int(lost > 0)


def main() -> int:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    verbs.add_parser("rooms")
    one = verbs.add_parser("draw")
    one.add_argument("out", type=Path)
    one.add_argument("--count", type=int, default=80)
    one.add_argument("--seed", type=int, default=0)
    one.add_argument("--room", action="append", default=[])
    one = verbs.add_parser("run")
    one.add_argument("drawn", type=Path)
    one.add_argument("out", type=Path)
    one.add_argument("--tests", type=Path, default=ROOT, help="a tree whose tests are taken")
    one.add_argument("--cache", type=Path, help="a folder of compiled kernels of this tree")
    one = verbs.add_parser("table")
    for name in ("drawn", "old", "new"):
        one.add_argument(name, type=Path)
    asked = vars(parser.parse_args())
    verb = asked.pop("verb")
    if verb == "rooms":
        print("\n".join(rooms()))
    elif verb == "draw":
        draw(asked["out"], asked["count"], asked["seed"], asked["room"])
    elif verb == "run":
        run(**asked)
    else:
        return table(**asked)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
