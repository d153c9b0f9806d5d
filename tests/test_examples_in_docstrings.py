"""The examples that stand in docstrings of public functions say what they print."""

import doctest
from pathlib import Path

import pytest

import omnidyn

WITH_EXAMPLES = (
    "align",
    "check",
    "compare",
    "confidence_band",
    "dead_zone",
    "drift",
    "identify",
    "read_log",
    "sample",
    "simulate",
    "track",
    "tune",
)


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_an_example_prints_what_it_says(name):
    (test,) = doctest.DocTestFinder(recurse=False).find(getattr(omnidyn, name), name)
    assert test.examples
    told = []
    doctest.DocTestRunner().run(test, out=told.append)
    assert not told, "".join(told)


def test_the_package_says_that_it_is_typed():
    """PEP 561."""
    assert Path(omnidyn.__file__).with_name("py.typed").is_file()
