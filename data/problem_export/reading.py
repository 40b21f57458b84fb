"""Reader of exported problems, from their npz and JSON."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from fgbaseline.geometry import FloatArray, HuberKernel, InputError, MonocularCamera, StereoCamera

from ..formats.files.field_checks import extrinsic, positive, time_stamps
from ..formats.files.file_errors import FilePath, reading, regular_file
from ..formats.files.npz_archive import NpzArchive
from ..observations import IntArray, Observations
from ..problem import Excluded, LandmarkMode, LandmarkPrior, Problem
from ..sequence import Sequence
from ..value_range import LARGEST, measurable
from . import layout
from .inertial import DEPTHS, START, interval_noise, read_depths, read_samples, read_start

MOST_UNSEEN = 100
"""most landmarks per observation: some landmarks are unobserved, and arrays have their number"""


def read_problem(folder: FilePath) -> Problem:
    """Problem in a folder written by `write_problem` (or in the same form), without ground truth.

    Numbers are read from problem.npz, texts from problem.json. Raises InputError naming file and key for missing,
    misshapen or non-finite values.
    """
    place = Path(folder)
    with reading(place / layout.SCALARS):
        words = _words(regular_file(place / layout.SCALARS))
    with reading(place / layout.ARRAYS), NpzArchive(regular_file(place / layout.ARRAYS)) as archive:
        return _problem(_Numbers(archive), words)


def _words(path: Path) -> dict[str, Any]:
    try:
        words = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"it is not JSON ({error}); export the problem again") from error
    found = words.get("schema") if isinstance(words, dict) else None
    if found != layout.SCHEMA:
        raise InputError(f"schema: expected {layout.SCHEMA!r}, got {found!r}; export the problem again")
    try:
        s = words["sequence"]
        return {
            "preset": str(words["preset"]),
            "diagnosed": bool(words["diagnosed"]),
            "reading": LandmarkMode(words["reading"]),
            "remarks": tuple(map(str, words["remarks"])),
            "sequence": {key: str(s[key]) for key in ("name", "form", "source")},
            "sequence_remarks": tuple(map(str, s["remarks"])),
            "start": str(words.get("start", "given")),
        }
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{error} is missing or not what it should be; export the problem again") from error


class _Numbers:
    """Arrays of an open archive, with shape checks."""

    def __init__(self, archive: NpzArchive) -> None:
        self._archive = archive

    def has(self, key: str) -> bool:
        return key in self._archive.keys

    def real(self, key: str, *shape: int | None, finite: bool = True) -> FloatArray:
        """Array `key`; None in `shape` allows any length."""
        array = self._archive.array(key)
        fits = array.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, array.shape, strict=True))
        if not fits:
            expected = tuple("n" if n is None else n for n in shape)
            raise InputError(f"{key}: expected shape {expected}, got {array.shape}; export the problem again")
        if finite and not measurable(array).all():
            raise InputError(
                f"{key}: it has entries that are not finite or beyond {LARGEST:g}; export the problem again"
            )
        return array

    def whole(self, key: str, *shape: int | None) -> IntArray:
        """Array `key` of integers >= 0, as `real`."""
        array = self.real(key, *shape)
        if (array < 0).any() or (array != np.floor(array)).any() or (array >= 2**31).any():
            raise InputError(f"{key}: expected whole numbers from 0 on, below 2^31; export the problem again")
        return array.astype(np.int64)

    def optional(self, key: str) -> float | None:
        """One number, None where it is NaN."""
        value = float(self.real(key, finite=False))
        return None if np.isnan(value) else positive(key, np.array(value), "or NaN for none")


def _problem(numbers: _Numbers, words: dict[str, Any]) -> Problem:
    sequence = _sequence(numbers, words)
    T, n = sequence.n_frames, len(sequence.observations)
    features = numbers.whole("features", None)
    if len(features) and (np.any(np.diff(features) <= 0) or features[-1] >= sequence.n_landmarks):
        raise InputError(f"features: they must rise and lie below n_landmarks ({sequence.n_landmarks})")
    excluded = numbers.whole("excluded", n)
    if len(excluded) and excluded.max() > max(Excluded):
        raise InputError(f"excluded: expected codes from 0 to {max(Excluded)}, got {excluded.max()}")
    prior = None
    if numbers.has("landmark_prior_mean"):
        mean = numbers.real("landmark_prior_mean", len(features), 3)
        prior = LandmarkPrior(mean, numbers.real("landmark_prior_covariance", 3, 3))
    threshold = numbers.optional("huber_threshold")
    steps = T - 1 if sequence.imu is None else 0
    return Problem(
        preset=words["preset"],
        sequence=sequence,
        increment=numbers.real("increment", steps, 6),
        increment_covariance=numbers.real("increment_covariance", steps, 6, 6),
        pixel_variance=positive("pixel_variance", numbers.real("pixel_variance"), "px^2"),
        features=features,
        excluded=excluded.astype(np.uint8),
        initial_pose=numbers.real("initial_pose", 4, 4),
        initial_covariance=numbers.real("initial_covariance", 6, 6),
        imu=None if sequence.imu is None else interval_noise(numbers.real, sequence),
        start=read_start(numbers.real, words["start"]) if numbers.has(START) else None,
        inverse_depth_prior=read_depths(numbers.real) if numbers.has(DEPTHS) else None,
        landmark_prior=prior,
        kernel=None if threshold is None else HuberKernel(threshold),
        mapping_pixel_variance=numbers.optional("mapping_pixel_variance"),
        pixel_inflation=positive("pixel_inflation", numbers.real("pixel_inflation"), "a factor"),
        landmark_mode=words["reading"],
        diagnosed=words["diagnosed"],
        remarks=words["remarks"],
    )


def _sequence(numbers: _Numbers, words: dict[str, Any]) -> Sequence:
    t = time_stamps("t", numbers.real("t", None, finite=False))
    K, imu_T_cam = numbers.real("K", 3, 3), numbers.real("imu_T_cam", 4, 4)
    n = len(numbers.real("frame", None))
    n_landmarks = int(numbers.whole("n_landmarks"))
    if n_landmarks > MOST_UNSEEN * (n + 1):
        raise InputError(
            f"n_landmarks: {n_landmarks:,} landmarks for {n:,} observations are more than {MOST_UNSEEN} for each; "
            "number the landmarks from 0 on"
        )
    frame, landmark = numbers.whole("frame", n), numbers.whole("landmark", n)
    order = np.diff(frame) * (int(landmark.max(initial=0)) + 1) + np.diff(landmark)
    if np.any(order <= 0):
        raise InputError("frame: observations must be sorted by frame, then landmark, without repeats")
    imu = read_samples(numbers.real) if numbers.has("imu_time_stamps") else None
    rows, pixel = len(t) if imu is None else 0, numbers.real("pixel", n, 4, finite=False)
    pair = not (n and np.isnan(pixel[:, 2:]).all())
    intrinsics = (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
    return Sequence(
        **words["sequence"],
        t=t,
        linear_velocity=numbers.real("linear_velocity", rows, 3),
        angular_velocity=numbers.real("angular_velocity", rows, 3),
        camera=StereoCamera(*intrinsics, positive("b", numbers.real("b"), "m"))
        if pair
        else MonocularCamera(*intrinsics),
        imu_T_cam=extrinsic("imu_T_cam", imu_T_cam[:3, :3], imu_T_cam[:3, 3]),
        observations=Observations(frame, landmark, numbers.real("pixel", n, 4) if pair else pixel),
        n_landmarks=n_landmarks,
        imu=imu,
        up_imu=numbers.real("up_imu" if numbers.has("up_imu") else "up", 3),
        remarks=words["sequence_remarks"],
    )
