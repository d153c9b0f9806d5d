"""The line Log, Robot, Fit, Drive, Track, Compare in a real browser, and what never goes silent."""

import os
import signal
import subprocess

import omnidyn
from omnidyn.document import sentence
from omnidyn.model.keys import Key, find_key
from tests.support.pages import choose_axebot, command, drop, laid_out, load_again, numbers, shown, tab, verdict
from tests.support.pages import write_log as written


def states(page):
    """Tab -> the mark and the words on it."""
    lines = [text.split("\n") for text in page.get_by_role("tab").all_inner_texts()]
    return {name: (mark, words) for name, mark, words in lines}


def workers(studio):
    """The processes that do jobs."""
    return [int(pid) for pid in subprocess.check_output(["pgrep", "-P", str(studio.process.pid)]).split()]


def primary(page):
    """The words of the primary buttons that are seen."""
    return page.locator(".q-btn--unelevated:visible:not(.q-btn-toggle .q-btn)").all_inner_texts()


def test_the_line_says_what_is_done_and_what_comes_next_and_the_address_keeps_the_tab(browser, tmp_path):
    _, page = browser.start()
    assert states(page)["Log"] == ("○", "no log yet")
    assert states(page)["Fit"] == ("–", "needs a log")
    assert "Next: drop a log" in page.inner_text("#next")
    assert page.locator(".empty li").count() == 3
    assert page.evaluate("document.querySelector('.empty img').naturalWidth") > 100
    shown(page, "empty")
    for name in ("Fit", "Compare"):
        tab(page, name)
        page.wait_for_selector(".empty")
        assert len(primary(page)) == 1
    drop_on = written(tmp_path / "log.csv", 12.0)
    tab(page, "Log")
    page.wait_for_selector("#example")
    drop(page, drop_on)
    verdict(page)
    assert primary(page) == ["Next: Robot"]
    page.click("#next-log")
    page.get_by_label("Choose axebot", exact=True).click()
    page.click("#next-robot")
    page.click("#fit:not([disabled])")
    words = verdict(page, "#fit-verdict")
    page.wait_for_function("document.querySelector('.tabs, .q-tabs').innerText.includes('fitted')")
    assert states(page)["Fit"] == ("✓", "fitted")
    assert page.url.endswith("?tab=fit")
    page.reload()
    assert verdict(page, "#fit-verdict") == words
    page.set_viewport_size({"width": 420, "height": 900})
    assert page.evaluate("(s => s.scrollWidth - s.clientWidth)(document.querySelector('.scroll'))") <= 0  # cards
    page.set_viewport_size({"width": 1400, "height": 900})
    page.go_back()
    page.get_by_text("Robots of this session").wait_for()
    assert page.url.endswith("?tab=robot")
    page.go_forward()
    assert verdict(page, "#fit-verdict") == words


def test_a_process_that_ends_is_said_and_run_again(browser, tmp_path):
    path = written(tmp_path / "long.csv", 120.0)
    studio, page = browser.start(path)
    verdict(page)
    choose_axebot(page)
    page.click("#fit:not([disabled])")
    page.wait_for_function("document.querySelector('#fit-progress')?.innerText.startsWith('part ')")  # it has begun
    for pid in workers(studio):
        os.kill(pid, signal.SIGKILL)
    page.wait_for_selector("#fit-stopped-again")
    assert "the process of this job ended before its result; got signal SIGKILL" in verdict(page, "#fit-stopped")
    page.wait_for_function("document.querySelector('.q-tabs').innerText.includes('stopped')")
    page.click("#fit-stopped-again")
    said = command("identify", path, "--robot", "axebot", "--json")[0]
    assert verdict(page, "#fit-verdict") == laid_out(said["verdict"])
    page.click("#fit:not([disabled])")
    page.wait_for_selector("#cancel-fit")
    page.click("#cancel-fit")
    page.wait_for_selector("#fit-stopped-cancelled, #fit-verdict")  # before there was anything, or the best so far
    tab(page, "Robot")
    page.get_by_text("Describe another robot").click()
    page.click("#make-robot")
    page.wait_for_selector("#make-robot .q-spinner")  # it shows that it works
    page.get_by_text("my-robot.toml").first.wait_for()


