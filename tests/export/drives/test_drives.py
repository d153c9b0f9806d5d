"""A program as files: what each gives row by row, and when it stops, in Python, C and Java; all of it compiles.

The right rows are those of the program itself; the right stop is the one that was asked for.
"""

import ast
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import omnidyn
from omnidyn.driving.connection import Command
from omnidyn.driving.dead_man import DeadMan
from omnidyn.driving.program import DriveProgram
from omnidyn.driving.wire import command_line, stop_line
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.drives.kinds import KINDS, program_files
from omnidyn.export.drives.rows import pieces
from tests.support.drive_scenarios import ARDUINO, DONE, FAULTS, Moment, faulty, healthy, write_stubs
from tests.support.exported import WARNINGS
from tests.support.faulty_drives import axebot_program

PROGRAM = axebot_program()
PROGRAM = replace(PROGRAM, robot=PROGRAM.robot.replace(drive=PROGRAM.robot.drive.replace(supply=12.0)))
ENDS = (DONE, *FAULTS)


def moments(end):
    return healthy(PROGRAM) if end == DONE else faulty(PROGRAM, end)


def check(end, inputs, ended):
    """The rows of the program until the middle, then the stop; or all of them."""
    rows = np.zeros((len(inputs), 3))
    whole = len(PROGRAM.inputs) if end == DONE else len(PROGRAM.inputs) // 2
    rows[:whole] = PROGRAM.inputs[:whole]
    np.testing.assert_allclose(inputs[:whole], rows[:whole], atol=2e-6)
    assert ended == end
    stopped = whole + (0 if end == DONE else 13 if end == "SILENT" else 60)  # a wheel is judged at the end of a leg
    assert not np.any(inputs[stopped:])


@pytest.mark.parametrize("end", ENDS)
def test_python(end):
    text = program_files(PROGRAM, "ros2").files["drive_program.py"]
    scope = {}
    exec(compile(text, "drive_program.py", "exec"), scope)
    program = scope["DriveProgram"]()
    inputs = np.array([program.step(*moment) for moment in moments(end)])
    names = {scope[name]: name for name in ("DONE", *FAULTS)}
    check(end, inputs, names[program.status])


def as_text(moment: Moment):
    angles = " ".join(map(repr, moment.angles)) if moment.angles is not None else "x"
    return f"{moment.now!r} {int(moment.held)} {moment.supply!r} {angles}\n"


def answers(command, end, **options):
    said = subprocess.run(
        command, input="".join(map(as_text, moments(end))), capture_output=True, text=True, check=True, **options
    ).stdout.splitlines()
    return np.array([[float(cell) for cell in line.split()] for line in said[:-1]]), said[-1]


HARNESS = """
#include "omnidyn_drive.h"
#include <stdio.h>
int main(void)
{
    omnidyn_drive drive;
    double now, supply, angle;
    int held, k, status = 0;
    float inputs[OMNIDYN_WHEELS], angles[OMNIDYN_WHEELS];
    memset(&drive, 0, sizeof drive);
    while (scanf("%lf %d %lf", &now, &held, &supply) == 3) {
        const float *given = angles;
        for (k = 0; k < OMNIDYN_WHEELS; k++) {
            if (scanf("%lf", &angle) == 1)
                angles[k] = (float)angle;
            else {
                scanf(" x");
                given = 0;
                break;
            }
        }
        status = omnidyn_drive_step(&drive, (uint32_t)(1e3 * now + 0.5), held != 0, given, (float)supply, inputs);
        for (k = 0; k < OMNIDYN_WHEELS; k++)
            printf("%.9g ", (double)inputs[k]);
        printf("\\n");
    }
    printf("%d\\n", status);
    return 0;
}
"""


@pytest.fixture(scope="module")
def c_program(tmp_path_factory):
    if shutil.which("gcc") is None:
        pytest.skip("no C compiler")
    folder = tmp_path_factory.mktemp("c")
    program_files(PROGRAM, "arduino").write(folder / "drive")
    (folder / "drive" / "main.c").write_text(HARNESS)
    strict = [flag for flag in WARNINGS if flag != "-Wdouble-promotion"]
    command = ["gcc", "-std=c99", "-O2", *strict, "-Wno-unused-result", "-o", "drive", "main.c", "-lm"]
    subprocess.run(command, cwd=folder / "drive", check=True)
    return folder / "drive" / "drive"


