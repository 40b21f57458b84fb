"""GTSAM keys; landmark keys encode a distance class, so that each class has its own relinearization threshold.

The linearization error of a landmark depends on its motion relative to its distance: 10 cm at 100 m are equivalent to
5 mm at 5 m. GTSAM sets thresholds by the letter of a key, so the letter encodes the distance class. With one threshold
for all, far landmarks and their cliques would be relinearized at every step.
"""

import math

import gtsam
import numpy as np

POSE = "x"
LANDMARK = "l"
"""letter of landmark keys without thresholds"""
LETTERS = "abcdefghijk"
NEAREST, RATIO = 10.0, 1.6
"""nearest class in baselines; each class reaches RATIO times as far as the one before"""


_LETTER_AT = 56
"""first bit of the letter in a key, as in `gtsam.symbol`, which takes ten times as long"""
_POSES, _LANDMARKS = ord(POSE) << _LETTER_AT, ord(LANDMARK) << _LETTER_AT

AUXILIARY_POSE = ord("z") << _LETTER_AT
"""Key of an auxiliary pose that is connected to the newest pose only and eliminated after it. It carries no
information, but makes a root clique of two poses, from which the covariance of the newest pose is read. Without it
GTSAM would invert the clique of all variables that the frame observes."""


def pose_key(frame: int) -> int:
    """Key of the pose of a frame."""
    return _POSES | frame


def landmark_key(landmark: int) -> int:
    """Key of a landmark, by its index in the sequence, in a batch graph."""
    return _LANDMARKS | landmark


def distance_key(landmark: int, distance: float) -> int:
    """Key of a landmark added to an incremental graph at a distance of `distance` baselines."""
    steps = math.log(max(distance, NEAREST) / NEAREST) / math.log(RATIO)
    return (ord(LETTERS[min(int(steps), len(LETTERS) - 1)]) << _LETTER_AT) | landmark


def landmark_of(key: int) -> int | None:
    """Landmark of a key; None for a pose."""
    return None if key == AUXILIARY_POSE or key >> _LETTER_AT == ord(POSE) else key & ((1 << _LETTER_AT) - 1)


def thresholds(position: float, rotation: float, landmark: float, baseline: float) -> gtsam.ISAM2ThresholdMap:
    """Relinearization thresholds: of poses in baselines (m) and rad, of landmarks as a share of their distance."""
    by_letter = gtsam.ISAM2ThresholdMap()
    by_letter.insert((POSE, np.array([rotation] * 3 + [position * baseline] * 3)))
    by_letter.insert((chr(AUXILIARY_POSE >> _LETTER_AT), np.full(6, np.inf)))
    for i, letter in enumerate(LETTERS):
        by_letter.insert((letter, np.full(3, landmark * baseline * NEAREST * RATIO**i)))
    return by_letter
