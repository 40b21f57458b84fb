"""TOML files of ours (limits, repairs, suites): read into a pydantic model, and told in one sentence what is wrong.

class Limits(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    limit: tuple[Limit, ...]

file = read_toml(path, Limits)
file.content.limit[0].metric
raise file.wrong(("limit", 0, "metric"), "there is no such metric")  # limits.toml: line 7: there is no ...
"""

import difflib
import json
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeGuard, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from fgbaseline.geometry import InputError

from .formats.named_file import FilePath, reading, regular_file, shown
from .toml_lines import Place, lines_of

SHOWN = 60
"""characters of a value that a sentence repeats"""
Content = TypeVar("Content", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class TomlFile(Generic[Content]):
    """A file that was read, and where everything stands in it."""

    content: Content
    path: FilePath
    lines: Mapping[Place, int]

    def line(self, place: Place) -> int:
        """The line, from 1, of a place such as ("limit", 0, "metric"), or of the nearest thing around it."""
        return _line(self.lines, place)

    def wrong(self, place: Place, sentence: str) -> InputError:
        """The error, to be raised, that says file and line before the sentence."""
        return _wrong(self.path, self.line(place), sentence)


def read_toml(path: FilePath, model: type[Content]) -> TomlFile[Content]:
    """The TOML file `path` as a `model`, which should forbid extra keys.

    TOML has types, so "5" is no number and 1 no truth value; arrays may become tuples, and strings enums and paths.
    Raises InputError naming the file, the line, the key and what is allowed, for the first thing that is wrong.
    """
    with reading(path):
        text = regular_file(path).read_bytes()
        values = _parsed(text)
    lines = lines_of(text)
    try:
        content = model.model_validate_json(json.dumps(values, default=str), strict=True)
    except ValidationError as error:
        errors = error.errors(include_url=False)
        unknown = [each for each in errors if each["type"] == "extra_forbidden"]  # what explains a missing key
        told = [_told(each, values, model) for each in unknown or errors]
        inmost = [(p, said) for p, said in told if not any(other[: len(p)] == p != other for other, _ in told)]
        line, sentence = min((_line(lines, place), sentence) for place, sentence in inmost)
        raise _wrong(path, line, sentence) from None
    return TomlFile(content, path, lines)


def _line(lines: Mapping[Place, int], place: Place) -> int:
    while place and place not in lines:
        place = place[:-1]
    return lines.get(place, 1)


def _wrong(path: FilePath, line: int, sentence: str) -> InputError:
    return InputError(f"{shown(path)}: line {line}: {sentence}")


def _parsed(text: bytes) -> dict[str, Any]:
    """What the text says. Raises InputError that begins with the line."""
    try:
        return tomllib.loads(text.decode())
    except UnicodeDecodeError as error:
        line = text.count(b"\n", 0, error.start) + 1
        raise InputError(f"line {line}: this is no UTF-8 text; write the file as TOML") from None
    except tomllib.TOMLDecodeError as error:
        said, _, where = str(error).rpartition(" (at ")
        found = re.search(r"line (\d+)", where)
        line = int(found[1]) if found else text.rstrip().count(b"\n") + 1
        raise InputError(f"line {line}: this is not TOML ({said[:1].lower()}{said[1:]}); see https://toml.io") from None
    except (ValueError, RecursionError):
        raise InputError("a value in it is too long or too deeply nested to be read; make it simpler") from None


def _told(error: ErrorDetails, values: Any, model: type[BaseModel]) -> tuple[Place, str]:
    """Where it is wrong, and the sentence."""
    place = _place(error["loc"], values)
    key = str(error["loc"][-1]) if error["loc"] else ""
    around = _name(place[:-1]) if place else ""
    if error["type"] == "extra_forbidden":
        allowed = sorted(_fields(model, place[:-1]))
        near = difflib.get_close_matches(key, allowed, n=1)
        meant = f" (did you mean '{near[0]}'?)" if near else ""
        return place, f"there is no key '{key}'{around}{meant}; allowed are {', '.join(allowed)}"
    if error["type"] == "missing":
        return place, f"the key '{key}' is missing{_name(place)}; add it"
    said = str(error["ctx"]["error"]) if error["type"] == "value_error" else _rule(error)
    last = next((part for part in reversed(place) if isinstance(part, str)), None)
    if isinstance(error["input"], dict) or last is None:
        return place, said if last is None else f"[{_dotted(place)}]: {said}"
    return place, f"{last} = {_shortened(json.dumps(error['input'], ensure_ascii=False, default=str))}{around}: {said}"


def _rule(error: ErrorDetails) -> str:
    """What pydantic allows, as the end of a sentence."""
    _, should, allowed = error["msg"].partition(", unable")[0].partition(" should ")
    return f"it should {allowed}; change it" if should else f"{error['msg']}; change it"


def _shortened(text: str) -> str:
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 3]}..."


def _place(loc: tuple[int | str, ...], values: Any) -> Place:
    """The part of pydantic's location that is in the file: without tags of unions, and without a missing key."""
    place: list[str | int] = []
    for part in loc:
        inside = isinstance(values, dict) and part in values
        if inside or (isinstance(values, list) and isinstance(part, int) and part < len(values)):
            place.append(part)
            values = values[part]
    return tuple(place)


def _name(place: Place) -> str:
    return f" in [{_dotted(place)}]" if place else ""


def _dotted(place: Place) -> str:
    return ".".join(part for part in place if isinstance(part, str))


def _fields(model: Any, place: Place) -> set[str]:
    """The keys that the models at a place know."""
    if not place:
        return {field.alias or name for one in _models(model) for name, field in one.model_fields.items()}
    if isinstance(place[0], int):
        return _fields(model, place[1:])
    inner = [
        field.annotation
        for one in _models(model)
        for name, field in one.model_fields.items()
        if place[0] == (field.alias or name)
    ]
    return set().union(*(_fields(annotation, place[1:]) for annotation in inner))


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """The models that an annotation such as `tuple[Limit, ...] | None` speaks of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _models(argument)


def is_finite_number(value: object) -> TypeGuard[int | float]:
    """Whether a value read from a file is a number within a double's range: no infinity, NaN or truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
