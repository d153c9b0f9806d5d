"""Numbers and names as the languages of exports want them: one function for each place where text can stand.

Names, notes and sources of a robot file are data in every language. `filled` puts text into a template, in one pass.
C and C++: c_comment, c_number. Java: java_comment. Python: python_comment. YAML and CSV: hash_comment, yaml_number.
XML: attribute, xml_comment. Names in programs and of files: identifier. TOML: model/robot_file.py. HTML:
report/html.py.
"""

from __future__ import annotations

import keyword
import math
import re
from xml.sax.saxutils import quoteattr

from omnidyn.errors import InputError, printable

SINGLE_MAX, SINGLE_MIN = 3.4028234663852886e38, 1.1754943508222875e-38  # of float32, normal numbers
LONGEST = 60  # of an identifier
_C = """
    alignas alignof asm auto bool break case catch char class concept const constexpr continue decltype default do
    delete double else enum explicit export extern final float for friend goto if import inline int long module mutable
    namespace new noexcept nullptr operator override private protected public register requires restrict return short
    signed sizeof static struct switch template this throw try typedef typeid typename typeof union unsigned using
    virtual void volatile while and bitand bitor compl not or xor true false null main
"""
_JAVA = (
    "abstract assert boolean byte extends finally implements instanceof interface native package permits record sealed "
    "strictfp super synchronized throws transient var yield"
)
_NOT_NAMES = "world base_link con prn aux nul"  # SDF has a frame of that name; Windows has such devices
# Words that a language keeps for itself; an identifier made of a name always ends differently.
_RESERVED_WORDS = frozenset(
    [*f"{_C} {_JAVA} {_NOT_NAMES}".split(), *map(str.lower, keyword.kwlist), *keyword.softkwlist]
    + [f"{port}{n}" for port in ("com", "lpt") for n in range(10)]
)
_WORD = re.compile(r"@(\w+)@")


def filled(template: str, **words: str) -> str:
    """A template with each @NAME@ replaced by that word, in one pass: what was put in is never looked at again."""
    return _WORD.sub(lambda match: words[match[1]], template)


def number(value: float) -> str:
    """A number in decimal digits that give back every bit: 0.1, 1e-07. Raises InputError for one that is not finite."""
    if not math.isfinite(value):
        raise InputError("not a finite number", got=value, expected="a number", remedy="check the robot file")
    return repr(float(value) + 0.0)  # no -0.0


def yaml_number(value: float) -> str:
    """A number that YAML 1.1 takes for a float: 1.0e-05; 1e-05 is a word to it. Raises InputError as `number`."""
    mantissa, exponent, power = number(value).partition("e")
    return f"{mantissa}{'' if '.' in mantissa or not exponent else '.0'}{exponent}{power}"


def c_number(value: float, single: bool = False) -> str:
    """A literal of C, double or float. Raises InputError for what a float cannot hold."""
    if single and value != 0.0 and not SINGLE_MIN <= abs(value) <= SINGLE_MAX:
        raise InputError(
            "a number does not fit single precision",
            got=value,
            expected=f"{SINGLE_MIN:.3g} to {SINGLE_MAX:.3g}",
            remedy="export double precision, or check the robot file",
            where="precision",
        )
    text = number(value)
    if single:
        text = f"{value + 0.0:.9g}"
        text = text if any(c in text for c in ".e") else text + ".0"
    return f"{text}f" if single else text


def identifier(name: str) -> str:
    """A name as an identifier of C, Java, Python, ROS, XML: small ASCII letters, digits and _, a letter first."""
    text = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")[:LONGEST].strip("_")
    text = text if text and text[0].isalpha() else f"robot_{text}".rstrip("_")
    return f"{text}_" if text in _RESERVED_WORDS else text


def attribute(text: str) -> str:
    """A text as a quoted attribute of XML; what XML cannot hold at all is shown as an escape."""
    return quoteattr(printable(text))


def xml_comment(lines: list[str]) -> str:
    """Lines as one comment of XML: it holds no two dashes, and does not end with one."""
    safe = [re.sub(r"-(?=-)", "- ", printable(line)).rstrip() for line in lines]
    inner = "\n".join(f"  {line}".rstrip() for line in safe)
    return f"<!--\n{inner}\n-->"


def c_comment(lines: list[str]) -> str:
    """Lines as one comment of C and C++. It ends where it shall, and no line of it runs on into the next one."""
    text = "\n   ".join(_ended(printable(line)) for line in lines)
    return f"/* {text.replace('*/', '* /').replace('/*', '/ *').replace('??/', '? ?/')} */"


def _ended(line: str) -> str:
    """The line without a backslash at its end, which would carry it over to the next line."""
    line = line.strip()
    return f"{line} ." if line.endswith("\\") else line


def java_comment(lines: list[str]) -> str:
    """Lines as comments of Java, with each backslash doubled: Java reads \\u000a as a line end even in a comment."""
    return _lines(lines, "//").replace("\\", "\\\\")


def python_comment(lines: list[str]) -> str:
    """Lines as the comments that a Python file begins with. Python takes its encoding from the first that names one."""
    return "# -*- coding: utf-8 -*-\n" + hash_comment(lines)


def hash_comment(lines: list[str]) -> str:
    """Lines as comments of YAML and CSV."""
    return _lines(lines, "#")


def _lines(lines: list[str], sign: str) -> str:
    return "".join(f"{sign} {printable(line)}".rstrip() + "\n" for line in lines)
