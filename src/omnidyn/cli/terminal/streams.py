"""What the two streams say and how: stdout is the result, stderr is talk. Both survive any terminal and locale."""

from __future__ import annotations

import codecs
import contextlib
import json
import os
import re
import shutil
import sys
from typing import Any, TextIO

import typer

from omnidyn.cli.terminal.flags import with_flags
from omnidyn.document import plain
from omnidyn.errors import printable

MIN_WIDTH, WIDTH_WITHOUT_TERMINAL = 20, 110
COLOURS = {
    "error": "red",
    "warning": "yellow",
    "note": "white",
    "yes": "green",
    "mended": "yellow",
    "no": "red",
}

# What a terminal that knows ASCII only gets to see.
_PLAIN = {
    "±": "+-",
    "≤": "<=",
    "≥": ">=",
    "≈": "~",
    "–": "-",
    "—": "-",
    "−": "-",
    "→": "->",
    "×": "x",
    "·": " ",
    "⋅": " ",
    "°": " deg",
    "²": "^2",
    "√": "sqrt",
    "…": "...",
    "ω": "omega",
    "θ": "theta",
    "τ": "tau",
    "Ω": "ohm",
}

_coloured: set[str] = set()  # words that we coloured: no other escape code is let through


def _plain(error: UnicodeError) -> tuple[str, int]:
    """Error handler of codecs: the plain word for a character the stream cannot carry, else its escape."""
    assert isinstance(error, UnicodeEncodeError)
    text = error.object[error.start : error.end]
    words = [_PLAIN.get(c) or c.encode("ascii", "backslashreplace").decode() for c in text]
    return "".join(words), error.end


codecs.register_error("omnidyn-plain", _plain)


def prepare() -> None:
    """Make both streams unable to fail on a character; in the C locale they carry ASCII only."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            encoding = {"encoding": "ascii"} if _ascii_locale() else {}
            with contextlib.suppress(ValueError, OSError):
                reconfigure(errors="omnidyn-plain", **encoding)


def _ascii_locale() -> bool:
    """Python shows UTF-8 in the C locale; whoever asks for that locale may not be able to read it."""
    locale = next((os.environ[name] for name in ("LC_ALL", "LC_CTYPE", "LANG") if os.environ.get(name)), "")
    return locale in ("C", "POSIX")


def say(words: str) -> None:
    """Talk, to stderr. A stderr that nobody reads, that is full or that is not there is no reason to stop."""
    if sys.stderr is None:
        return
    try:  # not typer.echo: it overrides the encoding of an ASCII stream
        print(printable(with_flags(words)), file=sys.stderr, flush=True)
    except (OSError, ValueError):
        silence(sys.stderr)


def silence(stream: TextIO | None) -> None:
    """Nothing more can be said there: what waits to be written is dropped, or Python ends with 120 for it."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())  # type: ignore[union-attr]


def say_trace(lines: str) -> None:
    """Talk of several lines, to stderr: a traceback."""
    for line in lines.splitlines():
        say(line)


def show(text: str) -> None:
    """The result, to stdout."""
    print(_escaped(with_flags(text)), flush=True)


def _escaped(text: str) -> str:
    """The text with an escape for what a terminal acts on, but for line breaks and our own colours."""
    if not _coloured:
        return "\n".join(map(printable, text.split("\n")))
    ours = re.compile("(" + "|".join(map(re.escape, sorted(_coloured))) + ")")
    parts = ours.split(text)
    return "".join(part if k % 2 else "\n".join(map(printable, part.split("\n"))) for k, part in enumerate(parts))


def show_json(document: dict[str, Any]) -> None:
    """The result for machines, to stdout."""
    show(to_json(document))


def to_json(document: Any) -> str:
    """JSON of numbers, text, arrays and what holds them; a number that is not finite becomes null."""
    return json.dumps(plain(document), indent=2, ensure_ascii=False, allow_nan=False)


def show_line(document: dict[str, Any]) -> None:
    """One of many results for machines, each on a line of its own, to stdout."""
    show(json.dumps(plain(document), ensure_ascii=False, allow_nan=False))


def width() -> int:
    """Columns to write in: of the terminal or COLUMNS, at least 20; without a terminal a wide page."""
    return max(MIN_WIDTH, shutil.get_terminal_size((WIDTH_WITHOUT_TERMINAL, 24)).columns)


def painted(word: str, tone: str) -> str:
    """The word in the colour of its tone, where stdout is a terminal that wants colours."""
    colours = (
        sys.stdout is not None
        and sys.stdout.isatty()
        and not os.environ.get("NO_COLOR")
        and os.environ.get("TERM") != "dumb"
    )
    if not colours or not tone:
        return word
    styled = typer.style(printable(word), fg=COLOURS[tone])
    _coloured.add(styled)
    return styled
