"""The answer first: sigma of the reference, overconfidence, criteria of trust, and no rounding as a result."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fgbaseline import compare, data
from fgbaseline.compare import Verdict
from fgbaseline.geometry import se3
from fgbaseline.reports import comparison
from fgbaseline.reports.accuracy_check.evaluation import evaluate
from fgbaseline.reports.accuracy_check.limits import read_limits
from fgbaseline.reports.formatting import number
from fgbaseline.reports.html.plot_data import page_data
from fgbaseline.reports.phrases.run import verdict
from fgbaseline.reports.phrases.run_accuracy import ate_sentences
from fgbaseline.reports.results.reader import read_folder
from fgbaseline.reports.results.run import summarize
from fgbaseline.reports.run.folder import write_numbers
from fgbaseline.reports.tables.run import OVERCONFIDENT, evidence_table, main_table, terminal_table
from fgbaseline.reports.tables.run_details import trust_table

from ..builders.runs import answer, as_dict, run_of, scene
from ..builders.synthetic import plain_problem


def claiming(sigma: float, frames: int) -> np.ndarray:
    return np.tile(sigma**2 * np.eye(6), (frames, 1, 1))


def run_with_claims(*names: str) -> compare.estimate_comparison.Run:
    """Filters that claim 1 mm beside a reference that claims 10 cm."""
    problem = plain_problem(scene())
    T = problem.n_frames
    filters = [answer(problem, name, (3.0, 0.0, 0.0), covariance=claiming(1e-3, T)) for name in names]
    return run_of(problem, *filters, answer(problem, "isam2", covariance=claiming(0.1, T)))


def test_overconfidence_comes_second_and_many_estimators_make_one_sentence() -> None:
    names = [f"filter-{i}" for i in range(9)]
    sentences = verdict(run_with_claims(*names))
    assert sentences[0].startswith("The reference")
    assert sentences[1].startswith(
        "Overconfident: filter-0 claims a position sigma of 0.00173 m (RMS) but differs from ground truth by 1.7"
    )
    assert all(name in sentences[1] for name in names)
    assert len([s for s in sentences if "filter-7" in s and "claims" in s]) == 1


def test_the_sigma_of_the_reference_is_in_summary_and_sentence() -> None:
    run = run_with_claims("ekf")
    reference = summarize(run).reference
    assert reference.sigma is not None
    assert reference.sigma.position_rmse == pytest.approx(0.1 * np.sqrt(3.0))
    assert reference.sigma.rotation_final_deg == pytest.approx(np.rad2deg(0.1 * np.sqrt(3.0)))
    said = (
        "Sigma of the reference isam2, with its start fixed: position (3D) 0.173 m RMS, 0.173 m at the end; rotation "
    )
    assert any(s.startswith(said) for s in verdict(run))


def test_a_reference_nees_without_a_positive_definite_difference_reads_overconfident() -> None:
    run = run_with_claims("ekf")
    summary = summarize(run).model_dump(mode="json")
    table = main_table(run, summary["estimators"])
    column = [c.title for c in table.columns].index("reference NEES, median (5.35 expected)")
    ekf = next(row for row in table.rows if row.name == "ekf")
    assert ekf.cells[column].text == OVERCONFIDENT


def test_a_reference_nees_over_part_of_the_frames_says_so_and_causes_have_a_note_each() -> None:
    problem = plain_problem(scene())
    T = problem.n_frames
    mixed = claiming(0.2, T)
    mixed[40:] = claiming(0.05, T - 40)
    run = run_of(
        problem,
        answer(problem, "ekf", (3.0, 0.0, 0.0), covariance=mixed),
        answer(problem, "batch", covariance=claiming(0.1, T)),
        answer(problem, "isam2", covariance=claiming(0.1, T)),
    )
    estimators = summarize(run).model_dump(mode="json")["estimators"]
    for table in (main_table(run, estimators), evidence_table(run, estimators)):
        column = next(i for i, c in enumerate(table.columns) if "reference NEES" in f"{c.group} {c.title}")
        notes = {row.name: dict(table.notes).get(row.cells[column].note) for row in table.rows}
        assert notes["ekf"] == f"over the 40 of {T} frames in which P − P_ref is positive definite"
        assert notes["batch"] == "it solves the graph of the reference: P − P_ref is zero up to rounding"
        assert notes["isam2"] == "it is the reference"
    overconfident = run_with_claims("ekf")
    estimators = summarize(overconfident).model_dump(mode="json")["estimators"]
    notes_of_ekf = set()
    for table in (main_table(overconfident, estimators), evidence_table(overconfident, estimators)):
        column = next(i for i, c in enumerate(table.columns) if "reference NEES" in f"{c.group} {c.title}")
        row = next(row for row in table.rows if row.name == "ekf")
        assert row.cells[column].text == OVERCONFIDENT
        notes_of_ekf.add(dict(table.notes)[row.cells[column].note])
    assert len(notes_of_ekf) == 1


@pytest.mark.parametrize(("defined", "is_shown"), [(20, False), (40, True)])
def test_a_reference_nees_of_less_than_half_of_the_frames_is_no_value_of_the_table(
    defined: int, is_shown: bool
) -> None:
    problem = plain_problem(scene())
    T = problem.n_frames
    nearly = claiming(0.0999, T)  # below the reference's, by less than makes it overconfident
    nearly[:defined] = claiming(0.2, defined)
    run = run_of(
        problem,
        answer(problem, "ekf", (0.01, 0.0, 0.0), covariance=nearly),
        answer(problem, "isam2", covariance=claiming(0.1, T)),
    )
    estimators = summarize(run).model_dump(mode="json")["estimators"]
    assert estimators["ekf"]["nees_reference"]["median"] is not None
    for table in (main_table(run, estimators), evidence_table(run, estimators)):
        column = next(i for i, c in enumerate(table.columns) if "reference NEES" in f"{c.group} {c.title}")
        cell = next(row.cells[column] for row in table.rows if row.name == "ekf")
        assert (cell.text != "–") == is_shown
        few, many = f"P − P_ref is positive definite in only {defined} of {T} frames", f"over the {defined} of {T} "
        assert dict(table.notes)[cell.note].startswith(many if is_shown else few)
    hint = next(chart["hint"] for chart in page_data(run)["charts"] if chart["name"] == "nees-reference")
    assert f"no value in {T - defined} frames of ekf, where P − P_ref is not positive definite" in hint


def test_another_minimum_of_the_same_graph_is_not_called_overconfident() -> None:
    problem = plain_problem(scene())
    run = run_of(problem, answer(problem, "isam2"), answer(problem, "batch"))
    assert not [s for s in verdict(run) if s.startswith("Overconfident")]


def test_inflated_pixel_noise_is_stated_and_low_residuals_are_no_praise() -> None:
    problem = plain_problem(scene())
    inflated = run_of(replace(problem, pixel_inflation=5.5), answer(problem, "isam2"))
    pixel = next(c for c in inflated.trust.criteria if c.code == "pixel_scale")
    assert pixel.remark == "the pixel sigma is inflated by a factor of 5.5 for time-correlated track errors"
    assert any(
        reason.endswith(f"(limit 1.6; 0.182 is expected of uncorrelated errors, as {pixel.remark})")
        for reason in inflated.trust.reasons
    )
    rows = trust_table(inflated.trust.criteria).rows
    assert "inflated by a factor of 5.5" in rows[0].cells[-1].text
    assert summarize(inflated).problem.pixel_inflation == 5.5
    plain = run_of(problem, answer(problem, "isam2"))
    assert not any("inflated" in reason for reason in plain.trust.reasons)


@pytest.mark.parametrize(("at_most", "code"), [(0.1, 2), (10.0, 0)])
def test_a_limit_below_the_sigma_of_the_reference_is_undecided(at_most: float, code: int, tmp_path: Path) -> None:
    run = run_with_claims("ekf")
    trusted = replace(run, trust=compare.Trust(Verdict.TRUSTED, ("it agrees",)))
    write_numbers(trusted, tmp_path)
    limits = tmp_path / "limits.toml"
    text = f'[[limit]]\nmetric = "divergence.rmse"\nestimators = "ekf"\nat_most = {at_most}\n'
    limits.write_text(text + "within_reference_sigma = true\n")
    checked = evaluate(read_limits(limits), read_folder(tmp_path), None)
    assert checked.exit_code == code
    assert checked.sigmas[0].startswith("Sigma of the reference isam2, with its start fixed: position (3D) 0.173 m RMS")
    limits.write_text(text)
    assert evaluate(read_limits(limits), read_folder(tmp_path), None).exit_code == (1 if code else 0)


@pytest.mark.parametrize(("digits", "resolution"), [(6, "1 × 10⁻⁵"), (4, "8.66 × 10⁻⁵")])
def test_a_difference_of_the_decimals_alone_is_zero_and_not_best(digits: int, resolution: str) -> None:
    rng = np.random.default_rng(0)
    poses = np.tile(np.eye(4), (100, 1, 1))
    poses[:, :3, 3] = np.cumsum(rng.normal(size=(100, 3)), axis=0)
    t = np.arange(100) / 10.0

    def rounded(decimals: int, name: str, offset: float = 0.0) -> data.Trajectory:
        moved = poses.copy()
        moved[:, :3, 3] = np.round(poses[:, :3, 3] + offset * np.sin(t)[:, None], decimals)
        return data.Trajectory(t, moved, name)

    result = comparison.compare(rounded(9, "truth"), rounded(digits, "mine"), rounded(digits, "off", 0.1), align="none")
    rmse = next(row for row in result.text_table.rows if row.name.startswith("RMSE, m"))
    mine, off = rmse.cells[-2], rmse.cells[-1]
    assert mine.text == f"< {resolution}"
    assert not mine.best
    assert not off.text.startswith("<")
    assert any(s.startswith("Nearer to truth than the decimals of the files resolve: mine") for s in result.verdict)


@pytest.mark.parametrize(("digits", "zero"), [(9, False), (4, True)])
def test_an_ate_below_the_decimals_of_the_ground_truth_is_zero_and_not_ranked(digits: int, zero: bool) -> None:
    exact = scene()
    assert exact.truth is not None
    poses = exact.truth.world_T_imu.copy()
    poses[:, :3, 3] = np.round(poses[:, :3, 3], digits)
    problem = plain_problem(replace(exact, truth=replace(exact.truth, world_T_imu=poses)))
    names = {"ekf": (4e-5, 0.0, 0.0), "isam2": (0.0, 1e-4, 0.0), "joint-ekf": (0.0, 0.5, 0.0)}
    run = run_of(problem, *(answer(plain_problem(exact), name, drift) for name, drift in names.items()))
    sentences, estimators = ate_sentences(run), as_dict(run)["estimators"]
    assert ("< 8.66 × 10⁻⁵ m for" in sentences[0]) == zero
    assert any("is the same to the printed digits" in sentence for sentence in sentences[1:]) == zero
    for table in (main_table(run, estimators), terminal_table(run, estimators)):
        at = next(i for i, column in enumerate(table.columns) if "unaligned" in column.title)
        cells = {row.name: row.cells[at] for row in table.rows}
        assert cells["ekf"].text.startswith("< ") == cells["isam2"].text.startswith("< ") == zero
        assert not (zero and cells["ekf"].best)
        assert not cells["joint-ekf"].text.startswith("< ")


def test_without_ground_truth_overconfidence_is_against_the_reference() -> None:
    problem = plain_problem(scene())
    problem = replace(problem, sequence=replace(problem.sequence, truth=None))
    T = problem.n_frames
    bold = answer(problem, "ekf", (3.0, 0.0, 0.0), covariance=claiming(1e-3, T))
    run = run_of(problem, bold, answer(problem, "isam2", covariance=claiming(1e-4, T)))
    (said,) = (s for s in verdict(run) if s.startswith("Overconfident: "))
    rmse = run.results["ekf"].divergence_rmse
    assert f"ekf claims a position sigma of 0.00173 m (RMS) but differs from isam2 by {number(rmse)} m (RMSE" in said


def test_a_claim_above_the_error_is_not_called_overconfident() -> None:
    problem = plain_problem(scene())
    T = problem.n_frames
    loose = answer(problem, "dead-reckoning", (0.5, 0.0, 0.0), covariance=claiming(1.0, T))
    run = run_of(problem, loose, answer(problem, "isam2", covariance=claiming(0.1, T)))
    assert not [s for s in verdict(run) if s.startswith("Overconfident")]


def test_a_reference_whose_nees_is_too_large_is_called_overconfident_though_its_sigma_exceeds_its_error() -> None:
    problem = plain_problem(scene())
    thin = claiming(1.0, problem.n_frames)
    thin[:, 3:, 3:] *= 1e-6  # 1 mrad, against 10 mrad of error below
    reference = answer(problem, "isam2", covariance=thin)
    turned = reference.world_T_imu @ se3.exp(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.01]))
    run = run_of(problem, replace(reference, world_T_imu=turned))
    said = [s for s in verdict(run) if s.startswith("Overconfident: isam2 differs from ground truth by ")]
    assert len(said) == 1
    assert "less than its position sigma of 1.73 m (RMS), but its covariance is too small" in said[0]


def test_a_reference_nees_above_its_bound_is_reported_where_the_position_sigma_is_large_enough() -> None:
    problem = plain_problem(scene())
    problem = replace(problem, sequence=replace(problem.sequence, truth=None))
    T = problem.n_frames
    flat = np.tile(np.diag([1.0, 1.0, 1e-6, 1.0, 1.0, 1.0]), (T, 1, 1))  # large but in z, where the difference is
    reference = answer(problem, "isam2", covariance=claiming(1e-4, T))
    mine = answer(problem, "mine", (0.0, 0.0, 0.1), covariance=flat)
    sentences = verdict(run_of(problem, mine, reference))
    assert not [s for s in sentences if s.startswith("Overconfident")]
    (sentence,) = (s for s in sentences if s.startswith("Median reference NEES: mine "))
    assert "; threshold 14.4 (97.5 % quantile of one pose). Its position sigma covers the divergence" in sentence
    sound = answer(problem, "mine", (0.0, 0.0, 0.1), covariance=claiming(1.0, T))
    assert not [s for s in verdict(run_of(problem, sound, reference)) if s.startswith("Median reference NEES")]


def test_an_inflation_of_a_few_percent_is_not_mentioned() -> None:
    problem = replace(plain_problem(scene()), pixel_inflation=1.04)
    assert not any("inflated" in reason for reason in run_of(problem, answer(problem, "isam2")).trust.reasons)


@pytest.mark.parametrize("n", [2, 6])
def test_uncertain_intervals_of_many_estimators_are_counted_and_not_listed(n: int) -> None:
    problem = plain_problem(scene())
    filters = [answer(problem, f"filter-{i}", (3.0 * i, 0.0, 0.0)) for i in range(n + 1)]
    run = run_of(problem, answer(problem, "isam2"), *filters)
    (sentence,) = (s for s in verdict(run) if "rough" in s and s.startswith("Larger divergence"))
    assert sentence.count("[") == (n if n == 2 else 0)
    assert (f"The 95 % intervals of {n} of these differences are rough" in sentence) == (n > 2)
    assert all(f"] (filter-{i} above filter-0, " in sentence for i in range(1, n + 1)) == (n == 2)
    assert "block" in sentence
