"""Tries random wrong files and options on the command line, and says what it should not have done.

    python -m tests.fuzz_inputs --count 2000 --seed 0

Every case runs `cdpr` in a process of its own, forked from this one, in an empty folder with
foreign files beside. Accepted: exit codes as README has them; with 2 one line on stderr, at most
500 characters, and nothing new on the disk; never a traceback or a warning of Python, never a
foreign file changed, never a process that dies by a signal or does not end. What takes long and has
nothing to do with input (studies, timings, rendering, most figures) is replaced by something short.
"""

from __future__ import annotations

import argparse
import gc
import hashlib
import json
import os
import pkgutil
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cdpr_drake
from cdpr_drake.analyses import installation, view
from cdpr_drake.analyses.frame.folder import LOCK
from cdpr_drake.analyses.runs.run import Run
from cdpr_drake.analyses.studies.study import STUDIES, Study
from cdpr_drake.analyses.workspaces.stability import Stability
from cdpr_drake.cli import app
from cdpr_drake.models import camera_catalogue, sensor_catalogue
from tests.fuzz_cases import COMMANDS as GOOD
from tests.fuzz_cases import Case, draw_case, lay_out
from tests.fuzz_cases import stability as ask_stability
from tests.messages import messages

LONGEST = 30.0
"""Time of a processor after which a case counts as one that hangs [s]."""

PATIENCE = 10.0
"""Times as much may pass on the wall, since other programs use the processors, too."""

MEMORY = 4 * 2**30
"""What a case may take beyond what it starts with [byte]."""

LONGEST_LINE = 500
CRASHED = 70
"""Exit code of an exception that reached nobody."""

CODES = {"doctor": {0, 1, 2}, "calibrate": {0, 2, 3, 6}, "identify": {0, 2, 3, 6}}
ANY_CODES = {0, 2, 3}
"""Accepted exit codes by command; 130 is for signals, which nobody sends here."""


def lighten() -> None:
    """Replaces what takes long by something short, in this process."""
    empty = {name: Study(name=name, title="", cases=lambda form: ()) for name in STUDIES}
    sys.modules["cdpr_drake.analyses.studies.empty"] = SimpleNamespace(STUDIES=empty)
    STUDIES.update(dict.fromkeys(STUDIES, "empty"))
    for module, name in (*PICTURES, (view, "time"), (installation, "CHECKS")):
        assert hasattr(module, name), f"{module.__name__} has no {name} to replace any more"
    installation.CHECKS = ()


def load_all() -> None:
    """Loads the package, so that a case neither loads it anew nor sees it edited meanwhile."""
    top = Path(cdpr_drake.__file__).parent
    for folder, folders, files in os.walk(top, followlinks=True):
        if folder == str(top):
            folders[:] = sorted(set(folders) - {"notebooks", "studio"})
        for name in sorted(files):
            words = (*Path(folder).relative_to(top).parts, name.removesuffix(".py"))
            if name.endswith(".py") and "__main__" not in words and "templates" not in words:
                with suppress(ImportError):  # of what is not installed
                    import_module(".".join(("cdpr_drake", *words)).removesuffix(".__init__"))


PICTURES = ((Run, "figures"), (Stability, "figures"))
"""What draws figures, by the module in which it is looked up."""


LONG_WORK = {
    "design": ["cdpr_drake.analyses.design.optimization.search_design"],
    "plan": ["cdpr_drake.analyses.planning.path_plan.plan_along_path"],
    "reconfigure": ["cdpr_drake.analyses.design.reconfiguration.results_folder"],
}
"""Where the long work of a command begins: all that it reads is read and accepted there."""


def _done(*given: Any, **more: Any) -> None:
    raise SystemExit(0)


def _no_sleep(seconds: float) -> None:
    raise KeyboardInterrupt


