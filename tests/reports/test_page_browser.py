"""The page in a real browser: it moves as its controls say, asks nobody for anything, and fits a phone.

Skipped where there is no Chromium, or no Playwright to drive it; FGBASELINE_CHROMIUM names another one.
"""

import io
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.data import Excluded, Landmarks
from fgbaseline.data.tracking import Picture, Pictures
from fgbaseline.reports.figures.paths import paths_overlaid
from fgbaseline.reports.figures.run_data import of_run
from fgbaseline.reports.figures.style import in_style
from fgbaseline.reports.html.run_page import render

from ..builders.browser import Opened
from ..builders.runs import answer, as_dict, failed, run_of, scene
from ..builders.synthetic import plain_problem
from .test_page_comparison import page_of, six

SCRIPT = "<script>alert(1)</script>"


def example() -> Run:
    """A filter that leaves, with two of its matches of frame 7 not used and three excluded, under a hostile name."""
    problem = plain_problem(scene(name=SCRIPT))
    excluded = problem.excluded.copy()
    at_7 = np.flatnonzero(problem.sequence.observations.frame == 7)
    excluded[at_7[:3]] = Excluded.PREDICTION
    problem = replace(problem, excluded=excluded)
    used = problem.mask.copy()
    used[at_7[3:5]] = False
    return run_of(
        problem,
        answer(problem, "dead-reckoning", (0.0, 60.0, 0.0), used=np.zeros(len(used), dtype=np.bool_)),
        answer(problem, SCRIPT, (3.0, 0.0, 0.0), used=used),
        answer(problem, "isam2", (0.0, 0.0, 0.3), used=problem.mask),
    )


@pytest.fixture(scope="module")
def run() -> Run:
    return example()


@pytest.fixture(scope="module")
def address(run: Run, tmp_path_factory: pytest.TempPathFactory) -> str:
    file = tmp_path_factory.mktemp("page") / "report.html"
    with in_style():
        drawn = {"paths_overlaid": paths_overlaid(of_run(run))}
    file.write_text(render(run, as_dict(run), drawn), encoding="utf-8")
    return file.as_uri()


@pytest.fixture
def opened(chromium: Any, address: str) -> Iterator[Opened]:
    it = Opened(chromium, address)
    yield it
    assert it.said == []
    assert it.asked == [address]
    it.page.context.close()


def test_docs_load_without_console_messages_and_without_network(opened: Opened, run: Run) -> None:
    assert opened.text("h1") == SCRIPT
    assert opened.count("#path-view .line") == 4
    assert opened.count(".chart .plot > svg") == opened.count(".chart") >= 10
    assert opened.count(".chart .cursor") == opened.count(".chart")
    assert SCRIPT in opened.text("#estimators-shown")


def test_nothing_that_comes_from_files_can_run(opened: Opened) -> None:
    opened.page.evaluate("document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=\"window.ran = 1\">')")
    opened.page.evaluate("document.body.append(Object.assign(document.createElement('script'), {text: 'ran = 1'}))")
    opened.page.wait_for_timeout(100)
    assert opened.page.evaluate("window.ran === undefined")
    assert len(opened.said) >= 2  # the browser says what it refused
    assert all("Content Security Policy" in text for text in opened.said)
    opened.said.clear()
    opened.asked[1:] = []


def test_switching_an_estimator_off_takes_its_lines_away_and_frees_the_axis(opened: Opened) -> None:
    before = opened.page.inner_html('.chart:has(svg[aria-label^="Divergence"]) .plot > svg')
    assert opened.count("#over-time .line.estimator-0") > 3
    opened.page.uncheck('#estimators-shown input[value="0"]')
    assert opened.count("#over-time .line.estimator-0") == 0
    assert opened.count("#path-view svg .estimator-0") == 0
    assert opened.count("#path-view .line.estimator-1") == 1
    assert opened.page.inner_html('.chart:has(svg[aria-label^="Divergence"]) .plot > svg') != before
    opened.page.check('#estimators-shown input[value="0"]')
    assert opened.page.inner_html('.chart:has(svg[aria-label^="Divergence"]) .plot > svg') == before


