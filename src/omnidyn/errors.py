"""Every error omnidyn raises on purpose, and how a message is put together.

    OmnidynError                    exit 3
    ├── InputError                  exit 3   a file, a value or an argument cannot be used
    │   └── UnsupportedError        exit 3   it is valid, but this version has no law for it
    ├── InsufficientDataError       exit 4   the data are valid but cannot answer the question
    ├── ThresholdError              exit 5   a limit set with --fail-if is exceeded
    └── MissingExtraError           exit 6   an optional dependency is not installed

A message has four parts: what is wrong, what was got, what was expected, what to do about it.
"""

from __future__ import annotations

import difflib
import unicodedata
from collections.abc import Iterable

LEAST_LIKENESS = 0.5  # of a name and the one that is proposed for it: 1 for equal ones


class OmnidynError(Exception):
    """Base of all errors of omnidyn: what, got, expected, remedy, and where it stands.

    Attributes are the parts as text; `str(error)` is the whole message on one line.
    """

    exit_code = 3

    def __init__(self, what: str, *, got: object = None, expected: str = "", remedy: str = "", where: str = ""):
        self.what, self.expected, self.remedy, self.where = what, expected, remedy, where
        self.got = "" if got is None else _short(got)
        super().__init__(self._message())

    def _message(self) -> str:
        head = f"{self.where}: {self.what}" if self.where else self.what
        parts = [head]
        if self.got:
            parts.append(f"got {self.got}")
        if self.expected:
            parts.append(f"expected {self.expected}")
        if self.remedy:
            parts.append(self.remedy)
        return printable("; ".join(parts))

    def at(self, where: str) -> OmnidynError:
        """The same error with the place put in front, such as a file name."""
        place = f"{where}: {self.where}" if self.where else where
        return type(self)(self.what, got=self.got or None, expected=self.expected, remedy=self.remedy, where=place)


def did_you_mean(name: str, names: Iterable[str], otherwise: str = "") -> str:
    """The remedy for a name that is none of `names`: the nearest of them, or `otherwise` where none is like it."""
    matches = difflib.get_close_matches(name, list(names), n=1, cutoff=LEAST_LIKENESS)
    return f"did you mean {matches[0]}?" if matches else otherwise


class InputError(OmnidynError):
    """A file, a value or an argument cannot be used as it is."""


class UnsupportedError(InputError):
    """A valid request for which this version of omnidyn has no law; refused by name, never ignored."""


class InsufficientDataError(OmnidynError):
    """Valid data that cannot answer the question asked of them."""

    exit_code = 4


class ThresholdError(OmnidynError):
    """A threshold asked for with --fail-if is exceeded."""

    exit_code = 5


class MissingExtraError(OmnidynError):
    """An optional dependency is missing; the remedy is the line that installs it."""

    exit_code = 6


class Terminated(BaseException):
    """SIGTERM arrived: unwind, so that nothing half-written stays behind."""


INTERRUPTS = (KeyboardInterrupt, Terminated)  # a user or a system that wants the work to end


def told_by(error: BaseException) -> BaseException:
    """The interrupt that arrived in compiled code, which Python then calls a SystemError; else the error itself."""
    cause: BaseException | None = error
    while isinstance(cause, SystemError):  # one for each compiled or C function that it went through
        cause = cause.__cause__
    return cause if isinstance(cause, INTERRUPTS) else error


_ACTS = ("Cc", "Cf", "Cs", "Zl", "Zp")  # categories of control, format, surrogate and line separators


def printable(text: str) -> str:
    """The text on one line, with an escape for what a terminal acts on, or no file may hold: \\u001b, \\u202e, \\ufffe.

    Names of robots, columns, files and groups come from others: they are shown as what they are, and can neither
    colour, hide or turn around what stands beside them, nor begin a line of their own.
    """
    if text.isprintable():
        return text
    return "".join(f"\\u{ord(c):04x}" if unicodedata.category(c) in _ACTS or _is_none(ord(c)) else c for c in text)


def _is_none(code: int) -> bool:
    """Whether Unicode has no character of this code, and never will; XML and YAML refuse a file that holds one."""
    return code & 0xFFFE == 0xFFFE or 0xFDD0 <= code <= 0xFDEF


def _short(value: object, limit: int = 80) -> str:
    """A value as text for a message: printable, on one line, never longer than `limit`."""
    try:
        text = value if isinstance(value, str) else repr(value)
    except ValueError:  # an integer of more digits than Python prints
        text = f"a huge {type(value).__name__}"
    return shortened(printable(text[: limit + 1]), limit)


def shortened(text: str, limit: int) -> str:
    """The text, or as many of its whole words as fit, with "..." behind them; a word too long is cut."""
    if len(text) <= limit:
        return text
    start = text[: limit - 3]
    words = start if text[limit - 3].isspace() else start.rpartition(" ")[0]
    return (words.rstrip(" ,;:") if len(words) > limit // 2 else start) + "..."
