"""Rankings use the moments that all estimates have; words and sign agree; coverage stands beside the ranks."""

import csv
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import compare as figures
from fgbaseline import data
from fgbaseline.compare.trajectory_comparison.ranking import ranking_of
from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray, se3
from fgbaseline.reports.comparison import compare
from fgbaseline.reports.phrases.bench import winner
from fgbaseline.reports.phrases.evidence import significance_sentences
from fgbaseline.reports.phrases.run import verdict
from fgbaseline.reports.results.bench import BENCH_METRICS
from fgbaseline.reports.tables.run import main_table
from fgbaseline.reports.tables.writers import latex, markdown

from ..builders.runs import answer, as_dict, run_of, scene
from ..builders.synthetic import plain_problem
from ..conftest import RECORDINGS

T = 200
NAMES = ("a", "b", "c")


@st.composite
def triples(draw: st.DrawFn) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Stamps and errors of three estimates, each with its own moments."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kept = [np.flatnonzero(random.random(60) < draw(st.sampled_from([0.3, 0.7, 1.0]))) for _ in NAMES]
    sizes = [draw(st.sampled_from([0.0, 1e-3, 0.1, 1.0])) for _ in NAMES]
    return {
        name: (0.1 * k, size * np.abs(random.normal(size=len(k))))
        for name, k, size in zip(NAMES, kept, sizes, strict=True)
        if len(k)
    }


@given(triples())
def test_words_and_sign_agree_and_every_rank_is_over_the_moments_that_all_have(
    drawn: dict[str, tuple[FloatArray, FloatArray]],
) -> None:
    errors = {name: e for name, (_, e) in drawn.items()}
    stamps = {name: t for name, (t, _) in drawn.items()}
    ranking = ranking_of(errors, stamps, tolerance=0.01, by_products=frozenset(), seed=0)
    taking_part = figures.rankable({name: len(t) for name, t in stamps.items()})
    common = set.intersection(*(set(stamps[name].tolist()) for name in taking_part))
    assert ranking.moments == len(common)
    if not common:
        assert ranking.rivals == ()
        return
    over_common = {
        name: np.sqrt(np.mean([e**2 for t, e in zip(*drawn[name], strict=True) if t in common])) for name in taking_part
    }
    for name in taking_part:
        assert ranking.rmse(name) == pytest.approx(over_common[name], rel=1e-9)
    assert [over_common[name] for name in ranking.rivals] == pytest.approx(sorted(over_common.values()))
    words = significance_sentences({name: ranking.rmse(name) for name in ranking.rivals}, ranking.behind)
    assert "\N{MINUS SIGN}" not in "".join(words).split("[")[0]
    for name, d in ranking.behind.items():
        assert d.value == pytest.approx(over_common[name] - over_common[ranking.rivals[0]], abs=1e-12)
        assert d.value >= 0.0
        farther = any(s.startswith("Larger position RMSE than") and f"{name} (" in s for s in words)
        assert farther == figures.is_claimed(d, ranking.rmse(name), ranking.rmse(ranking.rivals[0]))
        assert not farther or (d.value > 0.0 and d.low > 0.0)


def test_no_interval_decides_an_order_other_than_that_of_the_point_estimates() -> None:
    assert not figures.RmseDifference(0.1, -0.3, -0.2, 5, 20.0, True).settled
    assert not figures.RmseDifference(-0.1, 0.2, 0.3, 5, 20.0, True).settled
    assert figures.RmseDifference(0.1, 0.05, 0.2, 5, 20.0, True).settled


def path() -> FloatArray:
    """T poses along a curve."""
    return se3.compose(se3.exp(np.tile([0.8, 0.0, 0.01, 0.002, 0.0, 0.012], (T - 1, 1))))


def off(poses: FloatArray, meters: float, seed: int) -> FloatArray:
    moved = poses.copy()
    moved[:, :3, 3] += meters * np.random.default_rng(seed).normal(size=(len(poses), 3))
    return moved


