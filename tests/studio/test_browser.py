"""The studio in a real browser: each test ends in what a page shows and the command prints for the same file."""

import resource
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest

import omnidyn
from omnidyn.document import in_clauses
from omnidyn.model.keys import Key
from tests.support.pages import (
    as_flags,
    choose_axebot,
    command,
    drop,
    laid_out,
    load_again,
    numbers,
    pick,
    shown,
    tab,
    verdict,
    write_log,
)

# How long the server takes to answer a click [ms]: it turns the page dark, or light again
ANSWER = """() => new Promise(done => { const begun = performance.now();
    new MutationObserver((_, o) => { o.disconnect(); done(performance.now() - begun); })
        .observe(document.body, { attributes: true, attributeFilter: ['class'] });
    document.querySelector("[aria-label='light or dark']").click(); })"""
ROBOTINO = Path(__file__).parents[2] / "examples" / "robotino" / "exp00.csv"


def assert_same_numbers(page, path, *options):
    """The table of the page has the numbers that `omnidyn identify` prints."""
    said, code, words = command("identify", path, "--robot", "axebot", "--json", *options)
    assert code == 0, words
    shown = numbers(page)
    assert len(said["parameters"]) >= 6
    for key, number in said["parameters"].items():
        assert shown[key] == f"{number['value']:.5g}", key


def test_from_nothing_to_a_robot(browser, tmp_path):
    begun = time.monotonic()
    studio, page = browser.start()
    page.click("#example")
    assert verdict(page).startswith("Usable for whole logs")
    tab(page, "Fit")
    page.click("#fit:not([disabled])")
    words = verdict(page, "#fit-verdict")
    print(f"3 clicks, {time.monotonic() - begun:.1f} s from the start of the server")
    shown(page, "fit")
    log = tmp_path / "example.csv"
    log.write_bytes(page.request.get(f"{studio.address}log/log2/log").body())
    robot = tomllib.loads(page.request.get(f"{studio.address}fit/robot.toml").text())
    assert robot["friction"]["axes"]["coulomb"][0]["value"] == pytest.approx(2.2, abs=0.03)  # Table 3
    report = page.request.get(f"{studio.address}fit/report.html").text()
    assert all(line in report for line in words.splitlines())
    assert len(words.splitlines()[0].split()) <= 25
    assert_same_numbers(page, log)


def test_currents_without_a_sign_are_told_and_mended(browser):
    _, page = browser.start(ROBOTINO)
    assert verdict(page) == laid_out(command("check", ROBOTINO, "--json")[0]["verdict"])
    page.click("text=Apply this remedy")
    mended = command("check", ROBOTINO, "--current-unsigned", "--json")[0]["verdict"]
    page.get_by_text(in_clauses(mended)[0]).first.wait_for()
    page.get_by_text("The same by hand").first.click()
    assert "--current-unsigned" in page.inner_text("#call")


def test_a_click_on_a_shaded_stretch_explains_it(browser, tmp_path):
    def stick(twist):
        twist[900:1100] = twist[900]

    path = write_log(tmp_path / "stuck.csv", change=stick)
    said = command("check", path, "--json")[0]["logs"][0]
    with_rows = next(finding for finding in said["findings"] if finding["rows"])
    _, page = browser.start(path)
    assert verdict(page) == laid_out(said["verdict"])
    page.wait_for_function("document.querySelector('omni-plot').frames > 0")
    shown(page, "log")
    row = np.mean(with_rows["rows"][0]) - 2  # the first row of the file is its head
    x = page.evaluate(
        """t => { const p = document.querySelector('omni-plot'), box = p.canvas.getBoundingClientRect();
        return box.left + 62 + (t - p.view[0]) / (p.view[1] - p.view[0]) * p.inner(); }""",
        0.01 * float(row),
    )
    y = page.locator("omni-plot canvas").bounding_box()["y"] + 60
    page.mouse.click(x, y)
    page.wait_for_selector(".story .finding")
    story = as_flags(page.inner_text(".story"))
    assert with_rows["text"] in story
    assert with_rows["remedy"] in story


def test_what_cannot_be_read_or_fitted_is_said_and_fit_waits(browser, tmp_path):
    broken, rest = tmp_path / "broken.csv", tmp_path / "rest.csv"
    broken.write_text("t_s,vx_m_s\n0,1\n1,abc\n2,3\n", "utf-8")
    robot = omnidyn.load_robot("axebot")
    omnidyn.write_run(omnidyn.simulate(robot, np.zeros((600, 3)), 0.01), rest)
    _, page = browser.start(broken)
    words = command("check", broken, "--json")[2].strip().partition("omnidyn: error: ")[2].splitlines()[0]
    assert as_flags(verdict(page)) == laid_out(words.replace(f"{tmp_path}/", ""))
    page.click("text=Remove")
    tab(page, "Fit")
    assert page.is_disabled("#fit")
    assert page.inner_text("#why") == "Add a log first: tab Log."
    tab(page, "Log")
    drop(page, rest)
    said = command("check", rest, "--json")[0]["verdict"]
    assert verdict(page) == laid_out(said)
    choose_axebot(page)
    page.get_by_text("rest.csv: ").wait_for()
    assert page.is_disabled("#fit")
    with_robot = command("check", rest, "--robot", "axebot", "--json")[0]["verdict"]
    assert page.inner_text("#why") == f"rest.csv: {with_robot}"


