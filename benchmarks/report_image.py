"""The pictures of reports that README and docs show; docs/index.md has the command of the first, Makefile those of all.

Needs Chromium; FGBASELINE_CHROMIUM names one that is not found by its usual names.
"""

import os
import shutil
from pathlib import Path

import click
from playwright.sync_api import sync_playwright

NAMES = (os.environ.get("FGBASELINE_CHROMIUM"), "chromium", "chromium-browser", "google-chrome", "chrome")
WIDTH, HEIGHT = 1400, 1250
FRAME = 40
"""frame of the recording that a section shows: late enough for tracks to have tails"""


@click.command()
@click.argument("run", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.argument("image", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--section", help="Identifier of the section of the page to draw in place of its top.")
def main(run: Path, image: Path, section: str | None) -> None:
    """The top of RUN/report.html as IMAGE, with landmarks and ellipses switched on; or one section of the page."""
    chromium = next((found for name in NAMES if name and (found := shutil.which(name))), None)
    if chromium is None:
        raise click.ClickException("there is no Chromium; FGBASELINE_CHROMIUM names one")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT}, color_scheme="light")
        page.goto((run / "report.html").resolve().as_uri())
        for name in ("landmarks", "ellipses"):
            button = page.locator(f"button[data-do={name}]")
            if button.get_attribute("aria-pressed") == "false":
                button.click()
        page.mouse.move(0, 0)
        image.parent.mkdir(parents=True, exist_ok=True)
        if section is None:
            page.screenshot(path=image)
        else:
            page.locator("#frame").fill(str(FRAME))
            page.locator(f"#{section}").screenshot(path=image)
        browser.close()


if __name__ == "__main__":
    main()
