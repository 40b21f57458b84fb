"""Pages in a real browser: Chromium, driven by Playwright.

Skipped by name where there is no Chromium, or no Playwright; FGBASELINE_CHROMIUM names another one.
"""

import os
import shutil
from collections.abc import Iterator
from typing import Any

import pytest

NAMES = (os.environ.get("FGBASELINE_CHROMIUM"), "chromium", "chromium-browser", "google-chrome", "chrome")


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = next((found for name in NAMES if name and (found := shutil.which(name))), None)
    if path is None:
        pytest.skip("no Chromium here; install Debian's package chromium, or name one in FGBASELINE_CHROMIUM")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-gpu"])
        yield browser
        browser.close()


class Opened:
    """A page, and all that it said and asked for."""

    def __init__(
        self,
        browser: Any,
        address: str,
        width: int = 1400,
        height: int = 900,
        scheme: str = "light",
        *,
        touch: bool = False,
        ready: str = "#path-view .line",
    ) -> None:
        """Opens a page and waits for the element `ready`."""
        size = {"width": width, "height": height}
        self.context = browser.new_context(viewport=size, color_scheme=scheme, has_touch=touch)
        self.page = self.context.new_page()
        self.page.set_default_timeout(20_000)
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("dialog", lambda dialog: (self.said.append("a dialog"), dialog.dismiss()))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(address)
        self.page.wait_for_selector(ready)

    def attribute(self, selector: str, name: str) -> str:
        return str(self.page.eval_on_selector(selector, f"element => element.getAttribute('{name}')"))

    def count(self, selector: str) -> int:
        return int(self.page.locator(selector).count())

    def text(self, selector: str) -> str:
        return str(self.page.inner_text(selector))

    def boxes(self, selector: str) -> list[dict[str, float]]:
        """Of what is visible: x, y, width and height by `name`, px."""
        script = """all => all.filter(e => e.checkVisibility({visibilityProperty: true})).map(e => {
            const { x, y, width, height } = e.getBoundingClientRect();
            return { x, y, width, height, name: (e.textContent || e.id).slice(0, 30) };
        })"""
        found: list[dict[str, float]] = self.page.eval_on_selector_all(selector, script)
        return found

    def unfold_values(self) -> None:
        """Opens the charts' values as a table, which a later task of the browser fills: `toggle` is queued."""
        self.page.click("summary:has-text('Values of all charts')")
        self.page.wait_for_selector("#values td:not(:empty)")

    def set_frame(self, frame: int) -> None:
        self.page.eval_on_selector("#frame", f"e => {{ e.value = {frame}; e.dispatchEvent(new Event('input')); }}")
