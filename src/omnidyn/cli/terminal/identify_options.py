"""The options of `omnidyn identify`: those of the methods, and which method has what is given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, fields
from functools import cache
from typing import Any, ClassVar, NamedTuple

from omnidyn.cli.terminal.numbers import number_list
from omnidyn.errors import InputError
from omnidyn.identification.methods import (
    AUTO,
    FRICTION_METHODS,
    HOLD_OUT,
    METHODS,
    MOTOR_METHODS,
    OUTPUT_ERROR,
    QUICK,
    STEADY_STATE,
    Method,
    OutputError,
    SteadyState,
    option,
    refuse_word,
    takes_names,
)

FRICTION, MOTORS = "friction", "motors"
NAMES = {OUTPUT_ERROR: STEADY_STATE, STEADY_STATE: OUTPUT_ERROR}  # method -> the other one


@dataclass(frozen=True)
class RunOptions:
    """What to identify, by which method, from which runs: arguments of `identify`, not options of a method."""

    method: str = option(AUTO, "output-error (whole logs; the default) or steady-state (the paper's).", first=True)
    what: str = option(FRICTION, "friction, or motors: slope, dead band, lag of each, off the ground.", first=True)
    hold_out: tuple[str, ...] = option((), "Do not fit these logs: predict them.", metavar="GLOB", first=True)
    per: tuple[str, ...] = option((), "A group with friction of its own.", metavar="NAME=GLOB", first=True)
    group: tuple[str, ...] = option((), "Logs of one floor or load.", metavar="NAME=GLOB")
    quick: bool = option(False, "Leave out the diagnosis: what the model misses and what the numbers rest on.")

    CHOICES: ClassVar[dict[str, tuple[str, ...]]] = {"method": (*NAMES,), "what": (FRICTION, MOTORS)}


class IdentifyRequest(NamedTuple):
    """What the command line asks for. method: None where robot and logs choose it. groups: NAME=GLOB each.

    input: of motors, where no method is asked for.
    """

    method: Method | None
    what: str
    input: str
    hold_out: tuple[str, ...]
    groups: tuple[str, ...]
    quick: bool

    @property
    def group_option(self) -> str:
        """The option that groups come from."""
        return "per" if isinstance(self.method, OutputError) else "group"


@cache
def options() -> dict[str, Field[Any]]:
    """Every option that has a flag, by name, in the order of the help."""
    specs = {spec.name: spec for kind in (RunOptions, *METHODS) for spec in fields(kind)}
    return {name: spec for name, spec in specs.items() if spec.metadata["flag"] is not None}


def default_of(spec: Field[Any]) -> Any:
    """What the command line shows as the default of an option; it has no None."""
    return [] if takes_names(spec) else "" if spec.default is None else spec.default


def identify_request(option_values: Mapping[str, Any]) -> IdentifyRequest:
    """What is asked for. option_values: every option, as the command line has it.

    Raises InputError for words that mean nothing, for an option of another method, or of something else than is asked.
    """
    values: dict[str, Any] = {
        name: value for name, value in option_values.items() if value != default_of(options()[name])
    }
    values = {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}
    if "window" in values:
        values["window"] = tuple(number_list("--window", values["window"]))
    name, what = values.pop("method", AUTO), values.pop("what", FRICTION)
    if name != AUTO:
        refuse_word("method", name, RunOptions.CHOICES["method"])
    refuse_word("what", what, RunOptions.CHOICES["what"])
    kind = _method(name, what, [*values])
    groups = values.pop("per", ()) or values.pop("group", ())
    about = {"hold_out": values.pop("hold_out", ()), "groups": groups, "quick": values.pop("quick", False)}
    return IdentifyRequest(kind(**values) if kind else None, what, values.get("input", ""), **about)


def _takes(kind: type[Method], name: str) -> bool:
    """Whether a method has an option, or a use for one that says which runs."""
    if name in ("per", "group"):
        return kind is (OutputError if name == "per" else SteadyState)
    return name in kind.takes if name in (HOLD_OUT, QUICK) else name in {spec.name for spec in fields(kind)}


def _method(name: str, what: str, option_names: Sequence[str]) -> type[Method] | None:
    """The method by its name, or by options that one alone has; None where robot and logs say it."""
    kinds = MOTOR_METHODS if what == MOTORS else FRICTION_METHODS
    takers = {word: [kind.word for kind in kinds if _takes(kind, word)] for word in option_names}
    for word, methods in takers.items():
        if not methods and what == MOTORS:
            raise InputError("not an option of the motors", got=f"`{word}`", where=f"`what` {MOTORS}")
        if not methods:
            raise InputError("an option of the motors", got=f"`{word}`", expected=f"`what` {MOTORS}", where=f"`{word}`")
    steady, fit = ([word for word, has in takers.items() if has == [only]] for only in (STEADY_STATE, OUTPUT_ERROR))
    if fit and (name == STEADY_STATE or (steady and name == AUTO)):
        alternatives = ", ".join(f"`{word}`" for word in steady) or "`method`"
        raise _refusal(STEADY_STATE, fit[0], f"leave it out, or leave out {alternatives}")
    if steady and name == OUTPUT_ERROR:
        raise _refusal(OUTPUT_ERROR, steady[0], "for groups use `per`" if steady[0] == "group" else "leave it out")
    name = OUTPUT_ERROR if fit else STEADY_STATE if steady else name
    return {kind.word: kind for kind in kinds}.get(name)


def _refusal(method: str, refused: str, remedy: str) -> InputError:
    expected = f"with {NAMES[method]}"
    return InputError(f"{method} has no such option", got=f"`{refused}`", expected=expected, remedy=remedy)
