"""The site of the docs: built without a warning, whole, and read without a network."""

import importlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ..builders.commands import environment
from ..builders.documents import ROOT

pytestmark = pytest.mark.slow
pytest.importorskip("material", reason="mkdocs-material is not installed")

API = {
    "geometry": ("geometry",),
    "data": ("data", "data.simulate"),
    "diagnosis": ("diagnosis",),
    "ekf": ("ekf",),
    "smoother": ("smoother",),
    "compare": ("compare",),
    "reports": ("reports.comparison", "reports.accuracy_check", "reports.figures"),
}
"""page -> the packages on it"""
NAMES = (os.environ.get("FGBASELINE_CHROMIUM"), "chromium", "chromium-browser", "google-chrome", "chrome")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """As `make docs` builds it, elsewhere."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    env = environment(NO_MKDOCS_2_WARNING="1")
    result = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    output = result.stdout + result.stderr
    assert result.returncode == 0, output
    assert "WARNING" not in output
    return folder


def pages(site: Path) -> list[Path]:
    return [page for page in site.rglob("*.html") if page.name != "404.html"]


def test_every_document_has_a_page_that_the_navigation_leads_to(site: Path) -> None:
    documents = {path.relative_to(ROOT / "docs").with_suffix("") for path in (ROOT / "docs").rglob("*.md")}
    assert documents == {page.relative_to(site).with_suffix("") for page in pages(site)}
    nav = (ROOT / "mkdocs.yml").read_text().partition("\nnav:")[2]
    assert documents == {Path(name) for name in re.findall(r"- (\S+)\.md$", nav, re.MULTILINE)}


def test_every_public_name_is_described(site: Path) -> None:
    for page, packages in API.items():
        text = (site / "api" / f"{page}.html").read_text()
        for package in packages:
            public = set(importlib.import_module(f"fgbaseline.{package}").__all__)
            there = set(re.findall(rf'id="fgbaseline\.{re.escape(package)}\.(\w+)[".]', text))
            missing = public - there - {p.rpartition(".")[2] for p in packages}  # such as se3: below
            # Camera is a union of two described classes.
            assert missing <= {"se3", "so3", "strapdown", "Camera"}, (package, missing)
        if page == "geometry":
            assert 'id="fgbaseline.geometry.se3.exp"' in text
            assert 'id="fgbaseline.geometry.so3.hat3"' in text
            assert 'id="fgbaseline.geometry.strapdown.integrate"' in text
        if page == "diagnosis":
            assert 'id="fgbaseline.diagnosis.diagnose"' in text


def test_nothing_is_fetched_from_anywhere(site: Path) -> None:
    for page in pages(site):
        text = page.read_text()
        loaded = re.findall(r"<(?:script|img|iframe|source)\b[^>]*\bsrc=[\"']?([^\"' >]+)", text)
        loaded += re.findall(r"<link\b[^>]*\bhref=[\"']?([^\"' >]+)", text)
        assert not [address for address in loaded if re.match(r"(https?:)?//", address)], page


def test_formulas_are_mathml_without_leftovers(site: Path) -> None:
    for name in ("filter", "graph"):
        text = (site / "mathematics" / f"{name}.html").read_text()
        formulas = re.findall(r"<math.*?</math>", text, re.DOTALL)
        assert len(formulas) > 15
        assert len(formulas) == len(re.findall(r'class="arithmatex"', text))
        for formula in formulas:
            assert not re.search(r"\\|amp;|linebreak|merror", formula), formula


def test_the_example_of_the_site_runs(site: Path) -> None:
    text = (site / "examples" / "my-filter.html").read_text()
    assert text.count('class="dataframe"') == 1
    assert '<div class="figure"><svg' in text
    assert "The reference is trusted" in text
    assert "Traceback" not in text


def test_the_inertial_example_of_the_site_runs(site: Path) -> None:
    text = (site / "examples" / "my-inertial-filter.html").read_text()
    assert text.count('class="dataframe"') == 1
    assert "inertial samples" in text
    assert "Traceback" not in text


@pytest.mark.parametrize(("width", "scheme"), [(1400, "light"), (390, "dark")])
def test_docs_opened_from_a_folder_are_searchable_offline(site: Path, width: int, scheme: str) -> None:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = next((found for name in NAMES if name and (found := shutil.which(name))), None)
    if path is None:
        pytest.skip("there is no Chromium (FGBASELINE_CHROMIUM names one)")
    asked: list[str] = []
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
        page.on("request", lambda request: asked.append(request.url))
        for name in ("index", "mathematics/filter", "api/data", "examples/my-filter", "metrics"):
            page.goto((site / f"{name}.html").as_uri())
            assert page.evaluate("document.documentElement.scrollWidth") <= width, name
        page.goto((site / "index.html").as_uri())
        page.locator("label[for=__search]").first.evaluate("label => label.click()")
        page.locator("input.md-search__input").press_sequentially("perturbation")
        page.locator(".md-search-result__link").first.wait_for(timeout=60_000)
        assert "filter" in " ".join(page.locator(".md-search-result__link").evaluate_all("all => all.map(a => a.href)"))
        browser.close()
    assert not [address for address in asked if not re.match(r"(file|data|blob|about):", address)]
