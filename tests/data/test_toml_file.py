"""TOML files: every key on its line, and what is wrong in one sentence."""

from enum import StrEnum
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ConfigDict, Field, field_validator

from fgbaseline.data.toml_file import read_toml
from fgbaseline.data.toml_lines import lines_of
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


def test_a_good_file_becomes_the_model_and_knows_its_lines(file: Path) -> None:
    read = read_toml(file, Car)
    assert read.content.wheel == (Wheel(side=Side.LEFT, size=0.3), Wheel(side=Side.RIGHT, size=0.3, kind="alloy"))
    assert (read.content.engine, read.content.manual) == (Engine(power=40.0), Path("docs/manual.pdf"))
    assert read.line(("wheel", 1)) == 12
    assert read.line(("wheel", 1, "kind")) == 15
    assert read.line(("wheel", 0, "spokes")) == 8  # not there: that of its table
    assert str(read.wrong(("engine", "power"), "it is too weak")) == f"{file}: line 6: it is too weak"


BAD = [
    ('name = "mini"', "", 1, ("'name' is missing", "add it")),
    ("power = 40", "", 5, ("'power' is missing in [engine]",)),
    ("size = 0.3", "sise = 0.3", 10, ("no key 'sise' in [wheel]", "did you mean 'size'", "kind, side, size, spokes")),
    ("[engine]", "[motor]", 5, ("no key 'motor'", "engine, fast, manual, name, wheel")),
    ("size = 0.3", 'size = "0.3"', 10, ('size = "0.3" in [wheel]', "number")),
    ("size = 0.3", "size = -1", 10, ("size = -1", "greater than 0")),
    ("size = 0.3", "size = true", 10, ("size = true", "number")),
    ('side = "left"', 'side = "up"', 9, ('side = "up"', "'left' or 'right'")),
    ('kind = "alloy"', 'kind = "gold"', 15, ('kind = "gold"', "'steel' or 'alloy'")),
    ("size = 0.3", "size = 0.3\nspokes = 7", 11, ("spokes = 7", "come in pairs")),
    ('name = "mini"', 'name = "mini"\nfast = 1', 3, ("fast = 1", "boolean")),
    ('name = "mini"', 'name = "mini"\nfast = 2020-01-01', 3, ('fast = "2020-01-01"', "boolean")),
    ("[engine]\npower = 40", "engine = 3", 5, ("engine = 3",)),
    ('name = "mini"', 'name = "mini"\nname = "maxi"', 3, ("not TOML", "overwrite")),
    ("[engine]", "[engine", 5, ("not TOML",)),
    ("power = 40", "power = 40 kW", 6, ("not TOML",)),
    ('kind = "alloy"', 'kind = """', 15, ("not TOML", "unterminated")),
]


@pytest.mark.parametrize(("old", "new", "line", "names"), BAD)
def test_what_is_wrong_is_one_sentence_with_its_line(
    old: str, new: str, line: int, names: tuple[str, ...], file: Path
) -> None:
    file.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(InputError) as error:
        read_toml(file, Car)
    text = str(error.value)
    assert text.startswith(f"{file}: line {line}: ")
    assert "\n" not in text
    assert all(name in text for name in names), text


def test_the_first_of_several_is_told(file: Path) -> None:
    file.write_text(GOOD.replace("power = 40", "power = '40'").replace('"left"', '"up"'))
    with pytest.raises(InputError, match="line 6: power"):
        read_toml(file, Car)


@pytest.mark.parametrize(
    ("content", "names"),
    [
        (b"name = '\xff'\n", ("line 1", "UTF-8")),
        (b"\n\n" + bytes(range(128, 256)), ("line 3", "UTF-8")),
        (b"name = " + b"[" * 100_000, ("nested",)),
        (b"name = " + b"9" * 10_000, ("too long",)),
        (b"", ("line 1", "'name' is missing")),
    ],
)
def test_what_is_no_such_text_at_all(content: bytes, names: tuple[str, ...], file: Path) -> None:
    file.write_bytes(content)
    with pytest.raises(InputError) as error:
        read_toml(file, Car)
    assert all(name in str(error.value) for name in names), str(error.value)


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"car\.toml: there is no such file"):
        read_toml(tmp_path / "car.toml", Car)
    with pytest.raises(InputError, match="this is a folder"):
        read_toml(tmp_path, Car)


DECOYS = st.sampled_from(["", "# [[decoy]]\n", "\n\n", "# a.b = 1\n"])
NAMES = st.sampled_from(["a", "b", "long-name", "'q u o.t e d'", '"\\u00e9 #"', "7"])


@st.composite
def documents(draw: st.DrawFn) -> tuple[str, list[int]]:
    """A TOML text of every kind of table, array and quoting, and the numbers in it, each of them once."""
    numbers: list[int] = []

    def number() -> str:
        numbers.append(1_000_000 + len(numbers))
        return str(numbers[-1])

    def value(depth: int) -> str:
        kind = draw(st.sampled_from(["number", "array", "table", "text"] if depth < 2 else ["number"]))
        if kind == "array":
            gap = draw(st.sampled_from([" ", "\n  ", "\n# ] 3\n"]))
            return "[" + "".join(f"{gap}{value(depth + 1)}," for _ in range(draw(st.integers(0, 3)))) + gap + "]"
        if kind == "table":
            keys = draw(st.lists(NAMES, max_size=3, unique=True))
            return "{" + ", ".join(f"{key} = {value(depth + 1)}" for key in keys) + "}"
        return number() if kind == "number" else '"""\n[[a]]\nb = 1\n\\""" # """'

    def pairs() -> str:
        keys = draw(st.lists(st.lists(NAMES, min_size=1, max_size=2), max_size=3, unique_by=lambda parts: parts[0]))
        return "".join(f"{draw(DECOYS)}{' . '.join(parts)} = {value(0)}\n" for parts in keys)

    text = pairs()
    for index in range(draw(st.integers(0, 3))):
        array, name = draw(st.booleans()), f"t{index}"
        for _ in range(draw(st.integers(1, 3)) if array else 1):
            text += draw(DECOYS) + (f"[[ {name} ]] # [c]\n" if array else f"[{name}.'s u b']\n") + pairs()
            if draw(st.booleans()):
                text += f"[{name}.inner]\n{pairs()}" if array else ""
    return text.replace("\n", draw(st.sampled_from(["\n", "\r\n"]))), numbers


@given(documents())
def test_every_number_stands_on_the_line_that_its_place_is_said_to_have(document: tuple[str, list[int]]) -> None:
    import tomllib

    text, numbers = document
    rows = text.split("\n")
    lines = lines_of(text.encode())
    found = {}

    def walk(value: object, place: tuple[str | int, ...]) -> None:
        assert not place or 1 <= lines[place] <= len(rows)
        if isinstance(value, int):
            found[value] = rows[lines[place] - 1]
        elif isinstance(value, dict | list):
            for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
                walk(inner, (*place, key))

    walk(tomllib.loads(text), ())
    assert sorted(found) == numbers
    assert all(str(value) in row for value, row in found.items())
