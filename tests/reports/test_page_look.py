"""What a reader sees and touches: paths apart, zoomed charts, colors and dashes, phones, accessibility."""

import io
import json
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fgbaseline.diagnosis import diagnose
from fgbaseline.reports import figures
from fgbaseline.reports.figures.style import (
    DARK_GROUND,
    DASHES,
    ESTIMATOR_COLORS,
    EXTRA_COLORS,
    REFERENCE,
    TRUTH,
    colors,
    on_dark,
)
from fgbaseline.reports.html import comparison_page
from fgbaseline.reports.html.page import policy
from fgbaseline.reports.html.plot_encoding import embedded_json, floats
from fgbaseline.reports.html.run_page import render, render_diagnosis
from fgbaseline.reports.results.diagnosis import found_by

from ..builders.browser import Opened
from ..builders.color_vision import DEFICIENCIES, difference, seen
from ..builders.runs import answer, as_dict, run_of, scene
from ..builders.synthetic import drive, plain_problem
from .test_page_comparison import six

TEN = (
    "dead-reckoning",
    "ekf",
    "joint-ekf",
    "joint-ekf-bias",
    "fixed-lag",
    "isam2",
    "isam2-online",
    "my-filter",
    "another-filter-of-mine",
    "slam-toolbox",
)
REFERENCE_LINE = "estimator-5"
APART = 10.0
"""CIEDE2000 between two lines of one dash: a just noticeable difference is 1, and lines are thin"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten estimators within 3 m of each other, and the figures that are shown unfolded."""
    problem = plain_problem(scene())
    answers = [answer(problem, name, (0.3 * i, 0.02 * i * i, 0.1)) for i, name in enumerate(TEN)]
    run = run_of(problem, *answers)
    drawn = {name: figure for name, figure in figures.draw(run).items() if name in ("reprojection_distribution",)}
    file = tmp_path_factory.mktemp("look") / "report.html"
    file.write_text(render(run, as_dict(run), drawn), encoding="utf-8")
    return file


@pytest.fixture
def opened(chromium: Any, page: Path) -> Iterator[Opened]:
    it = Opened(chromium, page.as_uri())
    yield it
    assert it.said == []
    it.context.close()


@pytest.fixture
def phone(chromium: Any, page: Path) -> Iterator[Opened]:
    it = Opened(chromium, page.as_uri(), width=390, height=844, touch=True)
    yield it
    assert it.said == []
    it.context.close()


def middle(opened: Opened, selector: str) -> np.ndarray:
    (box,) = opened.boxes(selector)
    return np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])


def test_offsets_from_the_reference_are_enlarged_pose_by_pose(opened: Opened) -> None:
    opened.set_frame(40)
    reference, here = f"#path-view .here.{REFERENCE_LINE}", "#path-view .here.estimator-7"
    true, at = middle(opened, here) - middle(opened, reference), middle(opened, reference)
    opened.page.select_option("#path-view select", "10")
    np.testing.assert_allclose(middle(opened, reference), at, atol=0.2)
    np.testing.assert_allclose(middle(opened, here) - at, 10.0 * true, atol=2.0)
    assert "offset from isam2 (× 10)" in opened.text("#path-view .plot")
    opened.page.select_option("#path-view select", "1")
    np.testing.assert_allclose(middle(opened, here) - at, true, atol=0.2)
    assert "offset" not in opened.text("#path-view .plot")


