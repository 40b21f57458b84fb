"""TOML files (limits, repairs, suites) read into a pydantic model, with one sentence for the first fault.

class Limits(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    limit: tuple[Limit, ...]

file = read_toml(path, Limits)
file.content.limit[0].metric
raise file.wrong(("limit", 0, "metric"), "there is no such metric")  # limits.toml: limit[0].metric: there is no ...
"""

import difflib
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeAlias, TypeGuard, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from fgbaseline.geometry import InputError

from .file_errors import FilePath, shown
from .toml_text import toml_values

SHOWN = 60
"""characters of a value that a sentence repeats"""
Content = TypeVar("Content", bound=BaseModel)
Place: TypeAlias = tuple[str | int, ...]
"""keys and indices that lead from the top of a file to a value, such as ("limit", 0, "metric")"""


@dataclass(frozen=True, slots=True)
class TomlFile(Generic[Content]):
    """The content of a file, and its path for error messages."""

    content: Content
    path: FilePath

    def wrong(self, place: Place, sentence: str) -> InputError:
        """The error, to be raised, that names file and key path before the sentence."""
        return _wrong(self.path, key_path(place), sentence)


def key_path(place: Place) -> str:
    """The key path of a place: `limit[3].metric` for ("limit", 3, "metric")."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place).removeprefix(".")


def read_toml(path: FilePath, model: type[Content], values: dict[str, Any] | None = None) -> TomlFile[Content]:
    """The TOML file `path` as a `model`, which should forbid extra keys; `values` are its values, if read already.

    TOML has types, so "5" is no number and 1 no truth value; arrays may become tuples, and strings enums and paths.
    Raises InputError naming the file, the key path and the allowed values, for the first fault in the file.
    """
    values = toml_values(path) if values is None else values
    try:
        content = model.model_validate_json(json.dumps(values, default=str), strict=True)
    except ValidationError as error:
        errors = error.errors(include_url=False)
        unknown = [each for each in errors if each["type"] == "extra_forbidden"]  # what explains a missing key
        faults = [_fault(each, values, model) for each in unknown or errors]
        inmost = [f for f in faults if not any(g[0][: len(f[0])] == f[0] != g[0] for g in faults)]
        place, value, sentence = min(inmost, key=lambda fault: (_order(fault[0], values), fault))
        raise _wrong(path, f"{key_path(place)}{value}", sentence) from None
    return TomlFile(content, path)


def _order(place: Place, values: Any) -> tuple[int, ...]:
    """The place by the positions of its keys in the file."""
    order = []
    for part in place:
        order.append(part if isinstance(part, int) else list(values).index(part))
        values = values[part]
    return tuple(order)


def _wrong(path: FilePath, key: str, sentence: str) -> InputError:
    return InputError(": ".join(text for text in (shown(path), key, sentence) if text))


def _fault(error: ErrorDetails, values: Any, model: type[BaseModel]) -> tuple[Place, str, str]:
    """The place of an error, the value there where it is shown (` = 5`), and the sentence."""
    place = _place(error["loc"], values)
    if error["type"] == "extra_forbidden":
        key, around = str(error["loc"][-1]), place[:-1]
        allowed = sorted(_fields(model, around))
        near = difflib.get_close_matches(key, allowed, n=1)
        meant = f" (did you mean '{near[0]}'?)" if near else ""
        return around, "", f"there is no key '{key}'{meant}; allowed are {', '.join(allowed)}"
    if error["type"] == "missing":
        return place, "", f"the key '{error['loc'][-1]}' is missing; add it"
    sentence = str(error["ctx"]["error"]) if error["type"] == "value_error" else _rule(error)
    if isinstance(error["input"], dict) or not place:
        return place, "", sentence
    return place, f" = {_shortened(json.dumps(error['input'], ensure_ascii=False, default=str))}", sentence


def _rule(error: ErrorDetails) -> str:
    """The rule that pydantic states, as the end of a sentence."""
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


def _fields(model: Any, place: Place) -> set[str]:
    """The keys of the models at a place."""
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
    """The models in an annotation such as `tuple[Limit, ...] | None`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _models(argument)


def is_finite_number(value: object) -> TypeGuard[int | float]:
    """Whether a value read from a file is a number within a double's range: no infinity, NaN or truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