def test_two_pages_show_the_same_choices_and_a_bad_log_is_left_out(browser, tmp_path):
    good, other, broken = (tmp_path / name for name in ("good.csv", "other.csv", "broken.csv"))
    written(good, 12.0)
    written(other, 12.0, 2)
    broken.write_text("t_s,vx_m_s\n0,1\n1,abc\n2,3\n", "utf-8")
    studio, page = browser.start(good, other, broken)
    page.wait_for_selector("#verdict")
    choose_axebot(page)
    second = browser.open(studio)
    tab(second, "Fit")
    page.get_by_text("broken.csv: ").wait_for()
    assert page.is_disabled("#fit")
    page.get_by_label("use of broken.csv").get_by_text("leave out").click()
    page.get_by_label("use of other.csv").get_by_text("hold out").click()
    for name, use in (("broken.csv", "leave out"), ("other.csv", "hold out")):
        second.get_by_label(f"use of {name}").locator(".bg-primary").get_by_text(use).wait_for()
    page.locator(".free .q-chip__icon--remove").last.click()
    second.wait_for_function("document.querySelectorAll('.free .q-chip').length === 5")
    page.wait_for_function("document.querySelectorAll('.free .q-chip').length === 5")
    second.click("#fit:not([disabled])")
    words = verdict(second, "#fit-verdict")
    assert verdict(page, "#fit-verdict") == words
    free = [w for key in list(numbers(page))[:5] for w in ("--free", key)]
    said = command("identify", good, other, "--hold-out", other, "--robot", "axebot", *free, "--json")[0]
    assert {key: cell for key, cell in numbers(page).items() if key in said["parameters"]} == {
        key: f"{number['value']:.5g}" for key, number in said["parameters"].items()
    }


def test_robots_are_seen_edited_renamed_and_removed_and_a_map_is_none(browser, tmp_path):
    map_file = tmp_path / "log-columns.toml"
    log = written(tmp_path / "log.csv", 4.0)
    assert command("check", log, "--save-map", map_file)[1] == 0
    heavy = tmp_path / "heavy.toml"
    omnidyn.save_robot(omnidyn.load_robot("axebot"), heavy)
    _, page = browser.start(log)
    tab(page, "Robot")
    page.get_by_label("Choose axebot", exact=True).click()
    page.wait_for_function("document.querySelector('.q-tabs').innerText.includes('axebot')")
    drop(page, map_file)
    page.get_by_text("was not taken").wait_for()
    assert "400" in browser.complaints.pop()  # what the browser says of the refusal
    assert states(page)["Robot"] == ("✓", "axebot")
    load_again(page)
    drop(page, heavy)
    page.wait_for_function("document.querySelector('.q-tabs').innerText.includes('heavy.toml')")
    page.get_by_label("View or edit heavy.toml").click()
    field = page.get_by_label("File of heavy.toml")
    text = field.input_value()
    assert "mass_kg = 1.5" in text
    field.fill(text.replace("mass_kg = 1.5", "mass_kg = -1.5"))
    page.click("#keep-robot")
    page.get_by_text("mass_kg").last.wait_for()
    field.fill(text.replace("mass_kg = 1.5", "mass_kg = 2.5"))
    page.get_by_label("keep as").fill("heavier")
    page.click("#keep-robot")
    page.get_by_label("Remove heavier.toml").wait_for()
    assert page.get_by_label("Remove heavy.toml").count() == 0
    page.get_by_label("View or edit heavier.toml").click()
    assert "mass_kg = 2.5" in page.get_by_label("File of heavier.toml").input_value()
    page.get_by_label("Remove heavier.toml").click()
    page.wait_for_function("!document.querySelector('.panels').innerText.includes('heavier.toml')")
    assert states(page)["Robot"] == ("○", "none chosen")