def test_the_band_of_the_reference_holds_95_percent_across_its_path(opened: Opened) -> None:
    """The covariance of 1e-2 m^2 is that of every axis, so the band is 2 x 1.96 x 0.1 m wide everywhere."""
    band = f"#path-view .bounds.{REFERENCE_LINE}"
    assert opened.count(band) == 0
    opened.page.click('[data-do="band"]')
    assert opened.attribute('[data-do="band"]', "aria-pressed") == "true"
    edges = np.array(opened.attribute(band, "points").split(), dtype=np.float64).reshape(2, -1, 2)
    (ruler,) = opened.boxes("#path-view .ruler")
    meters = float(opened.text("#path-view .plot").split(" m")[0].split()[-1])
    widths = np.linalg.norm(edges[0] - edges[1, ::-1], axis=1)
    np.testing.assert_allclose(widths, 2.0 * 1.96 * 0.1 * ruler["width"] / meters, atol=0.3)
    opened.page.select_option("#path-view select", "10")
    assert opened.attribute(band, "points").split() != [f"{value:.1f}" for value in edges.ravel()]
    opened.page.uncheck('#estimators-shown input[value="5"]')
    assert opened.count(band) == 0


def test_the_picture_follows_the_cursor_until_it_is_dragged(opened: Opened) -> None:
    here, center = f"#path-view .here.{REFERENCE_LINE}", middle(opened, "#path-view .plot")
    opened.page.click('[data-do="follow"]')
    opened.page.click('[data-do="in"]')
    for frame in (5, 50):
        opened.set_frame(frame)
        np.testing.assert_allclose(middle(opened, here), center, atol=10.0)
    before = middle(opened, here)
    opened.page.mouse.move(center[0] + 60.0, center[1] + 60.0)
    opened.page.mouse.down()
    opened.page.mouse.move(center[0] + 100.0, center[1] + 60.0, steps=4)
    opened.page.mouse.up()
    np.testing.assert_allclose(middle(opened, here) - before, (40.0, 0.0), atol=1.0)
    assert opened.attribute('[data-do="follow"]', "aria-pressed") == "false"
    opened.set_frame(5)
    assert np.linalg.norm(middle(opened, here) - before) > 20.0


def test_the_caption_says_from_where_the_paths_are_seen(opened: Opened) -> None:
    assert opened.text("#path-view .view") == "From above."
    opened.page.click('[data-do="solid"]')
    assert opened.text("#path-view .view") == "In 3D."


def test_a_drag_zooms_every_chart_and_a_double_click_shows_all_of_the_time_again(opened: Opened) -> None:
    chart = opened.page.locator(".chart .plot > svg").first
    chart.scroll_into_view_if_needed()
    drawn = "all => all.map(e => e.outerHTML)"
    before = opened.page.eval_on_selector_all(".chart .line", drawn)
    box = chart.bounding_box()
    y, left, width = box["y"] + 60, box["x"] + 50, box["width"] - 60
    opened.page.mouse.move(left + 0.25 * width, y)
    opened.page.mouse.down()
    opened.page.mouse.move(left + 0.5 * width, y, steps=4)
    assert opened.boxes('.chart[data-chart="0"] .marked')[0]["width"] == pytest.approx(0.25 * width, abs=1.0)
    opened.page.mouse.up()
    zoomed = opened.page.eval_on_selector_all(".chart .line", drawn)
    assert all(a != b for a, b in zip(before, zoomed, strict=True))
    shown = "all => all.map(e => e.style.display !== 'none')"
    for frame, inside in ((5, False), (20, True), (55, False)):
        opened.set_frame(frame)
        assert opened.page.eval_on_selector_all(".chart .cursor", shown) == [inside] * opened.count(".chart")
    opened.page.mouse.dblclick(left + 0.5 * width, y)
    assert opened.page.eval_on_selector_all(".chart .line", drawn) == before


def test_the_span_of_time_has_buttons_for_keyboard_and_touch(opened: Opened) -> None:
    opened.set_frame(30)
    before = opened.page.inner_html(".chart .plot")
    opened.page.click('[data-time="in"]')
    assert opened.page.inner_html(".chart .plot") != before
    opened.page.click('[data-time="out"]')
    assert opened.page.inner_html(".chart .plot") == before
    opened.page.click('[data-time="in"]')
    opened.page.click('[data-time="all"]')
    assert opened.page.inner_html(".chart .plot") == before


