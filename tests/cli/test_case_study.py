"""docs/case-study.md: every command of it is run, in its order, on a robot that shares no code with omnidyn."""

import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import omnidyn
from omnidyn.model.keys import Key
from tests.support.robot_keys import generator

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "case-study.md").read_text("utf-8")
STUDY = generator("case_study_pictures")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("case")


@pytest.fixture(scope="module")
def said(folder):
    """Command -> what it said."""
    found = {}
    for words, text, code in STUDY.steps(folder):
        assert code == 0, (words, text)
        found[words] = text
    return found


def saying(said, start):
    (text,) = (text for words, text in said.items() if words.startswith(start))
    return text


def in_words(text):
    """Without numbers, and without which of them is the widest."""
    return re.sub(r"[\d.]+", "N", re.sub(r" \([a-z ]+\)", "", " ".join(text.split())))


@pytest.mark.long
def test_every_command_says_what_stands_below_it(said):
    assert len(said) == 16
    blocks = re.findall(r"^```text\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
    assert len(blocks) == 4
    whole = "\n".join(map(in_words, said.values()))
    for block in blocks:
        assert in_words(block.partition("\n-")[0]) in whole


@pytest.mark.long
def test_what_the_logs_tell_is_known_within_2_percent_and_true(said, folder):
    fit = omnidyn.load_robot(folder / "fit2.toml")
    off = {}
    for name, true in STUDY.TRUE.items():
        value, std = float(Key.parse(name).get(fit)), fit.priors[name].std
        assert 2.0 * std < 0.02 * value, name
        low, high = (0.0, STUDY.AT_REST / 100.0) if "oulomb" in name else (0.0, 0.0)
        off[name] = max(low - value / true + 1.0, value / true - 1.0 - high)
        assert off[name] < 0.02, name
    assert fit.drive.latency == pytest.approx(0.016, abs=1e-3)
    assert "N of N numbers are known" in in_words(saying(said, "identify log-plan.csv log-next.csv"))


@pytest.mark.long
def test_the_unknown_robot_follows_the_path_as_it_was_promised(said):
    promised = re.search(r"([\d.]+) mm in the mean", " ".join(saying(said, "track").split()))
    driven, guessed = (float(saying(said, f"follow.py {file}").split()[0]) for file in ("fit2.toml", "guess.toml"))
    assert promised is not None
    assert driven < 1.3 * float(promised[1]) < 5.0
    assert guessed > 5.0 * driven


@pytest.mark.long
def test_its_pictures_are_drawn(said, folder):
    for drawn in (STUDY.draw_numbers, STUDY.draw_eight):
        assert isinstance(drawn(folder), Figure)
    for name in re.findall(r"\]\((images/.*?\.png)\)", PAGE):
        assert (ROOT / "docs" / name).read_bytes().startswith(b"\x89PNG")


def test_the_robot_shares_no_code_with_omnidyn():
    script = (ROOT / "examples" / "unknown_robot" / "robot.py").read_text("utf-8")
    assert set(re.findall(r"^(?:import|from) (\w+)", script, re.MULTILINE)) == {"sys", "numpy"}
