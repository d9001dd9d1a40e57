"""The report page in a real browser: light and dark, wide and narrow: no overflow, no missing glyph, no network."""

import re
import shutil
from pathlib import Path

import pytest
from sample_run import compare_many, write_sample

from undertow.physics.errors import RequestError
from undertow.reports.page.pdf import find_browser, print_pdf
from undertow.workflows.report import report
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


def test_the_page_plays(pages, looked):
    """Sliders move the error, and the quickest of a few new predictions of five minutes takes less than 50 ms."""
    tab = looked(pages["one"], "light", 1280)
    told, knob = tab.locator("[data-play=told]"), tab.locator(".knob input").first
    after = float(told.inner_text().removesuffix(" m"))
    tab.locator("[data-play=all-before]").click()
    before = float(told.inner_text().removesuffix(" m"))
    assert after < 0.5 * before
    spent = []
    for value in ("40", "60", "80", "100", "120"):
        knob.evaluate("(one, x) => { one.value = x; one.dispatchEvent(new Event('input')); }", value)
        tab.wait_for_timeout(100)
        spent.append(float(tab.locator("#play").get_attribute("data-milliseconds")))
    assert min(spent) < 50.0
    assert float(told.inner_text().removesuffix(" m")) not in (before, after)
    tab.locator("[data-play=all-after]").click()
    assert float(told.inner_text().removesuffix(" m")) == after


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
