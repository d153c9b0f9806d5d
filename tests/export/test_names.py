"""A robot's name is data in every language: it changes comments and names, never what a file does."""

import ast
import io
import json
import re
import shutil
import subprocess
import tomllib
import xml.etree.ElementTree as ET
import zipfile

import pytest
import yaml
from hypothesis import given, settings

import omnidyn
from omnidyn.control.controllers import ControllerFile
from omnidyn.errors import InputError
from omnidyn.export.kinds import KINDS, maker
from omnidyn.export.ros.package import package_name
from omnidyn.export.spelling import c_comment, filled, identifier, java_comment, python_comment
from omnidyn.interop.robot_json import robot_of_json
from omnidyn.interop.urdf import robot_of_urdf
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.report.html import escaped, page
from tests.support.cases import case
from tests.support.exported import WARNINGS
from tests.support.names import HOSTILE, name

ROBOT = omnidyn.load_robot("axebot")
OPTIONS = {"fmu": {"compiled": False}}


def files_of(kind, robot):
    made = maker(kind)(robot, **OPTIONS.get(kind, {}))
    if kind != "fmu":
        return made.files
    (content,) = made.files.values()
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {each.rpartition("/")[2]: archive.read(each).decode() for each in archive.namelist()}


PLAIN = {kind: files_of(kind, ROBOT.replace(name="robot_x")) for kind in KINDS}


def tree(text):
    """Elements and attributes of an XML text: of the names that a robot gives, only that they are there."""
    own = ("model", "modelName", "description", "modelIdentifier", "name")
    root = ET.fromstring(text.encode())
    return [
        (node.tag, {key: value for key, value in node.items() if key not in own})
        for node in root.iter()
        if node.tag != "File"
    ]


def unchanged(file, text, plain):
    """Whether a file does what that of another name does."""
    kind = file.rpartition(".")[2]
    if file == "package.xml":
        own, other = (re.sub("<description>.*?</description>", "", each, flags=re.DOTALL) for each in (text, plain))
        return ET.fromstring(text).findtext("description") and own == other
    if file == "CMakeLists.txt":
        return re.sub(r"^#.*\n", "", text) == re.sub(r"^#.*\n", "", plain)
    if kind == "md":
        return text.partition("\n")[2] == plain.partition("\n")[2]
    if kind in ("c", "h"):
        return text.partition("*/")[2] == plain.partition("*/")[2]
    if kind == "java":
        own, other = (re.sub(r"^//.*\n", "", each, flags=re.MULTILINE) for each in (text, plain))
        return own == other
    if kind == "py":  # bytes: the encoding that a comment names counts
        return ast.dump(ast.parse(text.encode())) == ast.dump(ast.parse(plain.encode()))
    if kind == "yaml":
        return yaml.safe_load(text) == yaml.safe_load(plain)
    if kind == "csv":
        return text.partition("place,")[2] == plain.partition("place,")[2]
    if kind == "json":
        own, other = json.loads(text), json.loads(plain)
        return own["robot"].pop("name") and other["robot"].pop("name") and own == other
    return tree(text) == tree(plain)


@pytest.mark.parametrize("examples", [12, pytest.param(60, marks=pytest.mark.long)])
def test_names_change_comments_and_names_alone(examples, tmp_path):
    heads = {"c": [], "java": []}

    @settings(max_examples=examples)
    @given(name)
    def tried(name):
        if re.search("[\ud800-\udfff]", name):  # no text
            with pytest.raises(InputError, match="expected a valid string"):
                ROBOT.replace(name=name)
            return
        robot = ROBOT.replace(name=name)
        for kind in KINDS:
            files = files_of(kind, robot)
            assert len(files) == len(PLAIN[kind])
            for (file, text), plain in zip(files.items(), PLAIN[kind].values(), strict=True):
                assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_.]*", file)
                for end in ("bringup", "node") if kind.startswith("ros2") else ():
                    text = text.replace(package_name(robot.name, end), package_name("robot_x", end))
                assert unchanged(file, text, plain), (kind, file)
        assert robot_of_json(files_of("json", robot)["robot.json"]).name == robot.name
        assert ET.fromstring(files_of("mjcf", robot)["robot.xml"]).get("model") == robot.name
        assert ET.fromstring(files_of("fmu", robot)["modelDescription.xml"]).get("modelName") == robot.name
        assert robot_of_urdf(files_of("urdf", robot)["robot.urdf"]).name == robot.name
        assert parse_robot(robot_to_toml(robot)) == robot
        assert java_comment([name]).rstrip() == f"// {robot.name}".rstrip().replace("\\", "\\\\")
        heads["c"].append(c_comment([name, name]))
        heads["java"].append(java_comment([name, name]))

    tried()
    compiled(tmp_path, heads)


