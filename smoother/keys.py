"""Keys of landmarks in GTSAM, sorted by distance so that each class has its own relinearisation threshold.

What matters to the linearisation of a landmark is by how much it moved as a share of its distance: one at 100 m that
moves by 10 cm looks the same as one at 5 m that moves by 5 mm. GTSAM knows thresholds by the letter of a key only, so
the letter tells the distance. With one threshold for all, far landmarks are relinearised at every step, with all that
hangs on them.
"""

import gtsam
import numpy as np

UNPLACED = "l"
LETTERS = "abcdefghijk"
NEAREST, RATIO = 5.0, 1.6
"""m; a class reaches RATIO times as far as the one before it"""


class LandmarkKeys:
    """Gives every landmark of the sequence its key; one that was never placed is of the class 'l'."""

    def __init__(self) -> None:
        self._letter: dict[int, str] = {}

    def place(self, landmark: int, distance: float) -> None:
        """Says how far away (m) a landmark is when it enters the graph; its key is fixed from then on."""
        steps = np.log(max(distance, NEAREST) / NEAREST) / np.log(RATIO)
        self._letter[landmark] = LETTERS[min(int(steps), len(LETTERS) - 1)]

    def __call__(self, landmark: int) -> int:
        """The key of a landmark, by its index in the sequence."""
        return int(gtsam.symbol(self._letter.get(landmark, UNPLACED), landmark))


def pose_key(frame: int) -> int:
    """The key of the pose of a frame."""
    return int(gtsam.symbol("x", frame))


def landmark_of(key: int) -> int | None:
    """The landmark that a key stands for; None for a pose."""
    symbol = gtsam.Symbol(key)
    return None if chr(symbol.chr()) == "x" else int(symbol.index())


def thresholds(position: float, rotation: float, landmark: float) -> gtsam.ISAM2ThresholdMap:
    """Relinearisation thresholds: of poses in m and rad, of landmarks as a share of their distance."""
    by_letter = gtsam.ISAM2ThresholdMap()
    by_letter.insert(("x", np.array([rotation] * 3 + [position] * 3)))
    by_letter.insert((UNPLACED, np.full(3, landmark * NEAREST)))
    for i, letter in enumerate(LETTERS):
        by_letter.insert((letter, np.full(3, landmark * NEAREST * RATIO**i)))
    return by_letter
