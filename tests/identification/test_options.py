"""Options by name: an editor and help() show those of a Question, no more and no fewer."""

import inspect
import typing

import pytest

import omnidyn
from omnidyn.identification.options import Options
from omnidyn.identification.question import options


def test_the_names_for_editors_are_those_of_a_question_in_its_order():
    assert list(Options.__annotations__) == [each.name for each in options()]


def test_the_choices_for_editors_are_those_of_a_question():
    hints = typing.get_type_hints(Options)
    for each in options():
        if each.metadata["choices"]:
            assert set(typing.get_args(hints[each.name])) == set(each.metadata["choices"]), each.name


@pytest.mark.parametrize(
    "function, has, has_not",
    [
        (omnidyn.identify, {"free", "shape", "method"}, {"input", "steady"}),
        (omnidyn.Identification.of, {"free", "hold_out", "per"}, {"input"}),
        (omnidyn.fit_output_error, {"free", "loss"}, {"shape"}),
        (omnidyn.identify_steady, {"shape", "window"}, {"free"}),
        (omnidyn.identify_motors, {"input", "between", "window"}, {"free", "shape"}),
    ],
)
def test_a_signature_names_the_options_that_the_function_takes(function, has, has_not):
    signature = inspect.signature(function)
    names = set(signature.parameters)
    assert has <= names
    assert not has_not & names
    assert not [each for each in signature.parameters.values() if each.kind is each.VAR_KEYWORD]
    defaults = {each.name: each.default for each in options()}
    assert all(signature.parameters[name].default == defaults[name] for name in has)
