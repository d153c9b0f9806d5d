"""omnidyn watch: a file that grows, standard input, a socket; and what it does not take."""

import json
import socket
import threading
import time

import numpy as np
import pytest

import omnidyn
from omnidyn.cli import watch
from tests.support.axebot_logs import noisy, voltages

SECONDS = 20.0


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    run = omnidyn.simulate(omnidyn.load_robot("axebot"), voltages(np.random.default_rng(5), SECONDS), 0.01)
    path = tmp_path_factory.mktemp("watch") / "log.csv"
    omnidyn.write_run(noisy(run, 3), path)
    return path.read_text().splitlines(keepends=True)


def test_a_file_that_grows_and_is_written_anew(call, here, lines, monkeypatch):
    file, sleep = here / "log.csv", time.sleep
    file.write_text("".join(lines[:400]) + lines[400][:9])

    def grow():
        with file.open("a") as stream:
            stream.write(lines[400][9:] + "".join(lines[401:700]))

    steps = iter([grow, lambda: file.write_text("".join(lines[:500]))])  # then the logger begins anew

    def pause(seconds):
        next(steps, lambda: None)()
        sleep(seconds)

    monkeypatch.setattr("omnidyn.logs.growing.time.sleep", pause)
    code, out, err = call("watch", "log.csv", "--robot", "axebot", "--idle", "0.5", "--within", "60")
    assert code in (0, 4)
    assert "log.csv was written anew" in err
    assert "     6 s  " in out
    assert "ime began anew 1 times" in out
    assert "columns of log.csv" in err
    assert "Coulomb friction forward" in out


def test_standard_input_gives_a_line_of_json_each_second(call, here, monkeypatch, lines):
    (here / "rows").write_text("".join(lines))
    with (here / "rows").open() as stream:
        monkeypatch.setattr("sys.stdin", stream)
        code, out, err = call("watch", "-", "--robot", "axebot", "--json", "--within", "1")
    answers = [json.loads(line) for line in out.splitlines()]
    assert [round(answer["seconds"]) for answer in answers] == [*range(1, 21), 20]  # the last: all fitted once more
    number = answers[-1]["numbers"]["friction.axes.coulomb[0]"]
    assert number["low"] < 2.2 < number["high"]
    assert not number["reached"]
    assert code == 4
    assert not answers[-1]["enough"]
    assert "not yet: after 20 s" in err.lower()


def test_a_socket(call, lines, monkeypatch):
    listening, say = threading.Event(), watch.say
    monkeypatch.setattr(watch, "say", lambda text: (say(text), listening.set()))  # its first words: it listens
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]

    def send():
        assert listening.wait(60)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for first in range(0, 800, 10):
                sender.sendto("".join(lines[first : first + 10]).encode(), ("127.0.0.1", port))
                time.sleep(0.002)

    thread = threading.Thread(target=send, daemon=True)
    thread.start()
    code, out, err = call("watch", f"udp:{port}", "--robot", "axebot", "--idle", "2", "--within", "60")
    thread.join(60)
    assert f"listening at 127.0.0.1:{port}" in err
    assert "     7 s  " in out
    assert code in (0, 4)


def test_until_enough(call, here, lines):
    (here / "log.csv").write_text("".join(lines))
    options = ("--free", "friction.axes.coulomb[0]", "--until-enough", "--idle", "0.5")
    code, out, _ = call("watch", "log.csv", "--robot", "axebot", *options)
    assert code == 0
    assert "Enough: after" in out
    assert "    19 s  " not in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("missing.csv",), "missing.csv: no such file"),
        (("udp:x",), "not a port; got udp:x; expected udp:PORT"),
        (("log.csv", "--within", "0"), "--within: out of range; got 0; expected above 0 %"),
        (("log.csv", "--idle", "-1"), "--idle: out of range"),
        (("log.mcap",), "only text can be read while it grows; got mcap; expected a text file such as CSV"),
    ],
)
def test_what_it_does_not_take(call, here, arguments, words):
    (here / "log.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(100))
    (here / "log.csv").write_text("t_s\n")
    code, _, err = call("watch", *arguments, "--robot", "axebot")
    assert code == 3
    assert words in err


def test_numbers_are_shown_though_a_file_of_another_robot_takes_the_place(call, here, lines, monkeypatch):
    (here / "log.csv").write_text("".join(lines[:700]))
    other = "t_s,u1_V,u2_V,u3_V,u4_V,vx_m_s,vy_m_s,omega_rad_s\n"
    other += "".join(f"{0.01 * k:.2f},1,1.1,{k % 9},1.3,0.1,0.2,0.3\n" for k in range(300))
    monkeypatch.setattr("omnidyn.logs.growing.time.sleep", lambda _: (here / "log.csv").write_text(other))
    code, out, err = call("watch", "log.csv", "--robot", "axebot", "--idle", "5")
    assert code == 3
    assert "more wheels than the robot; got 4 wheels; expected 3" in err
    assert "95 % interval" in out


def test_times_that_are_too_short_are_seen(call, here, lines):
    """Times a thousand times too short: 2001 rows came, in no time."""
    head, *rows = lines
    short = [f"{float(at) / 1000.0:.6f},{rest}" for at, rest in (row.split(",", 1) for row in rows)]
    (here / "log.csv").write_text(head + "".join(short))
    code, out, _ = call("watch", "log.csv", "--robot", "axebot", "--idle", "0.2")
    assert code == 4
    assert "after 0 s and 2001 rows" in out


def test_a_wrong_key_is_refused_before_the_drive(call, here):
    (here / "log.csv").write_text("t_s\n")
    code, out, err = call("watch", "log.csv", "--robot", "axebot", "--free", "friction.axis", "--idle", "0.2")
    assert (code, out) == (3, "")
    assert "unknown key; got friction.axis" in err


def test_standard_input_that_is_closed_or_empty(call, here, monkeypatch):
    monkeypatch.setattr("sys.stdin", None)
    code, _, err = call("watch", "-", "--robot", "axebot")
    assert code == 3
    assert "standard input is closed; expected rows of text; pipe them in" in err
    (here / "rows").write_text("")
    with (here / "rows").open() as stream:
        monkeypatch.setattr("sys.stdin", stream)
        code, out, _ = call("watch", "-", "--robot", "axebot")
    assert code == 4
    assert "after 0 s and 0 rows" in out
    assert "number  key" not in out


def test_a_robot_with_a_speed_loop_that_rests_is_waited_for(call, here):
    still = np.zeros((600, 3))
    omnidyn.write_run(omnidyn.Run(t=0.01 * np.arange(600), wheel_speed=still, wheel_speed_command=still), "log.csv")
    code, out, _ = call("watch", "log.csv", "--robot", "robotino", "--idle", "0.2")
    assert code == 4
    assert "the robot never visibly moved" in out
