"""Names in one text, as options and keywords have them."""


def names_in(text: str | None) -> tuple[str, ...]:
    """Names that commas separate, without blanks around them; empty ones are left out."""
    return tuple(name.strip() for name in (text or "").split(",") if name.strip())
