"""Images to tracks: pairs, or images of one camera, are read, rectified and tracked one at a time."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fgbaseline.geometry import Camera, FloatArray, InputError, MonocularCamera, se3

from ..estimators.estimate import Progress
from ..formats.inertial.ground_truth import inertial_truth
from ..formats.inertial.imu_attachment import attach_imu
from ..formats.recordings.ground_truth import attach_truth
from ..formats.recordings.npz_writer import write_npz, write_tracks
from ..observations import BoolArray, Observations
from ..sequence import Sequence, Truth
from ..wording import plural
from .monocular_tracker import MonocularTracker
from .rectification import Image, rectify
from .rotation_prediction import rotation_between
from .settings import TrackerSettings
from .sources import ImageOptions, ImageRecording, open_recording
from .sources.image_recording import TruthFile
from .stereo_tracker import StereoTracker
from .thumbnails import Pictures
from .track_file import TrackFile

NAMED = 4
"""unreadable images that a remark names"""


@dataclass(frozen=True, eq=False, slots=True)
class TrackedRecording:
    """Tracks of a recording of images, over the frames whose images could be read."""

    recording: ImageRecording
    """recording of images, with t, velocities and truth of these frames"""
    camera: Camera
    """rectified"""
    imu_T_cam: FloatArray
    """(4, 4) of the rectified left camera, where the recording's extrinsic is known"""
    tracks: TrackFile
    left_out: tuple[int, ...] = ()
    """frames without readable images"""

    @property
    def n_landmarks(self) -> int:
        """Number of tracks."""
        return self.tracks.n_landmarks

    @property
    def observations(self) -> Observations:
        """Observations of the tracks, read from their file."""
        return self.tracks.observations()

    @property
    def no_motion(self) -> str | None:
        """Sentence on missing motion data and the options that add it; None if nothing is missing."""
        return _no_motion(self.recording)

    def sequence(self, truth: TruthFile | None = None) -> Sequence:
        """The recording with its motion, and the truth of a file or else its own.

        Its observations are in memory. Raises InputError where it has no motion, or the pose of the camera on the IMU
        is not known.
        """
        return self._sequence(truth, self.observations)

    def _sequence(self, truth: TruthFile | None, observations: Observations) -> Sequence:
        r = self.recording
        _require_motion(r)
        T = len(r.t)
        linear, angular = (np.zeros((T, 3)), np.zeros((T, 3))) if r.velocities is None else r.velocities
        sequence = Sequence(
            name=r.name,
            t=r.t,
            linear_velocity=linear,
            angular_velocity=angular,
            camera=self.camera,
            imu_T_cam=self.imu_T_cam,
            observations=observations,
            n_landmarks=self.n_landmarks,
            truth=r.truth if isinstance(r.truth, Truth) else None,
            up_imu=r.up_imu,
            form=r.form,
            source=r.source,
            remarks=r.remarks,
            time_unit_given=True,
            left_out=self.left_out,
        )
        if r.imu is not None:
            sequence = attach_imu(sequence, r.imu, r.imu_source, velocities=False)
        if truth is not None:
            return attach_truth(sequence, truth.path, truth.body)
        if isinstance(r.truth, TruthFile):
            sequence = attach_truth(sequence, r.truth.path, r.truth.body)
            if r.body_T_imu is not None and sequence.truth is not None:
                # velocity and biases of the file are those of the body
                poses, source = sequence.truth.world_T_imu @ r.body_T_imu, sequence.truth.source
                inertial = sequence.imu is not None
                own = inertial_truth(poses, source) if inertial else Truth.from_any_world(poses, source=source)
                sequence = sequence.with_truth(own)
        return sequence

    def write(self, path: Path, *, force: bool = True) -> None:
        """Writes the tracks as npz: a recording, or without motion what there is of it.

        Raises InputError, also where the file exists and `force` is false.
        """
        if self.no_motion is None:
            write_npz(self._sequence(None, Observations.none()), path, tracks=self.tracks, force=force)
        else:
            imu_T_cam = self.imu_T_cam if self.recording.extrinsic_known else None
            write_tracks(path, self.recording.t, self.camera, self.tracks, imu_T_cam, force=force)


def track(
    path: Path,
    options: ImageOptions = ImageOptions(),  # noqa: B008
    settings: TrackerSettings = TrackerSettings(),  # noqa: B008
    progress: Progress | None = None,
    *,
    motion: bool = False,
    pictures: Pictures | None = None,
) -> TrackedRecording:
    """Tracks of the recording of images at `path`: `opened_images` and `track_images` in one call."""
    return track_images(opened_images(path, options, motion=motion), settings, progress, pictures)


