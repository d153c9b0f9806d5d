"""Numbers and names as the formats want them: escaped, or made into an identifier; a number keeps every bit."""

from __future__ import annotations

import json
import math
import re
from xml.sax.saxutils import quoteattr

from omnidyn.errors import InputError, printable

SINGLE_MAX, SINGLE_MIN = 3.4028234663852886e38, 1.1754943508222875e-38  # of float32, normal numbers
LONGEST = 60  # of an identifier
# Words that a language keeps for itself; an identifier made of a name always ends differently.
_TAKEN = frozenset(
    re.findall(
        r"\w+",
        "auto break case char const continue default do double else enum extern float for goto if inline int long "
        "register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while "
        "class new public private protected this true false null and or not",
    )
)


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
            "a number does not fit single precision", got=value, expected=f"{SINGLE_MIN:.3g} to {SINGLE_MAX:.3g}",
            remedy="export double precision, or check the robot file", where="precision",
        )  # fmt: skip
    text = number(value)
    if single:
        text = f"{value + 0.0:.9g}"
        text = text if any(c in text for c in ".e") else text + ".0"
    return f"{text}f" if single else text


def identifier(name: str, fallback: str = "robot") -> str:
    """A name as an identifier of C, Java, Python, ROS, XML: small ASCII letters, digits and _, a letter first."""
    text = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")[:LONGEST].strip("_")
    text = text if text and text[0].isalpha() else f"{fallback}_{text}".rstrip("_")
    return f"{text}_" if text in _TAKEN else text


def attribute(text: str) -> str:
    """A text as a quoted attribute of XML; what XML cannot hold at all is shown as its escape."""
    return quoteattr(_for_xml(text))


def xml_comment(lines: list[str], indent: str = "  ") -> str:
    """Lines as one comment of XML: it holds no two dashes, and does not end with one."""
    safe = [re.sub(r"-(?=-)", "- ", _for_xml(line)).rstrip() for line in lines]
    inner = "\n".join(f"{indent}{line}".rstrip() for line in safe)
    return f"<!--\n{inner}\n-->"


def _for_xml(text: str) -> str:
    """The text without what XML 1.0 forbids."""
    return re.sub(r"[\ufffe\uffff]", "?", printable(text))


def line_comment(lines: list[str], sign: str) -> str:
    """Lines as comments of a language whose comments end with the line: #, //."""
    # A backslash at the end of a line would carry a C comment over to the next one; ??/ is one too.
    return "".join(f"{sign} {printable(line)}".rstrip().rstrip("\\").replace("??/", "? ?/") + "\n" for line in lines)


def quoted(text: str) -> str:
    """A text in double quotes, ASCII only: a string of C, Java, Python, YAML and JSON alike."""
    return json.dumps(printable(text), ensure_ascii=True)
