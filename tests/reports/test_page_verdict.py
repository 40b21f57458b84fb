"""The verdict says what constructed runs are known to show."""

import re
from dataclasses import replace

import numpy as np

from fgbaseline import compare
from fgbaseline.compare.divergence_onset import divergence_onset, mask_share, worst_second, wrong_share
from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.data import Event, EventKind, Excluded, Observations
from fgbaseline.reports.formatting import number, per_cent
from fgbaseline.reports.html.plot_data import page_data
from fgbaseline.reports.html.run_page import render
from fgbaseline.reports.phrases.run import verdict

from ..builders.runs import RECOVERED, answer, as_dict, failed, partly_known, run_of, scene, standard_run
from ..builders.synthetic import plain_problem


def sentence_of(run: Run, start: str) -> str:
    """The one sentence that begins so."""
    (sentence,) = [s for s in verdict(run) if s.startswith(start)]
    return sentence


def with_trust(run: Run, verdict_on_it: compare.Verdict, *reasons: str) -> Run:
    return replace(run, trust=compare.Trust(verdict_on_it, reasons))


def test_every_sentence_has_a_number_or_a_reason() -> None:
    for sentence in verdict(standard_run()):
        assert any(c.isdigit() for c in sentence) or ":" in sentence, sentence


def test_the_nearest_estimator_comes_first_with_meters_and_share_of_the_path() -> None:
    run = standard_run()
    sentences = verdict(run)
    (sentence,) = (s for s in sentences if s.startswith("Smallest divergence from isam2 ("))
    larger = sentence_of(run, "Larger divergence than ekf")
    table = run.results["ekf"].divergence
    assert table is not None
    rmse, length = float(np.sqrt(np.mean(table["position"] ** 2))), float(table["traveled"].max())
    assert f"{rmse:.3g} m ({100 * rmse / length:.3g} % of the path length)" in sentence
    assert ": ekf " in sentence
    assert "dead-reckoning" in larger
    assert sentences.index(sentence) < sentences.index(larger)


def test_the_divergence_onset_is_the_first_frame_beyond_the_threshold() -> None:
    run = standard_run()
    left = divergence_onset(run, run.results["ekf"])
    table = run.results["ekf"].divergence
    assert left is not None
    assert table is not None
    limit = 0.01 * float(table["traveled"].max())
    assert limit < 5.0
    assert table["position"][left.frame] > limit
    assert (table["position"][: left.frame] <= limit).all()
    assert left.seconds == run.problem.sequence.t[left.frame] - run.problem.sequence.t[0]
    sentence = sentence_of(run, "Maximum divergence: ")
    assert f"; threshold 1 % of the path length, {limit:.3g} m. Above the threshold: " in sentence
    assert f"ekf from {left.seconds:.1f} s (frame {left.frame}) on" in sentence
    assert "% of the frames" not in sentence


def test_a_path_below_the_threshold_is_reported_without_onset() -> None:
    problem = plain_problem(scene())
    run = run_of(problem, answer(problem, "ekf", (0.0, 0.1, 0.0)), answer(problem, "isam2"))
    sentence = sentence_of(run, "Maximum divergence: ekf 0.100 m; threshold 1 % of the path length, ")
    assert "Above the threshold" not in sentence


def test_the_excluded_share_is_that_of_the_matches_around_the_onset() -> None:
    problem = plain_problem(scene())
    frame = problem.sequence.observations.frame
    run = run_of(problem, answer(problem, "ekf", (0.0, 3.0, 0.0)), answer(problem, "isam2"))
    assert not [s for s in verdict(run) if "mask" in s]
    left = divergence_onset(run, run.results["ekf"])
    assert left is not None
    excluded = np.where(frame == left.frame, Excluded.PREDICTION, Excluded.NO).astype(np.uint8)
    t = problem.sequence.t
    around = np.sum(np.abs(t - t[left.frame]) <= 1.0)
    masked = replace(run, problem=replace(problem, excluded=excluded))
    what = "as wrong matches, moving points or points that cannot be triangulated"
    sentence = sentence_of(masked, "Within 1 s of the first frame above the threshold, the mask ")
    shares = f"{100 / around:.3g} % (ekf) of the observations {what}; in the whole recording {100 / 60:.3g} %."
    assert sentence.endswith(f"excluded {shares}")


