"""Keys in GTSAM; those of landmarks are sorted by distance so that each class has its own relinearization threshold.

What matters to the linearization of a landmark is by how much it moved as a share of its distance: one at 100 m that
moves by 10 cm looks the same as one at 5 m that moves by 5 mm. GTSAM knows thresholds by the letter of a key only, so
the letter tells the distance. With one threshold for all, far landmarks are relinearized at every step, with all that
hangs on them.
"""

import math

import gtsam
import numpy as np

from fgbaseline.geometry import FloatArray

POSE, VELOCITY, BIAS = "x", "v", "w"
"""the letters of a frame's variables; b is that of a class of landmarks"""
LANDMARK = "l"
"""the letter where no thresholds are at work"""
LETTERS = "abcdefghijk"
NEAREST, RATIO = 10.0, 1.6
"""baselines of the rig; a class reaches RATIO times as far as the one before it"""


_LETTER_AT = 56
"""the bit of a key from which on it holds its letter, as in `gtsam.symbol`, which costs ten times as much"""
_POSES, _LANDMARKS = ord(POSE) << _LETTER_AT, ord(LANDMARK) << _LETTER_AT
_VELOCITIES, _BIASES = ord(VELOCITY) << _LETTER_AT, ord(BIAS) << _LETTER_AT

AUXILIARY_POSE = ord("z") << _LETTER_AT
"""the key of a pose that hangs on the newest one alone and is eliminated after it.

It tells nothing, but makes a root of two poses, where the covariance of the newest one is at hand. Without it GTSAM
would find that pose at the end of a clique with all that a frame sees, and invert the whole of it for each frame.
With raw inertial data it hangs on all variables of the newest frame.
"""
_FRAME_LETTERS = frozenset([*map(ord, (POSE, VELOCITY, BIAS)), AUXILIARY_POSE >> _LETTER_AT])


def pose_key(frame: int) -> int:
    """The key of the pose of a frame."""
    return _POSES | frame


def frame_of(key: int) -> int:
    """The frame of a variable of a frame."""
    return key & ((1 << _LETTER_AT) - 1)


def state_keys(frame: int, inertial: bool) -> list[int]:
    """The keys of a frame's variables: its pose, and with raw inertial data its velocity and its biases."""
    return [_POSES | frame, _VELOCITIES | frame, _BIASES | frame] if inertial else [_POSES | frame]


def width(key: int) -> int:
    """How many numbers the tangent of a variable has."""
    return 6 if key >> _LETTER_AT in (ord(POSE), ord(BIAS)) else 3


def landmark_key(landmark: int) -> int:
    """The key of a landmark, by its index in the sequence, in a graph that is solved as a whole."""
    return _LANDMARKS | landmark


def distance_key(landmark: int, distance: float) -> int:
    """The key of a landmark that enters an incremental graph when it is `distance` (baselines) away."""
    steps = math.log(max(distance, NEAREST) / NEAREST) / math.log(RATIO)
    return (ord(LETTERS[min(int(steps), len(LETTERS) - 1)]) << _LETTER_AT) | landmark


def landmark_of(key: int) -> int | None:
    """The landmark that a key stands for; None for a variable of a frame."""
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
