"""The page holds every number of the table, escapes what comes from files, and needs nothing but itself."""

import json
import re
from base64 import b64decode, b64encode
from dataclasses import replace
from functools import cache
from hashlib import sha256
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.data import Event, Excluded, Observations, Status
from fgbaseline.reports import figures
from fgbaseline.reports.figures.style import ESTIMATOR_COLORS, EXTRA_COLORS, REFERENCE, TRUTH, on_dark
from fgbaseline.reports.formatting import number
from fgbaseline.reports.html.plot_data import page_data
from fgbaseline.reports.html.run_page import render
from fgbaseline.reports.phrases.run import verdict
from fgbaseline.reports.results.metric_record import MAIN
from fgbaseline.reports.results.metric_registry import shown_in
from fgbaseline.reports.run.folder import _write_tables
from fgbaseline.reports.tables.run import evidence_table, main_table
from fgbaseline.reports.tables.run_details import MAX_EVENTS, events_tables, long_tables

from ..builders.runs import answer, as_dict, failed, run_of, scene, standard_run
from ..builders.synthetic import plain_problem

SCRIPT = "<script>alert(1)</script>"


def rendered(run: Run, *, with_figures: bool = False) -> str:
    return render(run, as_dict(run), figures.draw(run) if with_figures else {})


@cache
def standard_page() -> str:
    return rendered(standard_run(), with_figures=True)


def unpacked(text: str, kind: str = "<f4") -> np.ndarray:
    return np.frombuffer(b64decode(text), kind)


