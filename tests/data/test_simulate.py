"""What is true of every simulated recording."""

import dataclasses
import time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fgbaseline.data.sequence import Sequence
from fgbaseline.data.simulate import (
    AXIS_CONVENTIONS,
    KITTI,
    Labels,
    Rig,
    Simulation,
    Velocities,
    axes_matrix,
    axes_name,
    default_drive,
    simulate,
    simulate_with_labels,
)
from fgbaseline.geometry import FloatArray, InputError, disparity, se3

from ..builders.refusals import refused

PATHS = ["town", "loop", "highway", "handheld"]
CLEAN = {"sigma_linear": 0.0, "sigma_angular": 0.0, "sigma_pixel": 0.0, "wrong_share": 0.0}


def in_camera(s: Sequence) -> FloatArray:
    """(n, 3) true landmarks in the left camera at each observation, m."""
    assert s.truth is not None
    assert s.truth.landmarks is not None
    world_T_cam = s.truth.world_T_imu[s.observations.frame] @ s.imu_T_cam
    return se3.transform(se3.inverse(world_T_cam), s.truth.landmarks[s.observations.landmark])


def residuals(s: Sequence, labels: Labels) -> FloatArray:
    """(k, 4) px, of the observations that are neither wrong nor moving."""
    good = ~(labels.wrong | labels.moving)
    return (s.observations.pixel - s.camera.project(in_camera(s)))[good]


def true_twists(s: Sequence) -> FloatArray:
    """(T-1, 6) the constant body twists that move each true pose to the next."""
    assert s.truth is not None
    return se3.log(se3.relative(s.truth.world_T_imu)) / s.dt[:, None]


def recorded(s: Sequence) -> FloatArray:
    return np.concatenate([s.linear_velocity, s.angular_velocity], axis=1)


# --- the default drive


def test_the_default_drive_is_a_minute_of_a_car_with_a_few_per_cent_of_wrong_matches() -> None:
    s, labels = simulate_with_labels(default_drive())
    assert s.n_frames == 600
    assert 0.02 < labels.wrong.mean() < 0.04
    assert not labels.moving.any()
    speed = true_twists(s)[:, 0]
    assert speed.min() >= -0.01
    assert speed.max() < 14.0
    assert (speed < 0.05).sum() > 20, "it stops at a light"
    heading = np.cumsum(true_twists(s)[:, 5] * s.dt)
    assert np.ptp(heading) > 1.2, "it turns by a right angle"
    assert s.form == "simulated"
    assert "seed 0" in s.source
    assert s.remarks


def test_a_minute_is_simulated_in_a_second() -> None:
    began = time.process_time()
    simulate(default_drive())
    assert time.process_time() - began < 1.0


# --- truth and observations


@pytest.mark.parametrize("path", PATHS)
def test_residuals_at_the_truth_have_the_declared_deviation(path: str) -> None:
    s, labels = simulate_with_labels(Simulation(path=path, sigma_pixel=0.7, moving_share=0.1, seed=3))  # type: ignore[arg-type]
    r = residuals(s, labels) / 0.7
    n = r.size
    # chi-square with n degrees of freedom, by its normal limit
    assert abs((r**2).sum() - n) < 4.0 * np.sqrt(2.0 * n)
    assert np.abs(r.mean(axis=0)).max() < 4.0 / np.sqrt(len(r))
    assert np.abs(np.corrcoef(r.T) - np.eye(4)).max() < 4.0 / np.sqrt(len(r))


def test_rows_share_noise_as_set() -> None:
    s, labels = simulate_with_labels(Simulation(row_correlation=0.8))
    correlation = np.corrcoef(residuals(s, labels).T)
    assert correlation[1, 3] == pytest.approx(0.8, abs=0.02)
    assert abs(correlation[0, 2]) < 0.02


@pytest.mark.parametrize("path", PATHS)
def test_every_tracked_point_is_before_both_cameras_and_in_both_images(path: str) -> None:
    settings = Simulation(path=path, seed=5)  # type: ignore[arg-type]
    s, labels = simulate_with_labels(settings)
    assert np.isfinite(in_camera(s)).all()
    nearest, _ = settings.depths
    assert in_camera(s)[:, 2].min() >= nearest
    assert disparity(s.camera.project(in_camera(s))).min() > 0.0
    pixel = s.observations.pixel
    size = np.array([settings.mount.width, settings.mount.height] * 2)
    assert (pixel >= 0).all()
    assert (pixel <= size - 1).all()
    assert disparity(pixel[~labels.wrong]).min() > -1.0


