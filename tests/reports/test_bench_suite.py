"""A suite is checked before anything runs, and its jobs are known by what decides their result."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from fgbaseline.data import write_npz
from fgbaseline.data.simulate import Simulation, simulate
from fgbaseline.geometry import InputError
from fgbaseline.reports.bench import worker
from fgbaseline.reports.bench.plan import plan
from fgbaseline.reports.bench.suite import read_suite
from fgbaseline.reports.results.bench import Planned

from ..builders.benches import N_RUNS, SUITE, written

DRIVE = '[[sequence]]\nname = "town"\nsimulate = { duration = 2 }\n'
FILE = '[[sequence]]\nfiles = "drive.npz"\n'


def planned(folder: Path, text: str, data: Path | None = None) -> list[Planned]:
    return plan(read_suite(written(folder, text)), data)


SEQUENCE = 'name = "x"\n[[sequence]]\n'


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """`drive.npz` in the folder of the suite."""
    path = tmp_path / "drive.npz"
    write_npz(simulate(Simulation(duration=1.0, features_per_frame=5.0)), path)
    return path


@pytest.mark.parametrize(
    ("text", "place", "said"),
    [
        ('name = "x"\nestimator = ["ekf"]\n' + DRIVE, "there is no key 'estimator'", "did you mean 'estimators'?"),
        ('name = "x"\nestimators = [\n "ekf",\n "kalman",\n]\n' + DRIVE, "estimators[1]", "no 'kalman'; installed are"),
        ('name = "x"\nestimators = ["ekf", "ekf"]\n' + DRIVE, "estimators", "'ekf' is named twice"),
        (SEQUENCE, "sequence[0]", "give files or simulate"),
        ('name = "x"\n' + DRIVE + 'files = "drive.npz"\n', "sequence[0]", "give files or simulate"),
        (SEQUENCE + 'files = ["drive.npz", "drive_2.npz"]\n', "sequence[0].files[1]", "'drive_2.npz' is not a file in"),
        (SEQUENCE + 'files = "kitti/*.mat"\n', "sequence[0].files", "'kitti/*.mat' matches no file in"),
        (SEQUENCE + 'files = "suite.toml"\n', "sequence[0].files", "a text file and no recording"),
        ('name = "x"\n' + FILE + 'truth = "poses.txt"\n', "sequence[0]", "truth and truth_frame"),
        ('name = "x"\n' + FILE + 'truth = "poses.txt"\ntruth_frame = "imu"\n', "sequence[0].files[0]", "poses.txt"),
        ('name = "x"\n' + FILE + "seeds = [1, 2]\n", "sequence[0]", "seeds are for simulated drives"),
        ('name = "x"\n' + DRIVE + "seeds = [1, 1]\n", "sequence[0]", "a seed is given twice"),
        ('name = "x"\n' + DRIVE + 'truth = "t.txt"\n', "sequence[0]", "truth is for recordings"),
        (SEQUENCE + 'simulate = { path = "moon" }\n', "sequence[0].simulate.path", 'path = "moon"'),
        (SEQUENCE + "simulate.duration = [1, 0]\n", "sequence[0].simulate.duration", "expected a number above 0"),
        (
            SEQUENCE + "simulate.duration = { from = 5, to = 1, steps = 3 }\n",
            "sequence[0].simulate.duration",
            "smaller",
        ),
        (
            'name = "x"\n' + DRIVE + '[sweep]\npreset = "documented"\nnoise = "assumed"\n',
            "sweep.noise",
            "the calibrated preset only",
        ),
        ('name = "x"\n' + DRIVE + '[sweep]\nlandmarks = "held"\n', "sweep.landmarks", "the documented preset only"),
        ('name = "x"\n' + DRIVE + "[sweep]\nfeatures = [200, 200]\n", "sweep.features[1]", "200 is given twice"),
        ('name = "x"\n' + DRIVE + "[sweep]\nfeatures = 0\n", "sweep.features = 0", "change it"),
        ('name = "x"\n' + DRIVE + "[sweep]\nheld_out = 1.0\n", "sweep.held_out = 1.0", "change it"),
        ('name = "x"\n' + DRIVE + DRIVE, "sequence[1]", "'town' is the name of sequence[0] too"),
        ('name = "a/b"\n' + DRIVE, "name", "no slashes"),
    ],
)
def test_an_invalid_setting_is_refused_with_its_key_path(drive: Path, text: str, place: str, said: str) -> None:
    with pytest.raises(InputError) as error:
        planned(drive.parent, text)
    assert f"suite.toml: {place}" in str(error.value)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_repairs_that_a_preset_would_not_use_are_refused(drive: Path) -> None:
    (drive.parent / "repairs.toml").write_text("velocity_scale = 1.0\n")
    text = 'name = "x"\n' + FILE + 'repairs = "repairs.toml"\n'
    assert len(planned(drive.parent, text)) == 1
    for sweep, said in (
        ('preset = ["calibrated", "documented"]', "the documented preset uses no repairs"),
        ('noise = "assumed"', 'noise = "assumed" uses no repairs'),
        ("noise = { pixel = 1.0 }", "[sweep] sets the noise too"),
    ):
        with pytest.raises(InputError, match=r"suite\.toml: sequence\[0\]\.repairs: ") as error:
            planned(drive.parent, f"{text}[sweep]\n{sweep}\n")
        assert said in str(error.value)


def test_every_combination_is_a_job_with_a_name_of_its_own(tmp_path: Path) -> None:
    jobs = planned(tmp_path, SUITE)
    names = [job.name for job in jobs]
    assert names == [
        "town seed=1",
        "town seed=2",
        "room features_per_frame=8",
        "room features_per_frame=12",
    ]
    assert len({job.job.key for job in jobs}) == N_RUNS
    assert [job.case for job in jobs[:2]] == ["town"] * 2


def test_a_preset_is_not_multiplied_by_settings_that_it_does_not_use(tmp_path: Path) -> None:
    sweep = (
        '[sweep]\npreset = ["calibrated", "documented"]\nnoise = ["estimated", { pixel = 1.0 }]\n'
        'landmarks = ["in-turn", "held"]\nfeatures = [20, "all"]\n'
    )
    jobs = planned(tmp_path, 'name = "x"\n' + DRIVE + sweep)
    assert sorted(job.job.preset for job in jobs) == ["calibrated"] * 4 + ["documented"] * 4
    assert len({job.name for job in jobs}) == 8


def test_ranges_go_from_end_to_end(tmp_path: Path) -> None:
    text = 'name = "x"\n[[sequence]]\nsimulate = { duration = 2, sigma_pixel = { from = 0.5, to = 2.0, steps = 4 } }\n'
    assert [job.name.partition("=")[2] for job in planned(tmp_path, text)] == ["0.5", "1", "1.5", "2"]


def test_a_job_is_identified_by_content_and_not_by_paths(drive: Path) -> None:
    here = planned(drive.parent, 'name = "x"\n' + FILE)[0].job
    elsewhere = drive.parent / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "other.npz").write_bytes(drive.read_bytes())
    text = 'name = "y"\n[[sequence]]\nname = "z"\nfiles = "*.npz"\n'
    assert planned(drive.parent, text, elsewhere)[0].job.key == here.key
    write_npz(simulate(Simulation(duration=1.0, features_per_frame=5.0, seed=1)), elsewhere / "other.npz")
    assert planned(drive.parent, text, elsewhere)[0].job.key != here.key


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 9},
        {"preset": "documented"},
        {"features": 30},
        {"noise": {"pixel": 1.0}},
        {"landmarks": "held"},
        {"held_out": 0.2},
        {"estimators": ("ekf",)},
        {"page": "figures"},
        {"code": "of tomorrow"},
    ],
)
def test_every_setting_is_part_of_the_key(tmp_path: Path, change: dict[str, object]) -> None:
    job = planned(tmp_path, 'name = "x"\n' + DRIVE)[0].job
    assert replace(job, **change).key != job.key  # type: ignore[arg-type]


def test_a_change_to_our_source_makes_it_another_job_and_one_to_the_reports_page_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rooms = {}
    for room in (*(f"fgbaseline.{name}" for name in worker.ROOMS), "fgbaseline.reports"):
        rooms[room] = tmp_path / room
        (rooms[room] / "bench").mkdir(parents=True)
        (rooms[room] / "html").mkdir()
        for name in ("bench/worker.py", "html/table.py", "filter.py"):
            (rooms[room] / name).write_text("x = 1\n")
        (rooms[room] / "figures").mkdir()
    monkeypatch.setattr(worker, "_folder", rooms.__getitem__)
    code: Callable[[bool], str] = lambda pages: worker.code_hash.__wrapped__(("ekf",), pages)  # noqa: E731
    before = code(False), code(True)
    (rooms["fgbaseline.reports"] / "html" / "table.py").write_text("x = 2\n")
    assert code(False) == before[0]
    assert code(True) != before[1]
    (rooms["fgbaseline.ekf"] / "filter.py").write_text("x = 2\n")
    assert code(False) != before[0]


@pytest.mark.parametrize("name", ["quick", "consistency"])
def test_the_shipped_suites_can_be_planned(name: str) -> None:
    suite = read_suite(Path(__file__).parents[2] / "suites" / f"{name}.toml")
    assert suite.content.name == name
    assert len(plan(suite, None)) >= 5