@pytest.mark.parametrize("end", ENDS)
def test_c(c_program, end):
    inputs, status = answers([c_program], end)
    codes = dict(zip(("2", "-1", "-3", "-4", "-2", "-5", "-6"), ENDS, strict=True))
    check(end, inputs, codes[status])


def java(*files, folder):
    subprocess.run(["javac", "-Xlint:all", "-Werror", "-d", folder, *files], check=True)


MAIN = """
import java.util.Scanner;
public class Main {
  public static void main(String[] words) {
    frc.robot.DriveProgram program = new frc.robot.DriveProgram();
    for (Scanner lines = new Scanner(System.in); lines.hasNextLine(); ) {
      String[] cells = lines.nextLine().split(" ");
      double[] angles = cells[3].equals("x") ? null : new double[cells.length - 3];
      for (int k = 0; angles != null && k < angles.length; k++) angles[k] = Double.parseDouble(cells[3 + k]);
      double[] inputs = program.step(Double.parseDouble(cells[0]), cells[1].equals("1"), angles,
          Double.parseDouble(cells[2]));
      StringBuilder row = new StringBuilder();
      for (double input : inputs) row.append(input).append(' ');
      System.out.println(row);
    }
    System.out.println(program.status());
  }
}
"""


@pytest.fixture(scope="module")
def java_program(tmp_path_factory):
    if shutil.which("javac") is None:
        pytest.skip("no Java compiler")
    folder = tmp_path_factory.mktemp("java")
    program_files(PROGRAM, "wpilib").write(folder / "routine")
    (folder / "Main.java").write_text(MAIN)
    java(folder / "routine" / "DriveProgram.java", folder / "Main.java", folder=folder)
    return folder


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.some(3)
def test_java(java_program, end):
    check(end, *answers(["java", "-cp", java_program, "Main"], end))


@pytest.mark.skipif(shutil.which("javac") is None, reason="no Java compiler")
@pytest.mark.parametrize("kind", ["ftc", "wpilib"])
def test_routines_compile_against_stubs(tmp_path, kind):
    stubs = write_stubs(tmp_path / "stubs")
    files = program_files(PROGRAM, kind).write(tmp_path / "routine")
    java(*stubs, *files, folder=tmp_path)


@pytest.mark.skipif(shutil.which("g++") is None, reason="no C++ compiler")
@pytest.mark.parametrize("by_line", ["0", "1"])
def test_the_sketch_compiles(tmp_path, by_line):
    program_files(PROGRAM, "arduino").write(tmp_path / "sketch")
    sketch = (tmp_path / "sketch" / "omnidyn_drive.ino").read_text()
    (tmp_path / "sketch" / "main.cpp").write_text(
        '#include "Arduino.h"\n' + sketch.replace("OMNIDYN_BY_LINE 1", f"OMNIDYN_BY_LINE {by_line}")
    )
    (tmp_path / "sketch" / "Arduino.h").write_text(ARDUINO)
    command = ["g++", "-std=c++11", "-Wall", "-Wextra", "-Werror", "-c", "main.cpp"]
    subprocess.run(command, cwd=tmp_path / "sketch", check=True)