def test_points_on_moving_objects_move_and_have_no_true_position() -> None:
    s, labels = simulate_with_labels(Simulation(moving_share=0.15, **CLEAN, duration=120))
    assert 0.07 < labels.moving.mean() < 0.2
    assert s.truth is not None
    assert s.truth.landmarks is not None
    known = np.isfinite(s.truth.landmarks).all(axis=1)
    assert np.array_equal(known[s.observations.landmark], ~labels.moving)
    world_T_cam = s.truth.world_T_imu[s.observations.frame] @ s.imu_T_cam
    where = se3.transform(world_T_cam, s.camera.triangulate(s.observations.pixel))
    for landmark in np.flatnonzero(~known)[:50]:
        places = where[s.observations.landmark == landmark]
        steps = np.diff(places, axis=0)
        assert np.ptp(steps, axis=0).max() < 1e-4, "at constant velocity"
    lengths = [np.ptp(where[s.observations.landmark == m], axis=0).max() for m in np.flatnonzero(~known)]
    assert np.median(lengths) > 2.0


def test_the_share_of_wrong_matches_is_the_declared_one_single_and_persistent() -> None:
    pooled, single = [], []
    for seed in range(10):
        s, labels = simulate_with_labels(Simulation(wrong_share=0.1, seed=seed))
        pooled.append(labels.wrong.mean())
        order = s.observations.by_track()
        wrong, landmark = labels.wrong[order], s.observations.landmark[order]
        together = wrong[1:] & wrong[:-1] & (landmark[1:] == landmark[:-1])
        single.append(1.0 - 2.0 * together.sum() / wrong.sum())
        error = np.linalg.norm((s.observations.pixel - s.camera.project(in_camera(s)))[labels.wrong], axis=1)
        assert np.mean(error > 3.0) > 0.97, "wrong is wrong"
    assert np.mean(pooled) == pytest.approx(0.0975, abs=0.003)  # two kinds of 5 % each, which can meet
    assert np.mean(single) < 0.6


def test_a_burst_of_wrong_matches_lies_at_the_simulated_times() -> None:
    s, labels = simulate_with_labels(Simulation(bursts=((20.0, 22.0, 0.6),), wrong_share=0.0))
    t = s.t[s.observations.frame]
    inside = (t >= 20.0) & (t <= 22.0)
    assert labels.wrong[inside].mean() == pytest.approx(0.6, abs=0.05)
    assert not labels.wrong[~inside].any()


def test_nothing_is_seen_in_a_blackout_and_tracks_end_there() -> None:
    s = simulate(Simulation(blackouts=((20.0, 25.0),)))
    t = s.t[s.observations.frame]
    assert not ((t >= 20.0) & (t <= 25.0)).any()
    assert not set(s.observations.landmark[t < 20.0]) & set(s.observations.landmark[t > 25.0])
    counts = np.bincount(s.observations.frame, minlength=s.n_frames)
    assert counts[252:260].min() > 25


def test_tracks_return_only_as_set() -> None:
    def gaps(s: Sequence) -> float:
        order = s.observations.by_track()
        landmark, frame = s.observations.landmark[order], s.observations.frame[order]
        returns = (np.diff(landmark) == 0) & (np.diff(frame) > 1)
        return len(set(landmark[1:][returns])) / s.n_landmarks

    assert gaps(simulate(Simulation())) == 0.0
    assert 0.05 < gaps(simulate(Simulation(returning_share=0.3))) <= 0.3
    s = simulate(Simulation(path="loop", duration=120.1, returning_share=0.3, return_after=60.0))
    order = s.observations.by_track()
    frame = s.observations.frame[order]
    jump = np.diff(frame)[np.diff(s.observations.landmark[order]) == 0]
    assert (jump > 500).sum() > 50, "points of the first lap are seen again when it closes"


@pytest.mark.parametrize("features", [20.0, 300.0, 2000.0])
def test_features_per_frame_is_the_average(features: float) -> None:
    s = simulate(Simulation(features_per_frame=features, duration=20.0))
    assert len(s.observations) / s.n_frames == pytest.approx(features, rel=0.1)


