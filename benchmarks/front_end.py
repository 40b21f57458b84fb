"""Time and memory of the stereo front end, beside the time of OpenCV's own calls in the same run.

python -m benchmarks.front_end FOLDER [--frames N]
"""

import argparse
import resource
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from fgbaseline.data.tracking import StereoTracker, TrackerSettings
from fgbaseline.data.tracking.rectification import rectify
from fgbaseline.data.tracking.sources import ImageRecording, open_recording
from fgbaseline.geometry import StereoCamera

CALLS = (
    "imdecode", "remap", "resize", "blur", "multiply", "add", "cornerMinEigenVal", "circle", "dilate",
    "calcOpticalFlowPyrLK", "solvePnPRansac", "solvePnPRefineLM",
)  # fmt: skip


class Timed:
    """CPU time of all calls of a function."""

    seconds = 0.0

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        begin = time.process_time()
        result = self.function(*arguments, **named)
        Timed.seconds += time.process_time() - begin
        return result


def repeated(recording: ImageRecording, frames: int) -> Iterator[Any]:
    """Pairs of a recording, forward and back until there are `frames` of them."""
    pairs = list(recording.pairs())
    return islice(cycle([*pairs, *pairs[-2:0:-1]]), frames)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--frames", type=int, default=0)
    parser.add_argument("--threads", type=int, default=1, help="of OpenCV")
    given = parser.parse_args()
    cv2.setNumThreads(given.threads)
    recording = replace(open_recording(given.folder), imu=None)
    rectified = rectify(recording.left, recording.right)
    for name in CALLS:
        setattr(cv2, name, Timed(getattr(cv2, name)))
    assert isinstance(rectified.camera, StereoCamera)
    tracker = StereoTracker(rectified.camera, TrackerSettings())
    pairs = repeated(recording, given.frames) if given.frames else recording.pairs()
    begin, counts = time.process_time(), []
    for pair in pairs:
        assert pair.left is not None
        assert pair.right is not None
        tracks = tracker.step(*rectified(pair.left, pair.right))
        counts.append(len(tracks.number))
    spent, n = time.process_time() - begin, len(counts)
    width, height = recording.left.size
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"{given.folder.name}: {n} pairs of {width} x {height}, {np.mean(counts):.0f} observations a frame; "
        f"{1e3 * spent / n:.1f} ms of CPU a pair ({n / spent:.0f} a second), {spent / Timed.seconds:.2f} times "
        f"OpenCV's own calls; peak memory {peak:.0f} MB"
    )


if __name__ == "__main__":
    main()
