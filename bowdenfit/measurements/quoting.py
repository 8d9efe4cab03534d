"""Values as error messages show them: in quotes, on one line, and short."""

_LONGEST = 40


def shown(value: object) -> str:
    """Text in quotes, anything else as it is written in Python; the middle of what is long is left out."""
    try:
        text = repr(" ".join(value.split()) if isinstance(value, str) else value)
    except ValueError:  # Python refuses to write out integers of more than 4300 digits
        return "a very large number"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 15]}...{text[-12:]}"


def listed(names: tuple[str, ...], most: int = 12) -> str:
    """Names in quotes with commas between them."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(shown(name) for name in names[:most]) + more