# --- velocities


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("scale", [0.0, 1.0])
def test_integrating_clean_velocities_gives_the_path(path: str, scale: float) -> None:
    s = simulate(Simulation(path=path, sigma_linear=0.0, sigma_angular=0.0, wrong_share=0.03 * scale))  # type: ignore[arg-type]
    assert s.truth is not None
    assert np.array_equal(s.truth.world_T_imu[0], np.eye(4))
    reached = se3.compose(se3.exp(recorded(s)[:-1] * s.dt[:, None]))
    assert np.abs(reached - s.truth.world_T_imu).max() < 1e-9


def test_before_is_the_velocity_of_the_interval_before() -> None:
    s = simulate(Simulation(path="handheld", velocity_of_interval="before", **CLEAN))
    assert np.abs(recorded(s)[1:] - true_twists(s)).max() < 1e-9


def test_the_mean_of_two_instantaneous_velocities_is_right_to_second_order() -> None:
    def worst(rate: float) -> float:
        s = simulate(Simulation(path="handheld", velocity_of_interval="mean", frame_rate=rate, duration=10.0, **CLEAN))
        u = recorded(s)
        return float(np.abs(0.5 * (u[1:] + u[:-1]) - true_twists(s)).max())

    assert worst(20.0) < 0.3 * worst(10.0)
    held = simulate(Simulation(path="handheld", velocity_of_interval="mean", **CLEAN))
    assert worst(10.0) < 0.2 * np.abs(recorded(held)[:-1] - true_twists(held)).max()


def test_simulated_bias_scale_and_axes_are_what_a_diagnosis_removes() -> None:
    clean = simulate(Simulation(path="handheld", **CLEAN))
    s = simulate(
        Simulation(
            path="handheld",
            gyro_bias=(0.01, -0.02, 0.03),
            velocity_scale=1.05,
            angular_axes="x,-y,-z",
            linear_axes="y,z,x",
            **CLEAN,
        )
    )
    w = (s.angular_velocity - (0.01, -0.02, 0.03)) @ axes_matrix("x,-y,-z").T
    v = s.linear_velocity @ axes_matrix("y,z,x").T / 1.05
    assert np.allclose(w, clean.angular_velocity, atol=1e-12)
    assert np.allclose(v, clean.linear_velocity, atol=1e-12)
    assert np.array_equal(s.observations.pixel, clean.observations.pixel)
    assert np.allclose(s.angular_velocity[:, 1] + 0.02, -clean.angular_velocity[:, 1])
    assert np.allclose(s.linear_velocity[:, 2] / 1.05, clean.linear_velocity[:, 1])  # IMU y is the recorded z


def test_a_velocity_stamped_t_is_measured_at_t_plus_the_time_offset() -> None:
    clean = simulate(Simulation(path="handheld", frame_rate=10.0, **CLEAN))
    late = simulate(Simulation(path="handheld", frame_rate=10.0, time_offset=0.3, **CLEAN))
    assert np.allclose(recorded(late)[:-3], recorded(clean)[3:], atol=1e-9)
    part = simulate(Simulation(path="handheld", frame_rate=10.0, time_offset=0.05, **CLEAN))
    between = 0.5 * (recorded(clean)[1:] + recorded(clean)[:-1])
    assert np.abs(recorded(part)[:-1] - between).max() < 0.1 * np.abs(np.diff(recorded(clean), axis=0)).max()


def test_velocity_noise_has_the_declared_deviation() -> None:
    noisy = simulate(Simulation(sigma_linear=0.2, sigma_angular=0.03, duration=300.0))
    clean = simulate(Simulation(sigma_linear=0.0, sigma_angular=0.0, duration=300.0))
    error = recorded(noisy) - recorded(clean)
    assert np.allclose(error.std(axis=0), [0.2] * 3 + [0.03] * 3, rtol=0.06)
    assert np.abs(error.mean(axis=0) / error.std(axis=0)).max() < 4.0 / np.sqrt(len(error))


# --- along given velocities


def wandering(n: int = 200) -> Velocities:
    rng = np.random.default_rng(4)
    t = 100.0 + np.cumsum(rng.uniform(0.09, 0.11, n))
    phase = np.linspace(0.0, 12.0, n)
    linear = np.stack([6.0 + 2.0 * np.sin(phase), 0.1 * np.cos(phase), 0.05 * np.sin(2 * phase)], axis=1)
    angular = np.stack([0.01 * np.cos(phase), 0.02 * np.sin(phase), 0.2 * np.sin(0.7 * phase)], axis=1)
    return Velocities(t, linear, angular)


