"""Panoramas of pictures with known rotations, against OpenCV's stitcher in its spherical mode, as a Markdown table.

`python benchmarks/mosaics.py [folder for what is drawn]`: the pictures are those of the tests. OpenCV's
`Stitcher` in the mode PANORAMA estimates rotations and focal lengths by bundle adjustment of rays, and draws on plate
carrée.
"""

import sys
import time
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

import projdist
from projdist.applications.mosaics import match, open_pictures, panorama, render

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from panorama_pictures import cameras, off_by, picture

WIDTH, HEIGHT, FOCAL = 480, 400, 420.0
SETS = {
    "100 degrees, 5 pictures": (cameras(np.random.default_rng(1), np.linspace(-25, 25, 5)), FOCAL),
    "150 degrees, 5 pictures": (cameras(np.random.default_rng(2), np.linspace(-50, 50, 5)), FOCAL),
    "150 degrees in two rows, 12": (
        cameras(np.random.default_rng(3), np.tile(np.linspace(-50, 50, 6), 2), np.repeat([-18.0, 18.0], 6)),
        FOCAL,
    ),
    "a full turn, 10": (cameras(np.random.default_rng(2), 36.0 * np.arange(10)), FOCAL),
    "all round, 18": (
        cameras(
            np.random.default_rng(2),
            np.r_[45.0 * np.arange(8), 45.0 * np.arange(8), 0.0, 0.0],
            np.r_[[-35.0] * 8, [35.0] * 8, 90.0, -90.0],
        ),
        270.0,
    ),
}


def ours(pixels):
    """Pictures used, rotations, focal lengths, what is drawn, its projection, and the distortion."""
    pictures = open_pictures(pixels)
    found = panorama(match(pictures))
    best = projdist.optimize("auto", found, criterion="airy_kavrayskiy_scaled", ellipsoid="sphere")
    drawn = render(found.mapped(best.projection), pictures)
    plain = projdist.summarize("plate-carree", found).airy_kavrayskiy_scaled
    name = best.projection.definition.split()[0].removeprefix("+proj=")
    words = f"{name} {best.value:.3f}, plate carrée {plain:.3f}"
    return found.images, found.cameras.rotations, found.cameras.focals, drawn.pixels, words


def theirs(pixels):
    """The same of OpenCV, whose cameras tell focal lengths in pixels of what it matched; None where it gives up."""
    stitcher = cv2.Stitcher_create(cv2.Stitcher_PANORAMA)
    status, drawn = stitcher.stitch([np.ascontiguousarray(one[..., ::-1]) for one in pixels])
    if status != cv2.Stitcher_OK:
        return None
    found = stitcher.cameras()
    share = min(1.0, np.sqrt(stitcher.registrationResol() * 1e6 / (WIDTH * HEIGHT)))
    rotations = np.stack([one.R.astype(float) for one in found])
    focals = np.array([one.focal for one in found]) / share
    return list(stitcher.component()), rotations, focals, drawn[..., ::-1], "plate carrée"


def main():
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    print("| set | tool | pictures used | rotations off by | focal length off by | s | drawn in, distortion |")
    print("| --- | --- | ---: | ---: | ---: | ---: | --- |")
    for name, (R, f) in SETS.items():
        pixels = [picture(one, f, WIDTH, HEIGHT) for one in R]
        for tool, run in (("projdist", ours), ("OpenCV", theirs)):
            start = time.process_time()
            found = run(pixels)
            seconds = time.process_time() - start
            if found is None:
                print(f"| {name} | {tool} | none | | | {seconds:.1f} | |", flush=True)
                continue
            images, rotations, focals, drawn, words = found
            off, share = off_by(rotations, R[images]), 100.0 * np.abs(focals / f - 1.0).max()
            used = f"{len(images)} of {len(R)}"
            print(f"| {name} | {tool} | {used} | {off:.2f}° | {share:.2f} % | {seconds:.1f} | {words} |", flush=True)
            if folder is not None:
                Image.fromarray(drawn).save(folder / f"{name.split(',')[0].replace(' ', '_')}_{tool}.png")


if __name__ == "__main__":
    main()
