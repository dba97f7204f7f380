"""What pydantic finds wrong with a request, in this product's words."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from solver.errors import Message

_WORDS: Final[Mapping[str, Message]] = {
    "missing": Message("missing-field", "This is missing, and nothing stands in for it."),
    "extra_forbidden": Message(
        "unknown-field", "There is no field of this name here. Correct the name, or leave it out."
    ),
    "float_type": Message("not-a-number", "This must be a number, written without quotation marks."),
    "float_parsing": Message("not-a-number", "This must be a number with a decimal point."),
    "finite_number": Message("not-finite", "This must be a finite number; NaN and infinity are no values."),
    "int_type": Message("not-a-whole-number", "This must be a whole number."),
    "int_parsing": Message("not-a-whole-number", "This must be a whole number."),
    "int_parsing_size": Message("not-a-whole-number", "This whole number is too large."),
    "int_from_float": Message("not-a-whole-number", "This must be a whole number."),
    "bool_type": Message("not-a-truth-value", "This must be true or false."),
    "bool_parsing": Message("not-a-truth-value", "This must be true or false."),
    "greater_than": Message("too-small", "This must be greater than %(gt)g."),
    "greater_than_equal": Message("too-small", "This must not be less than %(ge)g."),
    "less_than": Message("too-large", "This must be less than %(lt)g."),
    "less_than_equal": Message("too-large", "This must not be greater than %(le)g."),
    "string_type": Message("not-text", "This must be text in quotation marks."),
    "string_unicode": Message("not-text", "This text has characters that are not Unicode."),
    "string_pattern_mismatch": Message("bad-character", "This text has a character that cannot be kept."),
    "string_too_short": Message("empty", "This must not be empty."),
    "string_too_long": Message("too-long", "This text may have at most %(max_length)d characters."),
    "literal_error": Message("unknown-choice", "This must be %(expected)s."),
    "datetime_type": Message("bad-time", "This must be a time, written like 2026-03-01T09:30:00+03:00."),
    "datetime_parsing": Message("bad-time", "This must be a time, written like 2026-03-01T09:30:00+03:00."),
    "datetime_from_date_parsing": Message(
        "bad-time", "This must be a time, written like 2026-03-01T09:30:00+03:00."
    ),
    "year_range": Message("bad-time", "The year must lie between 1900 and 2199."),
    "date_type": Message("bad-day", "This must be a day, written like 2026-03-01."),
    "date_parsing": Message("bad-day", "This must be a day, written like 2026-03-01."),
    "date_from_datetime_parsing": Message("bad-day", "This must be a day, written like 2026-03-01."),
    "value_error": Message("bad-value", "This value cannot be used."),
    "list_type": Message("not-a-list", "This must be a list, in square brackets."),
    "too_short": Message("too-few", "Give at least %(min_length)d here."),
    "too_long": Message("too-many", "Give at most %(max_length)d here."),
    "model_attributes_type": Message("not-an-object", "This must be an object, in braces."),
    "model_type": Message("not-an-object", "This must be an object, in braces."),
    "dict_type": Message("not-an-object", "This must be an object, in braces."),
    "json_invalid": Message("bad-json", "This is not JSON: %(error)s at character %(at)d."),
}
_OTHER: Final = Message("bad-value", "This value cannot be used here.")


def worded(error: Mapping[str, Any]) -> Message:
    """One of pydantic's errors as a code and a sentence."""
    message = _WORDS.get(error["type"], _OTHER)
    values = dict(error.get("ctx", {}))
    if error["type"] == "json_invalid":
        values["at"] = error["loc"][-1]
    return replace(message, values=values)