def test_following_velocities_without_noise_gives_them_back() -> None:
    followed = wandering()
    s = simulate(Simulation(path="along", along=followed, **CLEAN))
    assert np.allclose(s.t, followed.t - followed.t[0])
    assert np.allclose(s.linear_velocity, followed.linear, atol=1e-10)
    assert np.allclose(s.angular_velocity, followed.angular, atol=1e-10)
    assert len(s.observations) / s.n_frames == pytest.approx(70.0, rel=0.15)


def test_following_a_sequence_uses_its_camera_and_its_axes() -> None:
    flipped = np.diag([1.0, -1.0, -1.0, 1.0])
    rig = Rig(KITTI.camera, KITTI.width, KITTI.height, flipped @ KITTI.imu_T_cam, KITTI.imu_above_ground)
    original = simulate(Simulation(rig=rig, **CLEAN))
    assert original.up[2] < -0.99
    s = simulate(Simulation(path="along", along=original, **CLEAN))
    assert s.camera == original.camera
    assert np.array_equal(s.imu_T_cam, original.imu_T_cam)
    assert np.allclose(recorded(s), recorded(original), atol=1e-9)
    assert s.up[2] < -0.99


def test_a_known_bias_is_subtracted_from_the_followed_velocities() -> None:
    followed = wandering()
    s = simulate(Simulation(path="along", along=followed, along_gyro_bias=(0.01, 0.0, -0.02), duration=5.0, **CLEAN))
    assert s.t[-1] <= 5.0
    assert np.allclose(s.angular_velocity + np.array([0.01, 0.0, -0.02]), followed.angular[: s.n_frames], atol=1e-10)


# --- laws


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    path=st.sampled_from(PATHS),
    seed=st.integers(0, 2**40),
    duration=st.floats(0.5, 12.0),
    frame_rate=st.floats(5.0, 60.0),
    features=st.floats(0.0, 120.0),
    offset=st.floats(-0.5, 0.5),
    moving=st.floats(0.0, 0.5),
    returning=st.floats(0.0, 1.0),
    interval=st.sampled_from(["after", "before", "mean"]),
    axes=st.sampled_from(AXIS_CONVENTIONS),
)
def test_any_settings_give_a_sequence_whose_landmarks_lie_before_the_camera(
    path, seed, duration, frame_rate, features, offset, moving, returning, interval, axes
) -> None:  # type: ignore[no-untyped-def]
    s, labels = simulate_with_labels(
        Simulation(
            path=path,
            seed=seed,
            duration=duration,
            frame_rate=frame_rate,
            features_per_frame=features,
            time_offset=offset,
            moving_share=moving,
            returning_share=returning,
            velocity_of_interval=interval,
            angular_axes=axes,
        )
    )
    assert s.n_frames == round(duration * frame_rate)
    assert len(labels.wrong) == len(labels.moving) == len(s.observations)
    depth = in_camera(s)[~labels.moving, 2]
    assert (depth > 0).all()
    counts = s.observations.counts(s.n_landmarks)
    assert counts.min(initial=3) >= min(3, s.n_frames)


@pytest.mark.parametrize("path", PATHS)
def test_the_same_settings_give_the_same_bytes(path: str) -> None:
    settings = Simulation(path=path, moving_share=0.1, returning_share=0.1, bursts=((2.0, 3.0, 0.5),), duration=10.0)  # type: ignore[arg-type]
    one, two = simulate(settings), simulate(dataclasses.replace(settings))
    assert recorded(one).tobytes() == recorded(two).tobytes()
    assert one.observations.pixel.tobytes() == two.observations.pixel.tobytes()
    assert one.observations.landmark.tobytes() == two.observations.landmark.tobytes()
    assert one.truth is not None
    assert two.truth is not None
    assert one.truth.world_T_imu.tobytes() == two.truth.world_T_imu.tobytes()
    other = simulate(dataclasses.replace(settings, seed=1))
    assert recorded(one).tobytes() != recorded(other).tobytes()


