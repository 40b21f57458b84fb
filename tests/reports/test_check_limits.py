"""Bounds, tolerances and what never passes: the laws of `check`."""

import json
import math
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline.compare.acceptance_limits import Better, Bounds, Outcome, around, rounded
from fgbaseline.data.finding import AS_GIVEN, UNITS
from fgbaseline.data.formats.files.toml_file import TomlFile
from fgbaseline.geometry import InputError
from fgbaseline.reports.accuracy_check.evaluation import evaluate
from fgbaseline.reports.accuracy_check.limits import Limits, read_limits
from fgbaseline.reports.phrases.check import remarks
from fgbaseline.reports.results.check import Checked, Line
from fgbaseline.reports.results.reader import read_folder, read_measured

from ..builders.summaries import estimator, summary, write

FINITE = st.floats(-1e6, 1e6)
SHARE = st.floats(0.0, 2.0)


@given(FINITE, FINITE, FINITE)
def test_a_value_holds_exactly_where_its_margin_is_not_negative(value: float, a: float, b: float) -> None:
    bounds = Bounds(min(a, b), max(a, b))
    assert (bounds.judge(value) is Outcome.HOLDS) == (bounds.margin(value) >= 0)


@given(FINITE, SHARE, SHARE, st.sampled_from(Better))
def test_a_baseline_holds_against_itself_and_tolerances_only_widen(
    baseline: float, relative: float, absolute: float, better: Better
) -> None:
    exact = around(baseline, better)
    wide = around(baseline, better, relative=relative, absolute=absolute)
    assert exact.judge(rounded(baseline, 12)) is Outcome.HOLDS
    assert wide.at_least <= exact.at_least <= exact.at_most <= wide.at_most
    assert math.isinf(wide.at_least) == (better is Better.LOWER)
    assert math.isinf(wide.at_most) == (better is Better.HIGHER)


def test_the_larger_tolerance_counts_and_sums_are_exact() -> None:
    assert around(0.7, Better.LOWER, absolute=0.1, relative=0.01).at_most == 0.8
    assert around(200.0, Better.LOWER, absolute=0.1, relative=0.01).at_most == 202.0
    assert around(-2.0, Better.HIGHER, relative=0.5) == Bounds(at_least=-3.0)


