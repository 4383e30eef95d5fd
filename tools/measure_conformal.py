"""Print the table of docs/design.md: what conformal maps of countries reach, and what none can have less than.

`python tools/measure_conformal.py [CODE ...]`, by default thirty countries; half a minute each.
"""

from __future__ import annotations

import sys

import projdist
from projdist import decisions

CODES = "CH DE KE UY BT HU TR ZM IS BO AT CZ PL ES IT RO UG GH IE FI SE BW EG LK MG NP PT RS ZW FR".split()
CRITERION = "max_scale_error_ppm"


def main() -> None:
    print("| ppm | degree 20 | and poles | their number | proven for every conformal map | reached, over proven |")
    print("| --- | --- | --- | --- | --- | --- |")
    for code in sys.argv[1:] or CODES:
        region = projdist.get_region(f"country:{code}@main")
        extent = decisions.extent_of(region)
        base = f"+proj=stere +lat_0={extent.lat:.4f} +lon_0={extent.lon:.4f} +ellps=WGS84"
        plain, poled = (
            projdist.design(
                region, kind="conformal", criterion=CRITERION, degree=20, poles=poles, base=base, against=()
            )
            for poles in (0, "auto")
        )
        proven = float(f"{poled.proven:.3g}")
        figures = (
            f"{plain.value:.4g} | {poled.value:.4g} | {poled.poles} | {proven:g} | {poled.value / poled.proven:.2f}"
        )
        print(f"| {region.name} | {figures} |", flush=True)


if __name__ == "__main__":
    main()
