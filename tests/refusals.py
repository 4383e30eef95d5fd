"""Calls that must be refused."""

from collections.abc import Callable
from typing import Any

import pytest


def refuses(match: str, function: Callable[..., Any], *args: Any, **words: Any) -> None:
    """The call raises ValueError with a message that matches."""
    with pytest.raises(ValueError, match=match):
        function(*args, **words)
