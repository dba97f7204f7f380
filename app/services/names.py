"""Names that people give to gyros, stands and certificates."""

from app.errors import Invalid, problem


def checked_name(value: str, column: str) -> str:
    """The name without surrounding blanks, when it can stand in an address and in a file name."""
    value = value.strip()
    if not value:
        raise Invalid(problem("empty", "This must not be empty.", column=column))
    if any(character in value for character in "/?#\\") or not value.isprintable() or value in (".", ".."):
        raise Invalid(problem("bad-name", "“%(value)s” has a character that a name cannot have (/ ? # \\).",
                              column=column, value=value))  # fmt: skip
    if value == "new":
        raise Invalid(
            problem("reserved-name", "“new” is an address of the pages; choose another name.", column=column)
        )
    return value
