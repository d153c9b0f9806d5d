"""Formulas on a page: as one writes them by hand; text that is none stays as it is, and is escaped."""

import pytest

from omnidyn.report.formulas import formula


@pytest.mark.parametrize(
    "text, shown",
    [
        ("K_t = K_v", "<i>K</i><sub>t</sub> = <i>K</i><sub>v</sub>"),
        ("v and v_n", "v and <i>v</i><sub>n</sub>"),
        ("[v v_n w] = R(theta) d(xi)/dt", "[v <i>v</i><sub>n</sub> w] = R(θ) dξ/dt"),
        ("r sqrt(3)/3 (w2 - w3)", "r √3/3 (<i>w</i><sub>2</sub> \N{MINUS SIGN} <i>w</i><sub>3</sub>)"),
        ("0 <= i <= i_max", "0 ≤ i ≤ <i>i</i><sub>max</sub>"),
        ("kg m^2", "kg m<sup>2</sup>"),
        ("-0.67 r1", "\N{MINUS SIGN}0.67 <i>r</i><sub>1</sub>"),
        ("within 1e-12 W", "within 10<sup>\N{MINUS SIGN}12</sup> W"),
        ("R = 2.06 ohm", "R = 2.06\N{NO-BREAK SPACE}Ω"),
        ("0.94 +- 0.55 N s/m", "0.94 ± 0.55\N{NO-BREAK SPACE}N\N{NO-BREAK SPACE}s/m"),
        ("back-EMF of a three-wheeled robot", "back-EMF of a three-wheeled robot"),
        ("eqs (4)-(6)", "eqs (4)-(6)"),
    ],
)
def test_a_formula(text, shown):
    assert formula(text) == shown


def test_tags_in_a_text_are_text():
    assert formula("<script>K_t</script>") == "&lt;script&gt;<i>K</i><sub>t</sub>&lt;/script&gt;"
