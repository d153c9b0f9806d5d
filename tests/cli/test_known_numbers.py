"""The sentence on how well numbers are known agrees with their 95 % intervals, by every method."""

import json
import re
from pathlib import Path

import pytest

from omnidyn.cli import main
from omnidyn.model.keys import in_words
from tests.support.cases import case

ROBOTINO = Path(__file__).resolve().parents[2] / "examples" / "robotino"
# y and yaw have one degree of freedom each: what is small beside the scatter is not known.
TABLE = """axis,speed,force
x,0.2,2.25
x,0.4,2.43
x,0.6,2.66
x,0.8,2.80
y,0.2,1.62
y,0.4,1.99
y,0.6,1.83
yaw,1,0.071
yaw,2,0.089
yaw,3,0.11
"""


def check(told):
    """What is named as the widest has the widest interval of those that hold no 0; the others are named as unknown."""
    for own in told["groups"].values() if "groups" in told else [told]:
        shares, unknown = {}, set()
        for each in own["parameters"].values():
            low, high = each["ci95"]
            share = 0.5 * (high - low) / abs(each["value"]) if low is not None and each["value"] else float("inf")
            if low is not None and (low > 0.0 or high < 0.0) and share <= 1.0:
                shares[each["words"]] = share
            else:
                unknown.add(each["words"])
        count = f"{'all' if not unknown else len(shares)} {'of ' if unknown else ''}{len(own['parameters'])}"
        assert f"{count} numbers are known" in told["verdict"].lower()
        widest, percent = re.findall(r"the widest \(([\w ]+)\) within ([\d.]+) %", told["verdict"])[0]
        assert widest == max(shares, key=lambda words: shares[words]).replace("  ", " ")
        assert float(percent) == pytest.approx(100.0 * shares[widest], rel=0.06)
        assert all(words in told["verdict"] for words in list(unknown)[:3])


def test_a_table_of_few_points(tmp_path, capsys):
    path = tmp_path / "mine.csv"
    path.write_text(TABLE)
    assert main(["identify", str(path), "--robot", "axebot", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    check(told)
    assert in_words("friction.axes.viscous[1]") in told["verdict"].partition("not ")[2]


def test_an_interval_of_a_recording_that_holds_0(capsys):
    path = case("logs/wide_interval/mine.csv")
    assert main(["identify", str(path), "--robot", "axebot", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    check(told)
    assert told["verdict"].startswith(
        "3 of 6 numbers are known, the widest (viscous friction turning) within 66 %; not known: "
    )


def test_the_robotino_of_the_readme(capsys):
    command = ("identify", str(ROBOTINO), "--robot", "robotino", "--method", "steady-state", "--current-unsigned")
    assert main([*command, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    check(told)
    assert "the widest (Coulomb friction forward) within 48 %" in told["verdict"]