def compiled(folder, heads):
    """Compile the comments, one after the other, in front of something."""
    (folder / "names.c").write_text("\n".join([*heads["c"], "extern int x;", ""]), "utf-8")
    (folder / "Names.java").write_text("".join(heads["java"]) + "public final class Names {}\n", "utf-8")
    for command in (
        ["gcc", "-std=c99", *WARNINGS, "-fsyntax-only", "names.c"],
        ["g++", "-std=c++17", *WARNINGS, "-x", "c++", "-fsyntax-only", "names.c"],
        ["clang", "-std=c99", *WARNINGS, "-fsyntax-only", "names.c"],
        ["javac", "-encoding", "UTF-8", "-d", ".", "Names.java"],
    ):
        if shutil.which(command[0]):
            subprocess.run(command, cwd=folder, check=True)


@pytest.mark.parametrize("file", ["robot.toml", "benign.toml"])
def test_code_in_a_name_does_not_run_in_java(file, tmp_path):
    folder = case("code/java_name")
    omnidyn.export.wpilib(load_robot(folder / file)).write(tmp_path / "java")
    runs_as_java(tmp_path / "java", (folder / "Main.java").read_text())


def test_java_runs_whatever_the_robot_is_called(tmp_path):
    omnidyn.export.wpilib(ROBOT.replace(name=HOSTILE[0])).write(tmp_path / "java")
    main = (
        "public class Main { public static void main(String[] a) { System.out.println(Math.abs(RobotGains.X_KV)); } }"
    )
    runs_as_java(tmp_path / "java", main)


def runs_as_java(folder, main):
    if shutil.which("javac") is None or shutil.which("java") is None:
        pytest.skip("no javac here")
    (folder / "Main.java").write_text(main)
    command = ["javac", "-encoding", "UTF-8", "Main.java", "RobotGains.java"]
    subprocess.run(command, cwd=folder, check=True)
    said = subprocess.run(["java", "-XX:TieredStopAtLevel=1", "Main"], cwd=folder, check=True, capture_output=True)
    assert float(said.stdout) > 0.0


@pytest.mark.parametrize("file", ["robot.toml", "robot2.toml", "robot3.toml"])
def test_a_name_is_no_place_of_a_template(file):
    robot = load_robot(case("code/c_placeholder") / file)
    plain = omnidyn.export.c_controller(ROBOT.replace(name="robot_x")).files
    for source, text in omnidyn.export.c_controller(robot).files.items():
        assert unchanged(source, text, plain[source])
        assert robot.name in text


def test_a_template_is_filled_once():
    assert filled("@A@ @B@", A="@B@", B="@A@") == "@B@ @A@"
    with pytest.raises(KeyError):
        filled("@C@", A="x")


@pytest.mark.parametrize(
    "word", ["class", "final", "lambda", "world", "con", "COM1", "None", "nullptr", "typeof", "yield"]
)
def test_no_identifier_is_a_word_of_a_language(word):
    assert identifier(word) == f"{word.lower()}_"


def test_a_python_file_keeps_its_encoding(tmp_path):
    """Python reads the encoding of a file in a comment: raw_unicode_escape would make code of the rest of a name."""
    import importlib.util

    path = tmp_path / "gains.py"
    path.write_text(python_comment(["coding: raw_unicode_escape \\u000araise SystemExit"]) + "X = 'ö'\n", "utf-8")
    spec = importlib.util.spec_from_file_location("gains_of_a_name", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.X == "ö"


@pytest.mark.parametrize("words", [*HOSTILE, "\U0001f916", "\x7f"])
def test_a_controller_file_keeps_every_character(words):
    table = tomllib.loads(ControllerFile("pid", {"faster": 1.5}, words).to_toml())
    assert table["source"] == words.encode("utf-8", "backslashreplace").decode()
    assert table["options"] == {"faster": 1.5}


@pytest.mark.parametrize("words", HOSTILE)
def test_a_page_shows_a_name_as_text(words):
    text = page(words, words, [], {"omnidyn": "0", "command": words, "inputs": []}, verdict=words)
    shown = escaped(words)
    assert text.count(shown) >= 5
    assert "<" not in shown
    assert shown.isprintable()
    assert text.encode("utf-8", "strict")


def test_a_name_that_grows_beyond_a_file_is_refused():
    with pytest.raises(omnidyn.OmnidynError, match="name"):
        ROBOT.replace(name="\x01" * 400)
    with pytest.raises(omnidyn.OmnidynError, match="name"):
        ROBOT.replace(name="a" * 10_000)
