"""RELIABILITY.md and SECURITY.md: each promise names a test that is there and runs; what the code may not do."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from tests.support.sources import trees

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("RELIABILITY.md", "SECURITY.md")
ROW = re.compile(r"^\| (?P<promise>[^|]+) \| `(?P<file>tests/[\w/]+\.py)::(?P<test>\w+)` \|$", re.MULTILINE)


def rows(page):
    return [match.groups() for match in ROW.finditer((ROOT / page).read_text("utf-8"))]


def always_skipped(function):
    """Whether a decorator skips a test without asking for a reason that may be absent: skip, skipif(True)."""
    words = [ast.unparse(decorator) for decorator in function.decorator_list]
    return any(re.search(r"mark\.skip\b|mark\.skipif\(True|mark\.xfail\b", word) for word in words)


@pytest.mark.parametrize("page", PAGES)
def test_every_promise_names_a_test_that_runs(page):
    found = rows(page)
    tables = [line for line in (ROOT / page).read_text("utf-8").splitlines() if line.startswith("| ")]
    assert len(found) == len(tables) - tables.count("| promise | test |") >= 10  # every row has its test
    for promise, file, test in found:
        assert promise.endswith("."), promise
        tree = ast.parse((ROOT / file).read_text("utf-8"))
        functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
        assert test in functions, f"{file} has no {test}"
        assert not always_skipped(functions[test]), f"{file}::{test} never runs"


def test_it_sees_what_never_runs():
    for text, never in (
        ("@pytest.mark.skip\ndef f(): ...", True),
        ("@pytest.mark.skip(reason='x')\ndef f(): ...", True),
        ("@pytest.mark.skipif(True, reason='x')\ndef f(): ...", True),
        ("@pytest.mark.skipif(os.name == 'nt', reason='x')\ndef f(): ...", False),
        ("@pytest.mark.long\ndef f(): ...", False),
    ):
        assert always_skipped(ast.parse(text).body[0]) == never


RUNS = {"eval", "exec", "__import__"}  # what makes code of text
UNPICKLES = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "shelve", "marshal", "yaml"}
SPEAKS = {"socket", "socketserver", "urllib", "http", "requests", "httpx", "aiohttp", "ftplib", "smtplib", "uvicorn"}
MAY_UNPICKLE = {"compiled/entries.py"}  # machine code that it wrote itself: SECURITY.md says so
MAY_SPEAK = {"cli/watch.py", "driving/senders.py"}  # UDP, where its user says so; the studio has its own tests


def imported(tree):
    """First words of all modules that a file imports, wherever."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name.partition(".")[0] for name in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield (node.module or "").partition(".")[0]


CALLS = {*RUNS, "system", "popen", "load", "read_pickle"}  # a call of another name is a risk by its `shell` only


def called(tree):
    """(name, keywords) of every call of a plain name or an attribute that may be a risk."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name = getattr(node.func, "id", None) or getattr(node.func, "attr", "")
            if name in CALLS or any(word.arg == "shell" for word in node.keywords):
                yield ast.unparse(node.func), name, {word.arg: ast.unparse(word.value) for word in node.keywords}


@cache
def findings():
    """Of every file of the package what could run a file of the user's, and what it imports. Each is read once."""
    return {name: (risks(tree), set(imported(tree))) for name, tree in trees().items()}


def risks(tree):
    """What in a file could run what a file of the user's holds."""
    found = {f"import {name}" for name in imported(tree) if name in UNPICKLES}
    for full, name, words in called(tree):
        if full in RUNS or words.get("shell") == "True" or full in ("os.system", "os.popen"):
            found.add(full)
        if full in ("np.load", "numpy.load") and words.get("allow_pickle") != "False":
            found.add(full)
        if name == "read_pickle":
            found.add(full)
    return found


def test_no_module_can_run_what_a_file_holds():
    assert {name: found for name, (found, _) in findings().items() if found} == {
        name: {"import pickle"} for name in MAY_UNPICKLE
    }


@pytest.mark.parametrize(
    "text",
    [
        "import pickle",
        "def f():\n    from yaml import load",
        "eval(x)",
        "exec(x)",
        "__import__(x)",
        "os.system(x)",
        "os.popen(x)",
        "np.load(x)",
        "pandas.read_pickle(x)",
        "run(x, shell=True)",
    ],
)
def test_it_sees_what_could(text):
    assert risks(ast.parse(text))


def test_no_module_speaks_to_the_network():
    found = {name for name, (_, named) in findings().items() if SPEAKS & named and not name.startswith("studio/")}
    assert found == MAY_SPEAK