def test_a_hairline_stands_under_the_pointer_in_every_chart(opened: Opened) -> None:
    chart = opened.page.locator(".chart .plot > svg").first
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    opened.page.mouse.move(box["x"] + 200, box["y"] + 60)
    (first, *others) = opened.boxes(".chart .hairline")
    assert first["x"] == pytest.approx(box["x"] + 200, abs=1.0)
    assert len(others) == opened.count(".chart") - 1
    opened.page.mouse.move(5, 5)
    assert opened.boxes(".chart .hairline") == []


def test_a_long_recording_draws_no_more_points_than_pixels_and_keeps_its_extremes(
    chromium: Any,
    page: Path,
    tmp_path: Path,
) -> None:
    text = page.read_text(encoding="utf-8")
    before, _, rest = text.partition('id="run">')
    held, _, after = rest.partition("</script>")
    run, n = json.loads(held), 8_000
    rng = np.random.default_rng(0)
    run |= {"frames": n, "t": floats(np.arange(n) / 20.0), "observations": None, "truth": None, "bookmarks": []}
    for estimator in run["estimators"]:
        estimator |= {"path": floats(np.cumsum(rng.normal(size=(n, 3)), axis=0)), "covariance": None}
    spike = rng.uniform(1.0, 2.0, n)
    spike[2_345] = 100.0
    gap = np.where(np.arange(n) < n // 2, spike, np.nan)
    run["charts"][0] |= {"lines": {"1": floats(spike), "2": floats(gap)}, "log": False}
    file = tmp_path / "long.html"
    file.write_text(f'{before}id="run">{embedded_json(run)}</script>{after}', encoding="utf-8")
    opened = Opened(chromium, file.as_uri())
    line = opened.attribute(".chart .line.estimator-1", "d")
    points = np.array([point.split() for point in line[1:].split("L")], dtype=np.float64)
    (box,) = opened.boxes('.chart[data-chart="0"] .plot > svg')
    assert box["width"] < len(points) <= 4 * box["width"]
    assert points[:, 1].min() < 20.0  # px below the top of the chart: the one frame of 8,000
    ends = opened.attribute(".chart .line.estimator-2", "d").split("L")[-1].split()
    assert float(ends[0]) == pytest.approx(50 + (box["width"] - 60) / 2, abs=1.5)
    assert policy() in text  # the page is the one that users get
    opened.context.close()


LOOKS = {**ESTIMATOR_COLORS, **{color: color for color in EXTRA_COLORS}, "reference": REFERENCE, "truth": TRUTH}


@pytest.mark.parametrize("ground", ["light", "dark"])
def test_two_lines_differ_in_dash_or_for_every_color_vision_in_color(ground: str) -> None:
    shown = {name: on_dark(color) if ground == "dark" else color for name, color in LOOKS.items()}
    for one, other in combinations(LOOKS, 2):
        if DASHES.get(LOOKS[one]) != DASHES.get(LOOKS[other]):
            continue
        for deficiency in DEFICIENCIES:
            apart = difference(seen(shown[one], deficiency), seen(shown[other], deficiency))
            assert apart > APART, (one, other, deficiency)


def test_ten_estimators_have_ten_looks() -> None:
    chosen = colors(TEN, "isam2")
    assert len({(color, DASHES.get(color)) for color in chosen.values()}) == len(TEN)


def test_charts_figures_and_legends_share_color_and_dash_on_light_and_dark_ground(
    chromium: Any,
    page: Path,
) -> None:
    chosen = colors(TEN, "isam2")
    style = "e => { const s = getComputedStyle(e); return [s.stroke, s.strokeDasharray]; }"
    for scheme in ("light", "dark"):
        opened = Opened(chromium, page.as_uri(), scheme=scheme)
        image = opened.page.locator("#figure-reprojection_distribution img")
        image.scroll_into_view_if_needed()
        opened.page.wait_for_function("e => e.complete && e.naturalWidth > 0", arg=image.element_handle())
        pixels = np.asarray(Image.open(io.BytesIO(image.screenshot())).convert("RGB"), dtype=np.int64)
        ground = DARK_GROUND if scheme == "dark" else "#ffffff"
        for key, name in enumerate(TEN):
            color = on_dark(chosen[name]) if scheme == "dark" else chosen[name]
            stroke, dash = opened.page.eval_on_selector(f".chart .line.estimator-{key}", style)
            assert stroke == f"rgb{tuple(rgb(color))}"
            assert [float(part.removesuffix("px")) for part in dash.split(", ") if part != "none"] == list(
                DASHES.get(chosen[name], ())
            )
        for color in (ground, *(on_dark(c) if scheme == "dark" else c for c in (chosen["ekf"], chosen["fixed-lag"]))):
            assert np.abs(pixels - rgb(color)).max(axis=2).min() <= 6, (scheme, color)
        opened.context.close()


def rgb(color: str) -> list[int]:
    return list(bytes.fromhex(color[1:]))


def test_everything_that_is_touched_has_40_pixels(phone: Opened) -> None:
    phone.page.click("#controls summary")
    for selector in ("button", "select", "summary", "nav a", "#controls label", "#frame"):
        found = phone.boxes(selector)
        assert found or selector == "select"
        for box in found:
            assert box["height"] >= 40.0, (selector, box)
            assert box["width"] >= 24.0, (selector, box)


def test_no_legend_and_no_table_of_a_phone_is_cut_off(phone: Opened) -> None:
    legend = phone.boxes(".legend li")
    assert [box["name"] for box in legend] == [*TEN, "truth"] * 2
    phone.page.click("#controls summary")
    for box in (*legend, *phone.boxes("#controls label")):
        assert 0.0 <= box["x"] <= 390.0 - box["width"], box
    cells = phone.boxes("#table tbody tr:first-child td")
    assert sum(box["x"] + box["width"] <= 390.0 for box in cells) >= 3
    names = "#table tbody th"
    before = phone.boxes(names)
    phone.page.eval_on_selector("#table .wide", "e => { e.scrollLeft = 120; }")
    assert [box["x"] for box in phone.boxes(names)] == [box["x"] for box in before]
    assert phone.boxes("#table tbody tr:first-child td")[0]["x"] == pytest.approx(cells[0]["x"] - 120.0)


def test_a_finger_zooms_by_dragging_and_moves_the_cursor_by_a_tap(phone: Opened) -> None:
    chart = phone.page.locator(".chart .plot > svg").first
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    phone.page.touchscreen.tap(box["x"] + 50 + 0.5 * (box["width"] - 60), box["y"] + 60)
    assert phone.text("#clock").startswith(("frame 29 ", "frame 30 "))
    before = phone.page.inner_html(".chart .plot")
    fingers = phone.context.new_cdp_session(phone.page)
    for kind, x in (
        ("touchStart", 100),
        ("touchMove", 130),
        ("touchMove", 180),
        ("touchMove", 220),
        ("touchEnd", None),
    ):
        points = [] if x is None else [{"x": box["x"] + x, "y": box["y"] + 60}]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    phone.page.wait_for_function("html => document.querySelector('.chart .plot').innerHTML !== html", arg=before)
    ticks = phone.page.locator(".chart .plot").first.locator("text").all_inner_texts()
    assert "0\u00a0s" not in ticks


def test_headings_are_aligned_as_the_cells_below_them(opened: Opened) -> None:
    aligned = """tables => tables.map(table => {
        const heads = [...table.tHead.rows].at(-1).cells, row = [...table.querySelectorAll("tbody tr")]
            .find(row => row.cells.length > 2), skipped = table.tHead.rows.length > 1 ? 1 : 0;
        return [...heads].map((head, i) => [head, row.cells[i + skipped]].map(e => getComputedStyle(e).textAlign));
    })"""
    tables = opened.page.eval_on_selector_all("table:has(tbody tr td + td)", aligned)
    assert len(tables) > 3
    assert [pair for pairs in tables for pair in pairs if pair[0] != pair[1]] == []


def test_the_sticky_header_ends_with_its_table(opened: Opened) -> None:
    opened.page.set_viewport_size({"width": 1400, "height": 500})
    (table,), (bar,) = opened.boxes("#table table"), opened.boxes("#controls")
    for above in (0.0, 0.4, 0.9, 1.2):
        opened.page.evaluate(
            f"scrollTo({{ top: scrollY + {table['y'] + above * table['height']}, behavior: 'instant' }})"
        )
        (now,), (head,) = opened.boxes("#table table"), opened.boxes("#table thead")
        assert now["y"] - 0.5 <= head["y"] <= now["y"] + now["height"] - head["height"] + 0.5
        if above == 0.4:
            assert head["y"] == pytest.approx(bar["height"], abs=1.0)
        opened.page.evaluate("scrollTo({ top: 0, behavior: 'instant' })")


@pytest.mark.parametrize("size", [(1400, 900), (1400, 700), (800, 1000)])
def test_the_bar_of_slider_and_switches_covers_no_table_and_no_heading(
    chromium: Any, page: Path, size: tuple[int, int]
) -> None:
    opened = Opened(chromium, page.as_uri(), *size)
    (bar,), (paths,), (table,) = (opened.boxes(one) for one in ("#controls", "#path-view", "#table h2"))
    assert paths["y"] + paths["height"] <= bar["y"] < bar["y"] + bar["height"] <= table["y"]
    for link in opened.page.locator("nav a").all():
        opened.page.evaluate("document.documentElement.style.scrollBehavior = 'auto'")
        section = link.get_attribute("href")
        link.evaluate("link => link.click()")
        (bar,) = opened.boxes("#controls")
        (heading,) = opened.boxes(f"{section} > h2")
        assert heading["y"] >= 0.0
        assert section in ("#verdict", "#paths") or heading["y"] >= bar["y"] + bar["height"] - 0.5
    opened.context.close()


def test_lines_that_coincide_with_the_reference_show_at_both_sides_of_it(chromium: Any, tmp_path: Path) -> None:
    problem = plain_problem(scene())
    drifts = {"ekf": (3.0, 0.0, 0.0), "isam2": (0.0, 0.0, 0.0), "batch": (1e-4, 0.0, 0.0)}
    run = run_of(problem, *(answer(problem, name, drift) for name, drift in drifts.items()))
    file = tmp_path / "report.html"
    file.write_text(render(run, as_dict(run), {}), encoding="utf-8")
    opened = Opened(chromium, file.as_uri())
    widths = """lines => lines.map(line => [line.getAttribute("class"),
        parseFloat(getComputedStyle(line).strokeWidth)])"""
    for place in ("#path-view", '.chart:has(svg[aria-label^="Height"])'):
        drawn = opened.page.eval_on_selector_all(f"{place} .line:not(.estimator-truth)", widths)
        assert [name for name, _ in drawn] == [f"line estimator-{i}" for i in (2, 1, 0)]  # the lowest first
        (_, batch), (_, reference), (_, ekf) = drawn
        assert batch >= reference + 2.0
        assert reference > ekf
    opened.page.select_option("#path-view select", "1000")
    drawn = opened.page.eval_on_selector_all("#path-view .line:not(.estimator-truth)", widths)
    assert drawn[0] == ["line estimator-1", 3.0]
    assert all(width < 3.0 for _, width in drawn[1:])
    opened.context.close()


def test_a_line_that_jumps_is_a_running_median_until_the_chart_is_zoomed_in(chromium: Any, tmp_path: Path) -> None:
    n = 900
    problem = plain_problem(scene(frames=n))
    seconds = np.where(np.arange(n) % 3 == 0, 1.0, 2e-3)  # every third frame takes 500 times as long
    run = run_of(problem, answer(problem, "isam2", seconds=seconds))
    file = tmp_path / "report.html"
    file.write_text(render(run, as_dict(run), {}), encoding="utf-8")
    opened = Opened(chromium, file.as_uri())
    chart = '.chart:has(svg[aria-label^="Time per frame"])'

    def heights() -> np.ndarray:
        line = opened.attribute(f"{chart} .line", "d")
        return np.array([point.split()[1] for point in line[1:].split("L")], dtype=np.float64)

    assert np.ptp(heights()) < 0.1
    assert "Running median over 9 frames" in opened.text(chart)
    opened.page.evaluate("document.querySelector('[data-time=in]').click()")
    for _ in range(3):
        opened.page.click("[data-time=in]")
    assert "Running median" not in opened.text(chart)
    assert np.ptp(heights()) > 50.0
    opened.context.close()


def test_a_table_that_is_cut_off_has_a_shadow_at_its_edge_until_its_end_is_in_sight(phone: Opened) -> None:
    phone.page.locator("#table .wide").scroll_into_view_if_needed()

    def edge() -> float:
        """Brightness of the last pixels beside the header, over that of those before."""
        picture = Image.open(io.BytesIO(phone.page.locator("#table .wide").screenshot())).convert("L")
        rows = np.asarray(picture, dtype=np.float64)[4:12]
        return float(rows[:, -3:].mean() / rows[:, -60:-40].mean())

    assert edge() < 0.95
    phone.page.eval_on_selector("#table .wide", "e => { e.scrollLeft = e.scrollWidth; }")
    assert edge() == pytest.approx(1.0, abs=0.01)


def test_printed_paths_have_a_legend_of_what_is_shown(opened: Opened) -> None:
    assert [box["name"] for box in opened.boxes("#path-view .legend li")] == [*TEN, "truth"]
    opened.page.uncheck('#estimators-shown input[value="1"]')
    opened.page.emulate_media(media="print")
    assert [box["name"] for box in opened.boxes("#path-view .legend li")] == [TEN[0], *TEN[2:], "truth"]


@pytest.fixture(scope="module")
def pages(page: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, str]]:
    """Page of each kind, and an element that is there once it is drawn."""
    folder = tmp_path_factory.mktemp("pages")
    comparison, found = six(), found_by(diagnose(drive(seconds=4.0)))
    assert found.diagnosis is not None
    assert found.tracks is not None
    drawn = figures.draw_diagnosis(found.diagnosis, found.tracks)
    texts = {
        "comparison": comparison_page.render(comparison, comparison.summary, comparison.figures()),
        "diagnosis": render_diagnosis(found, drawn),
    }
    for name, text in texts.items():
        (folder / f"{name}.html").write_text(text, encoding="utf-8")
    line = "#path-view .line"
    return {
        "run": (page, line),
        "comparison": (folder / "comparison.html", line),
        "diagnosis": (folder / "diagnosis.html", "#figures"),
    }


@pytest.mark.parametrize("kind", ["run", "comparison", "diagnosis"])
# Contrast depends on the scheme, room on the width: two of the four pairs have both of each.
@pytest.mark.parametrize(("width", "scheme"), [(1400, "light"), (390, "dark")])
def test_axe_finds_no_serious_fault(
    chromium: Any, pages: dict[str, tuple[Path, str]], kind: str, width: int, scheme: str
) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
    file, ready = pages[kind]
    opened = Opened(chromium, file.as_uri(), width=width, scheme=scheme, ready=ready)
    opened.page.set_default_timeout(120_000)
    opened.page.eval_on_selector_all("details", "all => all.forEach(details => { details.open = true; })")
    found = axe.Axe().run(opened.page, options={"resultTypes": ["violations"]}).response["violations"]
    faults = [f"{one['id']}: {one['nodes'][0]['html'][:200]}" for one in found if one["impact"] != "minor"]
    assert faults == []
    opened.context.close()
