"""What the translator knows and what it refuses: no construct is dropped without a word."""

import ast
import shutil
import subprocess

import pytest

from omnidyn.export.code.c_types import INT, REAL, Array, TranslationError
from omnidyn.export.code.program import CProgram
from omnidyn.export.code.sources import Source, source_of


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