@pytest.fixture
def lost(tmp_path: Path) -> Path:
    """A truth; an estimate of all of it that is bad in the second half; another of its first half only."""
    t, poses = 0.1 * np.arange(T), path()
    whole = off(poses, 0.02, 1)
    whole[T // 2 :] = off(poses, 2.0, 2)[T // 2 :]
    data.write_tum(tmp_path / "gt.tum", t, poses)
    data.write_tum(tmp_path / "whole.tum", t, whole)
    data.write_tum(tmp_path / "lost.tum", t[: T // 2], off(poses, 0.3, 3)[: T // 2])
    return tmp_path


def test_an_estimate_that_lost_track_half_way_is_ranked_over_what_both_have(lost: Path) -> None:
    result = compare(lost / "gt.tum", lost / "whole.tum", lost / "lost.tum", align="none")
    assert result.ranking.moments == T // 2
    assert list(result.ranking.rivals) == ["whole", "lost"]
    assert result.results["whole"].rmse > result.results["lost"].rmse
    said = " ".join(result.verdict)
    assert "Position RMSE against gt, not aligned, over the 100 poses that all have: whole " in said
    assert "Larger position RMSE than whole, by paired bootstrap: lost (" in said
    assert "100 poses (49.7 % of gt's time)" in said
    estimates = result.summary.estimates
    assert (estimates["whole"].rank, estimates["lost"].rank) == (1, 2)
    assert (estimates["whole"].coverage, estimates["lost"].coverage) == pytest.approx((1.0, 99 / 199))


def test_coverage_stands_beside_the_ranks_in_every_table(lost: Path) -> None:
    result = compare(lost / "gt.tum", lost / "whole.tum", lost / "lost.tum", align="none")
    result.report(lost / "out")
    for text in (markdown(result.text_table), latex(result.text_table), (lost / "out" / "report.html").read_text()):
        assert "share of the time, %" in text.replace("\\%", "%")
        assert "49.7" in text
        assert "RMSE over common stamps, m" in text
    bold = [line for line in latex(result.text_table).splitlines() if r"\textbf" in line]
    assert len(bold) == 1  # frames that one estimate alone has do not decide the ranking
    assert "common stamps" in bold[0]
    with (lost / "out" / "table.csv").open(newline="") as file:
        rows = {row["estimate"]: row for row in csv.DictReader(file)}
    assert float(rows["lost"]["coverage: share of the time, %"]) == pytest.approx(100 * 99 / 199)
    assert json.loads((lost / "out" / "comparison.json").read_text())["estimates"]["lost"]["rank"] == 2


def test_estimates_without_a_moment_in_common_are_not_ranked(lost: Path) -> None:
    t, poses = 0.1 * np.arange(T), path()
    late = Trajectory(t[T // 2 :], off(poses, 0.1, 4)[T // 2 :], "late")
    result = compare(lost / "gt.tum", lost / "lost.tum", late, align="none")
    assert any("Not ranked, too few poses in common: " in s for s in result.verdict)
    assert not any(s.startswith(("Position RMSE against", "Larger", "No significant")) for s in result.verdict)
    assert {e.rank for e in result.summary.estimates.values()} == {None}


def test_one_with_next_to_no_moments_takes_none_from_the_others(lost: Path) -> None:
    t, poses = 0.1 * np.arange(T), path()
    few = Trajectory(t[:3], poses[:3], "few")
    result = compare(lost / "gt.tum", lost / "whole.tum", lost / "lost.tum", few, align="none")
    assert result.ranking.moments == T // 2
    assert any(s == "Not ranked, too few poses in common with gt: few." for s in result.verdict)
    assert result.verdict[0].startswith("Too little data to evaluate few: 3 of its 3 poses are paired with gt")


def test_a_run_ranks_over_the_frames_that_all_estimators_have() -> None:
    problem = plain_problem(scene())
    poses = answer(problem, "ekf", (0.0, 1.0, 0.0)).world_T_imu.copy()
    poses[problem.n_frames // 2 :] = np.nan
    run = run_of(
        problem,
        answer(problem, "dead-reckoning", (0.0, 0.9, 0.0)),
        answer(problem, "ekf", world_T_imu=poses),
        answer(problem, "isam2"),
    )
    estimators = as_dict(run)["estimators"]
    assert estimators["ekf"]["divergence"]["rmse"] < estimators["dead-reckoning"]["divergence"]["rmse"]
    assert estimators["ekf"]["divergence_common"]["rmse"] > estimators["dead-reckoning"]["divergence_common"]["rmse"]
    assert {e["divergence_common"]["frames"] for e in estimators.values()} == {problem.n_frames // 2}
    said = verdict(run)
    assert any(s.startswith("Smallest divergence from isam2") and ": dead-reckoning " in s for s in said)
    assert any("ekf 49.2 %" in s for s in said)
    assert f"They are ranked over the {problem.n_frames // 2} frames that all have." in said
    table = main_table(run, estimators)
    assert {"share of the time, %", "RMSE over common frames, m"} <= {c.heading for c in table.columns}
    whole = main_table(run_of(problem, answer(problem, "ekf"), answer(problem, "isam2")), estimators)
    assert "share of the time, %" not in {c.heading for c in whole.columns}


@given(st.lists(st.lists(st.sampled_from([np.nan, 1.0, 2.0, 3.0]), min_size=3, max_size=3), min_size=2, max_size=6))
def test_runs_are_ranked_so_that_none_of_equally_many_answers_is_behind_by_less_than_nothing(
    runs: list[list[float]],
) -> None:
    table = figures.monte_carlo_ranking(pd.DataFrame(runs, columns=list(NAMES)))
    if len(table):
        alike = table[table["runs"] == table["runs"].iloc[0]]
        assert (alike["behind"].dropna() >= 0.0).all()


def test_a_bench_reports_estimators_with_fewer_answers_and_a_lower_error_than_the_best() -> None:
    errors = pd.DataFrame({"bold": [0.1, np.nan, 0.1], "sound": [0.2, 0.9, 0.2]})
    said = winner(
        "town",
        figures.monte_carlo_ranking(errors).reset_index(),
        next(m for m in BENCH_METRICS if m.name == "ate"),
        frozenset(),
    )
    assert said.startswith("town: ATE sound ")
    assert "not ranked for failed runs: bold (2 of 3 runs, 0.100 m below sound in these)" in said


def test_case_25_one_estimate_lost_track_half_way() -> None:
    folder = RECORDINGS / "cases" / "25-completion"
    if not folder.is_dir():
        pytest.skip(f"cases/25-completion is not in {RECORDINGS} (set FGBASELINE_RECORDINGS)")
    result = compare(folder / "gt.tum", folder / "whole.tum", folder / "lost.tum")
    assert {name: round(result.ranking.rmse(name), 4) for name in result.ranking.rivals} == {
        "whole": 0.0891, "lost": 0.1323
    }  # fmt: skip
    assert result.ranking.rivals == ("whole", "lost")
    assert any("Larger position RMSE than whole" in s and "lost (0.0432 m" in s for s in result.verdict)
