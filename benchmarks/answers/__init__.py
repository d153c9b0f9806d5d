"""The same answers: 360 commands and calls of the public API, recorded, and compared to the last digit.

    python -m benchmarks answers --record before.json
    python -m benchmarks answers --against before.json     # runs them again; exit code 1 where a number differs
    python -m benchmarks answers --against before.json --words     # shows where only words differ, too
    python -m benchmarks answers --compare before.json after.json
    PYTHONPATH=/other/checkout/src python -m benchmarks answers --record other.json

Only the command line (as `python -m omnidyn`, in this process) and public names of omnidyn are used, so that one and
the same script runs on any state of the code. Inputs are made here, rounded to 9 digits, so that a last digit of the
simulation does not pass for a difference of the fit. Real logs come from OMNIDYN_DATA; their cases are skipped without.
Numbers are told from words: values of calls, of JSON and of files; numbers in text for people are a kind of their own,
for a sentence may leave one out. Lines of progress and the path of the folder are left out of what is compared; of
pictures only their names count.
Which cases there are: cases.py.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import difflib
import hashlib
import io
import json
import os
import platform
import re
import runpy
import shlex
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import omnidyn
from benchmarks.answers.cases import CALLS, COMMANDS
from benchmarks.answers.inputs import make_inputs

DIFFERS = 1
SAMPLES = 24  # of a long array or a long file that are kept beside its hash: they show where and how much it differs
LONG_ARRAY, LONG_TEXT = 60, 300
PICTURES = (".png", ".svg", ".pdf")
SHOWN = 40  # differences of one case

# ---- a value as plain JSON, no digit lost -----------------------------------------------------------------


def plain(value: Any) -> Any:
    """Numbers, text, arrays and what holds them; floats by their shortest digits, long arrays by hash and samples."""
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float | np.generic):
        return repr(value.item() if isinstance(value, np.generic) else value)
    if isinstance(value, np.ndarray):
        return _array(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return _public({field.name: getattr(value, field.name) for field in dataclasses.fields(value)})
    if hasattr(type(value), "model_fields"):
        return _public({name: getattr(value, name) for name in type(value).model_fields})
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return _public(value._asdict())
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in (sorted(value, key=str) if isinstance(value, set | frozenset) else value)]
    if isinstance(value, Path):
        return str(value)
    return _public(vars(value)) if hasattr(value, "__dict__") and not callable(value) else type(value).__name__


def _public(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {name: plain(value) for name, value in fields.items() if not name.startswith("_")}


def _array(value: np.ndarray) -> Any:
    if value.size <= LONG_ARRAY:
        return [plain(item) for item in value.tolist()]
    flat = np.ascontiguousarray(value)
    every = max(1, value.size // SAMPLES)
    return {
        "shape": list(value.shape),
        "sha256": hashlib.sha256(flat.tobytes()).hexdigest(),
        "samples": [plain(item) for item in flat.ravel()[::every].tolist()],
    }


# ---- what a command left -----------------------------------------------------------------------------------


def told(text: str, here: Path) -> Any:
    """What a stream or a file says: JSON as such with its digits kept, else its lines, the long ones in part."""
    text = _cleaned(text, here)
    if text.lstrip().startswith(("{", "[")):
        with contextlib.suppress(ValueError):
            return json.loads(text, parse_float=str)
    lines = text.splitlines()
    if len(lines) <= LONG_TEXT:
        return lines
    return {
        "lines": len(lines),
        "sha256": hashlib.sha256(text.encode()).hexdigest(),
        "samples": lines[:: max(1, len(lines) // SAMPLES)],
    }


def _cleaned(text: str, here: Path) -> str:
    text = text.replace(str(here), "<here>")
    text = re.sub(r"(?m)^omnidyn: .* \.\.\. \d+ s\n", "", text)  # progress
    text = re.sub(r"(?s)<svg\b.*?</svg>", "<picture/>", text)
    return re.sub(r"data:image/[a-z+]+;base64,[A-Za-z0-9+/=]+", "<picture/>", text)


def _stamps(here: Path) -> dict[str, tuple[int, int]]:
    """Path below the folder -> (size, time of its last change)."""
    files = sorted(path for path in here.rglob("*") if path.is_file())
    return {str(path.relative_to(here)): (path.stat().st_size, path.stat().st_mtime_ns) for path in files}


def _written(path: Path, here: Path) -> Any:
    if path.suffix in PICTURES:
        return "a picture" if path.stat().st_size else "an empty file"
    try:
        return told(path.read_text("utf-8"), here)
    except UnicodeDecodeError:
        return f"not text: begins with {path.read_bytes()[:4]!r}"


class Folder:
    """The temporary folder that all cases share: what a case wrote is told and taken away."""

    def __init__(self, here: Path, kept: Path):
        self.here, self.kept = here, kept
        self.before = _stamps(here)

    def outcome(self) -> dict[str, Any]:
        """The files that are new or changed, by name; the folder is as it was before, then."""
        after = _stamps(self.here)
        found = {name: _written(self.here / name, self.here) for name in after if after[name] != self.before.get(name)}
        gone = [name for name in self.before if name not in after]
        for name in found:
            (self.here / name).unlink()
        for name in (*found, *gone):
            if name in self.before:
                shutil.copy2(self.kept / name, self.here / name)
        for folder in sorted((p for p in self.here.rglob("*") if p.is_dir()), reverse=True):
            if not any(folder.iterdir()):
                folder.rmdir()
        return found | dict.fromkeys(gone, "removed")


def run_command(line: str, here: Path) -> dict[str, Any]:
    """One command line in this process: exit code, stdout, stderr."""
    out, err, kept = io.StringIO(), io.StringIO(), (sys.argv, sys.stdin, sys.__stdout__)
    code: Any = 0
    sys.argv, sys.stdin = ["omnidyn", *shlex.split(line)], io.StringIO("")
    sys.__stdout__ = out  # type: ignore[misc]  # a command that cannot write silences it
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            runpy.run_module("omnidyn", run_name="__main__")
    except SystemExit as end:
        code = end.code
    finally:
        sys.argv, sys.stdin, sys.__stdout__ = kept  # type: ignore[misc]
    return {"code": code, "stdout": told(out.getvalue(), here), "stderr": told(err.getvalue(), here)}


def run_call(text: str, here: Path) -> dict[str, Any]:
    """One expression over the public names: its value, or its error."""
    names = {name: getattr(omnidyn, name) for name in omnidyn.__all__} | {"np": np, "Path": Path}
    try:
        value = plain(eval(text, names))
    except omnidyn.OmnidynError as error:
        return {"error": type(error).__name__, "says": _cleaned(str(error), here)}
    except (TypeError, ValueError) as error:  # a wrong call, refused by Python
        return {"error": type(error).__name__, "says": str(error)}
    return {"value": value}


# ---- all cases ---------------------------------------------------------------------------------------------


def cases() -> Iterator[tuple[str, Callable[[Path], Any]]]:
    """(name, what runs it). The commands of one line, between &&, run one after the other."""
    for line in COMMANDS:
        yield f"omnidyn {line}", lambda here, line=line: [run_command(each, here) for each in line.split(" && ")]
    for text in CALLS:
        yield text, lambda here, text=text: run_call(text, here)


def record(pattern: str = "") -> dict[str, Any]:
    """Run all cases whose name matches: {"made": about this recording, "cases": name -> outcome}."""
    done: dict[str, Any] = {}
    seconds: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(Path(folder).resolve()):
        here = Path.cwd() / "here"
        here.mkdir()
        os.chdir(here)
        skipped = make_inputs()
        shutil.copytree(here, here.parent / "kept")
        place = Folder(here, here.parent / "kept")
        for name, run in cases():
            if not re.search(pattern, name):
                continue
            assert name not in done, f"two cases of one name: {name}"
            if any(word in name for word in skipped):
                done[name] = {"skipped": "the real logs are not there: set OMNIDYN_DATA"}
                continue
            start = time.perf_counter()
            done[name] = {"outcome": run(here), "files": place.outcome()}
            seconds[name] = round(time.perf_counter() - start, 2)
            print(f"\r{len(done)} cases, {sum(seconds.values()):.0f} s", end="", file=sys.stderr, flush=True)
        os.chdir(here.parent)
    print(file=sys.stderr)
    package = Path(omnidyn.__file__).resolve().parent
    made = {"package": str(package), "python": platform.python_version(), "numpy": np.__version__, "seconds": seconds}
    return {"made": made, "cases": done}


# ---- comparison --------------------------------------------------------------------------------------------


NUMBERS, SHOWN_NUMBERS, WORDS = "numbers", "numbers shown", "words"  # what differs
FIGURE = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?", re.IGNORECASE)
DATA_FILE = r"\.(csv|toml|c|h|hpp|xml|yaml|urdf|java|py)\b"
TEXT = ("stdout", "stderr", ".html", ".md", "says")  # parts of a path below which text is written for people


class Difference(NamedTuple):
    """One place where two recordings of a case differ. kind: NUMBERS, SHOWN_NUMBERS (in text for people) or WORDS."""

    kind: str
    words: str


def differences(old: Any, new: Any, path: str = "") -> Iterator[Difference]:
    """Every place where two recordings of a case differ. A number that is only after is none of the old numbers."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys((*old, *new)):
            if key in old and key in new:
                yield from differences(old[key], new[key], f"{path}/{key}")
            else:
                lost = key in old and any(map(_is_number, _leaves(old[key])))
                yield Difference(
                    NUMBERS if lost else WORDS, f"{path}/{key}: only {'before' if key in old else 'after'}"
                )
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for k, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from differences(one, other, f"{path}[{k}]")
    elif isinstance(old, list) and isinstance(new, list):
        kind = _kind(old, new, path)
        lines = difflib.ndiff([_shown(each) for each in old], [_shown(each) for each in new])
        yield from (Difference(kind, f"{path}: {line}") for line in lines if line[:1] in "+-")
    elif old != new or type(old) is not type(new):
        yield Difference(_kind(old, new, path), f"{path}: {_shown(old)} -> {_shown(new)}{_relative(old, new)}")