def test_the_slider_moves_one_cursor_through_every_plot(opened: Opened) -> None:
    opened.set_frame(0)
    cursors = opened.page.eval_on_selector_all(".chart .cursor", "all => all.map(e => e.getAttribute('x1'))")
    here = opened.attribute("#path-view .here.estimator-1", "cx")
    said = opened.text(".frame-summary")
    opened.set_frame(40)
    moved = opened.page.eval_on_selector_all(".chart .cursor", "all => all.map(e => e.getAttribute('x1'))")
    assert all(float(b) > float(a) for a, b in zip(cursors, moved, strict=True))
    assert opened.attribute("#path-view .here.estimator-1", "cx") != here
    assert opened.text(".frame-summary") != said
    assert opened.text("#clock") == "frame 40 · 4.0\u00a0s"
    assert opened.attribute("#frame", "aria-valuetext") == "frame 40, 4.0\u00a0s"


def test_a_frame_shows_the_outcome_of_each_observation_and_its_true_reprojection_error(
    opened: Opened, run: Run
) -> None:
    opened.set_frame(7)
    opened.page.select_option("#frame-view select", "1")
    for side in ("left", "right"):
        image = f'[data-side="{side}"]'
        counts = [opened.count(f"{image} .{fate}") for fate in ("used", "rejected", "excluded")]
        assert counts == [7, 2, 3]
        assert opened.count(f"{image} .predicted") == 12
    table = run.results[SCRIPT].reprojection
    table = table[(table["frame"] == 7) & table["used"]]
    shown = float(opened.text(".frame-summary").partition("median error ")[2].partition("\u00a0")[0])
    assert math.isclose(shown, float(table["error"].median()), rel_tol=0.01)
    assert "3 × contradicts the motion of its track" in opened.text(".frame-summary")
    used = opened.page.inner_html('[data-side="left"]')
    color = "e => getComputedStyle(e).stroke"
    for mark in ("measured", "predicted"):
        drawn = opened.page.eval_on_selector(f'[data-side="left"] .used .{mark}', color)
        assert opened.page.eval_on_selector(f"#frame-view .marks .{mark}.sample", color) == drawn
    opened.page.select_option("#frame-view select", "2")
    assert opened.page.inner_html('[data-side="left"]') != used


@pytest.mark.parametrize("width", [1400, 390])
def test_a_frame_without_images_leads_to_the_nearest_that_has_them(
    chromium: Any, run: Run, tmp_path: Path, width: int
) -> None:
    """Images of one frame in 16; marks are as large as suits the width of the image."""
    packed = io.BytesIO()
    Image.new("L", (30, 20)).save(packed, "JPEG")
    t, both = run.problem.sequence.t, (packed.getvalue(),) * 2
    images = Pictures(step=16, size=(600, 400), pairs={k: Picture(float(t[k]), both) for k in range(0, 60, 16)})
    file = tmp_path / "report.html"
    file.write_text(render(run, as_dict(run), {}, images), encoding="utf-8")
    opened = Opened(chromium, file.as_uri(), width=width)
    opened.set_frame(7)
    assert opened.count("#frame-view image") == 0
    assert "no images of this frame; the nearest are those of" in opened.text(".frame-summary")
    opened.page.click(".frame-summary button")
    assert opened.text("#clock").startswith("frame 0 ")
    assert opened.count("#frame-view image") == 2
    assert opened.count(".frame-summary button") == 0
    radius = opened.attribute("#frame-view .used .measured", "d").partition("a")[2].split()[0]
    assert radius == "4" if width == 1400 else 2.0 <= float(radius) < 3.0
    assert opened.page.evaluate("document.documentElement.scrollWidth") == width
    opened.page.context.close()


def test_a_table_that_is_wider_than_the_page_scrolls_in_its_place(chromium: Any, address: str) -> None:
    opened = Opened(chromium, address, width=1400)
    headings = "() => getComputedStyle(document.querySelector('#table .main thead')).position"
    sizes = ((1500, "0.4rem", ".wide:not(.scrolls)", "sticky"), (1450, "2rem", ".scrolls", "static"))
    for width, size, place, position in sizes:
        opened.page.evaluate(f"document.querySelector('#table .main').style.fontSize = '{size}'")
        opened.page.set_viewport_size({"width": 900, "height": 900})
        opened.page.wait_for_timeout(100)
        opened.page.set_viewport_size({"width": width, "height": 900})
        opened.page.wait_for_selector(f"#table {place}")
        assert opened.page.evaluate("document.documentElement.scrollWidth") == width
        assert opened.page.evaluate(headings) == position
    opened.page.context.close()


def test_values_of_the_frame_are_there_as_numbers(opened: Opened, run: Run) -> None:
    opened.unfold_values()
    opened.set_frame(59)
    row = opened.text("#values tr:has-text('Divergence from isam2')")
    assert row.split("\t")[1:3] == [
        f"{run.results[n].divergence['position'].iloc[59]:#.3g}" for n in list(run.results)[:2]
    ]


