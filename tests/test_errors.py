"""How messages are put together."""

from omnidyn.errors import InputError, shortened


def test_words_are_not_cut_in_the_middle():
    text = "identified from whole logs by output error, " * 4
    short = shortened(text, 80)
    assert len(short) <= 80
    assert short.endswith("...")
    assert set(short.removesuffix("...").split()) <= set(text.replace(",", "").split()) | set(text.split())
    assert shortened("a" * 100, 20) == "a" * 17 + "..."
    assert shortened("short", 20) == "short"
    assert "'aaa" in str(InputError("no", got=["a" * 200]))