@pytest.mark.parametrize("value", [None, math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_never_holds(value: float | None) -> None:
    infinite = value is not None and math.isinf(value)
    assert Bounds().judge(value) is (Outcome.VIOLATED if infinite else Outcome.UNDECIDED)


def checked(folder: Path, document: Any, limits: str, baseline: Any = None, *, updating: bool = False) -> Checked:
    write(folder, document, limits, baseline)
    old = None if baseline is None else read_measured(folder / "baseline.json")
    return evaluate(read_limits(folder / "limits.toml"), read_folder(folder / "out"), old, updating=updating)


def only(result: Checked) -> Line:
    (line,) = result.lines
    return line


ATE = '[[limit]]\nmetric = "ate.rmse"\nat_most = 0.5\n'
BOTH = summary(isam2=estimator(0.1), ekf=estimator(0.6), joint_ekf=estimator(0.5))


def test_every_estimator_that_a_glob_matches_is_judged(tmp_path: Path) -> None:
    result = checked(tmp_path, BOTH, ATE.replace("at_most", 'estimators = "*ekf"\nat_most'))
    assert [(line.estimator, line.outcome.value, line.margin) for line in result.lines] == [
        ("ekf", "violated", pytest.approx(-0.1)),
        ("joint-ekf", "holds", 0.0),
    ]
    assert result.exit_code == 1
    listed = checked(tmp_path, BOTH, ATE.replace("at_most", 'estimators = ["isam2", "joint-*"]\nat_most'))
    assert [line.estimator for line in listed.lines] == ["isam2", "joint-ekf"]
    assert listed.exit_code == 0


@pytest.mark.parametrize(
    ("values", "reason", "outcome"),
    [
        (
            estimator(None, notes={"ate": "the recording has no truth"}),
            "the recording has no truth",
            Outcome.UNDECIDED,
        ),
        (estimator(ate=math.nan), "not a finite number", Outcome.UNDECIDED),
        (estimator(ate=math.inf), "infinite", Outcome.VIOLATED),
        (estimator(None, notes={"ate.rmse": "infinite"}), "infinite", Outcome.VIOLATED),
        ({**estimator(), "ate": None, "notes": {"ate": "no truth"}}, "no truth", Outcome.UNDECIDED),
        ({k: v for k, v in estimator().items() if k != "ate"}, "no such metric", Outcome.VIOLATED),
        (estimator(0.1, status="failed"), "the estimator failed: it lost its way", Outcome.VIOLATED),
    ],
)
@pytest.mark.parametrize("asked", ["at_most = 1e9", 'baseline = { better = "lower", relative = 9 }', "at_least = -1e9"])
def test_a_missing_or_failed_metric_never_passes(
    values: Any, reason: str, outcome: Outcome, asked: str, tmp_path: Path
) -> None:
    document = summary(isam2=estimator(), ekf=values)
    limits = ATE.replace("at_most = 0.5", asked)
    result = checked(tmp_path, document, limits, summary(isam2=estimator(), ekf=estimator()))
    assert result.lines[0].outcome is Outcome.HOLDS
    assert result.lines[1].outcome is outcome
    assert reason in result.lines[1].reason
    assert result.exit_code == (1 if outcome is Outcome.VIOLATED else 2)


def test_errors_that_a_figure_leaves_out_are_counted_beside_it(tmp_path: Path) -> None:
    values = estimator(0.1)
    values["ate"]["missing"] = 60
    result = checked(tmp_path, summary(ekf=values), ATE)
    assert only(result).missing == 60
    assert remarks(result) == [f"ekf, ate.rmse: 60 NaN errors left out ({result.limits}, limit[0])."]


def test_a_bound_and_a_baseline_are_two_lines_with_the_change_on_both(tmp_path: Path) -> None:
    limits = ATE + 'baseline = { better = "lower", relative = 0.1 }\n'
    old = summary(isam2=estimator(0.3))
    bound, before = checked(tmp_path, summary(isam2=estimator(0.36)), limits, old).lines
    assert (bound.outcome, bound.before, bound.change) == (Outcome.HOLDS, 0.3, 0.06)
    assert (before.outcome, before.bounds, before.margin) == (
        Outcome.VIOLATED,
        Bounds(at_most=0.33),
        pytest.approx(-0.03),
    )


@pytest.mark.parametrize(
    ("better", "ate", "outcome"),
    [
        ("lower", 0.2, "holds"),
        ("lower", 0.44, "holds"),
        ("lower", 0.45, "violated"),
        ("higher", 0.9, "holds"),
        ("higher", 0.35, "violated"),
        ("neither", 0.41, "holds"),
        ("neither", 0.3, "violated"),
        ("neither", 0.5, "violated"),
    ],
)
def test_only_a_change_for_the_worse_counts(better: str, ate: float, outcome: str, tmp_path: Path) -> None:
    limits = f'[[limit]]\nmetric = "ate.rmse"\nbaseline = {{ better = "{better}", relative = 0.1 }}\n'
    line = only(checked(tmp_path, summary(isam2=estimator(ate)), limits, summary(isam2=estimator(0.4))))
    assert line.outcome.value == outcome


def test_no_tolerance_means_no_change_beyond_the_digits_of_a_baseline(tmp_path: Path) -> None:
    limits = '[[limit]]\nmetric = "ate.rmse"\nbaseline = { better = "neither" }\n'
    old = summary(isam2=estimator(0.123456789))
    assert checked(tmp_path, summary(isam2=estimator(0.123457)), limits, old).exit_code == 0
    assert checked(tmp_path, summary(isam2=estimator(0.123470)), limits, old).exit_code == 1


DIVERGENCE = '[[limit]]\nmetric = "divergence.rmse"\nat_most = 1\n'


@pytest.mark.parametrize(
    ("trust", "limits", "outcome", "code"),
    [
        ("trusted", DIVERGENCE, "holds", 0),
        ("doubtful", DIVERGENCE, "holds", 0),
        ("untrusted", DIVERGENCE, "undecided", 2),
        ("untrusted", ATE, "holds", 2),
        ("untrusted", ATE.replace("0.5", "0.1"), "violated", 1),
        ("doubtful", 'reference = "trusted"\n' + DIVERGENCE, "undecided", 2),
        ("trusted", 'reference = "trusted"\n' + DIVERGENCE, "holds", 0),
        ("untrusted", 'reference = "none"\n' + ATE, "holds", 0),
        ("untrusted", 'reference = "none"\n' + DIVERGENCE, "undecided", 2),
        ("untrusted", 'reference = "none"\n' + DIVERGENCE.replace("divergence.rmse", "map.median"), "undecided", 2),
    ],
)
def test_a_reference_that_is_not_trusted_leaves_the_check_undecided(
    trust: str, limits: str, outcome: str, code: int, tmp_path: Path
) -> None:
    result = checked(tmp_path, summary(trust, isam2=estimator()), limits)
    assert (only(result).outcome.value, result.exit_code) == (outcome, code)
    said = (
        () if trust == "trusted" else (f"The reference, isam2, is {trust}: its pixel residuals are 9 times too large.",)
    )
    assert result.references == said


def test_a_baseline_that_is_not_comparable_is_undecided(tmp_path: Path) -> None:
    limits = '[[limit]]\nmetric = "divergence.rmse"\nbaseline = { better = "lower" }\n'
    new = summary(isam2=estimator())

    def undecided_reason(baseline: Any) -> str:
        result = checked(tmp_path, new, limits, baseline)
        assert (only(result).outcome, result.exit_code) == (Outcome.UNDECIDED, 2)
        return only(result).reason

    assert "no isam2" in undecided_reason(summary(ekf=estimator()))
    assert "untrusted" in undecided_reason(summary("untrusted", isam2=estimator()))
    assert "no run 'town'; it has 'loop'" in undecided_reason({**new, "sequence": {"name": "loop"}})
    assert "the baseline is batch, that of this run isam2" in undecided_reason(
        {**new, "reference": {"name": "batch", "trust": "trusted"}}
    )
    assert "no divergence.rmse" in undecided_reason(summary(isam2={"status": "ok", "ate": {"rmse": 1.0}}))
    assert "lost its way" in undecided_reason(summary(isam2=estimator(status="failed")))


def test_several_runs_are_held_each_by_its_name(tmp_path: Path) -> None:
    runs = {"town": summary(isam2=estimator(0.1)), "loop": summary("doubtful", isam2=estimator(0.6))}
    bench = {"schema": "fgbaseline/bench/1", "runs": runs}
    result = checked(tmp_path, bench, ATE)
    assert [(line.run, line.outcome.value) for line in result.lines] == [("town", "holds"), ("loop", "violated")]
    assert "The reference of loop, isam2, is doubtful" in result.references[0]
    one = checked(tmp_path, bench, ATE.replace("at_most", 'runs = "to*"\nat_most'))
    assert only(one).run == "town"


def comparison(trust: str | None) -> dict[str, Any]:
    """A comparison.json, as far as these tests look at it."""
    value = {"rmse": {"value": 0.3, "low": 0.2, "high": 0.4}, "n": 90}
    mine = {"source": "mine.tum", "translation": value, "relative": {"0.5 s": {"translation": value}}}
    return {
        "schema": "fgbaseline/comparison/1",
        "reference": {"name": "isam2", "trust": trust, "reasons": ["it lost its way"]},
        "sequence": None,
        "estimates": {"mine": {**mine, "reprojection": {"median": 0.9}, "final_m": 0.5, "notes": {}}},
    }


def limited(folder: Path, metric: str) -> TomlFile[Limits]:
    """A bound of 0.5 on a metric."""
    (folder / "limits.toml").write_text(f'reference = "none"\n[[limit]]\nmetric = "{metric}"\nat_most = 0.5\n')
    return read_limits(folder / "limits.toml")


@pytest.mark.parametrize(
    ("trust", "metric", "code"),
    [
        (None, "translation.rmse.value", 0),
        (None, "relative.0.5 s.translation.rmse.value", 0),
        ("trusted", "final_m", 0),
        ("untrusted", "translation.rmse.value", 2),
    ],
)
def test_trajectories_from_anywhere_are_held_to_limits(
    trust: str | None, metric: str, code: int, tmp_path: Path
) -> None:
    (tmp_path / "comparison.json").write_text(json.dumps(comparison(trust)))
    result = evaluate(limited(tmp_path, metric), read_folder(tmp_path), None)
    assert (only(result).estimator, result.exit_code) == ("mine", code)
    pixels = evaluate(limited(tmp_path, "reprojection.median"), read_folder(tmp_path), None)
    assert (only(pixels).value, pixels.exit_code) == (0.9, 1)  # not measured from the reference


WRONG = [
    (ATE.replace("ate.rmse", "ate.rsme"), "limit[0].metric", ("ate.rsme", "ate.rmse")),
    (ATE.replace("ate.rmse", "ate"), "limit[0].metric", ('"ate"', "ate.max, ate.rmse")),
    (ATE.replace("ate.rmse", "status"), "limit[0].metric", ('"status"', "not a number")),
    (ATE.replace("ate.rmse", "events.landmark dropped"), "limit[0].metric", ("events",)),
    (ATE + 'estimators = "jont-*"\n', "limit[0].estimators", ('"jont-*"', "no estimator", "ekf, isam2, joint-ekf")),
    (ATE + 'estimators = ["isam2", "batch"]\n', "limit[0].estimators", ('"batch"', "no estimator")),
    (ATE + 'runs = "loop*"\n', "limit[0].runs", ('"loop*"', "no run", "town")),
    (ATE + 'baseline = { better = "lower" }\n', "limit[0].baseline", ("--baseline FILE",)),
    ('[[limit]]\nmetric = "seconds"\nbaseline = { better = "lower" }\n', "limit[0].baseline", ("timings", "at_most")),
    ('[[limit]]\nmetric = "ate.rmse"\n', "limit[0]", ("at_most, at_least or baseline",)),
    (ATE + "at_least = 0.6\n", "limit[0]", ("0.6", "0.5", "nothing lies between")),
    (ATE + "at_last = 0.6\n", "limit[0]", ("'at_last'", "did you mean 'at_least'")),
    (ATE.replace("0.5", '"0.5"'), "limit[0].at_most", ("at_most", "number")),
    (ATE.replace("0.5", "nan"), "limit[0].at_most", ("at_most", "finite")),
    (ATE + 'baseline = { better = "less" }\n', "limit[0].baseline.better", ("'lower', 'higher' or 'neither'",)),
    (ATE + 'baseline = { better = "lower", relative = -0.1 }\n', "limit[0].baseline.relative", ("or equal to 0",)),
    (ATE + "baseline = { relative = 0.1 }\n", "limit[0].baseline", ("'better' is missing",)),
    (ATE.replace('"ate.rmse"', '""'), "limit[0].metric", ("empty",)),
    (ATE + "estimators = []\n", "limit[0].estimators", ("estimators",)),
    ("limit = []\n", "limit", ("limit",)),
    ("", "", ("'limit' is missing",)),
    ('reference = "good"\n' + ATE, "reference", ("'trusted', 'doubtful' or 'none'",)),
]


@pytest.mark.parametrize(("limits", "place", "names"), WRONG)
def test_empty_or_unmatched_limits_are_refused_with_their_key_path(
    limits: str, place: str, names: tuple[str, ...], tmp_path: Path
) -> None:
    with pytest.raises(InputError) as error:
        checked(tmp_path, BOTH, limits)
    assert re.search(rf"limits\.toml: {re.escape(place)}(: | = |the key)", str(error.value)), str(error.value)
    assert "\n" not in str(error.value)
    assert all(name in str(error.value) for name in names), str(error.value)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("{", ("not JSON",)),
        ("[]", ("schema",)),
        ('{"estimators": {}}', ("schema",)),
        ('{"schema": "fgbaseline/summary/1"}', ("estimators", "required")),
        ('{"schema": "fgbaseline/summary/1", "estimators": {}}', ("estimators",)),
        ('{"schema": "fgbaseline/summary/1", "estimators": {"a": 3}}', ("estimators.a",)),
        (
            '{"schema": "fgbaseline/x/1", "estimators": {"a": {}}, "reference": {"trust": "so-so"}}',
            ("reference.trust",),
        ),
        ('{"schema": "fgbaseline/bench/1", "runs": {}}', ("runs",)),
    ],
)
def test_a_file_that_is_no_summary_is_refused(text: str, names: tuple[str, ...], tmp_path: Path) -> None:
    write(tmp_path, BOTH, ATE)
    (tmp_path / "out" / "summary.json").write_text(text)
    with pytest.raises(InputError, match=r"summary\.json: ") as error:
        read_folder(tmp_path / "out")
    assert all(name in str(error.value) for name in names), str(error.value)


@pytest.mark.parametrize(
    ("certainty", "exit_code"), [("the cameras see turns 0.001 times as large as recorded", 2), (AS_GIVEN, 0)]
)
@pytest.mark.parametrize("code", sorted(UNITS))
def test_no_limit_holds_on_units_that_were_guessed(tmp_path: Path, code: str, certainty: str, exit_code: int) -> None:
    document = summary(isam2=estimator(0.1))
    document["problem"] = {"findings": [{"code": code, "certainty": certainty}]}
    result = checked(tmp_path, document, ATE)
    assert result.exit_code == exit_code
    assert bool(exit_code) == any(code in remark and "--time-unit" in remark for remark in remarks(result))
    document["problem"] = {"findings": [{"code": "gyro_bias", "certainty": certainty}]}
    assert checked(tmp_path, document, ATE).exit_code == 0
