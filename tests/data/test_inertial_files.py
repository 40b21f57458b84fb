"""Raw inertial samples in files: EuRoC's CSV and YAML, npz, exported problems; what cannot be used is refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fgbaseline import data
from fgbaseline.data.formats.inertial.imu_csv import read_imu_csv
from fgbaseline.data.formats.inertial.imu_yaml import read_imu_calibration
from fgbaseline.data.formats.inertial.velocity_csv import read_velocity_csv
from fgbaseline.data.imu import ASSUMED_NOISE, ImuNoise
from fgbaseline.data.problem.imu_gaps import interval_densities, sample_gaps
from fgbaseline.data.problem.inertial import imu_intervals
from fgbaseline.data.problem_export import layout, write_problem
from fgbaseline.geometry import InputError, se3

from ..builders.inertial import inertial_problem
from ..builders.inertial_paths import NOISE, inertial_recording, turn
from .test_problem_export import assert_equal

HEADER = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],"
    "a_RS_S_z [m s^-2]"
)
PLAIN = "t,wx,wy,wz,ax,ay,az"
YAML = """%YAML:1.0
sensor_type: imu
T_BS:
  cols: 4
  rows: 4
  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
rate_hz: 200
gyroscope_noise_density: 1.6968e-04 # [ rad / s / sqrt(Hz) ]
gyroscope_random_walk: 1e-5
accelerometer_noise_density: 2.0e-3
accelerometer_random_walk: 3.0000e-3
"""


def rows(n: int = 40, start_ns: int = 1_403_638_128_000_000_000, **changes: Any) -> list[list[str]]:
    """Samples at 100 Hz, as words."""
    return [[str(start_ns + k * 10_000_000), "0.01", "-0.02", "0.03", "0.1", "0.2", "9.8"] for k in range(n)]


def written(path: Path, lines: list[list[str]], header: str = HEADER) -> Path:
    path.write_text("\n".join([header, *(",".join(line) for line in lines)]) + "\n")
    return path


def test_eurocs_samples_are_read_by_their_header(tmp_path: Path) -> None:
    lines = rows()
    samples = read_imu_csv(written(tmp_path / "data.csv", lines), NOISE, 9.81).samples
    assert len(samples) == 40
    np.testing.assert_allclose(np.diff(samples.t), 0.01, rtol=1e-4)
    np.testing.assert_array_equal(samples.specific_force[0], [0.1, 0.2, 9.8])
    swapped = HEADER.split(",")
    order = [0, 4, 5, 6, 1, 2, 3]
    other = written(
        tmp_path / "b.csv", [[line[i] for i in order] for line in lines], ",".join(swapped[i] for i in order)
    )
    again = read_imu_csv(other, NOISE, 9.81).samples
    np.testing.assert_array_equal(again.specific_force, samples.specific_force)
    np.testing.assert_array_equal(again.angular_velocity, samples.angular_velocity)


def test_an_export_of_ros_is_read_by_the_stamp_of_its_header(tmp_path: Path) -> None:
    names = [f"field.{name}.{axis}" for name in ("angular_velocity", "linear_acceleration") for axis in "xyz"]
    header = ",".join(["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id", *names])
    lines = [[str(int(line[0]) + 7_000_000), "3", line[0], "imu", *line[1:]] for line in rows()]
    samples = read_imu_csv(written(tmp_path / "ros.csv", lines, header), NOISE, 9.81).samples
    expected = read_imu_csv(written(tmp_path / "euroc.csv", rows()), NOISE, 9.81).samples
    assert_equal(expected, samples, "imu")


@pytest.mark.parametrize("interval", [10.0**exponent for exponent in range(-9, 10)])
def test_stamps_of_any_interval_are_read_or_refused_in_one_sentence(interval: float, tmp_path: Path) -> None:
    t = 7.0 + interval * np.arange(40)
    stamped = [[f"{s:.17g}", *line[1:]] for s, line in zip(t, rows(), strict=True)]
    samples = written(tmp_path / "imu.csv", stamped, PLAIN)
    velocities = tmp_path / "velocities.csv"
    velocities.write_text("\n".join(f"{s:.17g} 1 0 0 0 0 0.1" for s in t))

    def read_samples() -> None:
        assert 5e-5 <= float(np.median(np.diff(read_imu_csv(samples, NOISE, 9.81).samples.t))) <= 1e4

    def read_velocities() -> None:
        factor = next(f for f in (1.0, 1e-3, 1e-6, 1e-9) if interval * f < 20.0)
        read_velocity_csv(velocities, t * factor)

    for read in (read_samples, read_velocities):
        if interval < 5e-5:
            with pytest.raises(InputError, match=r"csv: its time stamps are 1e-0\d apart, .* write seconds$"):
                read()
        else:
            read()


def test_units_of_a_header_are_converted(tmp_path: Path) -> None:
    header = HEADER.replace("rad s^-1", "deg s^-1")
    read = read_imu_csv(written(tmp_path / "data.csv", rows(), header), NOISE, 9.81)
    np.testing.assert_allclose(read.samples.angular_velocity[0], np.deg2rad([0.01, -0.02, 0.03]))
    assert "deg s^-1" in read.remarks[0]


KALIBR = """imu0:
  accelerometer_noise_density: 2.0e-3
  accelerometer_random_walk: 3.0e-3
  gyroscope_noise_density: 1.6968e-04
  gyroscope_random_walk: 1.0e-5
  update_rate: 200.0
