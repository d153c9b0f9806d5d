"""A picture that a command was asked for: its place, refused early, and the file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from omnidyn.cli.terminal.streams import say
from omnidyn.errors import InputError
from omnidyn.files import check_output, write_atomic

if TYPE_CHECKING:
    from omnidyn.report.style import Picture

KINDS = (".png", ".svg")


def refuse_picture(path: str, force: bool) -> None:
    """Before any work: a place where the picture could not be written in the end. Raises InputError."""
    if path and (not path.endswith(KINDS) or "\0" in path):
        raise InputError("cannot tell the kind of picture", got=path, expected="a name that ends in .png or .svg")
    if path:
        check_output(path, force)


def write_picture(picture: Picture, path: str, force: bool, remark: str = "") -> None:
    """Write it in the format that its name asks for, and say so. remark: what of the data it shows, in words."""
    write_atomic(path, picture.svg if path.endswith(".svg") else picture.png, force)
    say(f"omnidyn: wrote {path}{remark}")
