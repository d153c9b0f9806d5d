"""Names that others chose, in a terminal: what they hold is shown as what it is, and no line is forged."""

import json

import pytest

from omnidyn.cli.terminal import streams
from omnidyn.errors import InputError, printable
from omnidyn.model.presets import PRESETS
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml

NASTY = "bot\x1b[31m\x07\nomnidyn: wrote all.csv\r\x9b1m\u202e\u2028\x7f"
ACTS = ("\x1b", "\x07", "\r", "\x9b", "\u202e", "\u2028", "\x7f")
PLAIN = (PRESETS / "axebot.toml").read_text("utf-8")
LOG = "t_s,u1_V,u2_V,u3_V\n" + "".join(f"{k / 100},0,{3 * (k // 50 % 2)},-3\n" for k in range(300))


def robot_called(name):
    head, _, rest = PLAIN.partition("name = ")
    return f"{head}name = {json.dumps(name)}\n{rest.partition(chr(10))[2]}".replace("\x7f", "\\u007f")


def quiet(text):
    return not any(c in text for c in ACTS) and "\nomnidyn: wrote all.csv" not in text


def test_what_a_terminal_acts_on_is_shown_as_what_it_is():
    assert printable(NASTY) == (r"bot\u001b[31m\u0007\u000aomnidyn: wrote all.csv\u000d\u009b1m\u202e\u2028\u007f")
    for fine in ("Größe µ 速度 °/s", "a\u00a0b", "C:\\x", "e\u0301"):
        assert printable(fine) == fine


def test_a_robot_is_called_what_can_be_shown():
    robot = parse_robot(robot_called(NASTY))
    assert robot.name == printable(NASTY)
    assert parse_robot(robot_to_toml(robot)) == robot


@pytest.mark.parametrize("arguments", [["deadzone", "r.toml"], ["simulate", "r.toml", "u.csv"]])
@pytest.mark.parametrize("more", [[], ["--json"]])
def test_the_name_of_a_robot_says_nothing_of_its_own(call, here, arguments, more):
    (here / "u.csv").write_text(LOG)
    (here / "r.toml").write_text(robot_called(NASTY))
    code, out, err = call(*arguments, *more)
    assert code == 0
    assert quiet(out)
    assert quiet(err)
    assert r"\u001b[31m" in out


@pytest.mark.parametrize("more", [[], ["--json"]])
def test_names_of_columns_and_files_say_nothing_of_their_own(call, here, more):
    head, rows = LOG.split("\n", 1)
    columns = "ex\x1b[31mtra\u202e,ex\u202dtra,\x07bell"
    name = "a\nomnidyn: wrote all.csv\x1b[1m.csv"
    (here / name).write_text(f"{head},{columns}\n" + "".join(f"{row},1,2,3\n" for row in rows.splitlines()))
    code, out, err = call("check", name, *more)
    assert code in (0, 4)
    assert quiet(out)
    assert quiet(err)
    told = json.loads(out)["logs"][0]["findings"] if more else [{"text": " ".join(out.split())}]
    assert any(r"ex\u001b[31mtra\u202e, ex\u202dtra" in each["text"] for each in told)


def test_a_column_is_found_by_the_name_that_is_shown(call, here):
    head, rows = LOG.split("\n", 1)
    (here / "log.csv").write_text(head.replace("u2_V", "m\x07ove") + "\n" + rows)
    code, _, err = call("check", "log.csv", "--column", r"u2=m\u0007ove:V")
    assert code in (0, 4)
    assert r"u2 <- m\u0007ove [V]" in err


def test_two_columns_that_look_alike_stay_two(here):
    from omnidyn.logs.readers.read_table import read_table

    (here / "log.csv").write_text("t_s,a\x07b,a\\u0007b\n0,1,2\n1,3,4\n")
    table = read_table("log.csv")
    assert len(set(table.names)) == 3
    assert [table.numbers(name)[1] for name in table.names] == [1.0, 3.0, 4.0]


def test_a_message_of_an_error_is_one_line(call, here):
    missing = "no\nomnidyn: wrote all.csv\x1b[31m.csv"
    code, out, err = call("check", missing)
    assert (code, out) == (3, "")
    assert err == f"omnidyn: error: {printable(missing)}: no such file; check the spelling and the folder\n"
    assert str(InputError("a\nb", got="c\x1bd", where="e\u202ef")) == r"e\u202ef: a\u000ab; got c\u001bd"


def test_our_own_colours_stay(capsys, monkeypatch):
    monkeypatch.setattr(streams.sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    red = streams.painted("ERROR", "error")
    assert red == "\x1b[31mERROR\x1b[0m"
    streams.show(f"{red}  \x1b[32mforged\x1b[0m\n")
    assert capsys.readouterr().out == f"{red}  \\u001b[32mforged\\u001b[0m\n\n"


def test_presets_keep_their_names():
    assert load_robot("axebot").name == "axebot"