def test_one_noise_leaves_the_others_as_they_were() -> None:
    base = Simulation(duration=20.0)
    before, labels = simulate_with_labels(base)
    for name, value in {
        "sigma_linear": 0.5, "sigma_angular": 0.0, "gyro_bias": (0.1, 0.0, 0.0), "time_offset": 0.03,
        "velocity_scale": 1.1, "angular_axes": "x,-y,-z", "velocity_of_interval": "mean",
    }.items():  # fmt: skip
        after = simulate(dataclasses.replace(base, **{name: value}))
        assert np.array_equal(after.observations.pixel, before.observations.pixel), name
        assert not np.array_equal(recorded(after), recorded(before)), name
    for name, value in {"sigma_pixel": 0.1, "wrong_share": 0.2, "bursts": ((1.0, 2.0, 0.9),)}.items():
        after = simulate(dataclasses.replace(base, **{name: value}))
        assert np.array_equal(recorded(after), recorded(before)), name
        assert np.array_equal(after.observations.landmark, before.observations.landmark), name
        assert not np.array_equal(after.observations.pixel, before.observations.pixel), name
    after, relabeled = simulate_with_labels(dataclasses.replace(base, moving_share=0.2))
    standing = ~relabeled.moving
    assert np.array_equal(after.observations.landmark[standing], before.observations.landmark)
    after, relabeled = simulate_with_labels(dataclasses.replace(base, sigma_pixel=0.2))
    assert np.array_equal(labels.wrong, relabeled.wrong)


# --- axes


def test_there_are_24_conventions_each_a_rotation_with_its_own_name() -> None:
    assert len(set(AXIS_CONVENTIONS)) == 24
    assert AXIS_CONVENTIONS[0] == "x,y,z"
    for name in AXIS_CONVENTIONS:
        matrix = axes_matrix(name)
        assert np.array_equal(matrix @ matrix.T, np.eye(3))
        assert np.linalg.det(matrix) == pytest.approx(1.0)
        assert axes_name(matrix) == name
    assert np.array_equal(axes_matrix("x,-y,-z"), np.diag([1.0, -1.0, -1.0]))
    assert np.array_equal(axes_matrix("y,z,x") @ [1.0, 2.0, 3.0], [2.0, 3.0, 1.0])


@pytest.mark.parametrize("wrong", ["x,y,-z", "x,x,x", "", "xyz"])
def test_a_left_handed_axis_convention_is_refused(wrong: str) -> None:
    with pytest.raises(InputError, match="24"):
        axes_matrix(wrong)


# --- refusals


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("path", "sea"),
        ("duration", 0.0),
        ("duration", float("nan")),
        ("duration", 0.1),
        ("frame_rate", -1.0),
        ("frame_rate", float("inf")),
        ("seed", -1),
        ("seed", 1.5),
        ("sigma_linear", -0.1),
        ("sigma_pixel", float("nan")),
        ("gyro_bias", (0.0, float("nan"), 0.0)),
        ("gyro_bias", (0.0, 0.0)),
        ("gyro_bias", 0.01),
        ("gyro_bias", "abc"),
        ("bursts", ((1.0, 2.0),)),
        ("blackouts", (1.0, 2.0)),
        ("duration", 90000.0 * 2),
        ("velocity_scale", 0.0),
        ("time_offset", 1.5),
        ("velocity_of_interval", "during"),
        ("linear_axes", "x,y,-z"),
        ("angular_axes", "up"),
        ("features_per_frame", -1.0),
        ("track_length", 1.0),
        ("nearest", 0.0),
        ("farthest", 2.0),
        ("wrong_share", 1.1),
        ("moving_share", 1.0),
        ("bursts", ((1.0, 2.0, 3.0),)),
        ("bursts", ((2.0, 1.0, 0.3),)),
        ("blackouts", ((2.0, 1.0),)),
        ("world", "moon"),
        ("along", Velocities(np.arange(3.0), np.zeros((3, 3)), np.zeros((3, 3)))),
        ("sigma_linear", "much"),
    ],
)
def test_impossible_settings_are_refused_with_their_value(name: str, value: object) -> None:
    with refused(name):
        Simulation(**{name: value})  # type: ignore[arg-type]


def test_impossible_velocities_are_refused() -> None:
    good = wandering(10)
    with pytest.raises(InputError, match="along"):
        Simulation(path="along")
    bad_stamps = Velocities(good.t[::-1], good.linear, good.angular)
    bad_shape = Velocities(good.t, good.linear[:5], good.angular)
    bad_value = Velocities(good.t, good.linear * np.nan, good.angular)
    for bad in (bad_stamps, bad_shape, bad_value):
        with pytest.raises(InputError, match="along"):
            simulate(Simulation(path="along", along=bad))
    with pytest.raises(InputError, match="frame_rate"):
        simulate(Simulation(path="along", along=good, frame_rate=0.5))
    with pytest.raises(InputError, match="fewer than two"):
        simulate(Simulation(path="along", along=good, duration=0.01))
