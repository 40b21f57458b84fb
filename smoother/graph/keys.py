"""GTSAM keys; landmark keys encode a distance class, so that each class has its own relinearization threshold.

The linearization error of a landmark depends on its motion relative to its distance: 10 cm at 100 m are equivalent to
5 mm at 5 m. GTSAM sets thresholds by the letter of a key, so the letter encodes the distance class. With one threshold
for all, far landmarks and their cliques would be relinearized at every step.
"""

import math

import gtsam
import numpy as np

from fgbaseline.geometry import FloatArray

POSE, VELOCITY, BIAS = "x", "v", "w"
"""letters of a frame's variables; b, usual for biases, is that of a class of landmarks"""
LANDMARK = "l"
"""letter of landmark keys without thresholds"""
LETTERS = "abcdefghijk"
NEAREST, RATIO = 10.0, 1.6
"""distance of the nearest class, in baselines; that of the next class is RATIO times larger"""


_LETTER_AT = 56
"""first bit of the letter in a key, as in `gtsam.symbol`, which takes ten times as long"""
_POSES, _LANDMARKS = ord(POSE) << _LETTER_AT, ord(LANDMARK) << _LETTER_AT
_VELOCITIES, _BIASES = ord(VELOCITY) << _LETTER_AT, ord(BIAS) << _LETTER_AT

AUXILIARY_POSE = ord("z") << _LETTER_AT
"""Key of an auxiliary pose, which a factor connects to the newest pose only and which is eliminated last.

It adds no information. It makes a root clique of two poses, in which the covariance of the newest one is cheap. Without
it that pose would be in a clique with all observed landmarks, which GTSAM would invert as a whole for each frame. With
raw inertial data the auxiliary pose is connected to all variables of the newest frame.
"""
_FRAME_LETTERS = frozenset([*map(ord, (POSE, VELOCITY, BIAS)), AUXILIARY_POSE >> _LETTER_AT])


def pose_key(frame: int) -> int:
    """Key of the pose of a frame."""
    return _POSES | frame


def state_keys(frame: int, inertial: bool) -> list[int]:
    """Keys of a frame's variables: its pose, and with raw inertial data its velocity and its biases."""
    return [_POSES | frame, _VELOCITIES | frame, _BIASES | frame] if inertial else [_POSES | frame]


def width(key: int) -> int:
    """Dimension of the tangent space of a variable."""
    return 6 if key >> _LETTER_AT in (ord(POSE), ord(BIAS)) else 3


def landmark_key(landmark: int) -> int:
    """Key of a landmark, by its index in the sequence, in a batch graph."""
    return _LANDMARKS | landmark


def distance_key(landmark: int, distance: float) -> int:
    """Key of a landmark added to an incremental graph at a distance of `distance` baselines."""
    steps = math.log(max(distance, NEAREST) / NEAREST) / math.log(RATIO)
    return (ord(LETTERS[min(int(steps), len(LETTERS) - 1)]) << _LETTER_AT) | landmark


def landmark_of(key: int) -> int | None:
    """Landmark of a key; None for a variable of a frame."""
    return None if key >> _LETTER_AT in _FRAME_LETTERS else key & ((1 << _LETTER_AT) - 1)


def thresholds(
    pose: FloatArray, velocity: FloatArray, bias: FloatArray, landmark: float, baseline: float
) -> gtsam.ISAM2ThresholdMap:
    """Relinearization thresholds: of poses (6,), rad and baselines (m), of velocities (3,), m/s, of biases (6,), m/s^2
    and rad/s, of landmarks as a share of their distance."""
    by_letter = gtsam.ISAM2ThresholdMap()
    by_letter.insert((POSE, pose * np.repeat([1.0, baseline], 3)))
    by_letter.insert((VELOCITY, velocity))
    by_letter.insert((BIAS, bias))
    by_letter.insert((chr(AUXILIARY_POSE >> _LETTER_AT), np.full(6, np.inf)))
    for i, letter in enumerate(LETTERS):
        by_letter.insert((letter, np.full(3, landmark * baseline * NEAREST * RATIO**i)))
    return by_letter
