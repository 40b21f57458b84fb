"""`fgbaseline figures`: a run's figures for a paper."""

from pathlib import Path

import click


class Formats(click.ParamType[tuple[str, ...]]):
    """File formats, separated by commas."""

    name = "pdf,svg,png"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, ...]:
        """The formats, each once."""
        if isinstance(value, tuple):
            return value
        wanted = tuple(dict.fromkeys(part.strip().lower() for part in str(value).split(",")))
        for form in wanted:
            if form not in ("pdf", "svg", "png"):
                self.fail(f"there is no format {form!r}; choose from pdf, svg and png", param, ctx)
        return wanted


@click.command(epilog="Example: fgbaseline figures out/drive --format pdf --out paper/figures")
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--format", "formats", type=Formats(), default="pdf", show_default=True, help="One or more of these.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder to write.  [default: DIR/paper]")
@click.option("--force", is_flag=True, help="Replace the folder of an earlier call.")
def command(folder: Path, formats: tuple[str, ...], out: Path | None, force: bool) -> int:
    """Draw the figures of a run's folder DIR again, for a paper in two columns.

    As wide as a column, letters of 7 points, lines told apart without colour, fonts embedded. Nothing is computed
    again: what is drawn is what the run wrote. captions.json has a caption for each.
    """
    from fgbaseline.data.formats.atomic_folder import atomic_folder

    from ..figures.run import draw_for_paper
    from ..figures.run_data import of_folder
    from ..figures.saving import CAPTIONS, save, save_captions
    from ..figures.style import PAPER

    place = out or folder / "paper"
    figures = draw_for_paper(of_folder(folder))
    with atomic_folder(place, force=force, mark=CAPTIONS) as building:
        save({name: figure for name, (figure, _) in figures.items()}, building, formats, PAPER)
        save_captions({name: caption for name, (_, caption) in figures.items()}, building)
    click.echo(f"{len(figures)} figures as {', '.join(formats)} are in {place}")
    return 0
