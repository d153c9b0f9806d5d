"""How conf.py shows docstrings on the API page: they are prose for help(); on the page their arguments become tables.

A docstring names its arguments as "dt: length of the rows [s]. twist, pose: where it starts", at the beginning of a
line or of a sentence; formulas are indented. "Returns" and "Raises" begin a sentence of their own.
"""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import MISSING, fields, is_dataclass
from itertools import pairwise
from typing import Any, NamedTuple

from pydantic import BaseModel

from omnidyn.identification.methods import METHODS

OUTCOME = r"(?:Returns|Raises|Never raises|Errors:)"
BEGINS = r"(?:^|(?<=\n)|(?<=[.;] ))"  # of the text, a line or a sentence
NO_SIGNATURE = (
    "Comparison",
    "Estimate",
    "Identification",
    "Robot",
    "OmnidynError",
    *(method.__name__ for method in METHODS),
)  # made by functions

# What an argument is where its docstring need not say it.
COMMON = {
    "robot": "as `load_robot` gives it",
    "run": "of `read_log` or `simulate`",
    "runs": "of `read_log` or `simulate`",
    "path": "of the file",
    "force": "replace a file that is there",
    "draws": "how many plausible robots",
    "count": "how many",
    "rng": "a seed, or a numpy.random.Generator",
    "log": "as `read_log(path, recorded=True)` gives it",
    "duration": "of the whole [s]",
    "max_steps": "most rows",
    "wheels": "how many the robot has",
    "progress": "is told what is being done",
    "watch": "is told what is being done",
}

FIELDS = {
    "name": "of the robot",
    "source": "where it comes from, in words",
    "body": "mass, inertia, turning frame",
    "wheels": "where they stand, their radii and rollers",
    "motor": "its constants, gear and limits",
    "drive": "what a command is",
    "friction": "on the axes, along the direction of travel, at the wheels",
}


class Shown:
    """A default that is no value to type in: a function, or one made anew each time."""

    def __repr__(self) -> str:
        return "..."


class Argument(NamedTuple):
    """An argument of a function, or a field of a value."""

    name: str
    type: str
    default: str


class Told(NamedTuple):
    """A docstring in its parts. lead: paragraphs, a formula as a list of its lines. words: argument -> what it is."""

    lead: tuple[str | list[str], ...]
    words: dict[str, str]
    outcome: tuple[str, ...]


def arguments_of(thing: Any) -> list[Argument]:
    """What a function takes; what a value holds."""
    if inspect.isclass(thing):
        return _fields_of(thing)
    return [
        Argument(_starred(each), short_type(each.annotation), _default(each.default)) for each in _parameters(thing)
    ]


def _parameters(thing: Any) -> list[inspect.Parameter]:
    found = list(inspect.signature(thing).parameters.values())
    return found[1:] if found and found[0].name in ("self", "cls") else found


def _starred(each: inspect.Parameter) -> str:
    return {each.VAR_KEYWORD: "**", each.VAR_POSITIONAL: "*"}.get(each.kind, "") + each.name


def _fields_of(thing: type) -> list[Argument]:
    """Public fields of a dataclass or of a table of the robot file."""
    if issubclass(thing, BaseModel):
        shown = {name: field for name, field in thing.model_fields.items() if name != "priors"}
        return [Argument(name, short_type(_written(thing, name)), "") for name in shown]
    if not is_dataclass(thing):
        return []
    return [
        Argument(each.name, short_type(each.type), "" if each.default is MISSING else _default(each.default))
        for each in fields(thing)
    ]


def _written(thing: type, name: str) -> Any:
    """An annotation as the source has it."""
    every = (vars(each).get("__annotations__", {}) for each in thing.__mro__)
    return next((own[name] for own in every if name in own), "")


def _default(value: Any) -> str:
    return "" if value is inspect.Parameter.empty else repr(_shown(value))


def _shown(value: Any) -> Any:
    made = inspect.isfunction(value) or "factory" in type(value).__name__.lower()
    return Shown() if made else value


def short_type(annotation: Any) -> str:
    """A type in words of the source, without the `Annotated` that checks it."""
    if annotation is inspect.Parameter.empty:
        return ""
    if not isinstance(annotation, str):
        return getattr(annotation, "__name__", str(annotation)).replace("typing.", "")

    class Plain(ast.NodeTransformer):
        def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
            self.generic_visit(node)
            plain = isinstance(node.value, ast.Name) and node.value.id == "Annotated"
            return node.slice.elts[0] if plain and isinstance(node.slice, ast.Tuple) else node

    return ast.unparse(Plain().visit(ast.parse(annotation, mode="eval")))


def signature_of(thing: Any) -> tuple[str, str]:
    """(arguments with their defaults, type of what comes back), both without annotations."""
    if inspect.isclass(thing) and thing.__name__ in NO_SIGNATURE:
        return "", ""
    plain = [each.replace(annotation=each.empty, default=_shown(each.default)) for each in _parameters(thing)]
    back = inspect.signature(thing).return_annotation
    return str(inspect.Signature(plain)), "" if inspect.isclass(thing) else short_type(back)


