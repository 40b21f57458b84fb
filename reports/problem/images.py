"""Images to tracks for a run and for `fgbaseline track`, with progress."""

from pathlib import Path

import click

from fgbaseline.data.formats.files.atomic_write import require_new
from fgbaseline.data.formats.files.file_errors import shown
from fgbaseline.data.formats.files.toml_file import read_toml
from fgbaseline.data.tracking import (
    ImageOptions,
    Pictures,
    TrackedRecording,
    TrackerSettings,
    has_images,
    opened_images,
    track_images,
)
from fgbaseline.data.tracking.sources.image_recording import TruthFile
from fgbaseline.data.wording import plural
from fgbaseline.geometry import InputError

from ..progress import reporter


def tracked(
    source: Path,
    options: ImageOptions,
    settings: Path | None,
    *,
    motion: bool = False,
    truth: TruthFile | None = None,
    pictures: Pictures | None = None,
) -> TrackedRecording:
    """Tracks of a recording of images, whose pairs `pictures` gets, with progress on standard error.

    `truth` is that of the sequence to be made of it, which is checked before the images are read. Raises InputError.
    """
    chosen = TrackerSettings() if settings is None else read_toml(settings, TrackerSettings).content
    # Bad input is refused before progress is printed.
    recording = opened_images(source, options, motion=motion, truth=truth)
    with reporter().estimator("tracking") as progress:
        return track_images(recording, chosen, progress, pictures)


def write_tracks(source: Path, out: Path, options: ImageOptions, settings: Path | None, *, force: bool) -> int:
    """Tracks the images in `source` and writes `out`; prints what was found. Raises InputError."""
    if not has_images(source):
        raise InputError(f"{shown(source)}: this is neither a folder of images nor a bag; check the path")
    if out.suffix != ".npz":
        raise InputError(f"{shown(out)}: tracks are written as .npz; give a name that ends with it")
    require_new(out, force=force)
    found = tracked(source, options, settings)
    found.write(out, force=force)
    n, T = len(found.tracks), len(found.recording.t)
    for remark in found.recording.remarks:
        click.echo(remark)
    click.echo(
        f"{found.recording.name}: {plural(T, 'frame')}, {plural(found.n_landmarks, 'track')}, "
        f"{n / T:.0f} observations a frame, {n / max(found.n_landmarks, 1):.1f} frames a track"
    )
    if found.no_motion is not None:
        click.echo(f"fgbaseline run cannot use them as they are: {found.no_motion}.")
    click.echo(f"The tracks are in {out}")
    return 0