"""


@pytest.mark.parametrize("text", [YAML, KALIBR, KALIBR.replace("imu0:\n", "").replace("  ", "")])
def test_noise_of_euroc_and_of_kalibr(text: str, tmp_path: Path) -> None:
    (tmp_path / "sensor.yaml").write_text(text)
    found = read_imu_calibration(tmp_path / "sensor.yaml")
    assert found.noise == ImuNoise(1.6968e-4, 1e-5, 2e-3, 3e-3)
    assert found.gravity == 9.81


BAD_YAML = {
    "density of zero": (YAML.replace("1.6968e-04", "0.0"), "gyroscope_density is 0.0"),
    "a walk below zero": (YAML.replace("3.0000e-3", "-1"), "accelerometer_walk is -1.0"),
    "no number": (YAML.replace("1e-5", "small"), "gyroscope_random_walk: expected a number"),
    "a key missing": (YAML.replace("gyroscope_random_walk: 1e-5\n", ""), "gyroscope_random_walk is missing"),
    "a camera's file": ("sensor_type: camera\nrate_hz: 20\n", "not that of a camera"),
    "no yaml": ("a: [1, 2\nb: }", "it is not YAML"),
    "a list": ("- 1\n- 2\n", "it has no keys"),
}


@pytest.mark.parametrize("case", BAD_YAML)
def test_a_bad_calibration_is_refused_in_one_sentence(case: str, tmp_path: Path) -> None:
    text, message = BAD_YAML[case]
    (tmp_path / "sensor.yaml").write_text(text)
    with pytest.raises(InputError, match=r"sensor\.yaml: ") as caught:
        read_imu_calibration(tmp_path / "sensor.yaml")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def backward(lines: list[list[str]]) -> list[list[str]]:
    return [*lines[:10], lines[5], *lines[10:]]


def with_nan(lines: list[list[str]]) -> list[list[str]]:
    lines[7][5] = "nan"
    return lines


def without_gravity(lines: list[list[str]]) -> list[list[str]]:
    return [[*line[:4], "0.01", "0.02", "-0.01"] for line in lines]


def short(lines: list[list[str]]) -> list[list[str]]:
    return [line[:5] for line in lines]


BAD_CSV = {
    backward: "stamps must rise",
    with_nan: "line 9: 'nan' is not a finite number",
    without_gravity: "gravity was taken off",
    short: "5 numbers",
}


@pytest.mark.parametrize("change", BAD_CSV)
def test_bad_samples_are_refused_in_one_sentence(change: Any, tmp_path: Path) -> None:
    header = HEADER if change is not short else ",".join(HEADER.split(",")[:5])
    path = written(tmp_path / "imu.csv", change(rows()), header)
    message = "names no acceleration y" if change is short else BAD_CSV[change]
    with pytest.raises(InputError, match=r"imu\.csv: ") as caught:
        read_imu_csv(path, NOISE, 9.81)
    assert message in str(caught.value)


def test_doubled_samples_are_counted_and_left_out(tmp_path: Path) -> None:
    lines = rows()
    read = read_imu_csv(written(tmp_path / "imu.csv", [*lines[:5], lines[4], *lines[5:]]), NOISE, 9.81)
    assert len(read.samples) == 40
    assert [(f.code, f.before) for f in read.findings] == [("doubled_samples", 1)]


@pytest.fixture(scope="module")
def recording() -> data.Sequence:
    return inertial_recording(turn, n_frames=12)


def test_an_npz_gives_every_number_back(recording: data.Sequence, tmp_path: Path) -> None:
    data.write_npz(recording, tmp_path / "a.npz")
    read = data.read(tmp_path / "a.npz")
    assert recording.imu is not None
    assert_equal(recording.imu, read.imu, "imu")
    assert_equal(recording.truth, read.truth, "truth")
    assert_equal(recording.observations, read.observations, "observations")
    data.write_npz(read, tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def rewritten(recording: data.Sequence, path: Path, **changes: Any) -> Path:
    """The npz of a recording with some arrays changed, or left out where they are None."""
    data.write_npz(recording, path)
    with np.load(path) as archive:
        arrays = {key: archive[key] for key in archive.files} | changes
    np.savez(path, **{key: array for key, array in arrays.items() if array is not None})
    return path


def test_noise_and_gravity_have_defaults_and_a_remark(recording: data.Sequence, tmp_path: Path) -> None:
    read = data.read(rewritten(recording, tmp_path / "a.npz", imu_noise=None, gravity=None))
    assert read.imu is not None
    assert (read.imu.noise, read.imu.gravity) == (ASSUMED_NOISE, 9.81)
    assert any("are assumed" in remark for remark in read.remarks)


def test_stamps_of_samples_follow_the_unit_of_the_frames(recording: data.Sequence, tmp_path: Path) -> None:
    data.write_npz(recording, tmp_path / "s.npz")
    with np.load(tmp_path / "s.npz") as archive:
        stamps = {key: 1e3 * archive[key] for key in ("time_stamps", "imu_time_stamps")}
    read = data.read(rewritten(recording, tmp_path / "ms.npz", **stamps), time_unit=data.TimeUnit.MS)
    assert recording.imu is not None
    assert read.imu is not None
    np.testing.assert_allclose(read.imu.t, recording.imu.t, atol=1e-12)


STAMPS = [(1.0, 1e3), (1.0, 1e6), (1.0, 1e9), (1e3, 1e3), (1e6, 1e6), (1e9, 1e9), (1e3, 1.0), (1e9, 1.0)]


@pytest.mark.parametrize(("of_frames", "of_samples"), STAMPS)
@pytest.mark.parametrize("epoch", [0.0, 1_403_636_579.0])
def test_units_of_frames_and_samples_are_found_and_reported(
    of_frames: float, of_samples: float, epoch: float, recording: data.Sequence, tmp_path: Path
) -> None:
    assert recording.imu is not None
    frames, samples = of_frames * (recording.t + epoch), of_samples * (recording.imu.t + epoch)
    read = data.read(rewritten(recording, tmp_path / "a.npz", time_stamps=frames[None], imu_time_stamps=samples[None]))
    assert read.imu is not None
    assert read.n_frames == recording.n_frames
    precision = 1e-6 if epoch else 1e-9
    np.testing.assert_allclose(read.t - epoch, recording.t, atol=precision)
    np.testing.assert_allclose(read.imu.t - epoch, recording.imu.t, atol=precision)
    codes = {finding.code for finding in read.findings}
    assert ("imu_time_unit" in codes) == (of_frames != of_samples)
    assert ("time_unit" in codes) == (of_frames != 1.0)


def test_slow_keyframes_beside_samples_are_in_seconds(recording: data.Sequence, tmp_path: Path) -> None:
    assert recording.imu is not None
    stretch = 50.0 * np.arange(recording.n_frames) / (recording.n_frames - 1)
    samples = np.linspace(0.0, 50.0, len(recording.imu))
    read = data.read(rewritten(recording, tmp_path / "a.npz", time_stamps=stretch[None], imu_time_stamps=samples[None]))
    assert not read.findings
    np.testing.assert_array_equal(read.t, stretch)


def test_tracks_without_velocities_take_samples_from_a_file(recording: data.Sequence, tmp_path: Path) -> None:
    with_velocities(recording, tmp_path / "t.npz")
    with np.load(tmp_path / "t.npz") as archive:
        arrays = {key: archive[key] for key in archive.files if not key.endswith("velocity")}
    np.savez(tmp_path / "bare.npz", **arrays)
    read = data.read(tmp_path / "bare.npz", imu=imu_csv(recording, tmp_path / "imu.csv"))
    assert read.imu is not None
    assert any("has no velocities" in remark for remark in read.remarks)
    assert not any("are ignored" in remark for remark in read.remarks)
    with pytest.raises(InputError, match="linear_velocity is missing"):
        data.read(tmp_path / "bare.npz")


def test_body_velocities_beside_samples_are_ignored_and_reported(recording: data.Sequence, tmp_path: Path) -> None:
    zero = np.zeros((3, recording.n_frames))
    read = data.read(rewritten(recording, tmp_path / "a.npz", linear_velocity=zero, angular_velocity=zero))
    assert read.linear_velocity.shape == (0, 3)
    assert any("are ignored" in remark for remark in read.remarks)


BAD_KEYS: dict[str, tuple[dict[str, Any], str]] = {
    "noise of zero": ({"imu_noise": np.array([0.0, 1.0, 1.0, 1.0])}, "gyroscope_density is 0.0"),
    "noise beyond any sensor": ({"imu_noise": np.full(4, 1e9)}, "expected a number from 1e-09 to 1000"),
    "three densities": ({"imu_noise": np.ones(3)}, "imu_noise: expected 4 numbers"),
    "a negative gravity": ({"gravity": np.array(-9.81)}, "gravity: expected a positive number"),
    "no stamps": ({"imu_time_stamps": None}, "imu_time_stamps is missing, the time stamps of imu_angular_velocity and"),
    "another epoch": ({"imu_time_stamps": 1e9 + np.arange(10.0)[None]}, "imu_angular_velocity: expected shape (3, 10)"),
}


@pytest.mark.parametrize("case", BAD_KEYS)
def test_a_bad_array_is_refused_by_its_key(case: str, recording: data.Sequence, tmp_path: Path) -> None:
    changes, message = BAD_KEYS[case]
    with pytest.raises(InputError) as caught:
        data.read(rewritten(recording, tmp_path / "a.npz", **changes))
    assert message in str(caught.value)


def imu_csv(recording: data.Sequence, path: Path, offset: float = 0.0) -> Path:
    """The samples of a recording as EuRoC's CSV, their stamps moved by an offset in s."""
    imu = recording.imu
    assert imu is not None
    columns = np.column_stack([imu.angular_velocity, imu.specific_force])
    stamps = [round((t + offset + 1.0) * 1e9) for t in imu.t.tolist()]
    return written(path, [[str(s), *map(repr, row)] for s, row in zip(stamps, columns.tolist(), strict=True)])