def told(text: str, names: Sequence[str]) -> Told:
    """A docstring in its parts."""
    lead: list[str | list[str]] = []
    words: dict[str, str] = {}
    outcome: list[str] = []
    for block in _blocks(text):
        if isinstance(block, list):
            lead.append(block)
            continue
        for piece in _pieces(block, names):
            found = re.match(rf"({_list_of(names)})\s*: ", piece) if names else None
            flat = " ".join(piece.split())
            if re.match(OUTCOME, flat):
                outcome.append(flat)
            elif found:
                what = " ".join(piece[found.end() :].split())
                words |= {name: what for name in re.findall(r"\w+", found.group(1)) if name in names}
            elif flat:
                lead.append(flat)
    return Told(tuple(lead), words, tuple(outcome))


def _blocks(text: str) -> list[str | list[str]]:
    """Paragraphs, and formulas as lists of lines: those are indented and stand between blank lines."""
    found: list[str | list[str]] = []
    for part in re.split(r"\n\s*\n", inspect.cleandoc(text)):
        part = textwrap.dedent(part.removeprefix("Args:\n")) if part.startswith("Args:\n") else part
        lines = part.split("\n")
        formula = all(line.startswith("    ") for line in lines)
        found.append(textwrap.dedent(part).split("\n") if formula else part)
    return found


def _list_of(names: Sequence[str]) -> str:
    """A pattern of one of the names, or of several: "twist, pose and current"."""
    one = rf"(?:{'|'.join(sorted(map(re.escape, names), key=len, reverse=True))})"
    return rf"{one}(?:(?:,\s|\sand\s){one})*"


def _pieces(text: str, names: Sequence[str]) -> list[str]:
    """A paragraph cut where an argument, or what comes of it, begins."""
    starts = rf"{OUTCOME}\b" if not names else rf"(?:{_list_of(names)}\s*: |{OUTCOME})"
    cuts = [0, *(found.start() for found in re.finditer(rf"{BEGINS}(?={starts})", text)), len(text)]
    return [text[begin:end] for begin, end in pairwise(cuts) if text[begin:end].strip()]


def as_rst(thing: Any, text: str) -> list[str]:
    """The docstring of a function, a value or one of its methods as lines of reStructuredText."""
    if thing in METHODS:
        return [*_escaped(text.partition("\n\n")[0]), "", *_options_table(thing)]
    takes = arguments_of(thing) if callable(thing) else []
    parts = told(text, [each.name.lstrip("*") for each in takes])
    lines: list[str] = []
    for part in parts.lead:
        lines += ["::", "", *("    " + line for line in part)] if isinstance(part, list) else _escaped(part)
        lines.append("")
    if takes and (len(takes) > 1 or parts.words):
        lines += _table(takes, parts.words, inspect.isclass(thing))
    for each in parts.outcome:
        lines += [*_escaped(each), ""]
    return lines


def _table(takes: Iterable[Argument], words: dict[str, str], fields_of_a_value: bool) -> list[str]:
    head = ("holds" if fields_of_a_value else "argument", "type", "default", "what it is")
    common = FIELDS if fields_of_a_value else COMMON
    rows = [
        (
            f"``{a.name}``",
            a.type and f"``{a.type}``",
            a.default and f"``{a.default}``",
            *_escaped(words.get(a.name.lstrip("*"), common.get(a.name, ""))),
        )
        for a in takes
    ]
    return _list_table(_without_empty([head, *rows]))


def _options_table(method: type) -> list[str]:
    rows = [("option", "default", "what it does")]
    for spec in fields(method):
        words = f"{spec.metadata['words']} {spec.metadata['more']}".rstrip()
        rows.append((f"``{spec.name}``", f"``{spec.default!r}``", _escaped(words)[0]))
    return _list_table(rows)


def _without_empty(rows: list[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """The rows without columns that hold nothing but their head."""
    kept = [k for k, column in enumerate(zip(*rows, strict=True)) if any(column[1:])]
    return [tuple(row[k] for k in kept) for row in rows]


def _list_table(rows: Sequence[tuple[str, ...]]) -> list[str]:
    lines = [".. list-table::", "   :header-rows: 1", ""]
    for row in rows:
        lines += [f"   {'* ' if k == 0 else '  '}- {cell}".rstrip() for k, cell in enumerate(row)]
    return [*lines, ""]


def _escaped(text: str) -> list[str]:
    """Plain text as one line of markup that shows it as it is; `code` stays code."""
    shown = []
    for k, part in enumerate(" ".join(text.split()).split("`")):
        shown.append(f"``{part}``" if k % 2 else re.sub(r"([\\*_|<>])", r"\\\1", part))
    words = "".join(shown)
    return [re.sub(r"(``)(?=\w)", r"\1\\ ", words) if "``" in words and words.count("``") % 2 else words]
