"""The options of a Question as keywords: for editors, which read types, and for help(), which reads signatures.

What an option does, and who takes it, stands once, in question.py; a test holds the names here to those there.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Literal, TypedDict, TypeVar

from omnidyn.identification.question import EVERYONE, options

Function = TypeVar("Function", bound=Callable[..., object])
Names = str | Sequence[str]


class Options(TypedDict, total=False):
    """Every option of an identification, by name: see `Question`."""

    method: Literal["auto", "output-error", "steady-state"]
    free: Names | None
    fixed: Names
    nuisances: Names | None
    loss: Literal["gaussian", "student-t"]
    hold_out: Names
    per: Names
    per_free: Names
    profile: Names
    bootstrap: int
    ladder: bool
    quick: bool
    start: Literal["auto", "rest", "free"]
    between: str
    what: Literal["friction", "motors"]
    shape: str
    speed: Literal["wheel", "set", "ground"]
    force_from: Literal["current", "voltage", ""]
    input: str
    window: tuple[float, float] | None
    steady: bool
    group: Names
    rest: Literal["bound", "line", "ignore"]
    outputs: Names | None
    covariance: Literal["auto", "white", "autoregressive", "sandwich"]
    tick_rad: float | None
    robust: bool


def shows_options(*takers: tuple[str, str]) -> Callable[[Function], Function]:
    """A function whose signature names the options that it takes, in place of **options.

    takers: (method, what) of those whose options it takes, such as FIT of question.py; all of them by default.
    """

    def shown(function: Function) -> Function:
        """The function, its signature completed; what it does stays as it is."""
        signature = inspect.signature(function)
        kept = [each for each in signature.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
        more = [
            inspect.Parameter(
                each.name, inspect.Parameter.KEYWORD_ONLY, default=each.default,
                annotation=getattr(Options.__annotations__.get(each.name), "__forward_arg__", inspect.Parameter.empty),
            )
            for each in options() if set(each.metadata["of"]) & set(takers or EVERYONE)
        ]  # fmt: skip
        function.__signature__ = signature.replace(parameters=[*kept, *more])  # type: ignore[attr-defined]
        return function

    return shown