def with_velocities(recording: data.Sequence, path: Path) -> Path:
    """The tracks of a recording with body velocities, one second later."""
    zero = np.zeros((recording.n_frames, 3))
    assert recording.truth is not None
    poses = se3.inverse(recording.truth.world_T_imu[0]) @ recording.truth.world_T_imu
    moved = replace(
        recording, t=recording.t + 1.0, linear_velocity=zero, angular_velocity=zero, imu=None, truth=data.Truth(poses)
    )
    data.write_npz(moved, path)
    return path


def test_samples_replace_the_velocities_of_tracks(recording: data.Sequence, tmp_path: Path) -> None:
    tracks, samples = with_velocities(recording, tmp_path / "t.npz"), imu_csv(recording, tmp_path / "imu.csv")
    read = data.read(tracks, imu=samples)
    assert read.n_frames == recording.n_frames
    assert any(str(samples) in remark for remark in read.remarks)
    assert any("are assumed" in remark for remark in read.remarks)
    with pytest.raises(InputError, match="add --imu"):
        data.read(tracks, imu_calibration=samples)


def test_stamps_of_samples_that_cannot_be_are_refused_by_their_cause(recording: data.Sequence, tmp_path: Path) -> None:
    assert recording.imu is not None
    clock = recording.imu.t + 1_403_636_579.0
    stray = np.append(0.0, clock[1:])
    cut = np.array([float(f"{stamp:.6g}") for stamp in clock])
    for stamps, message in (
        (stray, "the stamp of sample 0 is 0, while the next is 1403636578"),
        (clock.astype(np.float32).astype(np.float64), "their digits are lost: they went through a float32"),
        (cut, "their digits are lost: "),
    ):
        with pytest.raises(InputError) as caught:
            data.read(rewritten(recording, tmp_path / "a.npz", imu_time_stamps=stamps[None]))
        assert message in str(caught.value)


