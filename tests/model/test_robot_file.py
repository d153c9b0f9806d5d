"""Robot files: what they give, what comes back, and every bad one refused by name (BAD_INPUTS.md, rows 1-2, 31-33).

Each bad file is the axebot preset with one edit; the message must name the key, the fault and what was expected.
"""

import os
import random
import re
import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from omnidyn.errors import InputError, OmnidynError
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import PRESETS, load_robot, parse_robot, preset_names, robot_to_toml, save_robot
from tests.support.growth import LINEAR, growth

AXEBOT = (PRESETS / "axebot.toml").read_text(encoding="utf-8")


def edited(old: str, new: str) -> str:
    assert old in AXEBOT, f"the preset has no {old!r} any more"
    return AXEBOT.replace(old, new, 1)


# ---- good files ------------------------------------------------------------------------------------------


def test_the_preset_is_table_3(axebot):
    """The printed numbers of Table 3, one by one."""
    assert (axebot.body.mass, axebot.body.inertia, axebot.body.rotating_frame) == (1.5, 0.025, False)
    assert axebot.wheels.azimuth_deg == (180.0, -60.0, 60.0)
    assert (axebot.wheels.robot_radius, axebot.wheels.wheel_radius) == (0.1, 0.035)
    motor = axebot.motor
    assert (motor.resistance, motor.inductance) == (1.69, 0.00011)
    assert (motor.torque_constant, motor.emf_constant, motor.gear_ratio, motor.voltage_limit) == (
        0.0059,
        0.0059,
        19.0,
        6.0,
    )
    assert (motor.current_limit, motor.electrical) == (None, "quasi-static")
    assert axebot.friction.axes.viscous == (0.94, 0.96, 0.01)
    assert axebot.friction.axes.coulomb == (2.2, 1.5, 0.099)
    assert axebot.friction.axes.breakaway is None
    assert axebot.priors == {}


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_says_where_it_comes_from_and_survives_writing(name, tmp_path):
    robot = load_robot(name)
    assert robot.name == name
    assert len(robot.source) > 20
    path = save_robot(robot, tmp_path / "copy.toml")
    assert load_robot(path) == robot
    assert load_robot(str(path)) == robot


def test_numbers_with_what_is_known_about_them():
    text = edited("resistance_ohm = 1.69", 'resistance_ohm = { value = 1.7, std = 0.05, source = "datasheet" }')
    text = text.replace("coulomb = [2.2,", "coulomb = [{ value = 2.2, std = 0.1 },")
    robot = parse_robot(text)
    assert robot.motor.resistance == 1.7
    assert robot.friction.axes.coulomb == (2.2, 1.5, 0.099)
    assert robot.priors == {
        "motor.resistance_ohm": Prior(std=0.05, source="datasheet"),
        "friction.axes.coulomb[0]": Prior(std=0.1),
    }
    assert parse_robot(robot_to_toml(robot)) == robot


def test_a_byte_order_mark_and_windows_line_ends_are_fine(tmp_path, axebot):
    path = tmp_path / "windows.toml"
    path.write_bytes(b"\xef\xbb\xbf" + AXEBOT.replace("\n", "\r\n").encode())
    assert load_robot(path) == axebot


def test_an_integer_is_a_number(axebot):
    assert parse_robot(edited("mass_kg = 1.5", "mass_kg = 2")).body.mass == 2.0


# ---- bad files -------------------------------------------------------------------------------------------

