"""Figures show what the comparison says, look the same everywhere, and cope with whatever a run leaves."""

from dataclasses import replace
from functools import cache
from io import BytesIO
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from PIL import Image
from scipy.stats import chi2

from fgbaseline.compare.estimate_comparison import Run
from fgbaseline.data import Excluded, Observations
from fgbaseline.data.top_view import TopView
from fgbaseline.reports import figures
from fgbaseline.reports.figures.layout import lay_out
from fgbaseline.reports.figures.residuals import BANDS, observations_by_frame
from fgbaseline.reports.figures.run import figure_functions
from fgbaseline.reports.figures.run_data import of_run
from fgbaseline.reports.figures.style import ESTIMATOR_COLORS, SCREEN, in_style, safe_text

from ..builders.runs import answer, failed, partly_known, run_of, scene, standard_run
from ..builders.synthetic import plain_problem


@cache
def drawn_standard() -> dict[str, Figure]:
    """The figures of the standard run, drawn once: tests only look at them."""
    return figures.draw(standard_run())


def drawn(run: Run, *names: str) -> dict[str, Figure]:
    """Some of the figures of a run, as `figures.draw` draws them."""
    draw_one = figure_functions(of_run(run))
    with in_style():
        some = {name: figure for name in names if (figure := draw_one[name]()) is not None}
        for figure in some.values():
            lay_out(figure)
    return some