def test_the_paths_are_shown_in_3d_with_landmarks_and_ellipses(opened: Opened) -> None:
    flat = opened.attribute("#path-view .line.estimator-1", "d")
    opened.page.click('[data-do="solid"]')
    assert opened.attribute('[data-do="solid"]', "aria-pressed") == "true"
    assert opened.attribute("#path-view .line.estimator-1", "d") != flat
    opened.page.click('[data-do="landmarks"]')
    assert opened.count("#path-view .dots") == 3
    opened.page.click('[data-do="ellipses"]')
    assert opened.count("#path-view .ellipse.estimator-2") >= 1


def test_a_path_shows_frame_time_and_error_under_the_pointer_and_a_click_moves_the_cursor(opened: Opened) -> None:
    opened.set_frame(30)
    box = opened.page.locator("#path-view .here.estimator-2").bounding_box()
    opened.set_frame(5)
    at = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    opened.page.mouse.move(*at)
    hint = opened.text(".hint")
    assert "frame 30" in hint
    assert "3.0\u00a0s" in hint
    assert "from the truth" in hint or hint.startswith("truth")
    opened.page.mouse.click(*at)
    assert opened.text("#clock").startswith("frame 30 ")


def test_the_page_is_operable_by_keyboard(opened: Opened) -> None:
    opened.set_frame(10)
    opened.page.focus("#frame")
    opened.page.keyboard.press("ArrowRight")
    assert opened.text("#clock").startswith("frame 11 ")
    opened.page.focus('#estimators-shown input[value="0"]')
    opened.page.keyboard.press("Space")
    assert opened.count("#path-view svg .estimator-0") == 0
    opened.page.focus("#path-view svg")
    before = opened.attribute("#path-view .line.estimator-1", "d")
    opened.page.keyboard.press("+")
    closer = opened.attribute("#path-view .line.estimator-1", "d")
    assert closer != before
    opened.page.keyboard.press("0")
    assert opened.attribute("#path-view .line.estimator-1", "d") == before
    reached = {""}
    opened.page.focus(".skip")
    for _ in range(130):
        opened.page.keyboard.press("Tab")
        reached.add(str(opened.page.evaluate("document.activeElement.id || document.activeElement.dataset.do || ''")))
    assert {"solid", "landmarks", "ellipses", "in", "out", "reset", "frame", "play"} <= reached


@pytest.mark.parametrize("width", [360, 800])
def test_nothing_runs_over_the_edge_of_a_phone(chromium: Any, address: str, width: int) -> None:
    opened = Opened(chromium, address, width=width, height=740)
    assert opened.page.evaluate("document.documentElement.scrollWidth") == width
    slider = opened.page.locator("#frame").bounding_box()
    assert slider["x"] >= 0
    assert slider["x"] + slider["width"] <= width
    opened.page.evaluate("document.getElementById('evidence').scrollIntoView({ behavior: 'instant' })")
    (slider, heading) = (opened.page.locator(one).bounding_box() for one in ("#frame", "#evidence"))
    assert 0 <= slider["y"] < slider["y"] + slider["height"] <= heading["y"] < 200
    opened.page.context.close()


def test_dark_ground_changes_every_color_that_it_would_swallow(chromium: Any, address: str) -> None:
    stroke = "getComputedStyle(document.querySelector('#path-view .line.estimator-2')).stroke"
    colors = {}
    for scheme in ("light", "dark"):
        opened = Opened(chromium, address, scheme=scheme)
        colors[scheme] = opened.page.evaluate(stroke)
        if scheme == "dark":
            opened.page.emulate_media(media="print")
            colors["print"] = opened.page.evaluate(stroke)
        opened.page.context.close()
    assert colors == {"light": "rgb(0, 0, 0)", "dark": "rgb(237, 240, 242)", "print": "rgb(0, 0, 0)"}


def test_on_paper_there_are_no_controls(opened: Opened, tmp_path: Path) -> None:
    opened.page.emulate_media(media="print")
    for selector in ("#controls", ".tools", "nav"):
        assert not opened.page.is_visible(selector)
    assert opened.page.is_visible("#path-view svg")
    assert not opened.page.is_visible("#behind li")
    opened.page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert opened.page.is_visible("#behind li")
    opened.page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert not opened.page.is_visible("#behind li")
    assert len(opened.page.pdf(format="A4")) > 20_000