def test_frames_outside_the_samples_are_cut_and_counted(recording: data.Sequence, tmp_path: Path) -> None:
    tracks, samples = with_velocities(recording, tmp_path / "t.npz"), imu_csv(recording, tmp_path / "imu.csv", 0.75)
    read = data.read(tracks, imu=samples)
    assert read.n_frames == recording.n_frames - 3  # samples begin at 1.25 s, frames at 1.0, 1.1 and 1.2 s
    assert read.left_out == (0, 1, 2)
    found = next(f for f in read.findings if f.code == "frames_without_samples")
    assert found.before == 3
    assert "from 1.0 to" in found.sentence
    assert read.observations.frame.max() == read.n_frames - 1
    assert read.truth is not None
    assert len(read.truth.world_T_imu) == read.n_frames


def test_another_epoch_is_refused_with_both_ranges(recording: data.Sequence, tmp_path: Path) -> None:
    tracks, samples = with_velocities(recording, tmp_path / "t.npz"), imu_csv(recording, tmp_path / "imu.csv", 1e9)
    with pytest.raises(InputError) as caught:
        data.read(tracks, imu=samples)
    assert "the frames are from 1.0 to 2.1 s and the inertial samples from 1000000000.5 to" in str(caught.value)


def test_a_frame_within_a_period_of_the_last_sample_stays(recording: data.Sequence) -> None:
    imu = recording.imu
    assert imu is not None
    cut = imu_intervals(imu, np.append(recording.t[:-1], imu.t[-1] + 331e-9))
    assert cut.dt[-1] == pytest.approx(331e-9, rel=1e-6)
    np.testing.assert_array_equal(cut.specific_force[-1], imu.specific_force[-1])