def child(case: Case, work: Path, base: Path, longest: float) -> None:
    """Runs a case in this process and ends it."""
    code = CRASHED
    try:
        os.setsid()
        os.chdir(work)
        for number, name in ((1, "stdout"), (2, "stderr")):
            file = os.open(
                base.parent / f"{base.name}.{name}", os.O_WRONLY | os.O_CREAT | os.O_TRUNC
            )
            os.dup2(file, number)
        size = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[0])
        limit = size * os.sysconf("SC_PAGE_SIZE") + MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (int(longest), int(longest) + 1))
        if not case.pictures:
            for module, name in PICTURES:
                setattr(module, name, lambda *given, **more: {})
        view.time = SimpleNamespace(sleep=_no_sleep)
        if case.catalogue:
            module = {"cameras": camera_catalogue, "sensors": sensor_catalogue}[case.catalogue]
            module._FOLDER = work / case.catalogue
        for target in LONG_WORK.get("".join(case.arguments[:1]), ()):
            place, _, name = target.rpartition(".")
            module = pkgutil.resolve_name(place)
            assert hasattr(module, name), target
            setattr(module, name, _done)
        app.main(case.arguments)
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else CRASHED
    except BaseException:
        traceback.print_exc()
    finally:
        try:
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(code)


def snapshot(base: Path) -> dict[str, str]:
    """Kind and contents of all below a folder, by path."""
    found = {}
    for folder, folders, files in os.walk(base):
        for name in [*folders, *files]:
            path = Path(folder, name)
            if path.is_symlink():
                kind = f"link {os.readlink(path)}"
            elif path.is_file():
                kind = hashlib.sha256(path.read_bytes()).hexdigest()
            else:
                kind = "folder" if path.is_dir() else "other"
            found[str(path.relative_to(base))] = kind
    return found


MINE = "work/mine"
"""The program's own results, which `--overwrite` may replace."""


def judge(case: Case, status: int | None, out: str, err: str, before: dict[str, str],
          after: dict[str, str]) -> Iterator[str]:  # fmt: skip
    """What a case should not have done, each as "kind: words"; status None: it did not end."""
    ended_by = os.WTERMSIG(status) if status is not None and os.WIFSIGNALED(status) else 0
    if status is None or ended_by == signal.SIGXCPU:
        if "%" not in err:  # who says how far it is may take its time
            yield f"hang: {err[-200:]!r}"
    elif ended_by:
        yield f"signal: {signal.Signals(ended_by).name}: {err[-200:]!r}"
    code = os.WEXITSTATUS(status) if status is not None and os.WIFEXITED(status) else None
    if code == CRASHED or "Traceback" in err + out:
        yield f"traceback: {(err.strip() or '?').splitlines()[-1][:200]}"
    elif code is not None and code not in CODES.get("".join(case.arguments[:1]), ANY_CODES):
        yield f"code: {code}: {err[:200]}"
    if "\x1b" in out + err:
        yield f"escape: {(out + err)[:300]!r}"
    if re.search(r"[a-z]Warning: ", err):  # Python's; Drake has the word alone
        yield f"warning: {err.strip()[:300]}"
    changed = [p for p, kind in before.items() if after.get(p) != kind and not p.startswith(MINE)]
    if changed:
        yield f"deleted: {changed}"
    new = [p for p in after if p not in before]
    half = [
        p for p in new if Path(p).name != LOCK
        and (Path(p).name.startswith(".part-") or "-work-" in p or ".lock" in p)
    ]  # fmt: skip
    if half and status is not None:
        yield f"half: {half[:4]}"
    if code == 2:
        own = [p for p, kind in before.items() if after.get(p) != kind]
        if new or own:
            yield f"left: {(new + own)[:4]}"
        said = messages(err).strip()
        helped = not case.arguments or ("Usage" in out and not said)
        lines = said.split("\n")
        if case.arguments[:1] == ["check"] and not said:
            lines = out.strip().split("\n")
        elif not helped and not all(line.startswith("cdpr: ") for line in lines):
            yield f"lines: {len(lines)}: {err[:300]!r}"
        if max(map(len, lines)) > LONGEST_LINE:
            yield f"long: {max(map(len, lines))} characters: {err[:200]!r}"
        if not all(line.isprintable() for line in lines):
            yield f"unprintable: {err[:200]!r}"
    if code == 3:
        yield f"incomplete: {err.strip()[:300]}"


