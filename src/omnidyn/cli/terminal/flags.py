"""Options as the command line writes them: the library names them in backticks, `hold_out`; here that is --hold-out."""

from __future__ import annotations

import re
from functools import cache

# Options beside those of `omnidyn identify`, and those whose flag is not their name.
PLAIN_OPTIONS = (
    "area",
    "assume",
    "azimuth",
    "column",
    "controller",
    "current_unsigned",
    "dead_man",
    "delay",
    "draws",
    "dt",
    "duration",
    "evaluations",
    "fail_if",
    "force",
    "force_guess",
    "free_base",
    "full",
    "hold",
    "horizon",
    "map",
    "max_bytes",
    "max_steps",
    "metric",
    "no_header",
    "no_observer",
    "noise",
    "path",
    "plant",
    "planned",
    "pose",
    "rate",
    "repair",
    "resume",
    "robot",
    "scheduler",
    "sensors",
    "shard",
    "skip",
    "skip_bad_rows",
    "sort",
    "split",
    "ticks_per_turn",
    "tol",
    "twist",
    "wheel_radius",
    "wheel_table",
    "with",
    "workers",
)
_OPTION_IN_TEXT = re.compile(r"`([a-z_]+)`")


@cache
def flags() -> dict[str, str]:
    """Option -> flag."""
    from omnidyn.cli.terminal.identify_options import options

    words = {name: spec.metadata["flag"] or name for name, spec in options().items()}
    words["groups"] = "per"
    words["beside"] = "with"
    words["aim"], words["seconds"] = "for", "time"  # of a plan
    words["limits"] = "limit"
    words["variables"] = "var"  # of a file of MATLAB
    return {
        name: f"--{word.replace('_', '-')}"
        for name, word in {**{name: name for name in PLAIN_OPTIONS}, **words}.items()
    }


def with_flags(text: str) -> str:
    """The text with every option in backticks as its flag."""
    return _OPTION_IN_TEXT.sub(lambda match: flags().get(match[1], match[0]), text) if "`" in text else text


def of_place(place: str) -> str:
    """Where an error stands: the flag, where that is an option."""
    return flags().get(place, place)
