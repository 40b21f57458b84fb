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


def matched(estimate: FloatArray, reference: FloatArray | None = None) -> compare.Matched:
    t = DT * np.arange(len(estimate))
    truth = winding() if reference is None else reference
    return compare.associate(Trajectory(t, truth, "reference"), Trajectory(t, estimate, "estimate"))


def test_a_wrong_scale_drifts_by_its_percentage_of_every_metre() -> None:
    pair = matched(winding(scale=1.03))
    rates = compare.drift(pair, metres=1.0, seconds=1.0)
    assert rates.loc["translation", "value"] == pytest.approx(3.0, rel=1e-3)
    assert rates.loc["translation per second", "value"] == pytest.approx(0.3, rel=1e-2)
    assert rates.loc["rotation", "value"] == pytest.approx(0.0, abs=1e-9)
    assert rates.loc["translation", "over"] == "1 m"
    end = np.linalg.norm(pair.estimate.position[-1] - pair.reference.position[-1])
    length = compare.growing_divergence(pair)["travelled"].iloc[-1]
    assert rates.loc["end translation", "value"] == pytest.approx(100.0 * end / length)


def test_a_drift_of_heading_is_a_rotation_per_second() -> None:
    rates = compare.drift(matched(winding(heading_rate=np.deg2rad(0.5))), seconds=4.0)
    assert rates.loc["rotation per second", "value"] == pytest.approx(0.5, rel=1e-6)
    assert rates.loc["rotation per second", "low"] == pytest.approx(0.5, rel=1e-6)
    assert rates.loc["end rotation", "value"] == pytest.approx(0.5 * DT / 1.0, rel=1e-3)


def test_without_stamps_nothing_is_said_per_second() -> None:
    pair = matched(winding(scale=1.01))
    frames = replace(pair, reference=replace(pair.reference, stamped=False))
    assert "translation per second" not in compare.drift(frames).index
    with pytest.raises(InputError, match="it has no time stamps, so nothing can be said per second"):
        compare.drift(frames, seconds=1.0)
    with pytest.raises(InputError, match="it has no time stamps"):
        compare.relative_errors(frames, 1.0, "s")
    still = np.tile(np.eye(4), (N, 1, 1))
    with pytest.raises(InputError, match="it stands still, so it has no drift per metre"):
        compare.drift(matched(winding(), still))
    with pytest.raises(InputError, match="no two poses are 9000 m apart"):
        compare.drift(pair, metres=9000.0)


def test_heading_to_the_left_is_positive_and_grows_as_it_was_made_to() -> None:
    table = compare.growing_divergence(matched(winding(heading_rate=np.deg2rad(0.5))))
    np.testing.assert_allclose(table["heading_deg"], 0.5 * table["t"], atol=1e-9)
    np.testing.assert_allclose(table["rotation_deg"], np.abs(table["heading_deg"]), atol=1e-9)
    down = np.diag([1.0, -1.0, -1.0, 1.0])
    pair = matched(down @ winding(heading_rate=np.deg2rad(0.5)) @ down, down @ winding() @ down)
    other = compare.growing_divergence(pair, up=(0.0, 0.0, -1.0))
    np.testing.assert_allclose(other["heading_deg"], table["heading_deg"], atol=1e-9)


def test_the_parts_of_the_path_add_up() -> None:
    table = compare.growing_divergence(matched(winding(scale=1.02, heading_rate=0.002)))
    parts = compare.growth_by_part(table, 8)
    assert parts["frames"].sum() == N
    squares = (parts["rmse"] ** 2 * parts["frames"]).sum()
    assert squares == pytest.approx((table["position"] ** 2).sum())
    grown = (parts["per_frame"] * np.append(parts["frames"][:-1], parts["frames"].iloc[-1] - 1)).sum()
    assert grown == pytest.approx(table["position"].iloc[-1])
    np.testing.assert_allclose(parts["per_metre"], parts["per_frame"], rtol=1e-3)  # steps of one metre
    assert np.isnan(table["percent_of_path"].iloc[0])
    assert parts["from_m"].iloc[0] == 0.0
    assert parts["to_m"].iloc[-1] == table["travelled"].iloc[-1]
    with pytest.raises(InputError, match="a path that stands still cannot be split"):
        compare.growth_by_part(compare.growing_divergence(matched(winding(), np.tile(np.eye(4), (N, 1, 1)))))


