"""What drift, growth and the shares of the difference say of paths whose errors are known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fgbaseline import compare
from fgbaseline.data import Trajectory
from fgbaseline.geometry import FloatArray, InputError, se3

N, DT = 801, 0.1


def winding(scale: float = 1.0, heading_rate: float = 0.0, noise: float = 0.0, seed: int = 0) -> FloatArray:
    """Poses of a winding drive at 10 m/s; wrong by a scale, a drift of heading (rad/s) and a noise of position (m)."""
    twist = np.zeros((N - 1, 6))
    twist[:, 0] = scale
    twist[:, 5] = 0.04 * np.sin(np.arange(N - 1) / 30.0) + heading_rate * DT
    poses = se3.compose(se3.exp(twist))
    poses[1:, :3, 3] += noise * np.random.default_rng(seed).normal(size=(N - 1, 3))
    return poses


def matched(estimate: FloatArray, reference: FloatArray | None = None) -> compare.MatchedTrajectories:
    t = DT * np.arange(len(estimate))
    truth = winding() if reference is None else reference
    return compare.associate(Trajectory(t, truth, "reference"), Trajectory(t, estimate, "estimate"))


def test_a_wrong_scale_drifts_by_its_percentage_of_every_meter() -> None:
    pair = matched(winding(scale=1.03))
    rates = compare.drift(pair, meters=1.0, seconds=1.0)
    assert rates.loc["translation", "value"] == pytest.approx(3.0, rel=1e-3)
    assert rates.loc["translation per second", "value"] == pytest.approx(0.3, rel=1e-2)
    assert rates.loc["rotation", "value"] == pytest.approx(0.0, abs=1e-9)
    assert rates.loc["translation", "over"] == "1 m"
    end = np.linalg.norm(pair.estimate.position[-1] - pair.reference.position[-1])
    length = compare.divergence_along_path(pair)["traveled"].iloc[-1]
    assert rates.loc["end translation", "value"] == pytest.approx(100.0 * end / length)


def test_a_drift_of_heading_is_a_rotation_per_second() -> None:
    rates = compare.drift(matched(winding(heading_rate=np.deg2rad(0.5))), seconds=4.0)
    assert rates.loc["rotation per second", "value"] == pytest.approx(0.5, rel=1e-6)
    assert rates.loc["rotation per second", "low"] == pytest.approx(0.5, rel=1e-6)
    assert rates.loc["end rotation", "value"] == pytest.approx(0.5 * DT / 1.0, rel=1e-3)


def test_without_stamps_there_are_no_metrics_per_second() -> None:
    pair = matched(winding(scale=1.01))
    frames = replace(pair, reference=replace(pair.reference, stamped=False))
    assert "translation per second" not in compare.drift(frames).index
    with pytest.raises(InputError, match="it has no time stamps, which drift and RPE over seconds need"):
        compare.drift(frames, seconds=1.0)
    with pytest.raises(InputError, match="it has no time stamps"):
        compare.relative_errors(frames, 1.0, "s")
    still = np.tile(np.eye(4), (N, 1, 1))
    with pytest.raises(InputError, match="it stands still, so it has no drift per meter"):
        compare.drift(matched(winding(), still))
    with pytest.raises(InputError, match="no two poses are 9000 m apart"):
        compare.drift(pair, meters=9000.0)


def test_heading_to_the_left_is_positive_and_grows_as_it_was_made_to() -> None:
    table = compare.divergence_along_path(matched(winding(heading_rate=np.deg2rad(0.5))))
    np.testing.assert_allclose(table["heading_deg"], 0.5 * table["t"], atol=1e-9)
    np.testing.assert_allclose(table["rotation_deg"], np.abs(table["heading_deg"]), atol=1e-9)
    down = np.diag([1.0, -1.0, -1.0, 1.0])
    pair = matched(down @ winding(heading_rate=np.deg2rad(0.5)) @ down, down @ winding() @ down)
    other = compare.divergence_along_path(pair, up=(0.0, 0.0, -1.0))
    np.testing.assert_allclose(other["heading_deg"], table["heading_deg"], atol=1e-9)


def test_the_parts_of_the_path_add_up() -> None:
    table = compare.divergence_along_path(matched(winding(scale=1.02, heading_rate=0.002)))
    parts = compare.divergence_growth(table, 8)
    assert parts["frames"].sum() == N
    squares = (parts["rmse"] ** 2 * parts["frames"]).sum()
    assert squares == pytest.approx((table["position"] ** 2).sum())
    grown = (parts["per_frame"] * np.append(parts["frames"][:-1], parts["frames"].iloc[-1] - 1)).sum()
    assert grown == pytest.approx(table["position"].iloc[-1])
    np.testing.assert_allclose(parts["per_meter"], parts["per_frame"], rtol=1e-3)  # steps of one meter
    assert np.isnan(table["percent_of_path"].iloc[0])
    assert parts["from_m"].iloc[0] == 0.0
    assert parts["to_m"].iloc[-1] == table["traveled"].iloc[-1]
    with pytest.raises(InputError, match="expected a reference that moves"):
        compare.divergence_growth(compare.divergence_along_path(matched(winding(), np.tile(np.eye(4), (N, 1, 1)))))


def test_the_first_time_beyond_a_bound() -> None:
    table = compare.divergence_along_path(matched(winding(scale=1.02)))
    passed = compare.first_exceedance(table, 1.0)
    assert passed is not None
    assert (table["position"].iloc[: passed.frame] <= 1.0).all()
    assert passed.value == table["position"].iloc[passed.frame] > 1.0
    assert passed.t == pytest.approx(passed.frame * DT)
    assert passed.traveled == table["traveled"].iloc[passed.frame]
    assert compare.first_exceedance(table, 1e6) is None
    turned = compare.divergence_along_path(matched(winding(heading_rate=-0.01)))
    right = compare.first_exceedance(turned, 2.0, "heading_deg")
    assert right is not None
    assert right.value < -2.0


def test_two_poses_have_their_rates() -> None:
    truth, estimate = (np.tile(np.eye(4), (2, 1, 1)) for _ in range(2))
    truth[1, 0, 3] = 2.0
    estimate[1] = se3.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.deg2rad(4.0)])
    estimate[1, 0, 3] = 2.2
    t = np.array([0.0, 0.5])
    rates = compare.drift(compare.associate(Trajectory(t, truth, "reference"), Trajectory(t, estimate, "estimate")))
    assert rates["unit"].to_dict() == {
        "translation": "%",
        "rotation": "deg/m",
        "translation per second": "m/s",
        "rotation per second": "deg/s",
        "end translation": "%",
        "end rotation": "deg/m",
    }
    assert rates["value"].tolist() == pytest.approx([10.0, 2.0, 0.4, 8.0, 10.0, 2.0])
    assert rates["over"].tolist() == ["2 m", "2 m", "0.5 s", "0.5 s", "2 m", "2 m"]
    assert rates["n"].tolist() == [1] * 6


@pytest.mark.parametrize(
    ("wrong", "share"),
    [({"scale": 1.02}, "scale"), ({"heading_rate": 2e-4}, "heading"), ({"noise": 0.5}, "noise")],
)
def test_one_kind_of_error_has_all_of_the_share(wrong: dict[str, float], share: str) -> None:
    found = compare.error_decomposition(matched(winding(**wrong)))
    assert getattr(found, share) > 0.99
    assert found.scale + found.heading + found.noise == pytest.approx(1.0)
    if share == "scale":
        assert found.scale_percent == pytest.approx(2.0)
    if share == "heading":
        assert found.heading_deg_per_s == pytest.approx(np.rad2deg(2e-4), rel=0.01)


def test_a_constant_heading_error_is_found_and_first_pose_alignment_takes_it_out() -> None:
    turn = se3.exp([0.0, 0, 0, 0, 0, np.deg2rad(1.0)])
    found = compare.error_decomposition(matched(turn @ winding()))
    assert found.heading > 0.9999
    assert found.heading_deg == pytest.approx(1.0, rel=1e-3)
    aligned = compare.error_decomposition(matched(turn @ winding()).aligned("first-pose"))
    assert aligned.rms < 1e-9


@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(compare.Align))
def test_shares_are_shares(seed: int, kind: compare.Align) -> None:
    random = np.random.default_rng(seed)
    reference = se3.compose(se3.exp(random.normal(size=(20, 6))))
    estimate = reference @ se3.exp(0.3 * random.normal(size=(21, 6)))
    found = compare.error_decomposition(matched(estimate, reference).aligned(kind), random.normal(size=3))
    assert found.scale + found.heading + found.noise == pytest.approx(1.0)
    assert min(found.scale, found.heading, found.noise) >= -1e-12


@pytest.mark.parametrize(
    ("wrong", "share"),
    [({"scale": 1.02}, "scale"), ({"heading_rate": 2e-4}, "heading"), ({"noise": 0.5}, "noise")],
)
def test_the_only_kind_of_error_has_a_share_near_one(wrong: dict[str, float], share: str) -> None:
    table = compare.decomposition_intervals(matched(winding(**wrong)), repetitions=100)
    assert table.loc[share, "low"] > 0.95
    assert table.loc[share, "value"] == getattr(compare.error_decomposition(matched(winding(**wrong))), share)


@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(compare.Align))
def test_intervals_of_shares_are_shares_and_hold_them(seed: int, kind: compare.Align) -> None:
    random = np.random.default_rng(seed)
    reference = se3.compose(se3.exp(random.normal(size=(20, 6))))
    pair = matched(reference @ se3.exp(0.3 * random.normal(size=(21, 6))), reference).aligned(kind)
    table = compare.decomposition_intervals(pair, repetitions=20)
    assert (table["low"] <= table["value"]).all()
    assert (table["value"] <= table["high"]).all()
    assert table["low"].min() > -1e-9
    assert table["high"].max() < 1 + 1e-9


def test_no_difference_has_no_intervals_either() -> None:
    table = compare.decomposition_intervals(matched(winding()))
    assert table.columns.tolist() == ["value", "low", "high"]
    assert table.index.tolist() == ["scale", "heading", "noise"]
    assert table.isna().all(axis=None)
    still = compare.decomposition_intervals(matched(winding(), np.tile(np.eye(4), (N, 1, 1))), repetitions=5)
    assert still["high"].tolist() == [0.0, 0.0, 1.0]


def test_no_difference_has_no_shares_and_a_standing_reference_only_noise() -> None:
    same = compare.error_decomposition(matched(winding()))
    assert same.rms == 0.0
    assert np.isnan([same.scale, same.heading, same.noise]).all()
    still = compare.error_decomposition(matched(winding(), np.tile(np.eye(4), (N, 1, 1))))
    assert (still.scale, still.heading, still.noise) == (0.0, 0.0, 1.0)
    assert still.scale_percent == 0.0


def ahead(x: list[float] | FloatArray) -> FloatArray:
    """Poses straight ahead at these places."""
    poses = np.tile(np.eye(4), (len(x), 1, 1))
    poses[:, 0, 3] = x
    return poses


def test_the_table_of_drift_is_named() -> None:
    rates = compare.drift(matched(ahead(1.1 * np.arange(51)), ahead(np.arange(51.0))))
    assert rates.index.name == "quantity"
    assert rates.columns.tolist() == ["value", "low", "high", "unit", "over", "n"]
    np.testing.assert_allclose(rates.loc["translation", ["value", "low", "high"]].astype(float), 10.0)
    assert rates.loc["translation", "n"] == 48  # of 5 m, the last two of 4 and 3


def test_drift_is_measured_over_a_tenth_of_the_path_or_its_longest_step() -> None:
    for x, over in ((np.arange(51.0), "5 m"), (np.append(np.arange(41.0), 50.0), "10 m")):
        rates = compare.drift(matched(ahead(1.1 * x), ahead(x)))
        assert rates.loc["translation", "over"] == over
        assert rates.loc["translation per second", "over"] == f"{0.1 * DT * (len(x) - 1):.4g} s"
        assert rates.loc["end translation", "over"] == "50 m"
    for meters in (0.0, -1.0):
        with pytest.raises(InputError, match=f"no two poses are {meters:g} m apart, of 50 m in all"):
            compare.drift(matched(ahead(x), ahead(x)), meters=meters)


def test_drift_is_measured_over_pairs_up_to_half_as_long_again() -> None:
    x = np.array([0.0, 3.0, 6.0])
    assert compare.drift(matched(ahead(1.1 * x), ahead(x)), meters=2.0).loc["translation", "n"] == 2
    assert compare.drift(matched(ahead(1.1 * x), ahead(x)), meters=2.0).loc["translation", "value"] == pytest.approx(
        10.0
    )
    with pytest.raises(InputError, match=r"no two poses are 1\.9 m apart"):
        compare.drift(matched(ahead(x), ahead(x)), meters=1.9)


def test_growth_of_a_known_case() -> None:
    table = compare.divergence_along_path(matched(ahead([0.0, 1.1, 2.2, 3.3, 4.4]), ahead(np.arange(5.0))))
    assert table.index.name == "frame"
    assert table.columns.tolist()[-2:] == ["t", "percent_of_path"]
    assert table["percent_of_path"].tolist() == pytest.approx([np.nan, 10.0, 10.0, 10.0, 10.0], nan_ok=True)
    parts = compare.divergence_growth(table, 2)
    assert parts.index.name == "part"
    assert parts.to_dict("list") == {
        "from_m": [0.0, 2.0],
        "to_m": [2.0, 4.0],
        "frames": [2, 3],
        "rmse": pytest.approx([0.005**0.5, (0.29 / 3) ** 0.5]),
        "per_meter": pytest.approx([0.1, 0.1]),
        "per_frame": pytest.approx([0.1, 0.1]),
        "heading_deg": [0.0, 0.0],
    }
    assert compare.divergence_growth(table, 1)["frames"].tolist() == [5]
    assert len(compare.divergence_growth(table)) == 10
    assert compare.divergence_growth(table)["frames"].sum() == 5
    for parts_wanted in (0, -1):
        with pytest.raises(InputError, match="at least 1 part"):
            compare.divergence_growth(table, parts_wanted)


def test_unknown_poses_are_excluded_from_the_drift() -> None:
    table = compare.divergence_along_path(matched(ahead([0.0, 1.1, 2.2, 3.3, 4.4]), ahead(np.arange(5.0))))
    table.loc[3, "position"] = np.nan
    assert compare.divergence_growth(table, 2)["rmse"].tolist() == pytest.approx([0.005**0.5, 0.1**0.5])


def test_a_bound_that_is_reached_is_not_passed() -> None:
    table = compare.divergence_along_path(matched(ahead([0.0, 1.5, 3.0]), ahead(np.arange(3.0))))
    assert compare.first_exceedance(table, 1.0) is None
    assert compare.first_exceedance(table, 0.5) == compare.Exceedance(2, 2 * DT, 2.0, 1.0)
    assert compare.first_exceedance(table, 0.0) == compare.Exceedance(1, DT, 1.0, 0.5)


def test_the_table_of_shares_states_block_length_and_reliability() -> None:
    """A difference of the same size everywhere has blocks of one pose."""
    for n, block, reliable in ((10, 1, True), (9, 1, False), (5001, 2, True)):
        reference = ahead(np.arange(float(n)))
        beside = reference.copy()
        beside[:, 1, 3] = 1.0
        table = compare.decomposition_intervals(matched(beside, reference), repetitions=3)
        assert table.index.name == "share"
        assert table.attrs == {"block": block, "reliable": reliable}


def test_one_pose_has_shares_without_intervals_and_two_have_both() -> None:
    one = compare.decomposition_intervals(matched(ahead([1.0]), ahead([0.0])))
    assert one["value"].tolist() == [0.0, 0.0, 1.0]
    assert one[["low", "high"]].isna().all(axis=None)
    two = compare.decomposition_intervals(matched(ahead([1.0, 3.0]), ahead([0.0, 1.0])), repetitions=3)
    assert two[["low", "high"]].notna().all(axis=None)


def test_draws_without_any_difference_are_left_out() -> None:
    # One pose of thirty is off: most draws of few blocks do not hold it.
    reference = ahead(np.arange(30.0))
    one_off = reference.copy()
    one_off[7, 1, 3] += 1.0
    table = compare.decomposition_intervals(matched(one_off, reference), repetitions=50)
    assert table.notna().all(axis=None)
    assert (table["low"] <= table["value"]).all()
    assert (table["value"] <= table["high"]).all()


def test_the_intervals_of_shares_depend_on_the_confidence_and_the_seed() -> None:
    pair = matched(winding(scale=1.001, heading_rate=2e-4, noise=0.5))
    wide, narrow, other = (
        compare.decomposition_intervals(pair, repetitions=200, confidence=c, seed=s)
        for c, s in ((0.95, 0), (0.5, 0), (0.95, 1))
    )
    assert (wide["low"] <= narrow["low"]).all()
    assert (wide["high"] >= narrow["high"]).all()
    assert (wide["high"] - wide["low"]).sum() > (narrow["high"] - narrow["low"]).sum()
    assert not wide.equals(other)


def test_the_intervals_of_drift_depend_on_the_confidence_and_the_seed() -> None:
    pair = matched(winding(noise=0.5))
    wide, narrow, other, again = (
        compare.drift(pair, 20.0, repetitions=200, confidence=c, seed=s).loc["translation", ["low", "high"]].tolist()
        for c, s in ((0.95, 0), (0.5, 0), (0.95, 1), (0.95, 0))
    )
    assert wide[0] < narrow[0] < narrow[1] < wide[1]
    assert wide == again != other