def test_columns_corrected_by_hand(browser, tmp_path):
    path = write_log(tmp_path / "log.csv")
    wrong = tmp_path / "wrong.csv"
    wrong.write_text(path.read_text("utf-8").replace("vx_m_s", "foo").replace("vy_m_s", "bar"), "utf-8")
    studio, page = browser.start(wrong)
    verdict(page)
    page.get_by_text("Columns and units").click()
    for column, component in (("foo", "vx"), ("bar", "vy")):
        page.get_by_label(f"{column} is").click()
        pick(page, component)
        page.get_by_label(f"unit of {column}").fill("m/s")
    page.click("#apply-columns")
    page.get_by_text("Save this map").wait_for()
    saved = tmp_path / "columns.toml"
    saved.write_bytes(page.request.get(f"{studio.address}log/log1/map").body())
    assert verdict(page) == laid_out(command("check", wrong, "--map", saved, "--json")[0]["verdict"])
    assert verdict(page) == laid_out(command("check", path, "--json")[0]["verdict"])


def test_a_fit_goes_on_while_pages_answer_and_can_be_cancelled(browser, tmp_path):
    path = write_log(tmp_path / "long.csv", seconds=150.0)
    studio, page = browser.start(path)
    verdict(page)
    other = browser.open(studio)
    choose_axebot(page)
    page.wait_for_selector("#fit:not([disabled])")
    idle = [page.evaluate(ANSWER) for _ in range(9)]
    page.click("#fit")
    page.wait_for_selector("#cancel-fit")
    spent = [page.evaluate(ANSWER) for _ in range(9)]
    assert page.is_visible("#cancel-fit"), "the fit was over too soon, or the page waited for it"
    print(f"answers while a fit runs: {sorted(map(round, spent))} ms, before: {sorted(map(round, idle))} ms")
    assert sorted(spent)[4] < 20.0 * sorted(idle)[4]
    load_again(page)
    tab(page, "Fit")
    page.wait_for_selector("#cancel-fit")
    tab(other, "Fit")
    other.click("#cancel-fit")
    page.wait_for_selector("#cancel-fit", state="detached")
    page.wait_for_selector("#fit:not([disabled])")
    page.click("#fit")
    whole = "document.querySelector('#fit-verdict')?.innerText.includes('interrupted') === false"  # the new one
    page.wait_for_function(whole)
    other.wait_for_function(whole)
    words = verdict(page, "#fit-verdict")
    assert verdict(other, "#fit-verdict") == words
    assert_same_numbers(page, path)


def test_what_is_missing_is_added_by_a_button(browser, tmp_path):
    resistance = Key.parse("motor.resistance_ohm")
    robot = omnidyn.load_robot("axebot")
    path = write_log(tmp_path / "warm.csv", robot=resistance.set(robot, 1.25 * resistance.get(robot)))
    _, page = browser.start(path)
    choose_axebot(page)
    page.click("#fit:not([disabled])")
    verdict(page, "#fit-verdict")
    assert "motor.resistance_ohm" not in numbers(page)
    page.click("text=Add resistance and refit")
    page.get_by_role("cell", name="motor.resistance_ohm").first.wait_for()
    shown = float(numbers(page)["motor.resistance_ohm"])
    assert shown == pytest.approx(1.25 * resistance.get(robot), rel=0.02)
    assert_same_numbers(page, path, "--free", "friction", "--free", "motor.resistance_ohm")


