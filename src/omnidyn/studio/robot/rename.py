"""Another name for a robot file."""

from __future__ import annotations

import shutil

from omnidyn.errors import InputError
from omnidyn.studio.calls import safe_name
from omnidyn.studio.parts import ROBOT
from omnidyn.studio.session import ROBOT_SUFFIX, Session


def rename_robot(session: Session, name: str, other: str) -> str:
    """Give a robot file another name, which it then has as a file too; an error in words, or ""."""
    if name not in session.robots:
        return str(InputError("this robot was removed on another page", got=name, remedy="use Undo first"))
    new = f"{safe_name(other.removesuffix(ROBOT_SUFFIX))}{ROBOT_SUFFIX}"
    if new in session.robots:
        return str(InputError("there is a robot of this name", got=new, remedy="use another name"))
    session.robots[new] = str(shutil.copyfile(session.robots.pop(name), session.new_folder() / new))
    if name in session.made:
        session.made.add(new)
    session.robot = new if session.robot == name else session.robot
    session.changed(ROBOT)
    return ""
