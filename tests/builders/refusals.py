"""What is refused, in one sentence that names the file."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from fgbaseline.geometry import InputError


@contextmanager
def refused(sentence: str, file: Path | None = None) -> Iterator[None]:
    """The block must raise an InputError on one line that has a sentence (a pattern), and begins with `file`."""
    with pytest.raises(InputError, match=sentence) as raised:
        yield
    assert str(raised.value).startswith("" if file is None else f"{file}: ")
    assert "\n" not in str(raised.value)