def test_the_mask_sentence_counts_every_reason_and_its_worst_second_is_that_of_the_bookmark() -> None:
    problem = plain_problem(scene())
    frame, t = problem.sequence.observations.frame, problem.sequence.t
    excluded = np.full(len(frame), Excluded.NO, dtype=np.uint8)
    excluded[frame == 5] = Excluded.COPIED
    excluded[frame == 41] = Excluded.PREDICTION
    excluded[frame == 42] = Excluded.MOVING
    run = run_of(replace(problem, excluded=excluded), answer(problem, "ekf"), answer(problem, "isam2"))
    n, k = len(frame), int((excluded != Excluded.NO).sum())
    assert f"The mask excluded {per_cent(k / n)} of the observations ({k:,} of {n:,})." in verdict(run)
    worst = worst_second(run.problem)
    assert worst is not None
    assert worst.second <= t[41] - t[0] < worst.second + 1.0
    assert f"from {worst.second:.0f} s to {worst.second + 1.0:.0f} s" in sentence_of(
        run, "Excluded as wrong matches, moving"
    )
    marked = [b["frame"] for b in page_data(run)["bookmarks"] if "moving" in b["text"]]
    assert len(marked) == 1
    assert worst.second <= t[marked[0]] - t[0] < worst.second + 1.0


def test_with_chosen_features_the_mask_is_counted_over_their_observations() -> None:
    """Excluded observations of other landmarks keep their reason, and do not count."""
    problem = plain_problem(scene())
    frame, landmark = problem.sequence.observations.frame, problem.sequence.observations.landmark
    features = problem.features[::2]
    chosen = np.isin(landmark, features)
    excluded = np.where(frame == 41, np.uint8(Excluded.PREDICTION), problem.excluded)
    excluded[(excluded == Excluded.NO) & ~chosen] = Excluded.FEATURE_NOT_CHOSEN
    few = replace(problem, features=features, excluded=excluded)
    assert mask_share(few) == (int(chosen.sum()), int((chosen & (frame == 41)).sum()))
    everywhere = np.ones(problem.n_frames, dtype=np.bool_)
    assert wrong_share(few, everywhere) == float((frame == 41)[chosen].mean())
    worst = worst_second(few)
    assert worst is not None
    assert worst.share <= 1.0


def test_a_reference_with_a_larger_error_than_the_filter_is_reported() -> None:
    problem = plain_problem(scene())
    run = run_of(
        problem,
        answer(problem, "dead-reckoning", (0.1, 0.0, 0.0)),
        answer(problem, "ekf", (0.0, 0.2, 0.0)),
        answer(problem, "isam2", (4.0, 4.0, 0.0)),
    )
    sentence = sentence_of(run, "The reference isam2 has a larger ATE")
    assert " than dead-reckoning (" in sentence
    assert "and ekf" in sentence
    assert not [s for s in verdict(standard_run()) if "larger ATE" in s]


def test_the_online_estimate_of_the_reference_is_not_ranked_against_it() -> None:
    problem = plain_problem(scene())
    online = answer(problem, "isam2-online", (0.0, 0.0, 0.1))
    reference = answer(problem, "isam2", (0.0, 0.0, 1.0), by_products={"isam2-online": online})
    run = run_of(problem, reference, online, answer(problem, "ekf", (0.0, 5.0, 0.0)))
    over, _, ranked = sentence_of(run, "Divergence from isam2 (RMSE over").partition("): ")
    assert over.endswith("; isam2-online, of the same graph, is not ranked")
    assert "isam2-online" not in ranked
    assert sentence_of(run, "isam2-online").startswith(
        "isam2-online, the causal estimate of isam2 (pose k from frames 0 to k, before isam2's final Gauss-Newton "
        "steps): divergence "
    )
    assert not [s for s in verdict(run) if "larger ATE" in s]


def test_frames_without_truth_are_counted() -> None:
    sequence = scene()
    assert sequence.truth is not None
    whole = plain_problem(sequence)
    problem = plain_problem(replace(sequence, truth=partly_known(sequence.truth, 7)))
    run = run_of(problem, answer(whole, "ekf", (1.0, 0.0, 0.0)), answer(whole, "isam2"))
    assert "53 of 60 frames)" in sentence_of(run, "ATE (")
    assert not [s for s in verdict(standard_run(truth=None)) if "truth" in s or "ATE" in s]


def test_trust_comes_first_with_its_reasons() -> None:
    run = standard_run()
    untrusted = with_trust(run, compare.Verdict.UNTRUSTED, "it used 12% of the observations")
    first = verdict(untrusted)[0]
    assert first.startswith("The reference, isam2, is untrusted: it used 12% of the observations")
    trusted = with_trust(run, compare.Verdict.TRUSTED, "it used 98% of the observations")
    assert verdict(trusted)[0].startswith("The reference, isam2, is trusted")
    judged = replace(run, trust=replace(run.trust, verdict=compare.Verdict.TRUSTED, reasons=("residual 0.9", "motion")))
    n = len(run.trust.criteria)
    assert n >= 7
    assert verdict(judged)[0] == f"The reference, isam2, is trusted ({n} of {n} criteria). Residual 0.9."


