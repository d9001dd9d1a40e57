"""The report page in a real browser: light and dark, wide and narrow: no overflow, no missing glyph, no network."""

import itertools
import json
import re
import shutil
from pathlib import Path

import pytest
from added_run import write_added
from keyboard import nameless, tab_through
from sample_run import compare_many, write_sample

from undertow.physics.errors import RequestError
from undertow.workflows.report import find_browser, print_pdf, report
from undertow.workflows.run_folder.write import write_page

LOOKS = [(scheme, width) for scheme in ("light", "dark") for width in (1280, 390)]
A4_WIDTH = 703  # pixels between the margins of the print style, 186 mm

OVERFLOW = "() => [document.documentElement.scrollWidth, window.innerWidth]"
OPEN_ALL = "() => document.querySelectorAll('details').forEach(one => one.open = true)"
MISSING_GLYPHS = """() => {
  const canvas = document.createElement('canvas'); canvas.width = canvas.height = 40;
  const pen = canvas.getContext('2d', {willReadFrequently: true});
  const drawn = (text, font) => {
    pen.clearRect(0, 0, 40, 40); pen.font = font; pen.textBaseline = 'middle'; pen.fillText(text, 6, 20);
    return Array.from(pen.getImageData(0, 0, 40, 40).data).filter((_, k) => k % 4 === 3).join();
  };
  const italic = letter => {  // what a browser puts for a single letter in <mi>
    const code = letter.codePointAt(0);
    if (letter === 'h') return '\\u210e';
    if (code >= 97 && code <= 122) return String.fromCodePoint(0x1d44e + code - 97);
    if (code >= 65 && code <= 90) return String.fromCodePoint(0x1d434 + code - 65);
    if (code >= 0x3b1 && code <= 0x3c9) return String.fromCodePoint(0x1d6fc + code - 0x3b1);
    return letter;
  };
  const tofus = {}, seen = new Set(), missing = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const style = getComputedStyle(node.parentElement);
    const font = `${style.fontStyle} ${style.fontWeight} 24px ${style.fontFamily}`;
    tofus[font] ??= new Set(['\\u0378', '\\u0380', '\\u{e0ffe}', '\\u{10ff00}'].map(code => drawn(code, font)));
    const letters = Array.from(node.data.trim());
    const slanted = node.parentElement.localName === 'mi' && letters.length === 1;
    for (const letter of letters.map(one => slanted ? italic(one) : one)) {
      if (/[\\s\\p{Cf}]/u.test(letter) || seen.has(font + letter)) continue;
      seen.add(font + letter);
      if (letter === '\\ufffd' || tofus[font].has(drawn(letter, font))) missing.push(letter);
    }
  }
  return [seen.size, missing];
}"""
CONTRAST = """() => {
  const style = getComputedStyle(document.documentElement);
  const light = name => {
    const value = style.getPropertyValue(name).trim().slice(1);
    const [r, g, b] = [0, 2, 4].map(k => parseInt(value.slice(k, k + 2), 16) / 255)
      .map(c => c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ratio = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  const names = ['--ink', '--muted', '--before', '--after'];
  return Object.fromEntries(names.map(name => [name, ratio(light(name), light('--card'))]));
}"""


@pytest.fixture(scope="module")
def executable():
    try:
        return find_browser()
    except RequestError as error:
        pytest.skip(f"no browser to look with: {error}")


@pytest.fixture(scope="module")
def browser(executable):
    driver = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser: pip install '.[dev]'")
    with driver.sync_playwright() as started:
        opened = started.chromium.launch(executable_path=str(executable))
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The page of seven models on a log of ten minutes, the page of two runs, and that of a comparison."""
    folder = tmp_path_factory.mktemp("browser")
    runs = [write_sample(folder / "long", seconds=600.0), write_sample(folder / "short", seconds=60.0)]
    compare_many(runs[0])
    one, *_, fleet = report(runs, out=folder / "fleet.html")
    compared = folder / "compared"
    compared.mkdir()
    for name in ("comparison.json", "series.csv"):
        shutil.copy(runs[0] / name, compared)
    (compared / "run.json").write_text('{"schema": "undertow.run/1", "verb": "compare"}')
    return {"one": one, "fleet": fleet, "compared": write_page(compared)}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A run that is judged in folds, each by a model that was fitted without it."""
    folder = tmp_path_factory.mktemp("found")
    write_added(folder, report=True)
    return folder / "run"


