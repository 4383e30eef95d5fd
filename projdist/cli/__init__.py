"""The command line: parse, call one function, format. The home of typer and rich."""

from projdist.cli.app import main

__all__ = ["main"]