MASS = "mass_kg = 1.5"
AZIMUTH = "[180.0, -60.0, 60.0]"
VISCOUS = "viscous = [0.94, 0.96, 0.01]"
BAD = {
    "unknown key": (MASS, f"{MASS}\nmas_kg = 1.0", "mas_kg: unknown key; got mas_kg; did you mean mass_kg"),
    "unknown table": ("[motor]", "[motors]\na = 1\n[motor]", "unknown key; got motors; did you mean motor"),
    "unknown key, nothing near": (
        MASS,
        f"{MASS}\nzzz = 1",
        "zzz: unknown key; got zzz; known keys: centre_height_m, centre_m, inertia_kg_m2, mass_kg",
    ),
    "missing key": (MASS, "", "mass_kg: a key is missing; expected mass_kg"),
    "missing table": (AXEBOT[AXEBOT.index("[motor]") : AXEBOT.index("[friction")], "", "motor: a key is missing"),
    "string for number": (
        MASS,
        'mass_kg = "1.5"',
        'mass_kg: cannot use this value; got the text "1.5"; expected a valid number; write numbers without quotes',
    ),
    "date for number": (MASS, "mass_kg = 2020-01-01", "mass_kg: cannot use this value; .*expected a valid number"),
    "NaN": (MASS, "mass_kg = nan", "mass_kg: cannot use this value; got nan; expected a finite number"),
    "bool": (MASS, "mass_kg = true", "mass_kg: cannot use this value; got True; expected a valid number"),
    "infinity": (MASS, "mass_kg = inf", "mass_kg: cannot use this value; got inf; expected a finite number"),
    "1e400, which tomllib takes for inf": (
        MASS,
        "mass_kg = 1e400",
        "mass_kg: cannot use .*got inf; expected a finite number",
    ),
    "negative mass": (MASS, "mass_kg = -1.5", "mass_kg: cannot use this value; got -1.5; expected greater than"),
    "no mass": (MASS, "mass_kg = 0.0", "mass_kg: cannot use this value; got 0.0; expected greater than"),
    "R = 0": ("resistance_ohm = 1.69", "resistance_ohm = 0", "resistance_ohm: cannot use .*got 0; expected greater"),
    "L = 0": ("inductance_H = 0.00011", "inductance_H = 0", "inductance_H: cannot use .*got 0; expected greater"),
    "l = 0": ("gear_ratio = 19.0", "gear_ratio = 0.0", "gear_ratio: cannot use .*got 0.0; expected greater"),
    "i_max = 0": (
        "gear_ratio = 19.0",
        "gear_ratio = 19.0\ncurrent_limit_A = 0",
        "current_limit_A: cannot use .*got 0; exp",
    ),
    "u_max < 0": (
        "voltage_limit_V = 6.0",
        "voltage_limit_V = -6",
        "voltage_limit_V: cannot use .*got -6; expected greater",
    ),
    "negative Coulomb": (
        "coulomb = [2.2,",
        "coulomb = [-2.2,",
        r"coulomb\[0\]: cannot use .*got -2.2; expected greater",
    ),
    "NaN in a list": (VISCOUS, "viscous = [0.94, nan, 0.01]", r"viscous\[1\]: cannot use .*got nan; expected a finite"),
    "breakaway below Coulomb": (VISCOUS, f"{VISCOUS}\nbreakaway = [2.2, 1.4, 0.1]", "breakaway .* is below coulomb"),
    "2 wheels": (AZIMUTH, "[180.0, 60.0]", "azimuth_deg: cannot use this value; .*expected at least 3 values"),
    "10 000 wheels": (AZIMUTH, str([i % 360.0 for i in range(10_000)]), "azimuth_deg: cannot use .*at most 16"),
    "wheels all at one place": (AZIMUTH, "[60.0, 60.0, 60.0]", "cannot move the robot in every direction"),
    "one number for the wheels": (AZIMUTH, "180.0", "azimuth_deg: cannot use this value; got 180.0"),
    "4 numbers for 3 axes": (
        VISCOUS,
        "viscous = [1, 2, 3, 4]",
        "viscous: cannot use this value; .*expected at most 3 values",
    ),
    "2 numbers for 3 axes": (VISCOUS, "viscous = [1.0, 2.0]", r"\[friction\.axes\] viscous: too few values"),
    "2 resistances for 3 motors": (
        "resistance_ohm = 1.69",
        "resistance_ohm = [1.0, 2.0]",
        r"resistance has 2 values.*\(3\)",
    ),
    "4 radii for 3 wheels": (
        "wheel_radius_m = 0.035",
        "wheel_radius_m = [1, 1, 1, 1]",
        r"wheel_radius has 4 values.*\(3\)",
    ),
    "a table that is a number": ("[body]", "body = 3\n[bodies]", "body: cannot use this value"),
    "a list of tables": ("[wheels]", "[[wheels]]", "wheels: cannot use this value"),
    "duplicate key": (MASS, f"{MASS}\n{MASS}", "not valid TOML; got Cannot overwrite a value .at line 7"),
    "duplicate table": ("[wheels]", "[body]", "not valid TOML; got Cannot declare .*line 10"),
    "syntax": (MASS, "mass_kg = = 1.5", "not valid TOML; got Invalid value .at line 6"),
    "other schema": ("schema = 1", "schema = 2", "schema: unknown schema; got 2; expected schema = 1"),
    "no schema": ("schema = 1", "", "schema: unknown schema; got none; expected schema = 1"),
    "schema true": ("schema = 1", "schema = true", "schema: unknown schema; got True; expected schema = 1"),
    "dynamic without inductance": ("inductance_H = 0.00011", "electrical = 'dynamic'\n#", "needs inductance_H"),
    "a word for electrical": (
        '"quasi-static"',
        '"static"',
        "electrical: cannot use .*got static; expected 'quasi-static'",
    ),
    "5000 digits": (MASS, "mass_kg = " + "9" * 5000, "not valid TOML; got Exceeds the limit .4300 digits"),
    "4000 digits": (MASS, "mass_kg = " + "9" * 4000, "mass_kg: cannot use this value"),
    "deviation below 0": (
        MASS,
        "mass_kg = { value = 1.5, std = -1.0 }",
        r"\[body\] mass_kg: std: .*got -1.0; expected greater",
    ),
    "misspelt deviation": (MASS, "mass_kg = { value = 1.5, st = 1.0 }", "mass_kg: st: unknown key; .*did you mean std"),
    "unknown origin": (
        MASS,
        'mass_kg = { value = 1.5, origin = "guessed" }',
        r"\[body\] mass_kg: origin: .*got guessed; expected 'guess', 'joint', 'given', 'datasheet'",
    ),
    "deviation without value": (MASS, "mass_kg = { std = 1.0 }", "mass_kg: cannot use this value"),
    "priors": ("schema = 1", "schema = 1\npriors = {}", "unknown key; got priors"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_in_words(case):
    old, new, words = BAD[case]
    text = edited(old, new)
    if case == "dynamic without inductance":
        text = text.replace('electrical = "quasi-static"', "")
    with pytest.raises(InputError, match=words) as caught:
        parse_robot(text, "my.toml")
    assert str(caught.value).startswith("my.toml: ")
    assert len(str(caught.value)) < 500
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 3


def test_a_number_where_a_list_belongs_is_told_so():
    """`tuple` is a word of Python's, not of TOML's."""
    text = re.sub(r"^coulomb = .*$", "coulomb = 1.0", AXEBOT, flags=re.MULTILINE)
    with pytest.raises(InputError, match=r"\[friction\.axes\] coulomb: .*; got 1\.0; expected a list$"):
        parse_robot(text)


BOMBS = {  # name -> its size, and what makes one of a size
    "brackets": (100_000, lambda n: "a = " + "[" * n + "]" * n),
    "tables": (20_000, lambda n: "a = " + "{ b = " * n + "1" + " }" * n),
    "tables not too deep for the parser": (150, lambda n: AXEBOT.replace("1.5", "{ a = " * n + "1" + " }" * n, 1)),
    "many keys": (60_000, lambda n: AXEBOT + "\n".join(f"k{i} = 1" for i in range(n))),
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_bomb_is_refused_at_once(bomb):
    """In a time that grows as its size."""
    size, make = BOMBS[bomb]

    def refused(size, number):
        with pytest.raises(InputError):
            parse_robot(make(size))

    assert growth(refused, size) <= LINEAR


def test_a_dotted_key_50_000_deep():
    with pytest.raises(InputError):
        parse_robot(AXEBOT + "\n[" + ".".join("a" * 50_000) + "]\nb = 1\n")


def test_a_hexadecimal_schema_of_5000_digits():
    """Hexadecimal integers have no limit in tomllib; Python refuses to print them."""
    with pytest.raises(InputError):
        parse_robot(edited("schema = 1", "schema = 0x" + "f" * 5000))


# ---- bad places ------------------------------------------------------------------------------------------


def test_places_where_there_is_no_robot(tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"no such robot; got axbot; expected .*axebot.*; did you mean axebot\?"):
        load_robot("axbot")
    (tmp_path / "mini.toml").write_text("", "utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"no such robot; got mini; .* did you mean mini.toml\?"):
        load_robot("mini")
    with pytest.raises(InputError, match=r"nothing\.toml: no such file"):
        load_robot(tmp_path / "nothing.toml")
    with pytest.raises(InputError, match="got a folder; expected a file"):
        load_robot(tmp_path)
    (tmp_path / "empty.toml").touch()
    with pytest.raises(InputError, match=r"empty\.toml: the file is empty"):
        load_robot(tmp_path / "empty.toml")
    (tmp_path / "zip.toml").write_bytes(b"PK\x03\x04" + bytes(100))
    with pytest.raises(InputError, match=r"not a text file; got a zip archive"):
        load_robot(tmp_path / "zip.toml")
    (tmp_path / "huge.toml").write_text("#" * (2**20 + 1))
    with pytest.raises(InputError, match="too large; got more than 1048576 bytes"):
        load_robot(tmp_path / "huge.toml")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_does_not_block(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(InputError, match=r"not a regular file \(a pipe or a device\)"):
        load_robot(tmp_path / "pipe.toml")


def test_saving_never_overwrites_unless_told(tmp_path, axebot, four_wheel):
    path = save_robot(axebot, tmp_path / "a.toml")
    with pytest.raises(InputError, match=r"a\.toml: the file exists already; use `force`"):
        save_robot(four_wheel, path)
    assert load_robot(path) == axebot
    save_robot(four_wheel, path, force=True)
    assert load_robot(path) == four_wheel
    assert os.listdir(tmp_path) == ["a.toml"]


# ---- anything at all -------------------------------------------------------------------------------------


@given(st.binary(max_size=400))
def test_any_bytes_give_an_omnidyn_error(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "bytes.toml"
    path.write_bytes(content)
    with pytest.raises(OmnidynError):
        load_robot(path)


@given(
    st.text(st.sampled_from(string.printable + "é\ud800\x00"), max_size=60),
    st.integers(0, len(AXEBOT)),
    st.integers(0, 40),
)
def test_a_damaged_file_gives_a_robot_or_an_omnidyn_error(junk, place, length):
    """Some of the preset replaced by junk."""
    try:
        robot = parse_robot(AXEBOT[:place] + junk + AXEBOT[place + length :])
    except OmnidynError:
        return
    assert parse_robot(robot_to_toml(robot)) == robot


TOML_VALUES = [
    "nan",
    "-inf",
    "true",
    '"x"',
    "[]",
    "{}",
    "[1,2,3]",
    "[[1],[2],[3]]",
    "1e999",
    "-0.0",
    "1979-05-27",
    "{value=1}",
]
TOML_VALUES += ["{value={}}", "{value=[1,2,3],std=1}", "9" * 4000, "[nan,nan,nan]", "[{value=1,std=0},1,1]", "1e-320"]


def test_any_value_at_any_key_gives_a_robot_or_an_omnidyn_error():
    lines = AXEBOT.splitlines()
    keys = [i for i, line in enumerate(lines) if "=" in line]
    refused = 0
    for i in keys:
        for value in TOML_VALUES:
            changed = [*lines[:i], lines[i].split("=")[0] + "= " + value, *lines[i + 1 :]]
            try:
                parse_robot("\n".join(changed))
            except OmnidynError:
                refused += 1
    assert refused > 0.8 * len(keys) * len(TOML_VALUES)


def test_bytes_flipped_at_random(tmp_path):
    """400 files, each with a few bytes of the preset changed."""
    draw, path = random.Random(1), tmp_path / "flipped.toml"
    for _ in range(400):
        content = bytearray(AXEBOT.encode())
        for _ in range(draw.randrange(1, 6)):
            content[draw.randrange(len(content))] = draw.randrange(256)
        path.write_bytes(content)
        try:
            load_robot(path)
        except OmnidynError as error:
            assert "\n" not in str(error)  # noqa: PT017


@pytest.mark.parametrize(
    "right, wrong, where",
    [
        ("mass_kg", "mas_kg", "[body] mas_kg"),
        ("resistance_ohm", "resistance_Ohm", "[motor] resistance_Ohm"),
        ("robot_radius_m", "robot_radius", "[wheels] robot_radius"),
    ],
)
def test_a_typo_is_named_before_the_key_that_is_missing_for_it(right, wrong, where):
    with pytest.raises(InputError) as caught:
        parse_robot(AXEBOT.replace(f"{right} =", f"{wrong} ="), "my.toml")
    assert str(caught.value) == f"my.toml: {where}: unknown key (and 1 more); got {wrong}; did you mean {right}?"
