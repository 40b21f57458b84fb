"""What the page says of the recording, and what stands above its table."""

import re
from dataclasses import replace

import pytest

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.data.finding import Finding
from fgbaseline.reports.formatting import quantity
from fgbaseline.reports.html.run_page import render
from fgbaseline.reports.phrases.run import verdict
from fgbaseline.reports.results.run import summarize

from ..builders.runs import standard_run


def rendered(run: Run) -> str:
    return render(run, summarize(run).model_dump(mode="json", by_alias=True), {})


def test_findings_stand_with_their_figures_and_repairs_below() -> None:
    run = standard_run()
    found = (
        Finding("gyro_bias", "It <drifts>.", 0.0271, 0.0201, "rad/s", "standard error 0.001 rad/s"),
        Finding("copied_frames", "Tracks are copies.", 6562, 0, "observations", "counted"),
        Finding("bursts", "Bursts.", 0.412, 0.002, "share of the matches", "counted"),
    )
    problem = replace(run.problem, diagnosed=True, findings=found, repairs=("user-specified: velocity_scale = 1.5",))
    labeled = rendered(replace(run, problem=problem))
    assert 'data-label="with repair and mask"' in labeled
    html = re.sub(r' data-label="[^"]*"', "", labeled)
    assert "The recording: 3 faults detected" in html
    assert "It &lt;drifts&gt;." in html
    assert ">median difference of the angular velocity from visual odometry</td>" in html
    assert "<td>0.0271\N{NO-BREAK SPACE}rad/s</td><td>0.0201\N{NO-BREAK SPACE}rad/s</td>" in html
    assert ">observations</td><td>6,562</td><td>0</td>" in html
    assert "<td>41.2 %</td><td>0.200 %</td>" in html
    assert "standard error 0.001 rad/s" in html
    assert "counted" not in html
    assert "Bias and time offset: all other repairs of the angular velocity are applied to both values." in html
    assert "Axes: without any repair" not in html
    assert ">without repair</th>" in html
    assert "<li>User-specified: velocity_scale = 1.5.</li>" in html


def test_a_clean_recording_is_reported_as_such_and_an_undiagnosed_one_is_not() -> None:
    run = standard_run()
    assert "The recording:" not in rendered(run)
    clean = rendered(replace(run, problem=replace(run.problem, diagnosed=True)))
    assert "The recording: no fault detected" in clean


def test_six_sentences_stand_on_top_and_the_rest_is_folded_away() -> None:
    run = standard_run()
    sentences, page = verdict(run), rendered(run)
    assert len(sentences) > 6
    shown, folded = page[: page.index('<section id="table"')].split("<details>")
    assert shown.count("<li>") == 6
    assert f"{len(sentences) - 6} more conclusion" in folded
    assert folded.count("<li>") == len(sentences) - 6


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.5, "share of the tracks", "50.0 %"),
        (0.02, "m/s", "0.0200\N{NO-BREAK SPACE}m/s"),
        (0.793, "°", "0.793°"),
        (0.361, "px", "0.361\N{NO-BREAK SPACE}px"),
        (0.35, "m/s^2", "0.350\N{NO-BREAK SPACE}m/s^2"),
        (0.00112, "rad/s/sqrt(Hz)", "0.00112\N{NO-BREAK SPACE}rad/s/sqrt(Hz)"),
        (1.06, "recorded over seen", "1.06"),
        (12.0, "frames", "12"),
    ],
)
def test_a_finding_s_figure_has_its_unit(value: float, unit: str, text: str) -> None:
    assert quantity(value, unit) == text
