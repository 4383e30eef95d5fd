"""What the command `oldmap` writes for GIS programs: the rectified scan, and layers."""

from __future__ import annotations

from pathlib import Path

from projdist import gis
from projdist.applications.oldmaps import RECTIFIED_BY, OldMap, rectify
from projdist.cli.errors import refuse
from projdist.cli.layers import check_libraries
from projdist.cli.options import choice, file_of_kind, number
from projdist.cli.output import drawing
from projdist.cli.progress import working
from projdist.support import tell

SHEETS = (".tif", ".tiff")
LAYERS = (".gpkg",)


class OldMapFile:
    """Where a sheet or layers go; a wrong word ends the command with 2."""

    def __init__(
        self,
        output: str,
        *,
        image: str | None,
        by: str | None,
        resolution: str | None,
        overwrite: bool,
    ) -> None:
        self.path = file_of_kind(output, (*SHEETS, *LAYERS), overwrite)
        self._overwrite = overwrite
        self._is_sheet = self.path.suffix.lower() in SHEETS
        allowed = list(RECTIFIED_BY) if self._is_sheet else [name for name in RECTIFIED_BY if name != "fit"]
        self._by = choice("rectification", by, allowed) if by is not None else "fit" if self._is_sheet else "mdt"
        self._resolution = None if resolution is None else number("resolution", resolution, 1e-6, 1e7, " of metres")
        if self._is_sheet:
            if image is None:
                refuse(f"Invalid output '{output}'. It needs a scan: --image FILE.")
            if self.path.exists() and Path(image).exists() and self.path.samefile(image):
                refuse(f"Invalid output '{output}'. It is the scan.")
            self._image = image
        else:
            for name, value in (("image", image), ("resolution", resolution)):
                if value is not None:
                    refuse(f"Invalid option '--{name}' for '{output}'. It is for pictures and rectified scans.")
        check_libraries(self.path)

    def save(self, found: OldMap) -> None:
        """Write the file, and tell where it has no CRS; what cannot be done ends the command."""
        with drawing(self.path), working("Drawing"):
            if self._is_sheet:
                sheet = rectify(found, self._image, by=self._by, resolution=self._resolution)
                gis.save_sheet(sheet, self.path, crs=found.points.crs, overwrite=self._overwrite)
            else:
                gis.save_layers(gis.old_map_layers(found, by=self._by), self.path, overwrite=self._overwrite)
        if found.points.crs is None:
            tell(f"'{self.path}' has no CRS, but metres of a plane without a name; --crs states it.")