def run_case(case: Case, root: Path, longest: float = LONGEST) -> tuple[list[str], float, str]:
    """Runs a case in a process of its own.

    Returns:
        What it should not have done, how long it took [s], and what it said on stderr.
    """
    base = Path(tempfile.mkdtemp(dir=root))
    work = lay_out(case, base)
    before, began = snapshot(base), time.monotonic()
    sys.stdout.flush()
    number = os.fork()
    if number == 0:
        child(case, work, base, longest)
    status = None
    while status is None and time.monotonic() - began < PATIENCE * longest:
        ended, code = os.waitpid(number, os.WNOHANG)
        if ended:
            status = code
        else:
            time.sleep(0.005)
    passed = time.monotonic() - began
    if status is None:
        os.killpg(number, signal.SIGKILL)
        os.waitpid(number, 0)
    said = {}
    for name in ("stdout", "stderr"):
        file = base.parent / f"{base.name}.{name}"
        said[name] = file.read_text(encoding="utf-8", errors="replace") if file.exists() else ""
        file.unlink(missing_ok=True)
    found = list(judge(case, status, said["stdout"], said["stderr"], before, snapshot(base)))
    shutil.rmtree(base)
    return found, passed, said["stderr"]


def warm_up(commands: Sequence[Sequence[str]]) -> None:
    """Loads and compiles what most cases need, so that they find it when they are forked."""
    here, shown = Path.cwd(), (sys.stdout, sys.stderr)
    with Path(os.devnull).open("w", encoding="utf-8") as nothing:
        sys.stdout = sys.stderr = nothing
        try:
            for command in commands:
                with tempfile.TemporaryDirectory() as folder:
                    os.chdir(folder)
                    try:
                        app.main([*command])
                    except SystemExit as end:
                        assert end.code == 0, command  # noqa: PT017
                    finally:
                        os.chdir(here)
        finally:
            sys.stdout, sys.stderr = shown


WARM = [words for words in GOOD if words[0] in ("simulate", "tension", "static", "stability")]
"""What needs kernels; and no Meshcat, whose threads would not survive a fork."""

FEW = 200
"""With fewer cases only what most of them need is loaded before, and stability is left out."""


def main() -> int:
    """Runs cases, prints what was found, and returns 1 if anything was."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--longest", type=float, default=LONGEST, help="time limit of a case [s]")
    parser.add_argument("--show", action="store_true", help="print every case")
    given = parser.parse_args()
    load_all()
    lighten()
    certified = ask_stability("acrobot_small", "certified")
    few = given.count < FEW
    warm_up(GOOD[:1] + GOOD[4:5] if few else [*WARM, certified])
    gc.collect()
    gc.freeze()  # else each case searches all of it for garbage, and so copies it
    counts, codes, slowest = Counter[str](), 0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        for number in range(given.first, given.first + given.count):
            case = draw_case(given.seed, number)
            if few and case.arguments[:1] == ["stability"]:  # whose kernels are not loaded
                continue
            found, passed, err = run_case(case, root, given.longest)
            slowest = max(slowest, passed)
            counts.update({each.partition(":")[0] for each in found})
            codes += bool(found)
            if found or given.show:
                command = json.dumps(case.arguments)[:300]
                print(f"{number} ({passed:.1f} s) {command} [{case.words}]", flush=True)
                for each in found or [err.strip()[:200]]:
                    print(f"    {each}", flush=True)
    print(f"{given.count} cases, {codes} with findings {dict(counts)}; slowest {slowest:.1f} s")
    return 1 if codes else 0


if __name__ == "__main__":
    sys.exit(main())
