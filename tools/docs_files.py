"""What the generators share: the folders of the documentation, small PNGs, and the parts of the gallery's page."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from PIL import Image

DOCS = Path(__file__).parents[1] / "docs"
IMAGES = DOCS / "images"
GALLERY = DOCS / "gallery.md"
DPI = 150


def write_png(figure: Figure, path: Path, cmap: str = "viridis_r", colours: int = 256) -> None:
    """A PNG with a palette: a third of the size."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI)
    picture = Image.open(buffer).convert("RGB")
    # The palette is chosen for the picture and, so that rare colours stay, for a strip of the whole colour map.
    strip = np.tile((colormaps[cmap](np.linspace(0.0, 1.0, picture.width))[:, :3] * 255).astype(np.uint8), (60, 1, 1))
    palette = Image.fromarray(np.concatenate([picture, strip])).quantize(colours)
    indexed = picture.quantize(palette=palette, dither=Image.Dither.NONE)
    values = np.array(indexed.getpalette()).reshape(-1, 3)
    values[indexed.getpixel((0, 0))] = 255  # paper stays white
    indexed.putpalette(values.ravel().tolist())
    indexed.save(path, optimize=True)
    print(f"{path.relative_to(DOCS)}: {picture.width} x {picture.height}, {path.stat().st_size / 1000:.0f} kB")


def write_part(name: str, text: str) -> None:
    """Replace a part of the gallery's page, which stands between two comments."""
    begin, end = f"<!-- begin: {name} -->\n", f"<!-- end: {name} -->\n"
    page = GALLERY.read_text(encoding="utf-8")
    head, found, rest = page.partition(begin)
    _, closed, tail = rest.partition(end)
    if not found or not closed:
        raise ValueError(f"{GALLERY} has no part '{name}'.")
    GALLERY.write_text(f"{head}{begin}\n{text.strip()}\n\n{end}{tail}", encoding="utf-8")
