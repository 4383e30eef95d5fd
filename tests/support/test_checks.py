"""Arguments that are none: one line each, with what was given."""

import numpy as np
import pytest
from tables import each

from projdist.support.checks import check_number, check_numbers, check_pair, check_path, check_whole_number


@each(
    ("check", "value", "message"),
    [
        (check_number, "1", "Invalid thing '1'. It must be a number."),
        (check_number, True, "Invalid thing 'True'. It must be a number."),
        (check_number, None, "Invalid thing 'None'. It must be a number."),
        (check_number, [1.0, 2.0], "It must be a number."),
        (check_number, 1j, "It must be a number."),
        (check_whole_number, 1.0, "Invalid thing '1.0'. It must be a whole number, 0 or more."),
        (check_whole_number, -1, "Invalid thing '-1'. It must be a whole number, 0 or more."),
        (check_whole_number, True, "It must be a whole number, 0 or more."),
        (check_numbers, None, "Invalid thing"),
        (check_numbers, ["x"], "Invalid thing"),
        (check_pair, [1.0, 2.0, 3.0], "They must be two numbers."),
        (check_pair, 1.0, "They must be two numbers."),
        (check_path, 3, "Invalid thing '3'. It must be the path of a file."),
    ],
)
def test_refused(check, value, message):
    """What it is, and what it must be."""
    with pytest.raises(ValueError, match=r"^Invalid thing") as refused:
        check("thing", value)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_accepted():
    """Numbers of numpy are numbers, too."""
    assert check_number("thing", np.float32(1.5)) == 1.5
    assert check_number("thing", 2) == 2.0
    assert check_whole_number("thing", np.int8(3)) == 3
    assert check_pair("thing", (1, np.nan))[0] == 1.0
    assert check_numbers("thing", (1, 2)).dtype == float
    assert check_path("thing", "a/b").name == "b"
