"""What is compiled, and how: never stale, never in the way.

numba looks only at the file of the kernel itself: edit a formula that a kernel calls from another file, and the old
machine code is served without a word. `kernel` stamps every cache entry with a hash of all that it can reach. Here a
copy of the whole package is edited and run in fresh processes; the same formulas in plain Python are the truth.
"""

import ast
import importlib
import json
import os
import pkgutil
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numba.core.caching import NullCache
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaError

import omnidyn
from omnidyn.compiled.entries import Entries
from omnidyn.compiled.kernel import kernel, part
from omnidyn.compiled.stamp import stamp
from tests.support.sources import trees

PACKAGE = Path(omnidyn.__file__).parent

# Twist and heading of the paper's robot from the kernels of the exact engine, and from its formulas in plain Python.
SCRIPT = """
import json, sys
import numpy as np
from omnidyn.model.robot_file import load_robot
from omnidyn.model.dynamics import discretise, state_space
from omnidyn.simulation.exact import exact_march as exact
from omnidyn.simulation.exact.step import exact_step, pieces, turned_within
from omnidyn.simulation.simulate import simulate
robot, dt = load_robot("axebot"), 0.05
voltage = np.array([[3.0, -1.0, 2.5]] * 4 + [[-2.0, 4.0, 1.0]] * 4)
run = simulate(robot, voltage, dt)
system = state_space(robot)
levels = [level.tolist() for level in exact.axis_levels(robot, system)]
phi, drive = discretise(system, dt).tolist(), exact.drive_acceleration(system, voltage).tolist()
twist, heading = [], 0.0
for axis in range(3):
    a, c, s = (level[axis] for level in levels)
    speed = 0.0
    for row in drive:
        end = exact_step(speed, row[axis], c, s, a, phi[axis], 0.0)
        if axis == 2:
            event, before, after = pieces(speed, row[axis], c, s, a, phi[axis], dt)
            heading += turned_within(dt, speed, end, event, before, after, a)
        speed = end
    twist.append(speed)
hits = len(exact._run.stats.cache_hits) if hasattr(exact._run, "stats") else None
json.dump({"twist": run.twist[-1].tolist(), "heading": run.pose[-1, 2], "python twist": twist,
           "python heading": heading, "hits": hits, "x": run.pose[-1, 0]}, sys.stdout)
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the package in a folder of its own, with its own cache."""
    folder = tmp_path_factory.mktemp("copy")
    shutil.copytree(PACKAGE, folder / "omnidyn", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def fresh(folder, **environment):
    """The numbers of SCRIPT from a new process that uses the package in `folder`."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    clean |= {"PYTHONPATH": str(folder)} | environment
    done = subprocess.run([sys.executable, "-c", SCRIPT], env=clean, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def agrees_with_python(numbers):
    assert numbers["twist"] == pytest.approx(numbers["python twist"], rel=1e-13, abs=1e-15)
    assert numbers["heading"] == pytest.approx(numbers["python heading"], rel=1e-13)
    return True


@pytest.fixture(scope="module")
def before(copy):
    """The numbers of the copy as it is, with the cache that they leave behind."""
    return fresh(copy, NUMBA_CACHE_DIR=str(copy / "cache"))


def test_an_edited_formula_is_compiled_anew(copy, before):
    """exact/step.py is called by the kernel of exact/exact_march.py, whose own file stays untouched."""
    folder = {"NUMBA_CACHE_DIR": str(copy / "cache")}
    assert agrees_with_python(before)
    assert before["hits"] == 0
    again = fresh(copy, **folder)
    assert again["hits"] == 1, "the second process should find the machine code of the first"
    assert {**again, "hits": 0} == {**before, "hits": 0}
    formula = copy / "omnidyn" / "simulation" / "exact" / "step.py"
    text = formula.read_text()
    edited = text.replace("slid = x + phi *", "slid = x + phi * (1 + 1) *", 1)
    edited = edited.replace(
        "return (speed - now + before * t) / rate", "return 3 * (speed - now + before * t) / rate", 1
    )
    assert edited.count("(1 + 1)") == edited.count("3 * (speed") == 1, "exact/step.py reads differently now"
    formula.write_text(edited)
    try:
        after = fresh(copy, **folder)
    finally:
        formula.write_text(text)
    assert agrees_with_python(after)  # a stale _run would give the old numbers
    assert after["hits"] == 0
    for name in ("twist", "heading", "x"):
        assert after[name] != pytest.approx(before[name], rel=1e-3)


def test_without_a_writable_folder_it_compiles_in_memory(copy, tmp_path):
    """A file stands wherever numba would make a folder: works for root too, whom no permission stops."""
    shutil.copytree(copy / "omnidyn", tmp_path / "omnidyn", ignore=shutil.ignore_patterns("__pycache__"))
    for source in (tmp_path / "omnidyn").rglob("*.py"):
        (source.parent / "__pycache__").touch()
    blocked = tmp_path / "blocked"
    blocked.touch()
    homes = {name: str(blocked / "x") for name in ("HOME", "XDG_CACHE_HOME", "USERPROFILE", "LOCALAPPDATA", "APPDATA")}
    numbers = fresh(tmp_path, NUMBA_CACHE_DIR=str(blocked / "cache"), **homes)
    assert agrees_with_python(numbers)
    assert numbers["hits"] == 0
    assert not [path for path in tmp_path.rglob("*") if path.suffix in (".nbi", ".nbc", ".kernel")]


@pytest.mark.long
def test_a_numba_that_nobody_tried_gives_the_same_numbers(copy, before):
    """To the last bit; it goes its own way, and takes longer."""
    file = copy / "omnidyn" / "compiled" / "private.py"
    text = file.read_text()
    assert text.count("range(61, 69)") == 1, "private.py reads differently now"
    file.write_text(text.replace("range(61, 69)", "range(0)"))
    try:
        after = fresh(copy, NUMBA_CACHE_DIR=str(copy / "cache"))
    finally:
        file.write_text(text)
    assert after["hits"] == 0
    assert {**after, "hits": before["hits"]} == before


def test_with_all_that_is_private_switched_off_the_numbers_are_the_same(copy, before):
    """To the last bit, and nothing is kept on disk."""
    after = fresh(copy, NUMBA_CACHE_DIR=str(copy / "other"), OMNIDYN_PLAIN_NUMBA="1")
    assert {**after, "hits": before["hits"]} == before
    assert after["hits"] == 0
    assert not list((copy / "other").rglob("*.*"))


def test_without_a_compiler_it_runs_as_plain_python(copy):
    """NUMBA_DISABLE_JIT, for debuggers: the same numbers."""
    numbers = fresh(copy, NUMBA_DISABLE_JIT="1")
    assert agrees_with_python(numbers)
    assert numbers["hits"] is None


# ---- every kernel of the package -------------------------------------------------------------------------


@cache
def dispatchers():
    """(where, compiled function) for everything numba has compiled in the package."""
    found = {}
    for info in pkgutil.walk_packages([str(PACKAGE)], "omnidyn."):
        if info.name.endswith("__main__"):
            continue
        module = importlib.import_module(info.name)
        for name, value in vars(module).items():
            if isinstance(value, Dispatcher):
                found.setdefault(f"{value.py_func.__module__}.{value.py_func.__name__}", value)
                assert value.py_func.__module__.startswith("omnidyn."), name
    return found


@cache
def functions():
    """(name, syntax tree) of every function of the package."""
    found = []
    for file, tree in trees().items():
        module = f"omnidyn/{file.removesuffix('.py')}".replace("/", ".")
        found += [(f"{module}.{node.name}", node) for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return found


def decorated(decorator):
    """Names of functions under `@decorator` in the sources, found without running them."""
    return {
        name
        for name, node in functions()
        if decorator in [getattr(mark, "id", getattr(mark, "attr", "")) for mark in node.decorator_list]
    }


def test_every_kernel_is_stamped_and_nothing_else_is_cached():
    kernels = decorated("kernel") | decorated("branching_kernel")
    assert {"omnidyn.simulation.exact.exact_march._run", "omnidyn.simulation.implicit.implicit_march._march"} <= kernels
    everything = dispatchers()
    assert kernels <= set(everything)
    for name, function in everything.items():
        options = function.targetoptions
        assert options["error_model"] == "numpy", name
        assert not options.get("parallel"), name
        assert not options.get("fastmath"), name
        if name in kernels:
            assert options["nogil"] is True, name
            assert isinstance(function._cache, Entries), name
            assert function._cache.stamp == stamp(function.py_func), name
        else:
            assert isinstance(function._cache, NullCache), f"{name} is cached without a stamp"


def test_parts_count_no_references():
    """Counting costs three times as long as the arithmetic. If this fails, numba has changed `_nrt`: time it anew."""
    counted = decorated("kernel") | decorated("branching_kernel") | decorated("maker")
    for name, function in dispatchers().items():
        assert function.targetoptions.get("_nrt", True) == (name in counted), name


@pytest.mark.parametrize("give", [lambda x: x.copy(), lambda x: x[1:]])
def test_no_part_makes_an_array(give):
    given = part(give)

    def taker(x):
        return given(x)[0]

    with pytest.raises(NumbaError, match=r"NRT required|Only accept returning of array"):
        kernel(taker)(np.zeros(3))


def sources_of(names):
    """(name, syntax tree) of the functions of the package that are called so."""
    return [(name, node) for name, node in functions() if name in names]


def given_away(function):
    """Names that a function returns and also indexes: arrays, as far as the text shows."""
    nodes = list(ast.walk(function))
    indexed = {node.value.id for node in nodes if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name)}
    returned = [node.value for node in nodes if isinstance(node, ast.Return)]
    parts = [part for value in returned for part in (value.elts if isinstance(value, ast.Tuple) else [value])]
    return [part.id for part in parts if isinstance(part, ast.Name) and part.id in indexed]


def test_no_part_gives_an_array_away():
    """numba lets a part return an argument: its caller would take off a reference that nobody has put on."""
    assert given_away(ast.parse("def f(x):\n    x[0] = 1.0\n    return 2.0, x")) == ["x"]
    checked = 0
    for name, node in sources_of(decorated("part") | decorated("inlined")):
        assert not given_away(node), name
        checked += 1
    assert checked > 50


def test_no_part_calls_a_maker():
    """Makers are private: whoever calls one stands in its module."""
    makers = decorated("maker")
    assert all(name.rpartition(".")[2].startswith("_") for name in makers)
    for name, node in sources_of(decorated("part") | decorated("inlined")):
        calls = {getattr(call.func, "id", "") for call in ast.walk(node) if isinstance(call, ast.Call)}
        assert not makers & {f"{name.rpartition('.')[0]}.{called}" for called in calls}, name


def test_nobody_compiles_behind_our_back():
    """numba is imported in compiled/; others import the modules that are named here, and counts."""
    doors = "kernel|listeners|parallel|scalar_function|stamp|trace|warmed"
    for file, tree in trees().items():
        if file.startswith("compiled/"):
            continue
        inside = re.findall(
            rf"omnidyn\.compiled\b(?!\.(?:{doors})\b|\.entries import take_stock)",
            (PACKAGE / file).read_text(encoding="utf-8"),
        )
        assert not inside, file
        for node in ast.walk(tree):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not [name for name in names if name.split(".")[0] == "numba"], file
