"""--help in groups: what one needs first, and the rest under a head of its own."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand

FIRST, MORE = "Options", "More options"


class Grouped(TyperCommand):
    """A command whose options stand in groups, by their `rich_help_panel`; those without one are FIRST."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Arguments, then the groups, FIRST before the others."""
        groups: dict[str, list[tuple[str, str]]] = {"Arguments": [], FIRST: []}
        for each in self.get_params(ctx):
            told = each.get_help_record(ctx)
            if told is not None:
                own = "Arguments" if each.param_type_name == "argument" else getattr(each, "rich_help_panel", None)
                groups.setdefault(own or FIRST, []).append(told)
        for head, lines in groups.items():
            if lines:
                with formatter.section(head):
                    formatter.write_dl(lines)
