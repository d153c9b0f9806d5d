"""Formulas that are written on one line of text, as formulas on a page: plain HTML, no script, no font of our own."""

from __future__ import annotations

import re

from omnidyn.report.html import escaped

GREEK = {"theta": "θ", "xi": "ξ", "delta": "δ", "omega": "ω"}
PLAIN_SIGNS = {"&lt;=": "≤", "&gt;=": "≥", "+-": "±"}

# What stands for what, in this order, in text that is escaped already.
_RULES = (
    (r"sqrt\((\d+)\)", r"√\1"),
    (r"d\((\w+)\)/dt", r"d\1/dt"),
    (r"(?:\b|(?<=\bd))(theta|xi|delta|omega)(?:\b|(?=/dt))", lambda match: GREEK[match[1]]),
    (r"(?<![\w&])([A-Za-z])_([A-Za-z0-9]+)\b", r"<i>\1</i><sub>\2</sub>"),
    (r"\b([wr])([123])\b", r"<i>\1</i><sub>\2</sub>"),
    (r"(?<=[A-Za-z0-9)])\^(-?\w+)", r"<sup>\1</sup>"),
    (r"(?<![\w.])1e-0*(\d+)", r"10<sup>-\1</sup>"),
    (r"(?:^|(?<=[\s(=,>]))-(?=[\d\s])", "\N{MINUS SIGN}"),
    (r"\bohm\b", "Ω"),
    (r"(?<=\d) (?=(?:[VANWms%Ω]|kg|rad/s|m/s|mm/s)(?![A-Za-z]))", "\N{NO-BREAK SPACE}"),
    (r"(?<=[Nm]) (?=[ms](?![A-Za-z]))", "\N{NO-BREAK SPACE}"),
)


def formula(text: str) -> str:
    """The text as HTML: K_t, r1, l^2, sqrt(3) and theta as one writes them by hand; every other text as it stands."""
    html = escaped(text)
    for sign, replacement in PLAIN_SIGNS.items():
        html = html.replace(sign, replacement)
    for pattern, replacement in _RULES:
        html = re.sub(pattern, replacement, html)
    return html
