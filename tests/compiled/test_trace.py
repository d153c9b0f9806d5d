"""A traced function of plain numbers gives what the function of arrays gives."""

import ast

import numpy as np
import pytest

from omnidyn.compiled.scalar_function import scalar_function
from tests.support.sources import trees


def law(place, size):
    """Every operation that laws have, with a division by 0 and a root of less than 0 that no branch takes."""
    turned = np.cos(size) * place + np.sin(size) * np.square(place) / (np.exp(-size) + 1.0)
    safe = np.where(place > 0.0, np.sqrt(place), np.where(place == 0.0, 1.0, 1.0 / place))
    both = (place >= -1.0) & (place <= 2.0) & ~(place < 0.1)
    near = np.minimum(np.maximum(place, -0.5), 0.5) * np.sign(place) - np.abs(place) ** 3
    return {"turned": turned + safe, "near": np.where(both, near, -place), "none": 0.0 * place}


@pytest.mark.parametrize("size", [0.0, 0.3, -2.0, 7.0])
@pytest.mark.parametrize("place", [(0.0, 1.0, -1.0), (0.2, -0.7, 3.0), (-4.0, 1e-9, 2.0)])
def test_numbers_are_those_of_arrays(place, size):
    traced = scalar_function({"place": (3,), "size": ()}, law)
    with np.errstate(all="ignore"):
        wanted = np.concatenate(list(law(np.array(place), np.array(size)).values()))
    assert traced(place, size) == pytest.approx(wanted.tolist(), rel=1e-15, abs=1e-15)


def test_a_branch_on_an_input_is_not_traced():
    assert scalar_function({"place": (3,)}, lambda place: {"a": place if place[0] > 0.0 else -place}) is None


def test_no_text_becomes_code():
    """Neither eval nor exec is called anywhere in the package, nor what makes code of text."""
    for file, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                assert node.func.id not in ("eval", "exec", "compile", "__import__"), f"{file}:{node.lineno}"
