"""The command line: parse, call one function, format. The home of typer and rich."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
