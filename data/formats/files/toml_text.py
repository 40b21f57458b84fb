"""Syntax of TOML files, before a model validates the content."""

import re
import tomllib
from typing import Any

from fgbaseline.geometry import InputError

from .file_errors import FilePath, reading, regular_file


def toml_values(path: FilePath) -> dict[str, Any]:
    """The values in a file. Raises InputError naming the file and the line where the syntax is wrong."""
    with reading(path):
        return _parsed(regular_file(path).read_bytes())


def _parsed(text: bytes) -> dict[str, Any]:
    """The values in a text. Raises InputError, with the line where the syntax is wrong."""
    try:
        return tomllib.loads(text.decode())
    except UnicodeDecodeError as error:
        line = text.count(b"\n", 0, error.start) + 1
        raise InputError(f"line {line}: this is not UTF-8 text; write the file as TOML") from None
    except tomllib.TOMLDecodeError as error:
        why, _, where = str(error).rpartition(" (at ")
        found = re.search(r"line (\d+)", where)
        line = int(found[1]) if found else text.rstrip().count(b"\n") + 1
        raise InputError(f"line {line}: this is not TOML ({why[:1].lower()}{why[1:]}); see https://toml.io") from None
    except (ValueError, RecursionError):
        raise InputError("a value in it is too long or too deeply nested to be read; make it simpler") from None
