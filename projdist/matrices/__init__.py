"""Matrices of any dimension, and nothing of the Earth: what each does to shapes, and the means of many."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