def test_truth_may_begin_late(recording: data.Sequence, tmp_path: Path) -> None:
    truth = recording.truth
    assert truth is not None
    data.write_npz(recording, tmp_path / "a.npz")
    data.write_tum(tmp_path / "late.tum", recording.t[4:], truth.world_T_imu[4:])
    read = data.read(tmp_path / "a.npz", tmp_path / "late.tum", "imu")
    assert read.truth is not None
    np.testing.assert_array_equal(read.truth.known, np.arange(recording.n_frames) >= 4)
    np.testing.assert_allclose(read.truth.world_T_imu[5, :3, :3], truth.world_T_imu[5, :3, :3], atol=1e-8)


def test_eurocs_truth_has_velocity_and_biases(recording: data.Sequence, tmp_path: Path) -> None:
    """In the axes of the file, and of the frames that it has."""
    truth = recording.truth
    assert truth is not None
    assert truth.velocity is not None
    assert truth.gyroscope_bias is not None
    assert truth.accelerometer_bias is not None
    assert recording.imu is not None
    late = replace(recording, t=recording.t + 1.0e9, imu=replace(recording.imu, t=recording.imu.t + 1.0e9))
    data.write_npz(late, tmp_path / "a.npz")
    state = np.concatenate([truth.velocity, truth.gyroscope_bias, truth.accelerometer_bias], axis=1)
    data.write_euroc(tmp_path / "poses.csv", late.t, truth.world_T_imu)
    lines = (tmp_path / "poses.csv").read_text().splitlines()
    header = lines[0] + "," + ",".join(f"s{i}" for i in range(9))
    rows = [f"{line},{','.join(map(repr, row))}" for line, row in zip(lines[1:], state.tolist(), strict=True)]
    (tmp_path / "truth.csv").write_text("\n".join([header, *rows[3:]]) + "\n")
    read = data.read(tmp_path / "a.npz", tmp_path / "truth.csv", "imu").truth
    assert read is not None
    for name in ("velocity", "gyroscope_bias", "accelerometer_bias"):
        values = getattr(read, name)
        assert np.isnan(values[:3]).all()
        np.testing.assert_array_equal(values[3:], getattr(truth, name)[3:])


