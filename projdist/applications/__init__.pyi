from . import mosaics, oldmaps, pointclouds

__all__ = ["mosaics", "oldmaps", "pointclouds"]