def test_an_order_within_the_sigma_of_the_reference_is_not_one_by_accuracy() -> None:
    problem = plain_problem(scene())
    T = problem.n_frames
    filters = [answer(problem, "dead-reckoning", (0.1, 0.0, 0.0)), answer(problem, "ekf", (0.0, 3.0, 0.0))]

    def said(sigma: float) -> list[str]:
        covariance = np.tile(sigma**2 * np.eye(6), (T, 1, 1))
        run = run_of(problem, *filters, answer(problem, "isam2", covariance=covariance))
        return [s for s in verdict(run) if "closer to isam2, not which is closer to the truth" in s]

    assert said(5.0) == [
        "The divergences (RMSE) of dead-reckoning and ekf are below 3 times the RMS position sigma of isam2 "
        "(3 × 8.66 m): the ranking shows which is closer to isam2, not which is closer to the truth. Trusted "
        "means that isam2 solves this problem well, not that it is close to the truth."
    ]
    assert not said(0.1)


def test_a_batch_solution_from_the_answer_of_isam2_is_another_minimum_only_where_it_moved() -> None:
    problem = plain_problem(scene())
    start = Event(0, EventKind.STARTED_AT_ISAM2, "")

    def said(offset: float) -> str:
        batch = answer(problem, "batch", (0.0, offset, 0.0), events=(start,))
        return sentence_of(run_of(problem, answer(problem, "isam2"), batch), "batch")

    assert re.fullmatch(
        r"batch, started at the solution of isam2, stays at the same minimum: 1\.\d+ mm \(RMSE\) from isam2\.",
        said(2e-3),
    )
    assert said(30.0).startswith("batch, started at the solution of isam2, leaves it: 17")


def test_failures_and_recoveries_are_reported_with_their_reason() -> None:
    problem = plain_problem(scene())
    run = run_of(
        problem,
        failed(problem, "ekf", "no observations"),
        failed(problem, "joint-ekf", "no observations"),
        answer(problem, "isam2", status=RECOVERED, reason="8 landmarks were given up"),
    )
    assert "ekf and joint-ekf failed: no observations." in verdict(run)
    assert "isam2 recovered (finished after losses): 8 landmarks were given up." in verdict(run)


def test_a_recovery_stands_below_failures_and_ranking() -> None:
    problem = plain_problem(scene())
    paths = {"ekf": 3.0, "joint-ekf": 9.0}
    run = run_of(
        problem,
        failed(problem, "fixed-lag", "no observations"),
        *(answer(problem, name, (drift, 0.0, 0.0)) for name, drift in paths.items()),
        answer(problem, "isam2", status=RECOVERED, reason="8 landmarks were given up"),
    )
    beginnings = ("fixed-lag failed", "Smallest divergence", "isam2 recovered")
    at = [next(i for i, text in enumerate(verdict(run)) if text.startswith(beginning)) for beginning in beginnings]
    assert at == sorted(at)


def test_without_an_estimate_the_verdict_is_that_nothing_is_compared() -> None:
    problem = plain_problem(scene(observations=Observations.none(), truth=None))
    run = run_of(problem, failed(problem, "ekf", "no observations"))
    assert verdict(run)[0].startswith("There is no reference, so nothing is compared")


def test_assumed_noise_is_reported_as_assumed() -> None:
    run = standard_run()
    assert "0.500 px" in sentence_of(run, "Not diagnosed")
    diagnosed = replace(run, problem=replace(run.problem, diagnosed=True))
    assert not [s for s in verdict(diagnosed) if "Not diagnosed" in s]


def test_overconfidence_is_reported_as_a_ratio_of_errors() -> None:
    problem = plain_problem(scene())
    bold = np.tile(1e-4 * np.eye(6), (60, 1, 1))
    run = run_of(problem, answer(problem, "ekf", (3.0, 0.0, 0.0), covariance=bold), answer(problem, "isam2"))
    nees = run.results["ekf"].nees
    assert nees is not None
    mean = float(np.nanmean(nees))
    assert f"{number(np.sqrt(mean / 6))} for ekf (NEES {number(mean)})" in sentence_of(run, "Normalized error RMS")


def test_gaps_of_a_path_are_reported() -> None:
    problem = plain_problem(scene())
    broken = answer(problem, "ekf", (1.0, 0.0, 0.0))
    broken.world_T_imu[50:] = np.nan
    run = run_of(problem, broken, answer(problem, "isam2"))
    assert "ekf has no pose in 10 of 60 frames." in verdict(run)


def test_the_heading_names_the_path_whose_length_it_has() -> None:
    run = standard_run()
    assert run.problem.sequence.truth is not None
    assert " m by ground truth) with " in render(run, as_dict(run), {})
    alone = replace(run, problem=replace(run.problem, sequence=replace(run.problem.sequence, truth=None)))
    assert "by ground truth) with" not in render(alone, as_dict(alone), {})