@pytest.mark.parametrize("gap", [0.0, 0.35])
def test_an_exported_problem_comes_back_to_the_bit(gap: float, tmp_path: Path) -> None:
    problem = inertial_problem(2, n_frames=12)
    sequence = replace(problem.sequence, up_imu=np.array([0.0, 0.6, 0.8]))
    if gap:
        imu = sequence.imu
        assert imu is not None
        kept = (imu.t < 0.52) | (imu.t > 0.52 + gap)
        imu = replace(
            imu,
            t=imu.t[kept],
            angular_velocity=imu.angular_velocity[kept],
            specific_force=imu.specific_force[kept],
        )
        sequence = replace(sequence, imu=imu)
        problem = replace(problem, imu=imu_intervals(imu, sequence.t))
    problem = replace(problem, sequence=sequence)
    write_problem(problem, tmp_path)
    expected = replace(problem, sequence=replace(sequence, truth=None))
    assert_equal(expected, data.read_problem(tmp_path), "problem")
    table = np.genfromtxt(tmp_path / layout.SAMPLES, delimiter=",", names=True)
    assert sequence.imu is not None
    np.testing.assert_array_equal(table["ax"], sequence.imu.specific_force[:, 0])
    assert not (tmp_path / layout.INCREMENTS).exists()


def test_a_gap_enlarges_the_noise_of_its_intervals_alone() -> None:
    """As much as bridging random gaps of that length errs elsewhere, within a factor of two in the mean."""
    problem = inertial_problem(0, n_frames=60)
    imu = problem.sequence.imu
    assert imu is not None
    errors, stated = [], []
    for start in np.arange(0.32, 5.2, 0.2).tolist():
        kept = (imu.t < start) | (imu.t > start + 0.4)
        holed = replace(
            imu, t=imu.t[kept], angular_velocity=imu.angular_velocity[kept], specific_force=imu.specific_force[kept]
        )
        assert len(sample_gaps(holed)) == 1
        densities = interval_densities(holed, problem.sequence.t)
        touched = (problem.sequence.t[1:] > start) & (problem.sequence.t[:-1] < start + 0.41)
        np.testing.assert_array_equal(densities[~touched], np.tile(imu.noise.densities, (int((~touched).sum()), 1)))
        assert (densities[touched][:, [0, 2]] >= imu.noise.densities[[0, 2]]).all()
        whole, bridged = (imu_intervals(s, problem.sequence.t) for s in (imu, holed))
        change = [(s.specific_force * s.dt[:, None]).sum(axis=0) for s in (whole, bridged)]
        errors.append(change[1] - change[0])
        stated.append(np.sum((densities[:, 2] ** 2 - imu.noise.accelerometer_density**2) * problem.sequence.dt))
    ratio = np.sqrt(np.mean(np.square(errors)) / np.mean(stated))
    assert 0.2 < ratio < 2.0


def test_the_documented_preset_refuses_raw_inertial_data(recording: data.Sequence) -> None:
    with pytest.raises(InputError, match="raw inertial data"):
        data.documented(recording)
