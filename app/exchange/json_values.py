"""What JSON knows, made of what the solver says: messages, numbers that may be unknown, equal bytes."""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from solver.errors import Message

Json = dict[str, Any]


def message_json(message: Message) -> Json:
    """Write a message: its code and sentence, and what another language needs to say it."""
    plain: Json = {"code": message.code, "message": message.text}
    if message.values:
        plain |= {"template": message.template, "values": _plain(message.values)}
    return plain


def message_from(stored: Mapping[str, Any]) -> Message:
    """Read back what `message_json` wrote."""
    template = stored.get("template") or stored["message"]
    return Message(stored["code"], template, stored.get("values") or {})


def _plain(value: Any) -> Any:
    """Turn a message's values into what JSON knows."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return finite(value)
    return value if isinstance(value, str | int | bool | None) else str(value)


def finite(value: float | None) -> float | None:
    """The number, or None when it is unknown or not finite: JSON has no NaN."""
    return None if value is None or not math.isfinite(value) else float(value)


def dumps(content: Any, *, indent: int | None = None) -> str:
    """Write JSON, equal content to equal bytes: keys in their given order, no NaN, letters as they are."""
    return json.dumps(content, ensure_ascii=False, allow_nan=False, indent=indent)
