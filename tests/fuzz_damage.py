"""What may be wrong in a file: values, numbers and bytes that do not belong there."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from cdpr_drake.systems.scenarios.files import MECHANISM, scenario_kind

ROOT = Path(__file__).parent.parent
ROBOTS = sorted((ROOT / "models" / "robots").glob("*/robot.yaml"))
SCENARIOS = sorted((ROOT / "systems" / "scenarios").glob("*.yaml"))
ROBOT_SCENARIOS = [path for path in SCENARIOS if scenario_kind(str(path)) != MECHANISM]
CATALOGUES = {
    "cameras": sorted((ROOT / "models" / "cameras").glob("*.yaml")),
    "sensors": sorted((ROOT / "models" / "sensors").glob("*/*.yaml")),
}
NAN, INF = float("nan"), float("inf")

VALUES: list[Any] = [
    None, True, False, 0, -0.0, -1, 1, 3, 2**31, 2**63, 2**64, -(2**65), 10**400, 1e300, -1e300,
    1e-300, 5e-324, 1e9, 1e-9, NAN, INF, -INF, "", " ", "~", "null", "yes", "off", "1_000", "0x10",
    "1e3", "1 m", "5 deg", "60 N", "1.5kg", "1,5", "½", "\u22121", "\u0661\u0662", "nan", ".inf",
    "a/b", "../../x", "/etc/passwd", "~/x", ".", "..", "-rf", "x" * 5000, "é" * 300, "\u202eabc",
    "a\nb", "a\tb", "a\x00b", "\x1b[31mred", "$x$", "$\\frac{", "%s%n", "{}", "[bold]x[/nope]",
    "2026-01-01", "\ud7ff\U0001f916", [], [[]], [[[]]], {}, {"a": 1}, [1, 2], [1, 2, 3],
    [1, 2, 3, 4], [[1, 2, 3]], [NAN, 0, 0], [1e300, 0, 0], [INF] * 3, [None] * 3, ["a", "b", "c"],
    [0.1] * 500, [0, 0, 0], [-1e-320] * 3, list(range(8)), [[0.0] * 3] * 8, {"position": [0, 0, 0]},
    "robot.yaml", "acrobot_small", "pbvs", "projected", "motor", "rendered", "known_tag", "world",
]  # fmt: skip
"""What may stand where another value belongs."""

NUMBERS = [
    0, -0.0, 1, -1, 2, 7, 0.5, 90, 180, 360, 1e3, 1e4, 1e5, 1e6, 1e9, 1e12, 1e100, 1e300, -1e300,
    1e-3, 1e-6, 1e-9, 1e-12, 1e-100, 1e-300, 5e-324, -1e-9, 2**31, 2**53 + 1, 2**63, 10**400,
]  # fmt: skip
"""What may stand where another number belongs."""

JUNK = [
    b"\x00", b"\xff\xfe", b"\x80", b"\t", b"\x1b", b"\xe2\x80\xa8", b"\x85", b"&a", b"*a",
    b"!!binary x", b"!!python/object:os.system {}", b"{", b"]", b'"', b"'", b"|", b"<<: *a",
    b"---\n", b"...\n", b"%YAML 9.9\n", b"? ", b": ", b"- ", b"#", b"@", b"`", b'"\\UFFFFFFFF"',
    b"!<x> ",
]  # fmt: skip
"""What may get into a file."""


def _places(tree: Any, found: list[tuple[Any, Any]] | None = None) -> list[tuple[Any, Any]]:
    """All (container, key) of a tree of mappings and lists."""
    found = [] if found is None else found
    items = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in list(items):
        found.append((tree, key))
        if isinstance(value, (dict, list)):
            _places(value, found)
    return found


def change_tree(rng: random.Random, tree: Any) -> str:
    """Changes one place of a tree; returns what was done."""
    places = _places(tree)
    if rng.random() < 0.4:
        places = [(h, k) for h, k in places if type(h[k]) in (int, float)] or places
        holder, key = rng.choice(places)
        holder[key] = rng.choice(NUMBERS)
        return f"{key!r} is {holder[key]!r:.20}"
    holder, key = rng.choice(places)
    old = holder[key]
    kind = rng.choice(["value"] * 6 + ["delete", "rename", "swap", "add", "wrap", "number", "unit",
                                       "cut", "more"])  # fmt: skip
    if kind == "value":
        holder[key] = rng.choice(VALUES)
    elif kind == "delete":
        del holder[key]
    elif kind == "rename" and isinstance(holder, dict):
        new = rng.choice([str(key)[:-1], str(key).upper(), f"{key} ", None, 1, True, "", "x" * 999])
        holder[new] = holder.pop(key)
    elif kind == "swap":
        other, there = rng.choice(_places(tree))
        holder[key], other[there] = other[there], old
        if other is old or holder is other[there]:  # would contain itself
            holder[key] = None
    elif kind == "add" and isinstance(holder, dict):
        holder[rng.choice(["name", "kind", "extra", "mass", "pose", "1", "é"])] = rng.choice(VALUES)
    elif kind == "wrap":
        holder[key] = rng.choice([[old], {"value": old}, [old, old], [[old]], str(old)])
    elif kind == "number" and isinstance(old, (int, float)):
        holder[key] = rng.choice([-old, 10.0 ** rng.randint(-12, 12) * old, old + 1e-9, str(old)])
    elif kind == "unit":
        holder[key] = f"{old} {rng.choice(['m', 'mm', 'deg', 'N', 'kg', '%'])}"
    elif kind == "cut" and isinstance(old, list):
        holder[key] = old[: rng.randint(0, len(old))]
    elif kind == "more" and isinstance(old, list):
        holder[key] = old + old[: rng.randint(0, len(old))]
    else:
        holder[key] = rng.choice(VALUES)
    return f"{kind} of {key!r}"


def change_bytes(rng: random.Random, data: bytes) -> tuple[bytes, str]:
    """Changes the text of a file; returns what was done, too."""
    lines = data.split(b"\n")
    at, line = rng.randrange(len(data)), rng.randrange(len(lines))
    junk = rng.choice(JUNK)
    changes: dict[str, Callable[[], bytes]] = {
        "truncated": lambda: data[:at],
        "junk": lambda: data[:at] + junk + data[at:],
        "noise": lambda: data[:at] + rng.randbytes(rng.randint(1, 200)) + data[at:],
        "flipped": lambda: data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :],
        "line deleted": lambda: b"\n".join(lines[:line] + lines[line + 1 :]),
        "line twice": lambda: b"\n".join(lines[: line + 1] + lines[line:]),
        "lines swapped": lambda: b"\n".join(rng.sample(lines, len(lines))),
        "windows": lambda: data.replace(b"\n", b"\r\n"),
        "old mac": lambda: data.replace(b"\n", b"\r"),
        "tabs": lambda: data.replace(b"  ", b"\t"),
        "bom": lambda: b"\xef\xbb\xbf" + data,
        "utf-16": lambda: data.decode().encode("utf-16"),
        "latin-1": lambda: data + "title: é\n".encode("latin-1"),
        "empty": lambda: b"",
        "comment": lambda: b"# nothing\n",
        "scalar": lambda: b"42\n",
        "list": lambda: b"- 1\n- 2\n",
        "binary": lambda: rng.randbytes(2000),
        "deep": lambda: b"name: " + b"[" * 3000 + b"]" * 3000,
        "deepest": lambda: rng.choice([b"[", b"- ", b'{"a":', b"? ", b"!!set {"]) * 100_000,
        "merged": lambda: b"<<: &m {<<: *m}\n" + data,
        "merge bomb": lambda: MERGES + data,
        "python": lambda: data.replace(b": ", b": !!python/object/apply:os.system ", at % 9 + 1),
        "long number": lambda: _NUMBER.sub(LONG_NUMBER, data, count=at % 9 + 1),
        "long name": lambda: _WORD.sub(b"n" * 300, data, count=at % 9 + 1),
        "nul": lambda: data.replace(b"\n", b"\0", at % 9 + 1),
        "huge power": lambda: _NUMBER.sub(b"1e999999", data, count=at % 9 + 1),
        "keys twice": lambda: b"\n".join(each for each in lines for _ in range(2)),
        "long line": lambda: data.replace(b"\n", b" ", at % 99 + 1) + b"x" * 200_000,
        "utf-32": lambda: data.decode().encode("utf-32"),
        "half a bom": lambda: b"\xef\xbb" + data,
        "deeper keys": lambda: b"".join(b" " * k + b"a:\n" for k in range(900)),
        "itself": lambda: data + b"\nassumptions: &a [*a]\n",
        "own top": lambda: b"&a\n" + data + b"\nextra: *a\n",
        "bomb": lambda: b"a0: &a0 [1]\n" + b"".join(
            b"a%d: &a%d [%s]\n" % (k + 1, k + 1, b", ".join([b"*a%d" % k] * 9)) for k in range(9)
        ) + data,
        "documents": lambda: data + b"\n---\n" + data,
        "twice": lambda: data + b"\n" + data,
        "long": lambda: data + b"\ntitle: " + b"x" * 300_000 + b"\n",
        "many": lambda: data + b"\nassumptions: [" + b"1, " * 30_000 + b"]\n",
        "comments": lambda: data + b"# x\n" * 5000,
        "upper": lambda: data.upper(),
        "digits": lambda: data.replace(b"0", rng.choice([b"O", b"1", b"0x", b"-", b"", b"00"])),
    }  # fmt: skip
    name = rng.choice(list(changes))
    return changes[name](), name


LONG_NUMBER = b"9" * 5000

MERGES = b"m0: &m0 {a: 1, b: 2}\n" + b"".join(
    b"m%d: &m%d {<<: [%s]}\n" % (k, k, b", ".join([b"*m%d" % (k - 1)] * 30)) for k in range(1, 12)
)
"""Mappings that are merged over and over."""

BOMB = b"a0: &a0 [lol, lol]\n" + b"".join(
    b"a%d: &a%d [%s]\n" % (k, k, b", ".join([b"*a%d" % (k - 1)] * 10)) for k in range(1, 10)
)

ENTITIES = b"<!DOCTYPE z [<!ENTITY a0 'lol'>" + b"".join(
    b"<!ENTITY a%d '%s'>" % (k, b"&a%d;" % (k - 1) * 10) for k in range(1, 10)
) + b"]><robot><link>&a9;</link></robot>"  # fmt: skip

SIZES = [
    b"0", b"-1", b"1e300", b"-1e300", b"1e-300", b"nan", b"inf", b"", b"1 1", b"x", b"1e999",
    b"1e999999", b"2026-11-28", b".inf", b"-.inf", b"0o17", b"1_000", b"12:30:45", b"~", b"yes",
    LONG_NUMBER, b"1" * 400, b"0x10", b"\xc2\xbd", b"null", b"[]", b"{}", b"true", b"2147483648",
]  # fmt: skip
"""What may stand where a number belongs in any text: degenerate, huge, long, and none."""

_NUMBER = re.compile(rb"(?<![\w.+-])[+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?(?![\w.])")
_CELL = re.compile(rb"[^,;\t\n|]+")
_WORD = re.compile(rb"[A-Za-z_][\w-]*")


def change_text(rng: random.Random, data: bytes, ending: str) -> tuple[bytes, str]:
    """Changes a text of any format: its numbers, heads, names and bytes; and what was done."""
    kind = rng.choice(["number"] * 6 + ["cell", "cell", "name", "word gone", "bytes", "bomb"])
    if kind == "bytes":
        try:
            return change_bytes(rng, data)
        except UnicodeDecodeError:
            return data[: len(data) // 2], "half"
    if kind == "bomb":
        whole = {
            ".yaml": BOMB + b"points: *a9\nplatform: *a9\nkinematics: *a9\n",
            ".json": rng.choice([
                b'{"a": %s}' % LONG_NUMBER, b"[" * 100_000, b"[" * 500 + b"]" * 500,
                b'{"a":' * 100_000, b'{"a": 1e999999, "a": NaN}', data + data,
            ]),
        }.get(ending)  # fmt: skip
        return whole or rng.choice([ENTITIES, b"<a>" * 100_000, data * 3]), kind
    pattern = {"number": _NUMBER, "cell": _CELL, "name": _WORD, "word gone": _WORD}[kind]
    places = list(pattern.finditer(data))
    if kind == "cell":
        places = places[: max(60, len(places) // 50)]  # heads stand at the top
    if not places:
        return data[: len(data) // 2], "half"
    new = {"name": rng.choice([b"n" * 300, b"\x1b[31mred", b"../../x", b"a,b", b"a\nb", b"\x00",
                                b"\x9b2J", b"\xe2\x80\xae", b"\xc2\x9b2J", b"=1+1"]),
           "word gone": b"", "cell": rng.choice([b"", b"W", b"X", *SIZES])}.get(kind)  # fmt: skip
    for place in sorted(rng.sample(places, min(len(places), rng.choice([1, 1, 2, 9]))),
                        key=lambda found: -found.start()):  # fmt: skip
        put = rng.choice(SIZES) if new is None else new
        data = data[: place.start()] + put + data[place.end() :]
    return data, kind


def change(rng: random.Random, path: Path, edit: dict[str, Any] | None = None) -> tuple[bytes, str]:
    """Contents of a file with one or two changes; `edit` is set before."""
    tree = yaml.safe_load(path.read_text(encoding="utf-8")) | (edit or {})
    if rng.random() < 0.35:
        return change_bytes(rng, yaml.safe_dump(tree, sort_keys=False).encode())
    done = []
    if rng.random() < 0.3:  # a part of another file of the kind
        other = yaml.safe_load(rng.choice(_siblings(path)).read_text(encoding="utf-8"))
        key = rng.choice(list(other))
        tree[key] = other[key]
        done.append(f"{key} of {other.get('name')}")
    done += [change_tree(rng, tree) for _ in range(rng.choice([1, 1, 1, 1, 2, 3]))]
    return yaml.safe_dump(tree, sort_keys=False, allow_unicode=True).encode(), ", ".join(done)


def _siblings(path: Path) -> list[Path]:
    folders = (ROBOTS, SCENARIOS, *CATALOGUES.values())
    return next(files for files in folders if path in files)
