"""TOML files: the key path of a fault, and what is wrong in one sentence."""

from enum import StrEnum
from pathlib import Path
from typing import Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, field_validator

from fgbaseline.data.formats.files.toml_file import key_path, read_toml
from fgbaseline.geometry import InputError


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Side(StrEnum):
    LEFT = "left"
    RIGHT = "right"


class Wheel(Part):
    side: Side
    size: float = Field(gt=0)
    spokes: int = 0
    kind: Literal["steel", "alloy"] = "steel"

    @field_validator("spokes")
    @classmethod
    def _even(cls, value: int) -> int:
        if value % 2:
            raise ValueError("spokes come in pairs; write an even number")
        return value


class Engine(Part):
    power: float


class Car(Part):
    name: str
    wheel: tuple[Wheel, ...] = ()
    engine: Engine | None = None
    manual: Path | None = None
    fast: bool = False


GOOD = """# a car
name = "mini"
manual = "docs/manual.pdf"

[engine]
power = 40

[[wheel]]
side = "left"
size = 0.3

[[wheel]]
side = "right"
size = 0.3
kind = "alloy"
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "car.toml"
    path.write_text(GOOD)
    return path


def test_a_valid_file_gives_the_model_and_its_faults_have_key_paths(file: Path) -> None:
    read = read_toml(file, Car)
    assert read.content.wheel == (Wheel(side=Side.LEFT, size=0.3), Wheel(side=Side.RIGHT, size=0.3, kind="alloy"))
    assert (read.content.engine, read.content.manual) == (Engine(power=40.0), Path("docs/manual.pdf"))
    assert key_path(("wheel", 1)) == "wheel[1]"
    assert key_path(("wheel", 1, "kind")) == "wheel[1].kind"
    assert str(read.wrong(("engine", "power"), "it is too weak")) == f"{file}: engine.power: it is too weak"
    assert str(read.wrong((), "it has no doors")) == f"{file}: it has no doors"


BAD = [
    ('name = "mini"', "", "", ("'name' is missing", "add it")),
    ("power = 40", "", "engine: ", ("'power' is missing",)),
    ("size = 0.3", "sise = 0.3", "wheel[0]: ", ("no key 'sise'", "did you mean 'size'", "kind, side, size, spokes")),
    ("[engine]", "[motor]", "", ("no key 'motor'", "engine, fast, manual, name, wheel")),
    ("size = 0.3", 'size = "0.3"', 'wheel[0].size = "0.3": ', ("number",)),
    ("size = 0.3", "size = -1", "wheel[0].size = -1: ", ("greater than 0",)),
    ("size = 0.3", "size = true", "wheel[0].size = true: ", ("number",)),
    ('side = "left"', 'side = "up"', 'wheel[0].side = "up": ', ("'left' or 'right'",)),
    ('kind = "alloy"', 'kind = "gold"', 'wheel[1].kind = "gold": ', ("'steel' or 'alloy'",)),
    ("size = 0.3", "size = 0.3\nspokes = 7", "wheel[0].spokes = 7: ", ("come in pairs",)),
    ('name = "mini"', 'name = "mini"\nfast = 1', "fast = 1: ", ("boolean",)),
    ('name = "mini"', 'name = "mini"\nfast = 2020-01-01', 'fast = "2020-01-01": ', ("boolean",)),
    ("[engine]\npower = 40", "engine = 3", "engine = 3: ", ("engine = 3",)),
    ('name = "mini"', 'name = "mini"\nname = "maxi"', "line 3: ", ("not TOML", "overwrite")),
    ("[engine]", "[engine", "line 5: ", ("not TOML",)),
    ("power = 40", "power = 40 kW", "line 6: ", ("not TOML",)),
    ('kind = "alloy"', 'kind = """', "line 15: ", ("not TOML", "unterminated")),
]


@pytest.mark.parametrize(("old", "new", "place", "names"), BAD)
def test_a_fault_is_one_sentence_with_its_key_path(
    old: str, new: str, place: str, names: tuple[str, ...], file: Path
) -> None:
    file.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(InputError) as error:
        read_toml(file, Car)
    text = str(error.value)
    assert text.startswith(f"{file}: {place}")
    assert "\n" not in text
    assert all(name in text for name in names), text


def test_the_first_of_several_faults_is_reported(file: Path) -> None:
    file.write_text(GOOD.replace("power = 40", "power = '40'").replace('"left"', '"up"'))
    with pytest.raises(InputError, match=r"engine\.power = "):
        read_toml(file, Car)


@pytest.mark.parametrize(
    ("content", "names"),
    [
        (b"name = '\xff'\n", ("line 1", "UTF-8")),
        (b"\n\n" + bytes(range(128, 256)), ("line 3", "UTF-8")),
        (b"name = " + b"[" * 100_000, ("nested",)),
        (b"name = " + b"9" * 10_000, ("too long",)),
        (b"", ("'name' is missing",)),
    ],
)
def test_a_file_that_is_no_toml_text_is_refused(content: bytes, names: tuple[str, ...], file: Path) -> None:
    file.write_bytes(content)
    with pytest.raises(InputError) as error:
        read_toml(file, Car)
    assert all(name in str(error.value) for name in names), str(error.value)


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"car\.toml: there is no such file"):
        read_toml(tmp_path / "car.toml", Car)
    with pytest.raises(InputError, match="this is a folder"):
        read_toml(tmp_path, Car)