@pytest.fixture
def looked(browser, request):
    """A function that opens a page in a scheme and width; everything that the page asks for is kept in `asked`."""
    opened = []

    def look(path: Path, scheme: str, width: int):
        tab = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
        tab.asked = []
        tab.on("request", lambda wanted: tab.asked.append(wanted.url))
        tab.on("console", lambda told: tab.asked.append(told.text))
        tab.goto(path.as_uri())
        opened.append(tab)
        return tab

    yield look
    for tab in opened:
        tab.close()


def test_a_page_of_many_models_is_small(pages):
    assert pages["one"].stat().st_size < 3_000_000


@pytest.mark.parametrize("name", ["one", "fleet", "compared"])
@pytest.mark.parametrize(("scheme", "width"), LOOKS)
def test_the_page_fits_the_window_and_asks_for_nothing(pages, looked, name, scheme, width, tmp_path):
    tab = looked(pages[name], scheme, width)
    wide, window = tab.evaluate(OVERFLOW)
    assert wide <= window == width
    tab.evaluate(OPEN_ALL)
    assert tab.evaluate(OVERFLOW)[0] <= width
    picture = tab.screenshot(path=tmp_path / "page.png", full_page=True)
    assert len(picture) > 50_000
    assert tab.asked == [pages[name].as_uri()]


@pytest.mark.parametrize(("wide", "fits"), [(378, True), (379, False)])
def test_a_pixel_too_much_would_be_seen(pages, looked, wide, fits):
    tab = looked(pages["one"], "light", 390)
    box = f"<p><span style='display: inline-block; width: {wide}px'>wide</span></p>"  # 12 pixels from the left edge
    tab.evaluate("box => document.querySelector('main').insertAdjacentHTML('beforeend', box)", box)
    assert (tab.evaluate(OVERFLOW)[0] <= 390) is fits


@pytest.mark.parametrize("name", ["one", "fleet"])
def test_every_letter_has_a_glyph(pages, looked, name):
    count, missing = looked(pages[name], "light", 1280).evaluate(MISSING_GLYPHS)
    assert count > 100
    assert missing == []


@pytest.mark.parametrize("letter", ["\u0379", "\ufffd", "\U0003ffff"])
def test_a_letter_without_a_glyph_would_be_seen(pages, looked, letter):
    tab = looked(pages["one"], "light", 1280)
    tab.evaluate("letter => document.querySelector('figcaption').append(letter)", letter)
    assert tab.evaluate(MISSING_GLYPHS)[1] == [letter]


@pytest.mark.parametrize("font", ["var(--math)", "monospace"])  # the page's own, and one without mathematical measures
def test_formulas_are_typeset(pages, looked, font):
    tab = looked(pages["one"], "light", 1280)
    tab.evaluate(OPEN_ALL)
    tab.add_style_tag(content=f"math {{ font-family: {font} !important; }}")
    drag = tab.locator(".term.new > math", has_text="7.8").first
    assert drag.evaluate("one => getComputedStyle(one).display").endswith("math")
    base, index = tab.locator(".term small msub").first.evaluate(
        "one => [...one.children].map(part => part.getBoundingClientRect()).map(box => [box.bottom, box.height])"
    )
    assert index[0] > base[0]
    assert index[1] < base[1]
    assert tab.locator(".balance mover").count() == 3


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_colours_can_be_told_from_the_paper(pages, looked, scheme):
    contrast = looked(pages["one"], scheme, 1280).evaluate(CONTRAST)
    assert contrast["--ink"] > 7.0
    assert contrast["--muted"] > 4.5
    assert min(contrast["--before"], contrast["--after"]) > 3.0


@pytest.mark.parametrize(("name", "width"), [("one", 1280), ("one", 390), ("fleet", 1280)])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_tab_key_comes_to_everything_and_shows_where_it_is(pages, looked, name, width, scheme):
    tab = looked(pages[name], scheme, width)
    tab.evaluate(OPEN_ALL)
    found, missed = tab_through(tab)
    assert len(found) > 10
    assert missed == []
    assert [one for one in found if one.contrast < 3.0 or not one.seen] == []
    assert nameless(tab) == []


