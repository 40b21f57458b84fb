"""What people's files once made us say: impossible observations trusted, lengths that are none, ranks by 1e-5 m."""

from collections.abc import Callable
from pathlib import Path

from fgbaseline import compare, data, diagnosis, smoother
from fgbaseline.compare.estimate_comparison import compare_all
from fgbaseline.reports.comparison import compare as compared
from fgbaseline.reports.phrases.run import verdict

Recordings = Callable[[str], Path]


def test_zero_for_unseen_is_not_trusted(recordings: Recordings) -> None:
    sequence = data.read(recordings("cases/46-zero-for-unseen/v16_zero_unobserved.npz"))
    zeros = bool((sequence.observations.pixel == 0.0).all(axis=1).mean() > 0.5)  # unless the reader drops them
    problem = diagnosis.calibrated(sequence)
    trust = compare.trust(problem, smoother.isam2(problem))
    assert (trust.verdict is compare.Verdict.UNTRUSTED) == zeros
    assert any("have no positive disparity" in reason for reason in trust.reasons) == zeros


def test_the_length_of_a_path_that_bends_is_its_length(recordings: Recordings) -> None:
    folder = recordings("cases/22-vcu-rvi/vcu_lab_motion6_gt.csv").parent
    result = compared(folder / "vcu_lab_motion6_gt.csv", folder / "vcu_lab_motion6_tum.csv")
    (length,) = [sentence for sentence in result.verdict if sentence.startswith("Path length over")]
    assert "2.69 % shorter" in length
    assert not any("too short" in sentence for sentence in result.verdict)


def test_a_standing_rig_ranks_no_estimator_by_a_hundredth_of_a_millimeter(recordings: Recordings) -> None:
    problem = diagnosis.calibrated(data.read(recordings("cases/40-stationary/v08_stationary.npz")))
    isam2 = smoother.isam2(problem)
    answers = {"isam2": isam2, "fixed-lag": smoother.fixed_lag(problem)}
    answers["batch"] = smoother.batch(problem, given={"isam2": isam2})
    sentences = verdict(compare_all(problem, answers, {}))
    assert not [s for s in sentences if "larger ATE" in s or s.startswith(("Smallest", "Larger"))]
    assert any("is the same within 1 %" in s for s in sentences)
