"""--help in groups: what one needs first, and the rest under a head of its own."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand

FIRST, MORE_PANEL = "Options", "More options"


class Grouped(TyperCommand):
    """A command whose options stand in groups, by their `rich_help_panel`; those without one are FIRST."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Arguments, then the groups, FIRST before the others."""
        groups: dict[str, list[tuple[str, str]]] = {"Arguments": [], FIRST: []}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                panel = (
                    "Arguments"
                    if parameter.param_type_name == "argument"
                    else getattr(parameter, "rich_help_panel", None)
                )
                groups.setdefault(panel or FIRST, []).append(record)
        for head, lines in groups.items():
            if lines:
                with formatter.section(head):
                    formatter.write_dl(lines)