@pytest.mark.parametrize("spoiled", ["outline: none", "outline-color: var(--grid)", "outline-width: 1px"])
def test_a_focus_that_does_not_show_would_be_seen(pages, looked, spoiled):
    tab = looked(pages["fleet"], "light", 1280)
    tab.add_style_tag(content=f":focus-visible {{ {spoiled} !important; }}")
    tab.evaluate("() => document.querySelector('main').insertAdjacentHTML('beforeend', '<button></button>')")
    found, _ = tab_through(tab)
    assert any(one.contrast < 3.0 for one in found)
    assert nameless(tab) == ["button "]


def test_print_is_light_and_fits_the_paper(pages, looked):
    tab = looked(pages["one"], "dark", A4_WIDTH)
    tab.emulate_media(media="print", color_scheme="dark")
    assert tab.evaluate("() => getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert tab.evaluate(OVERFLOW)[0] <= A4_WIDTH
    assert tab.get_by_text("Blue terms are new or changed").is_visible()  # folded away on a screen
    assert not tab.locator("#play").is_visible()


def pages_of(content: bytes) -> int:
    counted = re.search(rb"/Type\s*/Pages.{0,200}?/Count\s+(\d+)", content, re.DOTALL)
    assert counted is not None
    return int(counted[1])


def test_the_pdf_has_pages(pages, executable, tmp_path):
    content = print_pdf(pages["one"], tmp_path / "report.pdf", executable).read_bytes()
    assert content.startswith(b"%PDF")
    assert 5 <= pages_of(content) <= 16


def test_paper_begins_with_a_summary_of_two_pages(pages, looked):
    """What stands before the appendix fits two sheets, and a third is needed where a page more is put before it."""
    tab = looked(pages["one"], "light", A4_WIDTH)
    tab.emulate_media(media="print")
    told = tab.locator("section.paper").all_inner_texts()
    assert [text.split("\n")[0] for text in told] == ["What is missing", "What to record next", "Appendix"]
    assert "surge quadratic damping" in told[0]
    assert "\N{MINUS SIGN}" in told[0]
    tab.add_style_tag(content=".appendix, .appendix ~ * { display: none !important; }")
    assert pages_of(tab.pdf(prefer_css_page_size=True)) == 2
    tab.add_style_tag(content="main { padding-top: 240mm !important; }")
    assert pages_of(tab.pdf(prefer_css_page_size=True)) == 3
    tab.emulate_media(media="screen")
    assert not tab.locator("section.paper").first.is_visible()


TELLS = """async () => {
  const box = document.querySelector('#play');
  while (!('error' in box.dataset)) await new Promise(done => setTimeout(done, 20));
  return [Number(box.dataset.error), box.querySelector('[data-play=told]').innerText];
}"""
"""The error beside the sliders once it is counted, in full and as it is written."""


def test_the_page_plays(pages, looked):
    """Sliders move the error, and the quickest of a few new predictions of minutes takes less than 50 ms."""
    tab = looked(pages["one"], "light", 1280)
    knob = tab.locator(".knob input").first
    after, _ = tab.evaluate(TELLS)
    tab.locator("[data-play=all-before]").click()
    before, _ = tab.evaluate(TELLS)
    assert after < 0.5 * before
    spent = []
    for value in ("40", "60", "80", "100", "120"):
        knob.evaluate("(one, x) => { one.value = x; one.dispatchEvent(new Event('input')); }", value)
        tab.wait_for_timeout(100)
        spent.append(float(tab.locator("#play").get_attribute("data-milliseconds")))
    assert min(spent) < 50.0
    assert tab.evaluate(TELLS)[0] not in (before, after)
    tab.locator("[data-play=all-after]").click()
    assert tab.evaluate(TELLS)[0] == after


def test_the_sliders_tell_the_error_that_the_page_leads_with(found, looked):
    """Before and after, to a thousandth, although the page counts them and the run had: of models fitted apart."""
    steps = json.loads((found / "findings.json").read_text())["steps"]
    assert len(json.loads((found / "findings.json").read_text())["folds"]["models"]) > 1
    tab = looked(found / "report.html", "light", 1280)
    for button, step, big in (("all-after", steps[-1], ".big.after b"), ("all-before", steps[0], ".big.before b")):
        tab.locator(f"[data-play={button}]").click()
        error, told = tab.evaluate(TELLS)
        assert error == pytest.approx(step["rollout_rmse"]["10"]["position"], rel=1e-3)
        assert told == tab.locator(big).inner_text()


@pytest.mark.parametrize("width", [1280, 390])
def test_nothing_beside_the_sliders_is_cut(found, looked, width):
    tab = looked(found / "report.html", "light", width)
    inside = tab.evaluate(
        """() => {
          const box = document.querySelector('#play figure').getBoundingClientRect();
          return [...document.querySelectorAll('#play figure *')].filter(one => {
            const own = one.getBoundingClientRect(), wide = one.scrollWidth > one.clientWidth + 1;
            return own.width && (own.left < box.left - 1 || own.right > box.right + 1 || wide && one.clientWidth);
          }).map(one => one.outerHTML.slice(0, 80));
        }"""
    )
    assert inside == []


def test_the_motion_plays_over_time_and_stops(found, looked):
    tab = looked(found / "report.html", "light", 1280)
    cursor, play = tab.locator("[data-play=cursor]"), tab.locator("[data-play=run]")
    pixels = "() => document.querySelector('[data-play=track]').toDataURL()"
    begun = tab.evaluate(pixels)
    play.focus()
    tab.keyboard.press("Space")
    tab.wait_for_function("() => Number(document.querySelector('[data-play=cursor]').value) > 20")
    assert play.inner_text() == "Pause"
    tab.keyboard.press("Space")
    stopped = int(cursor.input_value())
    assert play.inner_text() == "Play"
    assert tab.evaluate(pixels) != begun
    tab.wait_for_timeout(200)
    assert int(cursor.input_value()) == stopped
    tab.keyboard.press("Tab")
    tab.keyboard.press("ArrowRight")
    tab.wait_for_timeout(50)
    assert int(cursor.input_value()) == stopped + 1
    assert cursor.get_attribute("aria-valuetext") == tab.locator("[data-play=clock]").inner_text()


def test_who_asked_for_less_motion_sees_steps_of_a_second(found, looked):
    tab = looked(found / "report.html", "light", 1280)
    tab.emulate_media(reduced_motion="reduce")
    tab.evaluate(
        """() => {
          window.seen = new Set();
          const cursor = document.querySelector('[data-play=cursor]');
          (function look() { window.seen.add(Number(cursor.value)); requestAnimationFrame(look); })();
        }"""
    )
    tab.locator("[data-play=run]").click()
    tab.wait_for_timeout(2600)
    seen = sorted(tab.evaluate("() => [...window.seen]"))
    assert 2 <= len(seen) <= 4
    assert all(later - one >= 40 for one, later in itertools.pairwise(seen))  # four seconds of the log in one


def test_a_drawing_fills_the_window_when_it_is_clicked(pages, looked):
    tab = looked(pages["one"], "light", 1280)
    drawing = tab.locator(".plots.three .zoom").first
    small = drawing.locator("svg").bounding_box()
    drawing.click()
    large = drawing.locator("svg").bounding_box()
    assert large["width"] > 2.5 * small["width"]
    assert (large["x"] >= 0, large["x"] + large["width"] <= 1280, large["y"] + large["height"] <= 900) == (True,) * 3
    drawing.click()
    assert drawing.locator("svg").bounding_box() == small
    drawing.click()
    tab.emulate_media(media="print")
    assert drawing.locator("svg").bounding_box()["width"] < 1.5 * small["width"]


@pytest.mark.parametrize(("width", "most"), [(1280, 6), (390, 10)])
def test_the_story_takes_few_screens(pages, looked, width, most):
    tab = looked(pages["one"], "light", width)
    height = {1280: 900, 390: 844}[width]
    assert tab.evaluate("() => document.documentElement.scrollHeight") < most * height


def test_without_scripts_the_page_says_what_is_not_there(pages, browser):
    tab = browser.new_page(java_script_enabled=False)
    tab.goto(pages["one"].as_uri())
    assert tab.get_by_text("Sliders for what was added stand here where scripts may run.").is_visible()
    assert not tab.locator("#play").is_visible()
    assert tab.get_by_text("Which model to trust").last.is_visible()
    tab.close()
