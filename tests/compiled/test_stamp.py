"""The stamp of a kernel: an edit recompiles what it must, and nothing else."""

import ast
import importlib
import json
import os
import pkgutil
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numba
import pytest
from numba.core.dispatcher import Dispatcher

import omnidyn
from omnidyn.compiled import stamp
from omnidyn.compiled.entries import Entries
from tests.support.sampling import spread
from tests.support.sources import trees

PACKAGE = Path(omnidyn.__file__).resolve().parent
FILES = sorted(PACKAGE.rglob("*.py"))


def forget():
    for each in (stamp.reach, stamp.read, stamp._passed, stamp.tools):
        each.cache_clear()


@pytest.fixture
def fresh(monkeypatch):
    """Nothing is remembered before or after; returns how to move the package to another folder."""
    forget()
    yield lambda folder: monkeypatch.setattr(stamp, "PACKAGE", str(folder))
    forget()


def kernel_in(file, name="f", line=1):
    """What `stamp` looks at of a function."""
    return SimpleNamespace(__code__=SimpleNamespace(co_filename=str(file), co_qualname=name, co_firstlineno=line))


# ---- which files: by three other ways ---------------------------------------------------------------------


def module_of(file):
    return ".".join(("omnidyn", *file.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")


def carried_out(dotted):
    """Files of the package that run when a dotted name is imported."""
    found, place = {PACKAGE / "__init__.py"}, PACKAGE
    for name in dotted.split(".")[1:]:
        place /= name
        found |= {file for file in (place.with_suffix(".py"), place / "__init__.py") if file.exists()}
    return found


def imports(tree):
    """Dotted names that a syntax tree imports, what is for type checkers left out."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            assert not node.orelse
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "stamp.py knows no relative imports"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and "import_module" in (
            getattr(node.func, name, "") for name in ("attr", "id")
        ):
            yield from [node.args[0].value] if isinstance(node.args[0], ast.Constant) else []
        yield from imports(node)


@cache
def graph():
    """File -> the files that it imports."""
    found = {}
    for file in FILES:
        tree = trees()[file.relative_to(PACKAGE).as_posix()]
        names = {name for name in imports(tree) if name.split(".")[0] == "omnidyn"}
        found[file] = set().union(*map(carried_out, names))
    return found


def closure(file):
    found = carried_out(module_of(file))
    while new := set().union(*(graph()[each] for each in found)) - found:
        found |= new
    return found


def test_imports_found_by_pattern_are_those_of_the_syntax_tree():
    by_pattern = {file: {Path(each) for each in stamp.read(str(file))[1]} - {file} for file in FILES}
    assert by_pattern == {file: imported - {file} for file, imported in graph().items()}


@pytest.mark.parametrize(
    "text, found",
    [
        ("import omnidyn", "__init__"),
        ("import omnidyn.errors as e", "__init__ errors"),
        ("from omnidyn import errors, run", "__init__ errors run"),
        ("from omnidyn import load_robot", "__init__"),
        ("from omnidyn.model.frames import (\n    a,  # one (two\n    b,\n)\n", "__init__ model/__init__ model/frames"),
        ("def f():\n    from omnidyn.model import frames", "__init__ model/__init__ model/frames"),
        ("import_module('x')\nimportlib.import_module(\"omnidyn.units\")", "__init__ units"),
        ("x = 1\nif TYPE_CHECKING:\n    from omnidyn.run import Run\n\n    from omnidyn import cli\ny = 1", ""),
        ("x = 1\nif TYPE_CHECKING:\n    from omnidyn.run import Run\nfrom omnidyn import units", "__init__ units"),
        ("# see omnidyn.errors", ""),
        ('TABLE = {"a": "omnidyn.errors"}', ""),
        ("import omnidynamo\nfrom numba import omnidyn", ""),
    ],
)
def test_what_is_an_import(text, found):
    assert stamp.imported(text) == {str(PACKAGE / f"{name}.py") for name in found.split()}


def kernels():
    """Name -> compiled function of every entry point of the package."""
    found = {}
    for info in pkgutil.walk_packages([str(PACKAGE)], "omnidyn."):
        if not info.name.endswith("__main__"):
            for value in vars(importlib.import_module(info.name)).values():
                if isinstance(value, Dispatcher) and isinstance(value._cache, Entries):
                    found[f"{value.py_func.__module__}.{value.py_func.__qualname__}"] = value
    return found


def test_all_that_a_kernel_calls_stands_in_a_file_of_its_stamp():
    """Through globals and cells, from function to function."""
    met = set()
    for name, kernel in kernels().items():
        files, left, seen = stamp.reach(kernel.py_func.__code__.co_filename), [kernel], set()
        while left:
            function = left.pop().py_func
            seen.add(function)
            assert function.__code__.co_filename in files, f"{name} calls {function.__qualname__}"
            cells = [cell.cell_contents for cell in function.__closure__ or ()]
            named = [function.__globals__[key] for key in function.__code__.co_names if key in function.__globals__]
            left += [each for each in [*cells, *named] if isinstance(each, Dispatcher) and each.py_func not in seen]
        met |= seen
    assert len(met) > 100


LOADED = """
import importlib, json, sys
from pathlib import Path
import omnidyn.compiled.kernel
found = {}
for name in sys.argv[1:]:
    for each in [each for each in sys.modules if each.split(".")[0] == "omnidyn"]:
        del sys.modules[each]
    importlib.import_module(name)
    found[name] = [m.__file__ for n, m in sys.modules.items() if n.split(".")[0] == "omnidyn"]
json.dump(found, sys.stdout)
"""


MOST_REACHED = 0.12  # of the files of the package


def test_all_that_python_loads_for_a_kernel_is_in_its_stamp():
    names = sorted({kernel.py_func.__module__ for kernel in kernels().values()})
    done = subprocess.run(
        [sys.executable, "-c", LOADED, *names],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTHONPATH": str(PACKAGE.parent)},
    )
    package = len(list(PACKAGE.rglob("*.py")))
    for name, files in json.loads(done.stdout).items():
        reach = stamp.reach(str(PACKAGE.parent.joinpath(*name.split(".")).with_suffix(".py")))
        assert set(files) <= reach, name
        assert len(reach) < MOST_REACHED * package, f"{name} depends on {len(reach)} of {package} files"


# ---- what an edit recompiles ------------------------------------------------------------------------------


def test_each_file_edited_in_turn_changes_the_stamps_that_reach_it(tmp_path, fresh, monkeypatch, draws):
    monkeypatch.setattr(stamp, "imported", cache(stamp.imported))  # of a text: it takes most of the time
    copy = tmp_path / "omnidyn"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    fresh(copy)
    homes = sorted({Path(kernel.py_func.__code__.co_filename) for kernel in kernels().values()})
    needs = {home: closure(home) for home in homes}

    def stamps():
        forget()
        return {home: stamp.stamp(kernel_in(copy / home.relative_to(PACKAGE))) for home in homes}

    before = stamps()
    touched = set()
    for place in sorted(spread(len(FILES), draws(len(FILES)))):
        file = FILES[place]
        edited = copy / file.relative_to(PACKAGE)
        content = edited.read_bytes()
        edited.write_bytes(content + b"# a comment\n")
        changed = {home for home, value in stamps().items() if value != before[home]}
        edited.write_bytes(content)
        assert changed == {home for home in homes if file in needs[home]}, file
        touched |= {file} if changed else set()
    assert stamps() == before
    folders = {file.relative_to(PACKAGE).parts[0] for file in touched}
    assert not folders & {"cli", "report", "paper", "comparison", "__main__.py", "files.py", "units.py"}
    assert {"__init__.py", "compiled", "model", "simulation", "identification"} <= folders


def test_the_stamp_covers_names_and_contents(tmp_path, fresh):
    fresh(tmp_path)
    home = tmp_path / "k.py"
    home.write_text("from omnidyn.a import b, c\n")
    (tmp_path / "a").mkdir()
    (tmp_path / "__init__.py").touch()

    def now(name="f", line=1):
        forget()
        return stamp.stamp(kernel_in(home, name, line))

    seen = [now(), now("g"), now(line=2)]
    for edit in (
        "a/__init__.py:",
        "a/__init__.py:b = 1",
        "a/b.py:b = 1",
        "a/c.py:b = 1",
        "a/c.py:b = 2",
        "__init__.py:x",
        "k.py:from omnidyn.a import b, c\nx",
    ):
        name, _, content = edit.partition(":")
        (tmp_path / name).write_text(content)
        seen.append(now())
    assert len(set(seen)) == len(seen) == 10
    (tmp_path / "a" / "d.py").write_text("not imported")
    assert now() == seen[-1]
    (tmp_path / "a" / "b.py").rename(tmp_path / "a" / "d.py")
    assert now() not in seen


@pytest.mark.parametrize("what, name", [(numba, "__version__"), *((numba.config, name) for name in stamp.SETTINGS)])
def test_the_stamp_covers_compiler_and_settings(monkeypatch, fresh, what, name):
    home = kernel_in(__file__)
    before = stamp.stamp(home)
    assert hasattr(what, name)
    monkeypatch.setattr(what, name, "another")
    stamp.tools.cache_clear()
    assert stamp.stamp(home) != before


def test_a_source_is_read_once_in_a_process():
    assert stamp.read(__file__) is stamp.read(__file__)
    assert len(stamp.stamp(kernel_in(__file__))) == 64


def test_where_there_is_no_source_there_is_no_stamp():
    with pytest.raises(OSError, match="nowhere"):
        stamp.stamp(kernel_in("/nowhere/at/all.py"))