def test_the_first_time_beyond_a_bound() -> None:
    table = compare.growing_divergence(matched(winding(scale=1.02)))
    passed = compare.first_beyond(table, 1.0)
    assert passed is not None
    assert (table["position"].iloc[: passed.frame] <= 1.0).all()
    assert passed.value == table["position"].iloc[passed.frame] > 1.0
    assert passed.t == pytest.approx(passed.frame * DT)
    assert passed.travelled == table["travelled"].iloc[passed.frame]
    assert compare.first_beyond(table, 1e6) is None
    turned = compare.growing_divergence(matched(winding(heading_rate=-0.01)))
    right = compare.first_beyond(turned, 2.0, "heading_deg")
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
    found = compare.difference_shares(matched(winding(**wrong)))
    assert getattr(found, share) > 0.99
    assert found.scale + found.heading + found.noise == pytest.approx(1.0)
    if share == "scale":
        assert found.scale_percent == pytest.approx(2.0)
    if share == "heading":
        assert found.heading_deg_per_s == pytest.approx(np.rad2deg(2e-4), rel=0.01)


def test_a_constant_heading_error_is_found_and_first_pose_alignment_takes_it_out() -> None:
    turn = se3.exp([0.0, 0, 0, 0, 0, np.deg2rad(1.0)])
    found = compare.difference_shares(matched(turn @ winding()))
    assert found.heading > 0.9999
    assert found.heading_deg == pytest.approx(1.0, rel=1e-3)
    aligned = compare.difference_shares(matched(turn @ winding()).aligned("first-pose"))
    assert aligned.rms < 1e-9


@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(compare.Align))
def test_shares_are_shares(seed: int, kind: compare.Align) -> None:
    random = np.random.default_rng(seed)
    reference = se3.compose(se3.exp(random.normal(size=(20, 6))))
    estimate = reference @ se3.exp(0.3 * random.normal(size=(21, 6)))
    found = compare.difference_shares(matched(estimate, reference).aligned(kind), random.normal(size=3))
    assert found.scale + found.heading + found.noise == pytest.approx(1.0)
    assert min(found.scale, found.heading, found.noise) >= -1e-12


@pytest.mark.parametrize(
    ("wrong", "share"),
    [({"scale": 1.02}, "scale"), ({"heading_rate": 2e-4}, "heading"), ({"noise": 0.5}, "noise")],
)
def test_shares_are_sure_where_there_is_one_kind_of_error(wrong: dict[str, float], share: str) -> None:
    table = compare.share_intervals(matched(winding(**wrong)), repetitions=100)
    assert table.loc[share, "low"] > 0.95
    assert table.loc[share, "value"] == getattr(compare.difference_shares(matched(winding(**wrong))), share)


@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(compare.Align))
def test_intervals_of_shares_are_shares_and_hold_them(seed: int, kind: compare.Align) -> None:
    random = np.random.default_rng(seed)
    reference = se3.compose(se3.exp(random.normal(size=(20, 6))))
    pair = matched(reference @ se3.exp(0.3 * random.normal(size=(21, 6))), reference).aligned(kind)
    table = compare.share_intervals(pair, repetitions=20)
    assert (table["low"] <= table["value"]).all()
    assert (table["value"] <= table["high"]).all()
    assert table["low"].min() > -1e-9
    assert table["high"].max() < 1 + 1e-9


def test_no_difference_has_no_intervals_either() -> None:
    table = compare.share_intervals(matched(winding()))
    assert table.columns.tolist() == ["value", "low", "high"]
    assert table.index.tolist() == ["scale", "heading", "noise"]
    assert table.isna().all(axis=None)
    still = compare.share_intervals(matched(winding(), np.tile(np.eye(4), (N, 1, 1))), repetitions=5)
    assert still["high"].tolist() == [0.0, 0.0, 1.0]


def test_no_difference_has_no_shares_and_a_standing_reference_only_noise() -> None:
    same = compare.difference_shares(matched(winding()))
    assert same.rms == 0.0
    assert np.isnan([same.scale, same.heading, same.noise]).all()
    still = compare.difference_shares(matched(winding(), np.tile(np.eye(4), (N, 1, 1))))
    assert (still.scale, still.heading, still.noise) == (0.0, 0.0, 1.0)
    assert still.scale_percent == 0.0