def test_a_log_that_grows_is_watched(browser, tmp_path):
    rows = written(tmp_path / "whole.csv", 20.0).read_text("utf-8").splitlines(keepends=True)
    path = tmp_path / "log.csv"
    path.write_text("".join(rows[:900]), "utf-8")
    _, page = browser.start(path)
    verdict(page)
    assert page.is_disabled("#watch")
    choose_axebot(page)
    tab(page, "Log")
    page.click("#watch:not([disabled])")
    page.wait_for_selector(".meter")
    with path.open("a", encoding="utf-8") as file:
        file.write("".join(rows[900:]))
    live = omnidyn.Live(omnidyn.load_robot("axebot")).add(omnidyn.read_log(path))
    said = laid_out(f"log.csv: {sentence(str(live.verdict))}")
    same = "words => document.querySelector('#live-verdict')?.innerText.includes(words)"
    page.wait_for_function(same, arg=said.splitlines()[0])
    assert verdict(page, "#live-verdict") == said
    known = [number.is_reached for number in live.numbers.values() if number.within]
    assert page.locator(".meter").count() == len(known)
    assert page.locator(".meter .reached").count() == sum(known)
    shown(page, "live")
    page.click("#stop-watching")
    page.get_by_text("The same by hand (watch)").click()
    assert page.inner_text("#call-watch") == f"omnidyn watch {path} --robot axebot --within 10"


def press_on(page, selector):
    """Go to an element by Tab alone, as somebody without a mouse, and press Enter on it."""
    page.wait_for_selector(f"{selector}:not([disabled])")
    for _ in range(120):
        page.keyboard.press("Tab")
        if page.evaluate("name => !!document.activeElement?.matches(name)", selector):
            return page.keyboard.press("Enter")
    raise AssertionError(f"Tab does not reach {selector}")


def test_by_keyboard_from_two_logs_of_which_one_has_a_wrong_sign_to_a_robot_file(browser, tmp_path):
    def turn(twist):
        twist[:, 1] *= -1.0

    right, other, wrong = (tmp_path / name for name in ("right.csv", "other.csv", "wrong.csv"))
    written(right, 12.0)
    written(other, 12.0, 2)
    written(wrong, 12.0, 2, turn)
    _, page = browser.start()
    with page.expect_file_chooser() as chooser:
        press_on(page, "omni-drop")
    chooser.value.set_files([str(right), str(wrong)])
    said = "words => document.querySelector('.q-tabs')?.innerText.includes(words)"
    page.wait_for_function(said, arg="2 logs")
    press_on(page, "#next-log")
    press_on(page, "[aria-label='Choose axebot']")
    page.wait_for_function(said, arg="1 of 2 logs not usable")  # all is checked again: nothing is drawn anew now
    press_on(page, "#next-robot")
    page.wait_for_selector(".free .q-chip")
    page.get_by_text("wrong.csv: vy goes the other way than the voltages drive the robot").wait_for()
    same = "document.querySelector(\"[aria-label='use of right.csv']\").same"
    page.evaluate(f"{same} = true")
    press_on(page, "[aria-label='mend wrong.csv']")
    page.wait_for_function(said, arg="2 logs")
    assert page.evaluate(same)  # a check that ends makes no choice anew: a click on it would be lost
    press_on(page, "#fit")
    words = verdict(page, "#fit-verdict")
    with page.expect_download() as download:
        press_on(page, "a.robot-file")
    saved = omnidyn.load_robot(download.value.path().rename(tmp_path / "robot.toml"))
    assert "Failed" not in words
    said = command("identify", right, other, "--robot", "axebot", "--json")[0]
    for key, number in said["parameters"].items():
        if find_key(key):
            assert Key.parse(key).get(saved) == number["value"], key
