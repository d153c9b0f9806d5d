"""The claims as text for a terminal: verdict in colour and in words, place, statement, the two numbers."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from omnidyn.cli.terminal.streams import coloured, width
from omnidyn.paper.claim import Claim, ClaimVerdict

SHORT = {ClaimVerdict.REPRODUCED: "yes", ClaimVerdict.CORRECTED: "mended", ClaimVerdict.NOT_REPRODUCED: "no"}
COLOURS = {ClaimVerdict.REPRODUCED: "green", ClaimVerdict.CORRECTED: "yellow", ClaimVerdict.NOT_REPRODUCED: "red"}
INDENT = 8


def claims_table(claims: Sequence[Claim]) -> str:
    """Two or more lines per claim, never wider than the terminal, and the counts at the end."""
    columns = width()
    lines = [line for claim in claims for line in _claim(claim, columns)]
    lines.append("")
    for verdict in ClaimVerdict:
        number = sum(claim.verdict == verdict for claim in claims)
        lines += _entry(verdict, _wrapped(f"{number} {verdict.value}", columns))
    return "\n".join(lines)


def _claim(claim: Claim, columns: int) -> list[str]:
    first = _wrapped(f"{claim.place}: {claim.statement}", columns)
    return _entry(claim.verdict, first + _wrapped(f"printed {claim.printed}; ours {claim.ours}", columns))


def _entry(verdict: ClaimVerdict, lines: list[str]) -> list[str]:
    """Lines with the verdict in front of the first, the others below it."""
    label = coloured(f"{SHORT[verdict]:{INDENT}}", COLOURS[verdict])
    return [label + lines[0], *(" " * INDENT + line for line in lines[1:])]


def _wrapped(text: str, columns: int) -> list[str]:
    return textwrap.wrap(text, max(columns - INDENT, 12)) or [""]