class Elements(HTMLParser):
    """The start tags of a page with their attributes, and its text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.open: list[str] = []
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in ("meta", "img", "br", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1:] != ["script"]:
            self.text += data


def test_the_table_holds_every_number_of_the_summary_it_has_a_column_for() -> None:
    run = standard_run()
    text = Elements(standard_page()).text
    for name, estimator in as_dict(run)["estimators"].items():
        row = text[text.index(name, text.index("estimator")) :]
        for metric in shown_in(MAIN):
            value = estimator
            for key in metric.path:
                value = None if value is None else value.get(key)  # velocity and biases are of inertial runs
            if value is not None and (name != run.reference or metric.group != "divergence"):
                assert number(metric.scale * float(value)) in row, (name, metric.path)


def test_the_best_of_a_column_is_marked_and_the_reference_is_not_nearest_to_itself() -> None:
    run = standard_run()
    table = main_table(run, as_dict(run)["estimators"])
    at = [i for i, column in enumerate(table.columns) if column.heading in ("RMSE, aligned, m", "RMSE, m")]
    best = {row.name: [row.cells[i].best for i in at] for row in table.rows}
    assert best == {"dead-reckoning": [False, False], "ekf": [False, True], "isam2": [True, False]}
    assert [row.name for row in table.rows if row.reference] == ["isam2"]


def test_rounding_is_zero_with_its_resolution_and_never_the_best() -> None:
    problem = plain_problem(scene())
    drifts = {"ekf": 1e-9, "joint-ekf": 3.0, "isam2": 0.0}
    run = run_of(problem, *(answer(problem, name, (drift, 0.0, 0.0)) for name, drift in drifts.items()))
    table = main_table(run, as_dict(run)["estimators"])
    at = [i for i, column in enumerate(table.columns) if column.group.startswith("divergence") and column.unit == "m"]
    rows = {row.name: [row.cells[i] for i in at] for row in table.rows}
    assert len(at) == 2
    assert {(cell.text, cell.best) for cell in rows["ekf"]} == {("< 1 × 10⁻⁵", False)}
    assert all("10⁻⁶" not in cell.text for cell in rows["joint-ekf"])
    sentences = " ".join(verdict(run))
    assert "below 0.01 mm" in sentences
    assert "10⁻⁹ m" not in sentences
    printed = [main_table(run, as_dict(run)["estimators"]), evidence_table(run, as_dict(run)["estimators"])]
    texts = [cell.text for one in (*printed, *long_tables(run)) for row in one.rows for cell in row.cells]
    assert any(text.startswith("< ") for text in texts)
    assert not [text for text in texts if re.search("10⁻([6-9]|[¹²³])", text)]


@pytest.mark.parametrize(("farthest", "logarithmic"), [(60.0, True), (6.0, False)])
def test_a_chart_is_logarithmic_where_one_estimator_dwarfs_the_others(farthest: float, logarithmic: bool) -> None:
    problem = plain_problem(scene())
    drifts = {"dead-reckoning": farthest, "ekf": 3.0, "joint-ekf": 2.0, "isam2": 0.0}
    run = run_of(problem, *(answer(problem, name, (0.0, drift, 0.0)) for name, drift in drifts.items()))
    assert {chart["name"]: chart["log"] for chart in page_data(run)["charts"]}["divergence"] is logarithmic


def test_bookmarks_are_in_the_order_of_time() -> None:
    frames = [bookmark["frame"] for bookmark in page_data(standard_run())["bookmarks"]]
    assert len(frames) >= 2
    assert frames == sorted(frames)


def test_nothing_is_loaded_from_anywhere() -> None:
    for tag, attributes in Elements(standard_page()).tags:
        assert tag not in ("link", "iframe", "object", "embed")
        for name in ("src", "href", "srcset", "action", "data"):
            assert attributes.get(name, "#").startswith(("#", "data:image/")), (tag, name)
    without_figures = re.sub(r"data:image/[^\"]+", "", standard_page())
    assert "http" not in without_figures.replace("http-equiv", "").replace("http://www.w3.org/2000/svg", "")
    assert set(re.findall(r"url\([^)]*\)", without_figures)) == {"url(#on-dark)"}
    assert "@import" not in without_figures


def test_the_page_is_well_formed_named_and_described() -> None:
    elements = Elements(standard_page())
    assert not elements.open
    assert ("html", {"lang": "en"}) in elements.tags
    ids = [attributes["id"] for _, attributes in elements.tags if "id" in attributes]
    assert len(set(ids)) == len(ids)
    images = [attributes for tag, attributes in elements.tags if tag == "img"]
    assert len(images) == 20  # the overlaid paths twice: where there is no script, and among the still figures
    assert all(len(image["alt"]) > 10 for image in images)
    links = [attributes["href"][1:] for tag, attributes in elements.tags if tag == "a"]
    assert set(links) <= set(ids)


def test_the_page_stays_small() -> None:
    assert len(standard_page()) < 4_000_000


def test_text_from_files_is_escaped_wherever_it_stands() -> None:
    sequence = scene(name=SCRIPT, source=SCRIPT, form=SCRIPT, remarks=(SCRIPT,))
    problem = replace(plain_problem(sequence), remarks=(SCRIPT,), preset=SCRIPT)
    events = (Event(3, SCRIPT, SCRIPT, 7),)
    run = run_of(
        problem,
        answer(problem, SCRIPT, (1.0, 0.0, 0.0), status=Status.RECOVERED, reason=SCRIPT, events=events),
        answer(problem, "isam2"),
        failed(problem, f"x{SCRIPT}", SCRIPT),
    )
    html = rendered(replace(run, settings={SCRIPT: SCRIPT}))
    assert [len(attributes) for tag, attributes in Elements(html).tags if tag == "script"] == [2, 0]
    assert "<script>alert" not in html
    assert html.count("&lt;script&gt;alert(1)&lt;/script&gt;") >= 10
    assert html.count("\\u003cscript\\u003ealert(1)\\u003c/script\\u003e") >= 2


def test_only_the_script_of_the_page_itself_may_run() -> None:
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]+)"', standard_page())
    script = standard_page().rpartition("<script>")[2].partition("</script>")[0]
    digest = b64encode(sha256(script.encode()).digest()).decode()
    assert policy.replace("&#39;", "'").split("; ") == [
        "default-src 'none'",
        "img-src data:",
        "style-src 'unsafe-inline'",
        f"script-src 'sha256-{digest}'",
    ]


def test_the_plots_hold_the_data_of_the_run() -> None:
    run = standard_run()
    held = json.loads(standard_page().partition('id="run">')[2].partition("</script>")[0])
    ekf, problem = held["estimators"][1], run.problem
    poses = run.results["ekf"].estimate.world_T_imu
    path = unpacked(ekf["path"]).reshape(-1, 3)
    assert np.allclose(np.linalg.norm(path, axis=1), np.linalg.norm(poses[:, :3, 3], axis=1), atol=1e-4)
    pixel = unpacked(held["observations"]["pixel"], "<i2").reshape(-1, 4) / held["observations"]["parts"]
    assert np.abs(pixel - problem.sequence.observations.pixel).max() <= 1 / 32
    used = np.unpackbits(unpacked(ekf["used"], "u1"), bitorder="little")[: len(pixel)]
    assert np.array_equal(used, run.results["ekf"].estimate.used)
    divergence = next(chart for chart in held["charts"] if chart["name"] == "divergence")
    assert sorted(divergence["lines"]) == ["0", "1"]
    assert np.allclose(unpacked(divergence["lines"]["1"])[-1], run.results["ekf"].divergence["position"].iloc[-1])
    assert {c["name"] for c in held["charts"]} >= {"divergence", "error", "height", "reprojection", "nees", "time"}


def test_failed_estimators_are_listed_with_their_reason() -> None:
    problem = plain_problem(scene())
    run = run_of(problem, failed(problem, "ekf", "the covariance of frame 5 is singular"), answer(problem, "isam2"))
    text = Elements(rendered(run)).text
    assert text.count("the covariance of frame 5 is singular") == 2
    assert "Skip to the table" in text


def test_without_truth_there_is_no_column_for_it() -> None:
    run = standard_run(truth=None)
    table = main_table(run, as_dict(run)["estimators"])
    assert "ATE" not in [title for title, _, _ in table.groups]
    assert ">ATE</a>" not in rendered(run)


def test_a_missing_value_is_a_dash_whose_reason_stands_below() -> None:
    problem = plain_problem(scene())
    run = run_of(problem, answer(problem, "ekf", covariance=None), answer(problem, "isam2"))
    table = main_table(run, as_dict(run)["estimators"])
    missing = [cell for row in table.rows for cell in row.cells if cell.note and row.name == "ekf"]
    assert {cell.text for cell in missing} == {"–"}
    assert ({cell.note for cell in missing}, "it gives no covariance") in [({m}, text) for m, text in table.notes]
    assert "it gives no covariance." in Elements(rendered(run)).text


def test_a_run_without_observations_and_one_without_any_answer_have_their_page() -> None:
    problem = plain_problem(scene(observations=Observations.none(), truth=None))
    alone = run_of(problem, answer(problem, "dead-reckoning"), failed(problem, "ekf", "no observations"))
    assert "ekf failed: no observations." in Elements(rendered(alone, with_figures=True)).text
    nobody = run_of(problem, failed(problem, "ekf", "no observations"))
    assert "There is no reference" in rendered(nobody, with_figures=True)


def test_masked_observations_are_counted_and_events_of_one_kind_and_cause_are_one_row(tmp_path: Path) -> None:
    problem = plain_problem(scene())
    excluded = problem.excluded.copy()
    excluded[:31] = Excluded.PREDICTION
    problem = replace(problem, excluded=excluded)
    events = tuple(Event(k % 60, "landmark dropped", "it came to lie behind", k) for k in range(250))
    twin = answer(problem, "isam2-online", events=events)
    run = run_of(problem, answer(problem, "isam2", events=events, by_products={"isam2-online": twin}), twin)
    html = rendered(run)
    assert re.search(r"contradicts the motion of its track[^/]*</th><td>31</td>", html)
    assert "isam2, isam2-online: 250 × landmark dropped" in html
    assert html.count("it came to lie behind") == 1
    (table,) = events_tables(run)
    assert [[row.name, *(cell.text for cell in row.cells)] for row in table.rows] == [
        ["landmark dropped", "250", "0–59", "250 landmarks", "it came to lie behind"]
    ]
    assert "tables/events.csv" in table.caption
    _write_tables(run, tmp_path)
    listed = pd.read_csv(tmp_path / "events.csv")
    assert listed["estimator"].value_counts().to_dict() == {"isam2": 250, "isam2-online": 250}
    assert listed.loc[7, ["frame", "kind", "reason", "landmark"]].tolist() == [
        7, "landmark dropped", "it came to lie behind", 7
    ]  # fmt: skip


def test_the_most_frequent_causes_of_events_are_listed_and_the_others_counted() -> None:
    problem = plain_problem(scene())
    events = tuple(Event(3, "landmark dropped", f"cause {k}", k) for k in range(MAX_EVENTS + 50))
    (table,) = events_tables(run_of(problem, answer(problem, "isam2", events=events)))
    assert len(table.rows) == MAX_EVENTS
    assert table.caption.startswith("And 50 more. ")


def test_the_glossary_has_the_terms_of_the_page_and_no_other() -> None:
    tags = Elements(rendered(standard_run())).tags
    links = {a["href"].removeprefix("#term-") for _, a in tags if a.get("href", "").startswith("#term-")}
    terms = {a["id"].removeprefix("term-") for _, a in tags if a.get("id", "").startswith("term-")}
    assert links <= terms
    assert {"ate", "divergence", "nees", "reference-nees"} <= terms
    assert not terms & {"coverage", "segment-error", "relative-error-rpe", "drift", "held-out-error", "velocity"}


def test_the_moment_of_most_wrong_matches_is_the_one_of_the_sentence() -> None:
    problem = plain_problem(scene())
    frame = problem.sequence.observations.frame
    excluded = np.where((frame >= 30) & (frame < 33), Excluded.PREDICTION, problem.excluded)
    excluded = np.where(frame < 20, Excluded.COPIED, excluded).astype(np.uint8)  # copies are no wrong matches
    run = run_of(replace(problem, excluded=excluded), answer(problem, "isam2"))
    (bookmark,) = page_data(run)["bookmarks"]
    assert bookmark == {"frame": 35, "text": "most excluded wrong matches or moving points"}
    assert any("from 3 s to 4 s)." in sentence for sentence in verdict(run))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1.0, "1.00"),
        (0.123456, "0.123"),
        (-12.345, "−12.3"),
        (999.4, "999"),
        (1342.3, "1,342"),
        (2.25e6, "2.25 × 10⁶"),
        (4.2e-5, "4.20 × 10⁻⁵"),
        (66353, "66,353"),
        (0, "0"),
        (None, "–"),
        (float("nan"), "–"),
        (float("inf"), "∞"),
        (True, "–"),
    ],
)
def test_numbers_have_three_digits(value: object, text: str) -> None:
    assert number(value) == text


def test_numbers_of_numpy_are_numbers() -> None:
    assert number(np.float64(2.5)) == "2.50"


@pytest.mark.parametrize("color", [*ESTIMATOR_COLORS.values(), *EXTRA_COLORS, REFERENCE, TRUTH])
def test_every_color_stands_out_on_dark_ground(color: str) -> None:
    """By the contrast that the accessibility guidelines (WCAG 2.2, 1.4.11) ask of lines: 3 to 1."""
    (ground,) = re.findall(r"--card: (#\w+);", standard_style().partition("prefers-color-scheme: dark")[2])[:1]
    bright, dark = sorted((luminance(on_dark(color)), luminance(ground)), reverse=True)
    assert (bright + 0.05) / (dark + 0.05) >= 3.0


def luminance(color: str) -> float:
    """Relative luminance of `#RRGGBB`, 0 to 1."""
    share = np.frombuffer(bytes.fromhex(color[1:]), np.uint8) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def standard_style() -> str:
    return files("fgbaseline.reports.html").joinpath("report.css").read_text(encoding="utf-8")