def test_a_robot_of_its_own_sizes_is_that_of_init(browser, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, page = browser.start()
    tab(page, "Robot")
    page.get_by_text("Describe another robot").click()
    page.get_by_label("mass").fill("3000")
    page.click("#make-robot")
    page.wait_for_function("document.querySelector('.error-text')?.innerText.includes('kg')")
    sizes = ("--azimuth=60,180,300", "--wheel-radius=0.05", "--robot-radius=0.15")
    _, code, words = command("init", "my-robot", *sizes, "--mass=3000")
    assert code == 3
    assert page.inner_text(".error-text >> nth=0") == words.strip().removeprefix("omnidyn: error: ")
    page.get_by_label("mass").fill("3")
    page.click("#make-robot")
    page.get_by_text("my-robot.toml").first.wait_for()
    assert command("init", "my-robot", *sizes, "--mass=3")[1] == 0
    tab(page, "Drive")
    page.click("#drive")
    page.wait_for_selector("omni-drive canvas")
    limit = page.get_attribute("input[name=level]", "max")
    assert float(limit) == omnidyn.load_robot("my-robot.toml").motor.voltage_limit


def resident(studio):
    """MB of the server."""
    return int(Path(f"/proc/{studio.process.pid}/statm").read_text().split()[1]) * resource.getpagesize() / 2**20


def slide(page, name, value):
    """Set a slider."""
    page.eval_on_selector(
        f"input[name='{name}']", "(e, v) => { e.value = v; e.dispatchEvent(new Event('input')); }", str(value)
    )
    page.wait_for_timeout(150)


def test_the_dead_zone_is_felt_and_the_drive_is_fitted(browser, tmp_path):
    studio, page = browser.start()
    tab(page, "Drive")
    page.click("#drive")
    page.wait_for_selector("omni-drive canvas")
    page.wait_for_function("document.querySelector('omni-drive').painted > 10")
    axes = command("deadzone", "axebot", "--json")[0]["dead_zone"]
    assert f"forward {axes[0]['breakaway_scale_V']:.3g} V" in page.inner_text("#breakaway")
    still = "document.querySelector('omni-drive').dataset.still"
    slide(page, "level", 0.6)
    page.keyboard.down("w")
    page.wait_for_timeout(700)
    assert page.evaluate(still) == "true"
    slide(page, "level", 0.8)
    page.wait_for_function(f"{still} === 'false'")
    page.keyboard.up("w")
    page.wait_for_function(f"{still} === 'true'")
    slide(page, "friction.axes.coulomb[0]", 3.3)
    set_level = float(page.input_value("input[name='friction.axes.coulomb[0]']"))
    rough = Key.parse("friction.axes.coulomb[0]").set(omnidyn.load_robot("axebot"), set_level)
    omnidyn.save_robot(rough, tmp_path / "rough.toml")
    axes = command("deadzone", tmp_path / "rough.toml", "--json")[0]["dead_zone"]
    page.wait_for_function(
        f"document.querySelector('#breakaway').innerText.includes('forward {axes[0]['breakaway_scale_V']:.3g} V')"
    )
    pad = page.get_by_role("button", name="W forward").bounding_box()
    page.mouse.move(pad["x"] + 5, pad["y"] + 5)
    page.mouse.down()  # the button for a phone
    page.wait_for_timeout(700)
    assert page.evaluate(still) == "true"  # 0.8 V moved it before
    slide(page, "level", 5.0)
    page.wait_for_function(f"{still} === 'false'")
    page.mouse.up()
    page.wait_for_function(f"{still} === 'true'")
    for _ in range(3):
        page.get_by_label("more: load").press("Enter")
    mass = "document.querySelector('input[name=\"body.mass_kg\"]').parentElement.querySelector('output').innerText"
    load = "+document.querySelector('input[name=payload]').value"
    page.wait_for_function(f"{load} > 0 && {mass} === `${{+(1.5 + {load}).toPrecision(4)}} kg`")  # one look at both
    slide(page, "payload", 0.0)
    page.wait_for_function(f"{mass} === '1.5 kg'")
    page.click("#record")
    for key in "wsadqewsadqe":
        page.keyboard.down(key)
        page.wait_for_timeout(350)
        page.keyboard.up(key)
    counts = "(d => [performance.now() / 1000, d.received, d.painted])(document.querySelector('omni-drive'))"
    before, memory = np.array(page.evaluate(counts)), resident(studio)
    for part in range(2):  # recorded in the first half; minutes of it: benchmarks/skins/studio.py
        for key in 2 * "wqase":
            page.keyboard.down(key)
            page.wait_for_timeout(400)
            page.keyboard.up(key)
        if part == 0:
            page.click("#record")
    page.wait_for_selector("#to-fit")
    rates = np.diff([before, page.evaluate(counts)], axis=0)[0]
    rates = rates[1:] / rates[0]
    print(f"{rates[0]:.1f} frames a second, {rates[1]:.1f} painted")
    assert rates.min() > 0.0  # how many: benchmarks/skins/studio.py
    assert resident(studio) - memory < 5.0
    page.keyboard.down("w")
    shown(page, "drive")
    page.keyboard.up("w")
    page.click("#stop")
    page.click("#to-fit")
    page.click("#fit:not([disabled])")
    verdict(page, "#fit-verdict")
    log = tmp_path / "drive-1.csv"
    log.write_bytes(page.request.get(f"{studio.address}log/log2/log").body())
    fitted = float(numbers(page)["friction.axes.coulomb[0]"])
    print(f"friction set {set_level:g} N, fitted {fitted:g} N")
    assert fitted == pytest.approx(set_level, rel=0.03)  # its standard error is 0.8 %
    assert_same_numbers(page, log)