def opened_images(
    path: Path, options: ImageOptions, *, motion: bool = False, truth: TruthFile | None = None
) -> ImageRecording:
    """Recording of images at `path`, none of them read.

    Raises InputError for what is missing, and for motion and truth that `TrackedRecording.sequence` would refuse. With
    `motion` there has to be one.
    """
    recording = open_recording(path, options)
    if motion:
        _require_motion(recording)
    if _no_motion(recording) is None:
        rectified = rectify(recording.left, recording.right)
        TrackedRecording(recording, rectified.camera, rectified.imu_T_cam, TrackFile()).sequence(truth)
    return recording


def track_images(
    recording: ImageRecording, settings: TrackerSettings, progress: Progress | None, pictures: Pictures | None
) -> TrackedRecording:
    """Tracks of a recording of images; `progress` gets the number of frames done, and of all.

    `pictures` gets the rectified images. Frames with an unreadable image are left out, counted and named. Raises
    InputError for images that do not fit.
    """
    rectified, T = rectify(recording.left, recording.right), len(recording.t)
    camera, one = rectified.camera, recording.right is None
    tracker = (
        MonocularTracker(camera, settings) if isinstance(camera, MonocularCamera) else StereoTracker(camera, settings)
    )
    kept: list[int] = []
    unreadable: list[str] = []
    tracks = TrackFile()
    for k, pair in enumerate(recording.pairs()):
        images = [image for image in pair[:2] if image is not None]
        if len(images) < (1 if one else 2):
            unreadable.append(pair.name)
            continue
        _require_size(images, recording, pair.name)
        shown = rectified(*images)
        turn = rotation_between(recording, rectified.imu_T_cam[:3, :3], kept[-1], k) if kept else None
        points = tracker.step(*shown, rotation=turn)
        if pictures is not None:
            pictures.add(len(kept), float(recording.t[k]), *shown)
        kept.append(k)
        tracks.append(points)
        if progress is not None:
            progress(k + 1, T)
    unit = "image" if one else "pair"
    if len(kept) < 2:
        raise InputError(f"{recording.source}: {plural(len(kept), unit)} of {T} can be read; check the images")
    if tracks.n_landmarks == 0:
        exchanged = "" if recording.right is None else "left and right are not exchanged and that "
        raise InputError(
            f"{recording.source}: no point is tracked from one {unit} to the next; check that {exchanged}the "
            "calibration is that of these images"
        )
    is_kept = np.zeros(T, dtype=np.bool_)
    is_kept[kept] = True
    left_out = tuple(np.flatnonzero(~is_kept).tolist())
    recording = _of_frames(recording, is_kept)
    if unreadable:
        names = ", ".join(unreadable[:NAMED]) + (" and more" if len(unreadable) > NAMED else "")
        text = f"{plural(len(unreadable), unit)} of {T} cannot be read: {names}; left out."
        recording = replace(recording, remarks=(*recording.remarks, text))
    return TrackedRecording(recording, rectified.camera, rectified.imu_T_cam, tracks, left_out)


def _require_motion(r: ImageRecording) -> None:
    """Raises InputError where a recording has no motion, or the pose of the camera on the IMU is not known."""
    if (why := _no_motion(r)) is not None:
        raise InputError(f"{r.source}: {why}")


def _no_motion(r: ImageRecording) -> str | None:
    """Sentence on missing motion data and the options that add it; None if nothing is missing."""
    absent = f"{', '.join(r.absent)} missing: " if r.absent else ""
    if r.right is None and r.imu is None:
        scale = "its images are of one camera, and only raw inertial samples determine the scale"
        return f"{absent}{scale}; add --imu CSV"
    if r.velocities is None and r.imu is None:
        return f"{absent}it has images and no motion; add --imu CSV or --velocities CSV"
    if not r.extrinsic_known:
        return f"{absent}the pose of its left camera on the IMU is not known; add --extrinsic FILE"
    return None


def _require_size(images: list[Image], recording: ImageRecording, name: str) -> None:
    for image, camera in zip(images, filter(None, (recording.left, recording.right)), strict=True):
        height, width = image.shape
        if (width, height) != camera.size:
            raise InputError(
                f"{name}: the image has {width}x{height} px and the calibration {camera.size[0]}x{camera.size[1]}; "
                "give the calibration of these images"
            )


def _of_frames(recording: ImageRecording, kept: BoolArray) -> ImageRecording:
    """The recording of the frames that are kept; the first of them takes the place of frame 0."""
    truth, up = recording.truth, recording.up_imu
    if isinstance(truth, Truth) and not kept.all():
        truth = truth.of_frames(kept)
        if recording.imu is None and truth.known[0]:
            truth = truth.transformed(se3.inverse(truth.world_T_imu[0]))  # the world is the IMU at the first frame
    velocities = recording.velocities
    if velocities is not None:
        velocities = velocities[0][kept], velocities[1][kept]
    turn = rotation_between(recording, np.eye(3), 0, int(np.argmax(kept)))
    if up is not None and turn is not None:
        up = turn @ up
    return replace(recording, t=recording.t[kept], velocities=velocities, truth=truth, up_imu=up)
