"""What the translator knows and what it refuses: no construct is dropped without a word."""

import ast
import inspect
import math
import shutil
import subprocess

import numpy as np
import pytest

from omnidyn.compiled.trace import TranslationError
from omnidyn.export.code.c_types import INT, REAL, Array, record_type
from omnidyn.export.code.program import CProgram
from omnidyn.export.code.sources import Source, source_of
from tests.support.exported import STRICT


def source(text):
    (tree,) = ast.parse(text).body
    return Source("omnidyn.simulation.exact.step", tree.name, tree)


@pytest.mark.parametrize(
    "text",
    [
        "def f(x):\n    return x @ 3",
        "def f(x):\n    return math.tan(x)",
        "def f(x):\n    with x:\n        pass",
        "def f(x):\n    return [x]",
        "def f(x):\n    return print(x)",
        "def f(x):\n    a, b = abs(x)\n    return a",
    ],
)
def test_what_it_does_not_know_is_refused(text):
    with pytest.raises((TranslationError, AttributeError)):
        CProgram().function(source(text), (REAL,))


def test_a_swap_goes_through_temporaries():
    program = CProgram()
    program.function(source("def f(a, b):\n    a, b = b, a\n    return a - b"), (REAL, REAL))
    assert "held1 = b;\n    held2 = a;\n    a = held1;\n    b = held2;" in program.text()


def test_integers_divide_as_numbers():
    program = CProgram(single=True)
    program.function(source("def f(n):\n    return 1 / (n + 1)"), (INT,))
    assert "return 1.0f / (float)(n + 1);" in program.text()


def test_a_name_may_be_a_word_of_c():
    program = CProgram()
    program.function(source("def f(double):\n    int = 2.0 * double\n    return int"), (REAL,))
    assert "double f(double double_)" in program.text()


def test_the_translated_formula_computes_the_same(tmp_path):
    """exact_step on a grid of arguments, every branch: the same bits as the function called as it stands."""
    if shutil.which("gcc") is None:
        pytest.skip("no gcc here")
    from omnidyn.simulation.exact.step import exact_step

    program = CProgram()
    found = source_of(exact_step)
    assert found is not None
    program.function(found, (REAL,) * 7)
    cases = [
        (v, g, c, c * s, 6.7, phi, 0.0)
        for v in (0.0, 1e-9, 0.3, -0.3, -2.0)
        for g in (0.0, 0.5, -0.5, 3.0, -9.0)
        for c in (0.0, 1.5)
        for s in (1.0, 1.4)
        for phi in (1e-4, 0.01, 0.14)
    ]
    calls = "\n".join(f'printf("%a\\n", exact_step({", ".join(map(repr, case))}));' for case in cases)
    text = f"#include <math.h>\n#include <stdio.h>\n{program.text()}\nint main(void) {{\n{calls}\nreturn 0; }}\n"
    (tmp_path / "t.c").write_text(text)
    subprocess.run(["gcc", "-std=c99", "-o", "t", "t.c", "-lm"], cwd=tmp_path, check=True)
    out = subprocess.run(["./t"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout.split()
    plain = getattr(exact_step, "py_func", exact_step)
    assert [float.fromhex(each) for each in out] == [plain(*case) for case in cases]


def test_tables_that_are_written_are_not_constant():
    program = CProgram()
    made = program.function(source("def f(a, b):\n    a[0] = b[1]"), (Array((3,)), Array((3,))))
    assert made.writes == {0}
    assert "void f(double a[3], const double b[3])" in program.text()


def nested(x):
    (a, b), c = (x, 2.0 * x), x + 1.0
    both = ((a, b), c) if x > 0.0 else ((b, a), 0.0)
    (p, q), r = both
    return 100.0 * p + 10.0 * q + r + both[0][1]


def sliced(table):
    rows, whole = table[1:3], table[:]
    rows[0], whole[3] = 5.0, rows[1] ** 3
    return len(rows) + table[1] + table[3]


def counted(n):
    steps, bound, last, total = 0, math.inf, n, 0
    for _ in range(last):
        last -= 1
        steps += 1
    while steps < bound and steps < 2 * n:
        steps += 1
    for k in range(n - 1, -1, -1):
        total = 10 * total + k
    return 1000 * total + steps


def pulled(body, bodies):
    total, other = 0.0, bodies[1]
    for j in range(3):
        total += body.push[j] if body.active > 0.0 else math.tan(body.level)
    if body.active == 0.0 or body.depth > 0.0:
        body.level = total
    other.level = 2.0 * body.level
    return other.level + bodies[0].level


def test_each_construct_computes_what_python_does(tmp_path):
    """Nested tuples, slices, loops whose end is worked out once, bounded while loops, records; what is known goes."""
    if shutil.which("gcc") is None:
        pytest.skip("no gcc here")
    dtype = np.dtype([("level", "f8"), ("push", "f8", (3,)), ("active", "f8"), ("depth", "f8")])
    bodies = np.array([(3.0, (1.0, 2.0, 4.0), 1.0, 0.5), (0.0, (0.0, 0.0, 0.0), 1.0, -0.5)], dtype).view(np.recarray)
    record, program = record_type("Body", dtype), CProgram(fixed_fields={("Body", "active"): 1.0})
    kinds = {nested: (REAL,), sliced: (Array((4,)),), counted: (INT,), pulled: (record, Array((2,), record))}
    for function, arguments in kinds.items():
        (tree,) = ast.parse(inspect.getsource(function)).body
        program.function(Source("omnidyn.simulation.exact.step", tree.name, tree), arguments)
    calls = {
        "nested(1.5)": nested(1.5),
        "nested(-2.0)": nested(-2.0),
        "sliced((double[4]){1.0, 2.0, 3.0, 4.0})": sliced(np.array([1.0, 2.0, 3.0, 4.0])),
        "counted(4)": counted(4),
        "pulled(&bodies[0], bodies)": pulled(bodies[0], bodies),
    }
    bodies["level"] = 3.0, 0.0
    text = "\n".join(
        ["#include <math.h>\n#include <stdio.h>", program.text(), program.records(record, "BODIES", bodies)]
        + ["int main(void) {\n    Body bodies[2];\n    bodies[0] = BODIES[0], bodies[1] = BODIES[1];"]
        + [f'    printf("%a\\n", (double){call});' for call in calls]
        + ["    return 0;\n}\n"]
    )
    assert "active" not in text
    (tmp_path / "t.c").write_text(text)
    subprocess.run(["gcc", *STRICT, "-o", "t", "t.c", "-lm"], cwd=tmp_path, check=True)
    out = subprocess.run(["./t"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout.split()
    assert [float.fromhex(number) for number in out] == pytest.approx(list(calls.values()), rel=1e-15)


def test_a_loop_without_end_gives_no_number():
    program = CProgram(most_turns=50)
    program.function(source("def f(x):\n    while True:\n        x += 1.0\n    return x"), (REAL,))
    assert "if (++held1 > 50) {\n            return (double)NAN;" in program.text()


def test_what_is_known_may_not_be_changed():
    record = record_type("Body", np.dtype([("active", "f8")]))
    with pytest.raises(TranslationError, match=r"body\.active is not constant"):
        CProgram(fixed_fields={("Body", "active"): 1.0}).function(
            source("def f(body):\n    body.active = 0.0"), (record,)
        )
