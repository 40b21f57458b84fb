"""Keys in GTSAM; those of landmarks are sorted by distance so that each class has its own relinearization threshold.

What matters to the linearization of a landmark is by how much it moved as a share of its distance: one at 100 m that
moves by 10 cm looks the same as one at 5 m that moves by 5 mm. GTSAM knows thresholds by the letter of a key only, so
the letter tells the distance. With one threshold for all, far landmarks are relinearized at every step, with all that
hangs on them.
"""

import math

import gtsam
import numpy as np

POSE = "x"
LANDMARK = "l"
"""the letter where no thresholds are at work"""
LETTERS = "abcdefghijk"
NEAREST, RATIO = 10.0, 1.6
"""baselines of the rig; a class reaches RATIO times as far as the one before it"""


_LETTER_AT = 56
"""the bit of a key from which on it holds its letter, as in `gtsam.symbol`, which costs ten times as much"""
_POSES, _LANDMARKS = ord(POSE) << _LETTER_AT, ord(LANDMARK) << _LETTER_AT

AUXILIARY_POSE = ord("z") << _LETTER_AT
"""the key of a pose that hangs on the newest one alone and is eliminated after it.

It tells nothing, but makes a root of two poses, where the covariance of the newest one is at hand. Without it GTSAM
would find that pose at the end of a clique with all that a frame sees, and invert the whole of it for each frame.
"""


def pose_key(frame: int) -> int:
    """The key of the pose of a frame."""
    return _POSES | frame


def landmark_key(landmark: int) -> int:
    """The key of a landmark, by its index in the sequence, in a graph that is solved as a whole."""
    return _LANDMARKS | landmark


def distance_key(landmark: int, distance: float) -> int:
    """The key of a landmark that enters an incremental graph when it is `distance` (baselines) away."""
    steps = math.log(max(distance, NEAREST) / NEAREST) / math.log(RATIO)
    return (ord(LETTERS[min(int(steps), len(LETTERS) - 1)]) << _LETTER_AT) | landmark


def landmark_of(key: int) -> int | None:
    """The landmark that a key stands for; None for a pose."""
    return None if key == AUXILIARY_POSE or key >> _LETTER_AT == ord(POSE) else key & ((1 << _LETTER_AT) - 1)


def thresholds(position: float, rotation: float, landmark: float, baseline: float) -> gtsam.ISAM2ThresholdMap:
    """Relinearization thresholds: of poses in baselines (m) and rad, of landmarks as a share of their distance."""
    by_letter = gtsam.ISAM2ThresholdMap()
    by_letter.insert((POSE, np.array([rotation] * 3 + [position * baseline] * 3)))
    by_letter.insert((chr(AUXILIARY_POSE >> _LETTER_AT), np.full(6, np.inf)))
    for i, letter in enumerate(LETTERS):
        by_letter.insert((letter, np.full(3, landmark * baseline * NEAREST * RATIO**i)))
    return by_letter
