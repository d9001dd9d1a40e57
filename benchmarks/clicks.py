"""Somebody who works with the page of the workbench and hurries: every click that it has, in an order that is drawn."""

import random
import re
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Locator, Page, Position

PATIENCE = 60_000
"""Milliseconds that anything may take, a search among them."""
AT_REST = "() => !document.querySelector('.work span')"
OPEN = "() => document.querySelectorAll('.undertow-time canvas').length > 0"
STAIRS = "() => [...document.querySelectorAll('.stairs .name')].map(e => e.innerText).join('|')"
SEEN = """() => [...document.querySelectorAll('.trouble, .count, .stairs, [aria-label="The corrected model"]')]
  .map(e => e.innerText).join('|') + [...document.querySelectorAll('article button')].map(e => e.innerText)"""


class StepFailedError(Exception):
    """A step that did not do what it should."""


class Clicks:
    """Somebody who works with one page, and hurries.

    Parameters
    ----------
    page : on the workbench
    draw : chooses what comes next
    logs : paths of logs to open beside the demo, of a shipped vehicle
    """

    def __init__(self, page: Page, draw: random.Random, logs: list[Path]) -> None:
        self._page, self._draw, self._logs = page, draw, logs
        self.sessions, self.doing = 1, ""
        self.acts: dict[Callable[[], None], int] = {
            self.add: 20,
            self.remove: 10,
            self.undo: 12,
            self.redo: 8,
            self.select: 8,
            self.zoom: 8,
            self.slide: 10,
            self.go_from: 6,
            self.hurry: 4,
            self.take: 4,
            self.reload: 2,
            self.another: 2,
            self.vehicle: 1,
            self.train: 2,
            self.tab: 1,
        }

    def step(self) -> str:
        """Do something; its name.

        Raises
        ------
        StepFailedError, playwright's Error
            when the page did not follow.
        """
        acts, weights = zip(*self.acts.items(), strict=True)
        act = self._draw.choices(acts, weights)[0]
        self.doing = act.__name__
        act()
        self.rest()
        return self.doing

    def rest(self) -> None:
        """Wait until nothing goes on, and what was pressed before has turned all buttons that it turns."""
        before = None
        while (now := self._page.evaluate(SEEN)) != before:
            before = now
            self._page.wait_for_timeout(600)
            self._page.wait_for_function(AT_REST)

    def demo(self) -> None:
        """Open the demo, and wait for what is found."""
        self._page.get_by_role("button", name="Try the demo").last.click()
        self.opened()

    def recover(self) -> None:
        """Load the page anew, and go on with what is open there."""
        self._page.reload()
        self._page.wait_for_timeout(2000)
        if self._page.evaluate(OPEN):
            self.opened()
        else:
            self.demo()

    def opened(self) -> None:
        """Wait until a log is open, and searched."""
        self._page.wait_for_function(OPEN)
        self._page.locator("section.cards article").first.wait_for()
        self.rest()

    def add(self) -> None:
        """Add an effect, and see its button turn."""
        self._press("Add ", "Remove ")

    def remove(self) -> None:
        """Take an effect out, and see its button turn."""
        self._press("Remove ", "Add ")

    def undo(self) -> None:
        """Take a step back."""
        self._button("Undo the last step")

    def redo(self) -> None:
        """Take it again."""
        self._button("Redo the step")

    def hurry(self) -> None:
        """Press several buttons without waiting for any."""
        names = self._draw.choices(("Undo the last step", "Redo the step"), k=4)
        self._page.evaluate(
            "names => names.forEach(n => document.querySelector(`button[aria-label='${n}']`).click())", names
        )
        self._page.evaluate(
            """shares => shares.forEach(share => {
              const seen = [...document.querySelectorAll('section.cards > .stack > article button')]
                .filter(button => button.offsetParent);
              seen[Math.floor(share * seen.length)]?.click();
            })""",
            [self._draw.random() for _ in range(2)],
        )

    def select(self) -> None:
        """Pick a cell of the map, and let go of it; by key, for what is drawn anew loses a press of the pointer."""
        cells = self._page.locator("[aria-label='Where it fails'] svg [role=button]")
        self._any(cells).press("Enter")
        self._page.get_by_role("button", name="Clear selection").click()

    def zoom(self) -> None:
        """Turn the wheel over the plots, and show all again."""
        plot = self._page.locator(".undertow-time .u-over").first
        plot.hover(position=self._within(plot))
        for _ in range(self._draw.randint(1, 5)):
            self._page.mouse.wheel(0, self._draw.choice((-240, 240)))
        plot.dblclick(position=self._within(plot))

    def slide(self) -> None:
        """Drag a slider some way."""
        sliders = self._page.locator("input[type=range]")
        if not sliders.count():
            return self.add()
        for share in [self._draw.random() for _ in range(6)]:
            sliders.nth(0).evaluate(
                "(s, share) => { s.value = +s.min + share * (s.max - s.min); s.dispatchEvent(new Event('input')); }",
                share,
            )
            self._page.wait_for_timeout(80)
        self._page.get_by_role("button", name="Set all numbers to their fitted values").wait_for()
        if self._draw.random() < 0.7:
            self._button("Set all numbers to their fitted values")
        return None

    def go_from(self) -> None:
        """Let both models go from a place on the track."""
        track = self._page.locator("[aria-label='Track on the water'] canvas").first
        track.click(position=self._within(track))

    def take(self) -> None:
        """Take a file away; the page says so where there is none."""
        what = self._draw.choice(("The report page", "model.yaml", "model.yaml", "findings.json", "The run folder"))
        arrived: list[object] = []
        self._page.once("download", lambda got: arrived.append(got))
        self._button("Take away")
        self._page.get_by_text(what, exact=True).click()
        refused = self._page.locator(".q-notification")
        for _ in range(PATIENCE // 100):
            self._page.wait_for_timeout(100)
            if arrived or refused.count():
                return
        raise StepFailedError(f"nothing came of {what}")

    def another(self) -> None:
        """Open the demo or another log in the place of this one."""
        self._button("Open another log")
        log = self._draw.choice([None, *self._logs])
        if log is None:
            return self.demo()
        self._page.get_by_label("or the path of a log").last.fill(str(log))
        self._page.get_by_label("vehicle", exact=True).last.click()
        self._page.get_by_role("option", name=re.compile("^Otter")).click()
        self._page.get_by_role("button", name="Open the log").last.click()
        self._page.get_by_text(f"{log.name} with").wait_for()
        return self.opened()

    def vehicle(self) -> None:
        """Give the boat another mass, which searches anew."""
        self._button("Look at the numbers of the vehicle")
        mass = self._page.get_by_label("mass", exact=True)
        mass.fill(f"{float(mass.input_value()) * self._draw.uniform(0.95, 1.05):.4g}")
        self._page.wait_for_timeout(600)
        self._page.get_by_role("button", name="Use these numbers").click()
        self._page.get_by_role("button", name="Use these numbers").wait_for(state="detached")
        self.opened()

    def train(self) -> None:
        """Train a network for some seconds, and stop it."""
        self._page.get_by_label("epochs").fill("500")
        self._button("Train a network")
        self._page.get_by_text("epoch ").first.wait_for()
        self._page.wait_for_timeout(2000)
        self._button("Stop training")
        self._page.get_by_text("Stopped. Nothing was kept.").wait_for()

    def reload(self) -> None:
        """Load the page anew, and find everything as it was."""
        before = self._page.evaluate(STAIRS)
        self._page.reload()
        self._page.wait_for_function(OPEN)
        self.rest()
        after = self._page.evaluate(STAIRS)
        if after != before:
            raise StepFailedError(f"before the page was loaded anew there was {before}, then {after}")

    def tab(self) -> None:
        """Open the demo in another tab, and close that."""
        page = self._page.context.new_page()
        page.set_default_timeout(PATIENCE)
        page.goto(self._page.url)
        self.sessions += 1
        page.get_by_role("button", name="Try the demo").click()
        page.wait_for_function(OPEN)
        page.close()

    def _press(self, begins: str, becomes: str) -> None:
        """Press the button of a card that is in sight, and wait until it says the other, or the page why not."""
        buttons = self._page.locator(f"section.cards article > .head > button[aria-label^='{begins}']:visible")
        if not buttons.count():
            return
        name = str(self._any(buttons).get_attribute("aria-label")).removeprefix(begins)
        self._page.get_by_role("button", name=f"{begins}{name}", exact=True).click()
        turned = self._page.get_by_role("button", name=f"{becomes}{name}", exact=True)
        turned.or_(self._page.locator(".trouble[role=alert]")).filter(visible=True).first.wait_for()

    def _button(self, name: str) -> None:
        """Press a button, if it can be pressed now."""
        button = self._page.get_by_role("button", name=name, exact=True)
        if button.count() and button.is_enabled():
            button.click()

    def _any(self, among: Locator) -> Locator:
        return among.nth(self._draw.randrange(among.count()))

    def _within(self, one: Locator) -> Position:
        """A place in the middle of something [pixels from its corner]."""
        box = one.bounding_box()
        assert box is not None, "it is on the screen"
        return {"x": self._draw.uniform(0.3, 0.7) * box["width"], "y": self._draw.uniform(0.3, 0.7) * box["height"]}
