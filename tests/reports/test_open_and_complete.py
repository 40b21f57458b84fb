"""What opens a page in the browser, and what the shell completes."""

from pathlib import Path

import pytest

from fgbaseline.data import write_npz
from fgbaseline.data.simulate import Simulation, simulate

from ..builders.commands import fgbaseline, installed


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording, its truth twice, and a browser that writes down what it is asked to open."""
    place = tmp_path_factory.mktemp("opened")
    sequence = simulate(Simulation(duration=4.0, features_per_frame=15.0))
    write_npz(sequence, place / "drive.npz")
    rows = [f"{k / 10} {k / 10} 0 0 0 0 0 1" for k in range(20)]
    for name in ("one", "two"):
        (place / f"{name}.tum").write_text("\n".join(rows))
    browser = place / "browser"
    browser.write_text('#!/bin/sh\necho "$1" >> "${0%/*}/opened"\n')
    browser.chmod(0o755)
    return place


COMMANDS = {
    "run": "run drive.npz --estimators dead-reckoning --as-recorded --out r --open",
    "compare": "compare one.tum two.tum --out c --open",
    "diagnose": "diagnose drive.npz --out d --open",
}


@pytest.mark.parametrize("command", COMMANDS)
def test_the_page_opens_in_the_browser_when_asked(folder: Path, command: str) -> None:
    words = COMMANDS[command].split()
    result = fgbaseline(*words, cwd=folder, drawing=False, BROWSER=str(folder / "browser"))
    assert result.returncode in (0, 1, 2), result.stderr
    page = folder / words[words.index("--out") + 1] / "report.html"
    assert page.is_file(), result.stderr
    assert (folder / "opened").read_text().splitlines()[-1] == page.as_uri()


@pytest.mark.parametrize("command", ["compare one.tum two.tum --open", "diagnose drive.npz --open"])
def test_without_a_folder_there_is_no_page_to_open(folder: Path, command: str) -> None:
    result = fgbaseline(*command.split(), cwd=folder)
    assert result.returncode == 2
    assert "open: there is no page; add --out DIR" in result.stderr


def completed(words: str, folder: Path, shell: str = "bash") -> list[str]:
    """What the installed command offers for the last of the words."""
    n = len(words.split()) - (not words.endswith(" "))
    result = installed(cwd=folder, _FGBASELINE_COMPLETE=f"{shell}_complete", COMP_WORDS=words, COMP_CWORD=str(n))
    return result.stdout.split()


def test_commands_options_choices_and_files_complete(folder: Path) -> None:
    assert completed("fgbaseline di", folder) == ["plain,diagnose"]
    assert "plain,--align" in completed("fgbaseline compare --al", folder)
    assert completed("fgbaseline compare --align s", folder) == ["plain,se3", "plain,sim3"]
    for words in ("compare on", "compare one.tum tw", "run dri", "compare one.tum two.tum --landmarks m"):
        assert completed(f"fgbaseline {words}", folder)[0].startswith("file,"), words


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_documented_line_gives_a_script_for_the_shell(folder: Path, shell: str) -> None:
    guide = (Path(__file__).parents[2] / "docs/getting-started.md").read_text()
    assert f"_FGBASELINE_COMPLETE={shell}_source fgbaseline" in guide
    script = installed(cwd=folder, _FGBASELINE_COMPLETE=f"{shell}_source").stdout
    assert f"_FGBASELINE_COMPLETE={shell}_complete" in script