RECEIVER = """
#include "omnidyn_drive.h"
#include "omnidyn_line.h"
#include <stdio.h>
int main(void)
{
    omnidyn_line line;
    unsigned long now;
    char text[OMNIDYN_LONGEST];
    memset(&line, 0, sizeof line);
    line.session = -1;
    while (scanf("%lu %119s", &now, text) == 2) {
        const float *inputs;
        for (const char *letter = text; *letter && *letter != '-'; letter++)
            omnidyn_letter(&line, (uint32_t)now, *letter == '~' ? '-' : *letter);
        omnidyn_letter(&line, (uint32_t)now, '\\n');
        inputs = omnidyn_acting(&line, (uint32_t)now);
        printf("%g %g %g\\n", (double)inputs[0], (double)inputs[1], (double)inputs[2]);
    }
    return 0;
}
"""


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no C compiler")
def test_the_receiver_in_c_does_as_that_in_python(tmp_path):
    """Lines that are late, lost, doubled, overtaken and wrong, of two sessions, and a clock that begins again at 0."""
    program_files(PROGRAM, "arduino").write(tmp_path / "c")
    (tmp_path / "c" / "main.c").write_text(RECEIVER)
    strict = [flag for flag in WARNINGS if flag != "-Wdouble-promotion"]
    command = ["gcc", "-std=c99", *strict, "-Wno-unused-function", "-o", "line", "main.c", "-lm"]
    subprocess.run(command, cwd=tmp_path / "c", check=True)
    rng, events, begun = np.random.default_rng(4), [], 2**32 / 1e6 - 6.0
    for session, start in ((5, 0.0), (9, 6.0)):
        for number in range(300):
            sent = start + 0.02 * number
            inputs = (0.0,) * 3 if number < 3 else tuple(rng.integers(1, 9, 3).tolist())
            command = Command(session, max(number - 2, 0), sent, 0.125, inputs)
            for _ in range(rng.choice([0, 1, 2], p=[0.1, 0.8, 0.1])):
                late = rng.choice([0.002, 0.05, 0.1, 0.4], p=[0.7, 0.1, 0.1, 0.1])
                events.append((sent + late, command))
        events.append((start + 5.0, None))
    events += [(moment, "") for moment in np.arange(0.011, 12.5, 0.02)]
    events.sort(key=lambda event: event[0])
    dead_man, wanted, text = DeadMan(3), [], []
    for moment, command in events:
        now = round(1e6 * (begun + moment))
        line = "x"
        if command is None:
            dead_man.stop()
            line = stop_line(9).decode().strip()
        elif command:
            broken = rng.random() < 0.05
            line = command_line(command).decode().strip()
            line = line.replace("*", "1*") if broken else line
            if not broken:
                dead_man.take(now / 1e6, command)
        wanted.append(dead_man.acting(now / 1e6))
        text.append(f"{now % 2**32} {line.replace('-', '~')}\n")
    said = subprocess.run(
        ["./line"], cwd=tmp_path / "c", input="".join(text), capture_output=True, text=True, check=True
    )
    got = [tuple(map(float, row.split())) for row in said.stdout.splitlines()]
    assert len(got) == len(wanted) > 1000
    assert sum(any(row) for row in wanted) > 300
    assert got == wanted


@pytest.mark.parametrize("kind", KINDS)
def test_names_from_a_robot_file_are_no_code(tmp_path, kind):
    """A name is data: no line of it becomes code of any language."""
    name = 'x"); import os #\n*/ #define X\n\\u000aSystem.exit(1); </script><b>'
    program = replace(PROGRAM, robot=PROGRAM.robot.replace(name=name), source=name)
    made = program_files(program, kind)
    for file, content in made.files.items():
        text = content if isinstance(content, str) else content.decode()
        if file.endswith(".py"):
            imported = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import)]
            assert {alias.name for node in imported for alias in node.names} <= {"math", "rclpy"}
        if file.endswith(".java"):  # Java reads it as the end of a line, in a comment too
            assert "\\u000aSystem" not in text.replace("\\\\u000a", "")
        assert "\n*/ #define" not in text
        assert "</script><b>" not in text or not file.endswith(".html")
        assert "\nSystem" not in text


@pytest.mark.parametrize("kind", ["ftc", "wpilib"])
def test_set_points_of_a_firmware_are_refused(kind):
    robot = omnidyn.load_robot("lekiwi")
    program = DriveProgram(robot, 0.02, np.ones((10, 3)))
    with pytest.raises(UnsupportedError, match="gives volts to motors"):
        program_files(program, kind)


def test_another_kind_is_refused():
    with pytest.raises(InputError, match="no such kind of program"):
        program_files(PROGRAM, "vex")


def test_pieces_give_every_row():
    rng = np.random.default_rng(0)
    rows = np.concatenate(
        [np.outer(np.linspace(0, 3, 40), [1, -1, 0.5]), rng.uniform(-6, 6, (7, 3)), np.zeros((30, 3))]
    )
    found = pieces(rows)
    again = np.concatenate([np.array(one.first) + np.arange(one.rows)[:, None] * np.array(one.step) for one in found])
    np.testing.assert_allclose(again, rows, atol=1e-8)
    assert len(found) <= 10


def test_the_page_has_each_move_and_needs_no_other_file():
    text = program_files(PROGRAM, "page").text
    for leg, returns in zip(PROGRAM.legs, PROGRAM.returns, strict=True):
        assert returns or leg.words in text
    assert "<script" not in text
    assert "http" not in text.replace("http-equiv", "")


def test_the_csv_is_the_program(tmp_path):
    (path,) = program_files(PROGRAM, "csv").write(tmp_path / "again.csv")
    held = omnidyn.read_commands(path, 3)
    np.testing.assert_array_equal(held.rows, PROGRAM.inputs)
