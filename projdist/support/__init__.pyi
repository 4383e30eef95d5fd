from . import hints
from .answers import Answer, plain
from .checks import (
    check_choice,
    check_degrees,
    check_instance,
    check_number,
    check_numbers,
    check_pair,
    check_path,
    check_text,
    check_whole_number,
    listed_values,
    quoted,
)
from .executors import check_executor, is_picklable, open_executor, own_executor, run_all
from .files import is_stream, refuse_existing, replacing
from .hints import NEAR, close_words, did_you_mean, listed, one_line, shown
from .notices import Notice, tell
from .signals import end_if_told, orderly_end
from .text_tables import MISSING, cells_of, is_number, number_of, numbered_rows, read_text

__all__ = [
    "MISSING",
    "NEAR",
    "Answer",
    "Notice",
    "cells_of",
    "check_choice",
    "check_degrees",
    "check_executor",
    "check_instance",
    "check_number",
    "check_numbers",
    "check_pair",
    "check_path",
    "check_text",
    "check_whole_number",
    "close_words",
    "did_you_mean",
    "end_if_told",
    "hints",
    "is_number",
    "is_picklable",
    "is_stream",
    "listed",
    "listed_values",
    "number_of",
    "numbered_rows",
    "one_line",
    "open_executor",
    "orderly_end",
    "own_executor",
    "plain",
    "quoted",
    "read_text",
    "refuse_existing",
    "replacing",
    "run_all",
    "shown",
    "tell",
]