def _kind(old: Any, new: Any, path: str) -> str:
    """What differs between two values that are not alike in form, or two leaves."""
    before, after = ([leaf for leaf in _leaves(value) if _is_number(leaf)] for value in (old, new))
    if before and before != (after if len(before) == len([*_leaves(old)]) else after[: len(before)]):
        return NUMBERS
    figures = [[figure for leaf in _leaves(value) for figure in FIGURE.findall(str(leaf))] for value in (old, new)]
    if not figures[0] or figures[0] == figures[1]:
        return WORDS
    for_people = any(part in path for part in TEXT) or (" " in str(old) and not re.search(DATA_FILE, path))
    return SHOWN_NUMBERS if for_people else NUMBERS


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _leaves(item)
    else:
        yield value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) or (isinstance(value, str) and FIGURE.fullmatch(value) is not None)


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)[:300]


def _relative(old: Any, new: Any) -> str:
    try:
        a, b = float(old), float(new)
        return f"  (by {abs(b - a) / abs(a):.1e} of it)" if a else ""
    except (TypeError, ValueError):
        return ""


def tell(old: Mapping[str, Any], new: Mapping[str, Any], kinds: Collection[str]) -> int:
    """Print every difference of two recordings of these kinds; the number of cases whose numbers differ."""
    one, other = old["cases"], new["cases"]
    skipped = [name for name in other if name in one and ("skipped" in one[name] or "skipped" in other[name])]
    ran = [name for name in other if name in one and name not in skipped]
    counts = dict.fromkeys((NUMBERS, SHOWN_NUMBERS, WORDS), 0)
    for name in ran:
        found = list(differences(one[name], other[name]))
        for kind in {each.kind for each in found}:
            counts[kind] += 1
        wanted = sorted((each for each in found if each.kind in kinds), key=lambda each: each.kind != NUMBERS)
        if wanted:
            print(name, *(f"    {each.kind} {each.words}" for each in wanted[:SHOWN]), sep="\n")
        if len(wanted) > SHOWN:
            print(f"    ... {len(wanted)} differences of this case")
    alone = [name for name in (*one, *other) if (name in one) != (name in other)]
    for name in alone:
        print(f"only {'before' if name in one else 'after'}: {name}")
    print(f"{len(ran)} cases in both; {len(skipped)} skipped, {len(alone)} in one only")
    print("; ".join(f"{kind} differ in {count}" for kind, count in counts.items()))
    return counts[NUMBERS]


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks answers", description="The same answers, or which not.")
    parser.add_argument("--record", metavar="FILE", help="run all cases and write what they answer")
    parser.add_argument("--against", metavar="FILE", help="run all cases and compare with a recording")
    parser.add_argument("--compare", nargs=2, metavar="FILE", help="compare two recordings")
    parser.add_argument("--only", default="", metavar="REGEX", help="cases whose name matches")
    parser.add_argument("--list", action="store_true", help="the names of all cases")
    parser.add_argument("--words", action="store_true", help="show differences of words, too")
    asked = parser.parse_args(arguments)
    kinds = (NUMBERS, SHOWN_NUMBERS, WORDS) if asked.words else (NUMBERS, SHOWN_NUMBERS)
    if asked.list:
        print(*(name for name, _ in cases() if re.search(asked.only, name)), sep="\n")
        return 0
    if asked.compare:
        old, new = (json.loads(Path(name).read_text("utf-8")) for name in asked.compare)
        return DIFFERS if tell(old, new, kinds) else 0
    if not (asked.record or asked.against):
        parser.error("what to do: --record, --against, --compare or --list")
    os.environ.update(COLUMNS="110", LC_ALL="C.UTF-8", NO_COLOR="1")
    old = json.loads(Path(asked.against).read_text("utf-8")) if asked.against else None
    out = Path(asked.record).resolve() if asked.record else None
    new = record(asked.only)
    if out:
        out.write_text(json.dumps(new, indent=1, ensure_ascii=False), "utf-8")
    if old is None:
        return 0
    if asked.only:
        old["cases"] = {name: case for name, case in old["cases"].items() if re.search(asked.only, name)}
    return DIFFERS if tell(old, new, kinds) else 0
