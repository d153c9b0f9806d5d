"""A plan that is driven by key in a real browser, until it is enough."""

from tests.support.pages import pick, shown, tab, verdict

STAGE = "document.querySelector('omni-run')?.dataset.stage"
ENOUGH = "document.querySelector('#told-verdict')?.innerText.includes('Enough')"


def hold_space_until(page, reached):
    """Hold the space bar until something is so, and once more where a busy machine lost it."""
    for _ in range(100):
        if page.locator("#go-on").count():
            page.click("#go-on")
        page.wait_for_selector("#hold:not([disabled])")
        page.keyboard.down(" ")
        page.wait_for_function(f"{reached} || ['stopped', 'done'].includes({STAGE})")
        if page.evaluate(reached):
            return
        page.keyboard.up(" ")
    raise AssertionError(page.inner_text(".panels"))


def test_a_plan_is_driven_by_the_space_bar_until_it_is_enough(browser):
    _, page = browser.start()
    tab(page, "Drive")
    page.click(".robot >> visible=true")
    pick(page, "axebot")
    page.get_by_label("what is driven").get_by_text("A plan").click()
    page.get_by_label("enough: ± %").fill("5")
    page.click("#plan:not([disabled])")
    assert "all 6 numbers of axebot" in verdict(page, "#plan-verdict")
    page.click(".which")
    pick(page, "simulated, 10 times as fast")
    assert page.inner_text("#now").startswith("Next move 1 of ")
    hold_space_until(page, "+document.querySelector('omni-run').dataset.row > 2000")
    page.evaluate("dispatchEvent(new Event('blur'))")  # another window is in front
    page.wait_for_selector("#go-on")
    page.keyboard.up(" ")
    assert "the key was released" in verdict(page, "#drive-verdict")
    assert "It stands in the middle again" in page.inner_text("#drive-remedy")
    assert page.inner_text("#now").startswith("Stopped in move ")
    shown(page, "plan")
    hold_space_until(page, ENOUGH)
    page.keyboard.up(" ")
    page.wait_for_selector("#fit-plan")
    for part in (".meter", ".reached", ".promised"):
        assert page.locator(f"#told {part}").count() == 6
    page.click("#fit-plan")
    page.get_by_text("planned-1.csv").first.wait_for()