def lines(axes: Axes, label: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Abscissa and ordinate of the lines of a label."""
    return [
        (np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float))
        for line in axes.get_lines()
        if line.get_label() == label
    ]


def legend_texts(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def all_texts(figure: Figure) -> str:
    return "\n".join(text.get_text() for axes in figure.axes for text in axes.texts)


def test_every_figure_of_a_full_run_is_there_in_the_order_of_the_page() -> None:
    assert list(drawn_standard()) == [
        "paths_overlaid",
        "paths_side_by_side",
        "path_dead-reckoning",
        "path_ekf",
        "path_isam2",
        "divergence",
        "error_to_truth",
        "height",
        "reprojection_over_time",
        "reprojection_distribution",
        "nees",
        "time_per_frame",
        "consistency",
        "reprojection_classes",
        "image_regions",
        "map_difference",
        "three_sigma_dead-reckoning",
        "three_sigma_ekf",
        "three_sigma_isam2",
    ]


def test_divergence_panels_hold_the_columns_of_the_comparison() -> None:
    run = standard_run()
    panels = drawn_standard()["divergence"].axes
    table = run.results["ekf"].divergence
    assert table is not None
    for axes, column in zip(panels, ("position", "rotation_deg", "along", "across", "up"), strict=True):
        ((t, values),) = lines(axes, "ekf")
        np.testing.assert_allclose(t, run.problem.sequence.t - run.problem.sequence.t[0])
        np.testing.assert_array_equal(values, table[column])
        assert not lines(axes, "isam2 (reference)")


def test_dotted_lines_are_in_the_picture_real_time_and_the_sigma_ratio_of_one() -> None:
    problem = plain_problem(scene())
    T = problem.n_frames
    fast = np.full(T, 1e-5)  # s, far below the interval between frames
    loose, tight = (np.tile(v * np.eye(6), (T, 1, 1)) for v in (4.0, 1.0))
    answers = [answer(problem, name, seconds=fast, covariance=P) for name, P in (("ekf", loose), ("isam2", tight))]
    some = drawn(run_of(problem, *answers), "time_per_frame", "consistency")
    interval = 1e3 * float(np.median(problem.sequence.dt))
    ratios = [axes for axes in some["consistency"].axes if "sigma ratio" in axes.get_ylabel()]
    assert len(ratios) == 2
    for axes, level in ((some["time_per_frame"].axes[0], interval), *((axes, 1.0) for axes in ratios)):
        (dotted,) = (line for line in axes.get_lines() if line.get_linestyle() == ":")
        assert list(dotted.get_ydata()) == pytest.approx([level, level])
        low, high = axes.get_ylim()
        assert low < level < high


def test_the_reference_is_included_where_errors_are_those_to_the_truth() -> None:
    run = standard_run()
    table = run.results["isam2"].truth
    assert table is not None
    ((_, values),) = lines(drawn_standard()["error_to_truth"].axes[0], "isam2 (reference)")
    np.testing.assert_array_equal(values, table["position"])


def test_paths_lie_in_the_horizontal_plane_with_equal_scales() -> None:
    run = standard_run()
    axes = drawn_standard()["paths_overlaid"].axes[0]
    view = TopView.of(run.problem)
    ((x, y),) = lines(axes, "ekf")
    np.testing.assert_allclose(np.stack([x, y], axis=1), view.plane(run.results["ekf"].estimate.world_T_imu[:, :3, 3]))
    assert axes.get_aspect() == 1.0
    forward = run.problem.sequence.imu_T_cam[:3, 2]
    np.testing.assert_allclose(view.plane(forward[None, :])[0], [1.0, 0.0], atol=0.05)
    np.testing.assert_allclose(np.cross(view.ahead, view.left), run.problem.sequence.up, atol=1e-12)


def test_the_distribution_ends_at_the_share_under_3_px_of_the_table() -> None:
    run = standard_run()
    ((x, y),) = lines(drawn_standard()["reprojection_distribution"].axes[0], "isam2 (reference)")
    errors = run.results["isam2"].reprojection["error"].to_numpy()
    for k in (50, 150, 250):
        assert y[k] == pytest.approx(100.0 * np.mean(errors <= x[k]))


def test_an_estimator_has_one_color_in_all_figures_and_the_reference_is_black() -> None:
    run = standard_run()
    colors = figures.colors(run.results, run.reference)
    assert colors == {
        "dead-reckoning": ESTIMATOR_COLORS["dead-reckoning"],
        "ekf": ESTIMATOR_COLORS["ekf"],
        "isam2": "#000000",
    }
    for name, figure in drawn_standard().items():
        drawn = {
            to_hex(line.get_color())
            for axes in figure.axes
            for line in axes.get_lines()
            if line.get_label() in ("ekf", "ekf and dead-reckoning")
        }
        assert drawn <= {ESTIMATOR_COLORS["ekf"].lower()}, name


def test_a_known_estimator_keeps_its_color_in_every_run_and_others_take_the_remaining_ones() -> None:
    problem = plain_problem(scene())
    strangers = [answer(problem, f"mine-{i}") for i in range(9)]
    run = run_of(problem, *strangers, answer(problem, "ekf"), answer(problem, "isam2"))
    colors = figures.colors(run.results, run.reference)
    assert colors["ekf"] == ESTIMATOR_COLORS["ekf"]
    assert len(set(colors.values())) == len(colors)


def test_saved_bytes_are_those_of_the_run(tmp_path: Path) -> None:
    chosen = ("paths_side_by_side", "path_ekf", "divergence", "reprojection_over_time")
    for folder, made in (("first", drawn_standard()), ("second", drawn(standard_run(), *chosen))):
        (tmp_path / folder).mkdir()
        figures.save({name: made[name] for name in chosen}, tmp_path / folder)
    files = sorted(path.name for path in (tmp_path / "first").iterdir())
    assert len(files) == 2 * len(chosen)
    for name in files:
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes(), name


def test_user_matplotlib_settings_are_kept(tmp_path: Path) -> None:
    with mpl.rc_context({"font.size": 31.0, "axes.facecolor": "red", "text.usetex": True}):
        height = drawn(standard_run(), "height")
        assert mpl.rcParams["font.size"] == 31.0
        figures.save(height, tmp_path)
    assert to_hex(height["height"].axes[0].get_facecolor()) == "#ffffff"


def test_no_figure_of_what_a_run_does_not_have() -> None:
    no_truth = standard_run(truth=None)
    assert not {"error_to_truth", "nees"} & set(figures.draw(no_truth))
    problem = plain_problem(scene(observations=Observations.none(), truth=None))
    alone = run_of(problem, answer(problem, "dead-reckoning"), failed(problem, "isam2", "no observations"))
    assert list(figures.draw(alone)) == [
        "paths_overlaid",
        "paths_side_by_side",
        "path_dead-reckoning",
        "height",
        "time_per_frame",
    ]
    nobody = run_of(problem, failed(problem, "ekf", "no observations"))
    assert figures.draw(nobody) == {}


def test_frames_without_pose_or_truth_are_gaps(tmp_path: Path) -> None:
    sequence = scene()
    assert sequence.truth is not None
    problem = plain_problem(replace(sequence, truth=partly_known(sequence.truth, 7)))
    broken = answer(plain_problem(sequence), "ekf", (1.0, 0.0, 0.0))
    broken.world_T_imu[20:40] = np.nan
    run = run_of(problem, broken, answer(plain_problem(sequence), "isam2"))
    every = figures.draw(run)
    ((_, values),) = lines(every["error_to_truth"].axes[0], "ekf")
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(values)), [*range(20, 40), *range(53, 60)])
    figures.save({name: every[name] for name in ("error_to_truth", "path_ekf")}, tmp_path)


def test_a_diverged_path_does_not_set_the_axes_of_the_others() -> None:
    problem = plain_problem(scene(truth=None))
    run = run_of(
        problem,
        answer(problem, "ekf", (0.0, 50_000.0, 9_000.0)),
        answer(problem, "dead-reckoning", (0.0, 2.0, 0.0)),
        answer(problem, "isam2"),
    )
    paths, height, divergence = drawn(run, "paths_overlaid", "height", "divergence").values()
    assert np.ptp(paths.axes[0].get_xlim()) < 200.0
    assert "ekf" in all_texts(paths)
    assert "poses outside the panel" in all_texts(paths)
    assert np.ptp(height.axes[0].get_ylim()) < 200.0
    assert "ekf leaves the panel at" in all_texts(height)
    assert "ekf leaves the panel at" in all_texts(divergence)


def test_landmarks_far_away_are_counted_and_not_shown() -> None:
    problem = plain_problem(scene())
    estimate = answer(problem, "isam2")
    position = estimate.landmarks.position.copy()
    position[:2] *= 1e4
    estimate = replace(estimate, landmarks=replace(estimate.landmarks, position=position))
    figure = drawn(run_of(problem, estimate), "path_isam2")["path_isam2"]
    assert np.ptp(figure.axes[0].get_xlim()) < 300.0
    assert "2 landmarks outside the panel" in all_texts(figure)


def test_names_are_drawn_as_they_are(tmp_path: Path) -> None:
    names = ["$x_{1", "_hidden", "<script>alert(1)</script>", "卡尔曼\n", "a/../../b", "x" * 100]
    problem = plain_problem(scene())
    run = run_of(problem, *(answer(problem, name, (1.0, 0.0, 0.0)) for name in names), answer(problem, "isam2"))
    chosen = drawn(run, "divergence", *(f"path_{name}" for name in names))
    assert set(legend_texts(chosen["divergence"])) == {safe_text(name) for name in names}
    figures.save(chosen, tmp_path)
    assert len(list(tmp_path.iterdir())) == 2 * len(chosen)


def test_a_run_with_one_estimator_draws() -> None:
    problem = plain_problem(scene())
    run: Run = run_of(problem, answer(problem, "ekf"))
    assert run.reference == "ekf"
    assert "divergence" not in figures.draw(run)


def test_two_answers_of_one_run_share_a_line_of_time() -> None:
    problem = plain_problem(scene())
    seconds = np.geomspace(1e-3, 1e-1, problem.n_frames)
    run = run_of(
        problem, answer(problem, "isam2", seconds=seconds), answer(problem, "isam2-online", seconds=seconds.copy())
    )
    assert "isam2 and isam2-online" in legend_texts(drawn(run, "time_per_frame")["time_per_frame"])


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ((0.05, 300.0), ["0.1", "1", "10", "100"]),
        ((2e-6, 0.05), ["10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²"]),
        ((0.7, 7.0), ["1", "2", "3", "4", "6"]),
        ((2e5, 1.5e6), ["2×10⁵", "3×10⁵", "4×10⁵", "6×10⁵", "10⁶"]),
        ((2.9e5, 3.55e5), ["2.9×10⁵", "3×10⁵", "3.1×10⁵", "3.2×10⁵", "3.3×10⁵", "3.4×10⁵", "3.5×10⁵"]),
    ],
)
def test_a_logarithmic_axis_is_labeled_with_numbers_and_powers_where_these_would_be_long(
    limits: tuple[float, float], expected: list[str]
) -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.set_yscale("log")
    axes.set_ylim(*limits)
    lay_out(figure)
    axis = axes.yaxis
    major, minor = (axis.get_majorticklocs(), axis.get_minorticklocs())
    texts = dict(zip(major, axis.get_major_formatter().format_ticks(list(major)), strict=True))
    texts |= dict(zip(minor, axis.get_minor_formatter().format_ticks(list(minor)), strict=True))
    shown = [texts[value] for value in sorted(texts) if limits[0] <= value <= limits[1] and texts[value]]
    assert shown == expected


def test_lines_that_coincide_all_show_and_the_reference_lies_on_those_of_its_graph() -> None:
    problem = plain_problem(scene())
    drifts = {"ekf": 3.0, "joint-ekf": 3.0, "isam2": 0.0, "batch": 1e-4}
    run = run_of(problem, *(answer(problem, name, (drift, 0.0, 0.0)) for name, drift in drifts.items()))
    for figure in drawn(run, "paths_overlaid", "height").values():
        look = {line.get_label(): line for line in figure.axes[0].get_lines()}
        batch, reference, ekf, twin = (look[name] for name in ("batch", "isam2 (reference)", "ekf", "joint-ekf"))
        assert batch.get_zorder() < reference.get_zorder() < ekf.get_zorder() == twin.get_zorder()
        assert batch.get_linewidth() > reference.get_linewidth() + 1.0
        assert ekf.get_linewidth() > twin.get_linewidth() + 1.0


def test_the_expected_curve_of_the_tracks_is_that_of_white_noise() -> None:
    """A point seen in 60 frames has 177 degrees of freedom: half of the tracks are below 1 - 2 / (9 x 177)."""
    panel = drawn_standard()["reprojection_classes"].axes[2]
    ((x, y),) = lines(panel, "noise as assumed")
    assert np.interp(50.0, y, x) == pytest.approx(1.0, abs=0.02)
    assert np.interp(95.0, y, x) == pytest.approx(chi2.ppf(0.95, 177) / 177, abs=0.02)


def test_each_observation_of_the_problem_or_the_mask_is_in_one_band() -> None:
    problem = plain_problem(scene())
    kinds = [kind for kind in Excluded if kind is not Excluded.FEATURE_NOT_CHOSEN]
    excluded = np.resize(kinds, len(problem.excluded)).astype(np.uint8)
    counts = observations_by_frame(replace(problem, excluded=excluded))
    assert list(counts) == list(BANDS)
    np.testing.assert_array_equal(sum(counts.values()), np.bincount(problem.sequence.observations.frame))
    assert counts["copied from the previous frame"].sum() == (excluded == Excluded.COPIED).sum() > 0


def test_labels_of_a_column_of_panels_are_aligned() -> None:
    panels = drawn_standard()["divergence"].axes
    assert len({axes.yaxis.label.get_position()[0] for axes in panels}) == 1


@pytest.mark.parametrize("height", [2.0, np.nextafter(10.32, 0.0), 7.7799])  # the second is a tick below 1548 rows
def test_a_png_has_the_pixels_of_the_canvas_at_any_height(height: float) -> None:
    figure = Figure(figsize=(4.0, height), dpi=SCREEN.dpi)
    figure.subplots().plot([0.0, 1.0], [0.0, height])
    raw = BytesIO()
    figure.savefig(raw, format="rgba", dpi=SCREEN.dpi)
    pixels = np.asarray(Image.open(BytesIO(figures.encoded(figure, "png"))))
    canvas = np.frombuffer(raw.getvalue(), np.uint8).reshape(-1, pixels.shape[1], 4)
    np.testing.assert_array_equal(pixels, canvas[:, :, :3])


def test_nothing_moves_when_a_figure_is_written(tmp_path: Path) -> None:
    (figure,) = drawn(standard_run(), "divergence").values()

    def places() -> list[object]:
        return [(*axes.get_position().bounds, axes.yaxis.label.get_position()) for axes in figure.axes]

    before = places()
    for form in ("png", "svg"):
        figures.save({"divergence": figure}, tmp_path, (form,))
        assert figure.get_layout_engine() is None
        assert places() == before


def test_every_observation_is_in_one_band_of_its_frame_whatever_excludes_it() -> None:
    problem = plain_problem(scene())
    reasons = np.array(list(Excluded), dtype=np.uint8)
    excluded = reasons[np.arange(len(problem.excluded)) % len(reasons)]
    bands = observations_by_frame(replace(problem, excluded=excluded))
    frame = problem.sequence.observations.frame
    np.testing.assert_array_equal(sum(bands.values()), np.bincount(frame, minlength=problem.n_frames))
    red = "wrong match, moved or undetermined"
    assert bands[red].sum() == np.isin(excluded, BANDS[red][1]).sum()
    assert Excluded.COPIED not in BANDS[red][1]