def test_figures_folded_away_are_there_when_unfolded_or_printed(chromium: Any, address: str) -> None:
    drawn = "() => [...document.images].every(image => image.complete && image.naturalWidth > 0)"
    unfolded = Opened(chromium, address).page
    unfolded.eval_on_selector_all("details", "all => all.forEach(details => { details.open = true; })")
    unfolded.locator("img").first.scroll_into_view_if_needed()
    unfolded.wait_for_function(drawn)
    printed = Opened(chromium, address).page
    assert printed.locator("img").count() > 0
    printed.pdf(format="A4")
    printed.wait_for_function(drawn)
    for page_ in (unfolded, printed):
        page_.context.close()


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Address of the page of a comparison of six estimates, one of them of positions only."""
    file = tmp_path_factory.mktemp("compared") / "report.html"
    file.write_text(page_of(six()), encoding="utf-8")
    return file.as_uri()


def test_a_comparison_is_clicked_through_as_a_run_is(chromium: Any, compared: str) -> None:
    opened = Opened(chromium, compared)
    assert opened.count("#path-view .line") == 7
    assert opened.count(".chart .plot > svg") == 7
    clock = opened.text("#clock")
    assert clock.startswith("stamp ")
    assert clock.endswith("\u00a0s")
    opened.page.click('button[data-frame]:has-text("wandering")')
    assert opened.text("#clock") != clock
    cursor = opened.attribute(".chart .cursor", "x1")
    opened.set_frame(10)
    assert opened.attribute(".chart .cursor", "x1") != cursor
    assert opened.text("#clock") == "stamp 10 · 1.0\u00a0s"
    assert opened.count("#path-view .here.estimator-4") == 0  # late, which has no pose yet
    flat = opened.attribute("#path-view .line.estimator-1", "d")
    opened.page.click('[data-do="solid"]')
    assert opened.attribute("#path-view .line.estimator-1", "d") != flat
    opened.page.click('[data-do="in"]')
    opened.page.click('[data-do="reset"]')
    rotation = '.chart:has(svg[aria-label^="Rotation"])'
    assert opened.count(f"{rotation} .line.estimator-6") == 0  # positions only
    assert opened.count(f"{rotation} .line.estimator-1") == 1
    opened.page.uncheck('#estimators-shown input[value="1"]')
    assert opened.count("#path-view svg .estimator-1") == opened.count("#over-time .line.estimator-1") == 0
    opened.unfold_values()
    row = opened.text("#values tr:has-text('Position error against truth')").split("\t")
    at_ten = six().results["steady"].divergence["position"][10]
    assert row[2] == f"{at_ten:#.3g}"
    assert (opened.said, opened.asked) == ([], [compared])
    opened.page.context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_comparison_fits_a_phone(chromium: Any, compared: str, scheme: str) -> None:
    opened = Opened(chromium, compared, width=390, height=740, scheme=scheme)
    assert opened.page.evaluate("document.documentElement.scrollWidth") == 390
    opened.page.context.close()


def test_a_run_with_little_data_is_drawn_without_warnings(chromium: Any, tmp_path: Path) -> None:
    problem = plain_problem(scene(truth=None))
    alone = answer(problem, "dead-reckoning", covariance=None, seconds=np.empty(0), landmarks=Landmarks.none())
    gone = alone.world_T_imu.copy()
    gone[20:] = np.nan
    run = run_of(problem, failed(problem, "ekf", "no"), replace(alone, world_T_imu=gone))
    file = tmp_path / "report.html"
    file.write_text(render(run, as_dict(run), {}), encoding="utf-8")
    opened = Opened(chromium, file.as_uri())
    assert opened.count('[data-do="ellipses"]') == opened.count('[data-do="landmarks"]') == 0
    opened.page.click('[data-do="solid"]')
    opened.set_frame(30)
    assert opened.said == []
    assert opened.count("#path-view .line") == 1
    assert opened.count("#path-view .here") == 0
    assert opened.boxes("#path-view select") == []  # no reference to be offset from
    assert "12 in the problem" in opened.text(".frame-summary")
    assert opened.count('[data-side="left"] .measured') == 12
    opened.page.context.close()


def test_without_a_script_the_still_figures_stand_in(chromium: Any, address: str) -> None:
    context = chromium.new_context(java_script_enabled=False)
    it = context.new_page()
    it.goto(address)
    assert it.is_visible("#figure-paths_overlaid-noscript img")
    assert not it.is_visible("#controls")
    context.close()
