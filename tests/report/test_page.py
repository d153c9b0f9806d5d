"""The page: it needs nothing from outside, runs nothing, and shows text as text."""

import base64
import hashlib
import re

import pytest

from omnidyn.paper.claim import Claim, ClaimVerdict
from omnidyn.report.page import SIGNS, STYLE, render_page
from omnidyn.report.style import Picture, new_figure
from tests.support.outputs import Reader

EVIL = "<script>alert(1)</script> & \"x\" 'y' </td></table>"
ROBOT = {"role": "robot", "name": "axebot", "sha256": "ab" * 32}
RECORD = {"omnidyn": "0.1.0", "command": "omnidyn demo", "inputs": [ROBOT]}
FIGURE = Picture("fig", "Title", "Caption", new_figure(1.0, 1.0))


def claim(verdict=ClaimVerdict.REPRODUCED, key="key", text="a plain word", numbers=None):
    return Claim(key, text, text, text, text, verdict, text, numbers or {"speed": [1.0, 2.5]})


def page(claims=None, pictures=None, title="A title", record=RECORD):
    return render_page(title, "Words.", claims or [claim()], pictures or [FIGURE], record)


@pytest.fixture(scope="module")
def demo_page(pictures):
    from omnidyn.paper.claims import all_claims

    return render_page("Title", "Words.", all_claims(), pictures, RECORD)


def test_it_is_whole_and_every_id_is_there_once(demo_page):
    ids = Reader(demo_page).all("id")
    assert len(ids) == len(set(ids))
    assert {"frames-and-wheels", "validation--section-4", "made", "fig1_robot"} <= set(ids)
    assert "figures" not in ids  # each stands beside its claims


def test_every_picture_stands_in_front_of_its_claims(demo_page):
    for name, first, last in (
        ("fig1_robot", "frames", "noise"),
        ("fig3_friction", "table-2-viscous-x", "table-2-coulomb-yaw"),
        ("fig2_traces", "steady-speed-x", "force-yaw"),
        ("fig5_dead_zone", "dead-zone-x", "dead-zone-yaw"),
        ("fig4_steps", "fig-4", "fig-4"),
        ("fig6_reconcile", "one-robot", "axes-disagree"),
    ):
        place = demo_page.index(f'id="{name}"')
        begin, end = demo_page.rindex("<section", 0, place), demo_page.index("</section>", place)
        assert begin < place < demo_page.index(f'id="{first}"') < end, name
        assert demo_page.index(f'id="{last}"') < end, name


def test_what_came_out_and_the_rule_stand_at_the_top(demo_page):
    from omnidyn.paper.claims import RULE, all_claims, headlines

    head = Reader(demo_page[: demo_page.index("<nav>")] + "</header></main></body></html>")
    assert head.tags.count("ol") == 1
    for line in headlines(all_claims()):
        assert line[:20] in head.text.replace("\N{NO-BREAK SPACE}", " ")
    assert RULE in head.text


def test_what_the_text_does_not_hold_stands_apart(demo_page):
    for key in ("current-limit", "figs-1-3", "mpc"):
        row = demo_page.index(f'<tr id="{key}">')
        table = demo_page.rindex("<table", 0, row)
        assert "<h3>Nothing to judge</h3>" in demo_page[table - 80 : table], key


def test_a_picture_can_be_made_large_without_a_script():
    read = Reader(page())
    assert "zoom-fig" in read.all("id")
    assert "zoom-fig" in read.all("for")
    assert ".zoom:checked" in STYLE


def test_pictures_beyond_the_subjects_have_a_section_of_their_own():
    assert "figures" in Reader(page()).all("id")


def test_it_asks_for_nothing_from_outside(demo_page):
    read = Reader(demo_page)
    links = [*read.all("src"), *read.all("href"), *read.all("action"), *read.all("data"), *read.all("srcset")]
    assert links
    assert all(link.startswith(("data:", "#")) for link in links)
    assert "url(" not in STYLE
    assert "@import" not in STYLE


def test_it_runs_nothing(demo_page):
    read = Reader(demo_page)
    assert not {"script", "iframe", "object", "embed", "form", "base"} & set(read.tags)
    assert not [name for _, name, _ in read.values if name.startswith("on") or name == "style"]


def test_the_policy_allows_this_style_and_embedded_images_only():
    text = page()
    policy = next(value for value in Reader(text).all("content") if "src" in value)
    assert "default-src 'none'" in policy
    assert "img-src data:;" in policy
    assert "unsafe" not in policy
    style = re.search(r"<style>(.*?)</style>", text, re.DOTALL)
    assert style
    digest = base64.b64encode(hashlib.sha256(style[1].encode()).digest()).decode()
    assert f"style-src 'sha256-{digest}'" in policy


def test_all_text_is_escaped():
    evil = Picture(EVIL, EVIL, EVIL, new_figure(1.0, 1.0))
    record = {"omnidyn": EVIL, "command": EVIL, "inputs": [{"role": EVIL, "name": EVIL, "sha256": EVIL}]}
    text = page([claim(key=EVIL, text=EVIL, numbers={EVIL: 1.0})], [evil], EVIL, record)
    read = Reader(text)
    assert "script" not in read.tags
    assert read.text.count("<script>alert(1)</script>") >= 12


@pytest.mark.parametrize("verdict", list(ClaimVerdict))
def test_a_verdict_has_a_colour_a_sign_and_words(verdict):
    colour, sign = verdict.short, SIGNS[verdict.short]
    text = page([claim(verdict)])
    assert f'class="badge {colour}"' in text
    assert sign in text
    assert verdict.value in Reader(text).text
    assert f".{colour} {{" in STYLE


def test_the_counts_add_up(demo_page):
    from omnidyn.paper.claims import all_claims

    counted = [int(number) for number in re.findall(r"</span> <b>(\d+)</b>", demo_page)]
    assert len(counted) == len(ClaimVerdict)
    assert sum(counted) == len(all_claims())


def test_the_numbers_behind_a_claim_are_there_to_the_last_digit():
    text = Reader(page([claim(numbers={"speed": 0.1 + 0.2, "rows": [1.0, 1e-300]})])).text
    assert "speed = 0.30000000000000004\nrows = [1.0, 1e-300]" in text


def test_a_claim_without_numbers_has_no_empty_box():
    bare = Claim("key", "a", "b", "c", "d", ClaimVerdict.REPRODUCED, "e")
    assert "<details>" not in page([bare])


def test_where_it_comes_from_is_on_it():
    text = Reader(page()).text
    assert "omnidyn demo" in text
    assert "axebot, sha256 " + "ab" * 32 in text


def test_light_dark_paper_and_narrow_screens_are_thought_of():
    for words in ("prefers-color-scheme: dark", "@media print", "max-width"):
        assert words in STYLE


def contrast(one, other):
    """WCAG contrast of two #rrggbb colours."""

    def luminance(colour):
        parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("block", [0, 1, 2])
def test_every_word_stands_out_from_its_ground(block):
    """Light, dark, print: 4.5 is what the accessibility guidelines ask for."""
    blocks = [dict(re.findall(r"--(\w+): (#\w{6})", text)) for text in re.findall(r":root \{(.*?)\}", STYLE, re.DOTALL)]
    assert len(blocks) == 3
    for name in ("ink", "soft", "yes", "mended", "no"):
        assert contrast(blocks[block][name], blocks[block]["paper"]) >= 4.5, name
