"""What makes a folder a package that colcon builds: package.xml (REP 149), CMakeLists.txt, README.md.

All files lie flat in share/NAME, programs in lib/NAME, where `ros2 launch` and `ros2 run` look for them.
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

from omnidyn.errors import printable
from omnidyn.export.contract import Content
from omnidyn.export.spelling import hash_comment, identifier

LIBRARY = "omnidyn_control"


def package_name(robot: str, kind: str) -> str:
    """The name of the package of a robot: small letters, digits and _, as ROS has it."""
    return f"{identifier(robot)}_{kind}".replace("__", "_")


def package(
    name: str,
    words: str,
    depends: Sequence[str],
    shared: Sequence[str],
    programs: Sequence[str] = (),
    sources: Sequence[str] = (),
) -> dict[str, Content]:
    """package.xml and CMakeLists.txt.

    Args:
        name: Of the package.
        words: What it is, in one line.
        depends: Packages of ROS that it needs where it runs.
        shared: Files for share/NAME.
        programs: Files for lib/NAME; the first one is run.
        sources: C of a library for lib/NAME.
    """
    needs = "\n".join(f"  <exec_depend>{package}</exec_depend>" for package in sorted({*depends, *_ALWAYS}))
    xml = f"""\
<?xml version="1.0"?>
<?xml-model href="http://download.ros.org/schema/package_format3.xsd" schematypens="http://www.w3.org/2001/XMLSchema"?>
<package format="3">
  <name>{name}</name>
  <version>0.1.0</version>
  <description>{escape(printable(words))}</description>
  <maintainer email="nobody@example.com">nobody yet: put in your name</maintainer>
  <license>TODO: License declaration</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
{needs}
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""
    lines = [
        "cmake_minimum_required(VERSION 3.8)",
        f"project({name}{' C' if sources else ''})",
        "find_package(ament_cmake REQUIRED)",
    ]
    if sources:
        lines += [
            f"add_library({LIBRARY} SHARED {' '.join(sources)})",
            f"set_target_properties({LIBRARY} PROPERTIES C_STANDARD 99 PREFIX lib SUFFIX .so)",
            f"target_link_libraries({LIBRARY} PRIVATE m)",
            f"install(TARGETS {LIBRARY} LIBRARY DESTINATION lib/${{PROJECT_NAME}})",
        ]
    if programs:
        lines.append(f"install(PROGRAMS {' '.join(programs)} DESTINATION lib/${{PROJECT_NAME}})")
    lines.append(f"install(FILES {' '.join(shared)} DESTINATION share/${{PROJECT_NAME}})")
    lines.append("ament_package()")
    return {"package.xml": xml, "CMakeLists.txt": hash_comment([words]) + "\n".join(lines) + "\n"}


_ALWAYS = ("launch", "launch_ros", "ros2launch")


BY_HAND = (
    "the maintainer: your name and address, in `package.xml`",
    "the licence: its name in `package.xml`, its text in a file LICENSE",
)


def by_hand(*more: str) -> str:
    """What is left to whoever takes a package, as Markdown. more: beside what all packages need."""
    return "Left to do by hand:\n\n" + "\n".join(f"- {line}" for line in (*more, *BY_HAND))


def read_me(title: str, about: Sequence[str], sections: Sequence[str]) -> str:
    """README.md: a title, points, then paragraphs of Markdown. A robot's name is text in it, whatever it holds."""
    points = "\n".join(f"- {plain(line)}" for line in about)
    return "\n\n".join([f"# {plain(title)}", points, *sections]) + "\n"


def plain(text: str) -> str:
    """Text that Markdown shows as it is, on one line."""
    kept = "".join(f"\\{letter}" if letter in "\\`*_[]<>#|&!" else letter for letter in printable(text))
    return " ".join(kept.split())
