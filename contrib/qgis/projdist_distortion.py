"""A script for the Processing toolbox of QGIS: what a CRS does to a layer, and the CRS that would be better.

It runs the command `projdist`, which needs `projdist[gis]` in any Python of this machine. See README.md beside it.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsProcessing,
    QgsProcessingAlgorithm,
    QgsProcessingException,
    QgsProcessingOutputString,
    QgsProcessingParameterCrs,
    QgsProcessingParameterEnum,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterString,
    QgsProcessingParameterVectorDestination,
    QgsProcessingParameterVectorLayer,
    QgsVectorFileWriter,
)

PURPOSES = ["any", "conformal", "equal-area", "equidistant", "compromise"]
MEASURES = ["scale_error_ppm", "areal_error_ppm", "angular_distortion", "fisher"]
NARROWEST = 0.01  # degrees
# What QGIS sets for its own Python, PROJ and GDAL is wrong for those of the command.
ITS_OWN = ("PYTHONHOME", "PYTHONPATH", "PROJ_LIB", "PROJ_DATA", "GDAL_DATA", "GDAL_DRIVER_PATH", "LD_LIBRARY_PATH")


# ---- the command lines ----------------------------------------------------------------------


def check_line(command: str, data: str, crs: str, purpose: str) -> list[str]:
    """The words that check a layer in a CRS."""
    return [command, "check", data, "--crs", crs, "--suggest", "--purpose", purpose, "--format", "json"]


def report_line(command: str, data: str, crs: str, purpose: str, path: str) -> list[str]:
    """The words that write the same as a page."""
    return [*check_line(command, data, crs, purpose)[:-2], "--output", path, "--overwrite"]


def tissot_line(command: str, crs: str, region: str, path: str) -> list[str]:
    """The words that write Tissot's indicatrices as a layer."""
    return [command, "tissot", crs, "--region", region, "--output", path, "--overwrite"]


def heatmap_line(command: str, crs: str, region: str, measure: str, path: str) -> list[str]:
    """The words that write a measure as a raster."""
    return [command, "heatmap", crs, "--region", region, "--measure", measure, "--output", path, "--overwrite"]


def box_of(west: float, south: float, east: float, north: float) -> str:
    """The region of an extent in degrees, which is at least a kilometre wide."""
    west, east = min(west, east - NARROWEST), max(east, west + NARROWEST)
    south, north = max(-90.0, min(south, north - NARROWEST)), min(90.0, max(north, south + NARROWEST))
    return f"box:{west:.9g},{south:.9g},{east:.9g},{north:.9g}"


def environment() -> dict[str, str]:
    """The environment without what QGIS has set for itself."""
    return {name: value for name, value in os.environ.items() if name not in ITS_OWN}


def run(words: list[str]) -> str:
    """What a command prints; raises QgsProcessingException with its own words where it fails."""
    try:
        done = subprocess.run(words, capture_output=True, text=True, encoding="utf-8", env=environment(), check=False)
    except OSError as error:
        raise QgsProcessingException(
            f"The command '{words[0]}' cannot be run ({error.strerror}). Install projdist[gis], or state its path."
        ) from error
    if done.returncode:
        raise QgsProcessingException(done.stderr.strip() or f"{words[0]} ended with {done.returncode}.")
    return done.stdout


def summary_of(found: dict) -> list[str]:
    """Lines on a check: the errors in the CRS, and in the one that is recommended."""
    lines = [_errors(found["crs"], found["name"], found["overall"])]
    better = found.get("recommended")
    if better:
        lines.append("Recommended: " + _errors(better["crs"], better["name"], better["overall"]))
    return [*lines, *found["notes"]]


def _errors(code: str, name: str, overall: dict) -> str:
    areas, lengths = (overall[f"{what}_error"] for what in ("area", "length"))
    parts = [
        f"{what} off by {100.0 * error:+.4g} %"
        for what, error in (("areas", areas), ("lengths", lengths))
        if error is not None
    ]
    return f"{code} ({name}): {', '.join(parts)}"


# ---- the algorithm --------------------------------------------------------------------------


class ProjdistDistortion(QgsProcessingAlgorithm):
    """Errors of a layer in a CRS, a better CRS, indicatrices and a heat map over the layer's extent."""

    def createInstance(self):
        return ProjdistDistortion()

    def name(self):
        return "projdist_distortion"

    def displayName(self):
        return "Distortion of a layer by its CRS"

    def group(self):
        return "projdist"

    def groupId(self):
        return "projdist"

    def shortHelpString(self):
        return (
            "Checks areas, lengths and bearings of a layer in a CRS, and recommends a better one. "
            "Adds Tissot's indicatrices and a raster of a measure over the layer's extent. Without a CRS it "
            "is the layer's own, or the project's. The command projdist does it all: pip install 'projdist[gis]'."
        )

    def initAlgorithm(self, configuration=None):
        lines_and_polygons = [QgsProcessing.TypeVectorLine, QgsProcessing.TypeVectorPolygon]
        self.addParameter(QgsProcessingParameterVectorLayer("INPUT", "Layer", lines_and_polygons))
        self.addParameter(QgsProcessingParameterCrs("CRS", "CRS to check it in", optional=True))
        self.addParameter(QgsProcessingParameterEnum("PURPOSE", "Recommend for", PURPOSES, defaultValue=0))
        self.addParameter(QgsProcessingParameterEnum("MEASURE", "Measure of the heat map", MEASURES, defaultValue=0))
        self.addParameter(QgsProcessingParameterString("COMMAND", "Command, or its path", "projdist"))
        report = QgsProcessingParameterFileDestination("REPORT", "Report", "HTML (*.html)", optional=True)
        indicatrices = QgsProcessingParameterVectorDestination("TISSOT", "Tissot's indicatrices", optional=True)
        raster = QgsProcessingParameterRasterDestination("HEATMAP", "Heat map", optional=True)
        for parameter in (report, indicatrices, raster):
            self.addParameter(parameter)
        self.addOutput(QgsProcessingOutputString("RECOMMENDED", "Recommended CRS"))
        self.addOutput(QgsProcessingOutputString("ERRORS", "Errors"))

    def processAlgorithm(self, parameters, context, feedback):
        layer = self.parameterAsVectorLayer(parameters, "INPUT", context)
        stated = self.parameterAsCrs(parameters, "CRS", context)
        project = context.project().crs() if context.project() else QgsCoordinateReferenceSystem()
        crs = _crs_text([stated] if stated.isValid() else [layer.crs(), project])
        purpose = PURPOSES[self.parameterAsEnum(parameters, "PURPOSE", context)]
        measure = MEASURES[self.parameterAsEnum(parameters, "MEASURE", context)]
        command = self.parameterAsString(parameters, "COMMAND", context)
        targets = {name: self._target(name, parameters, context) for name in ("REPORT", "TISSOT", "HEATMAP")}
        region = _region_of(layer, context)
        with tempfile.TemporaryDirectory() as folder:
            data = self._written(layer, parameters, context, folder)
            found = json.loads(run(check_line(command, data, crs, purpose)))
            for line in summary_of(found):
                feedback.pushInfo(line)
            feedback.setProgress(40)
            if targets["REPORT"]:
                run(report_line(command, data, crs, purpose, targets["REPORT"]))
        if targets["TISSOT"] and not feedback.isCanceled():
            run(tissot_line(command, crs, region, targets["TISSOT"]))
        feedback.setProgress(70)
        if targets["HEATMAP"] and not feedback.isCanceled():
            run(heatmap_line(command, crs, region, measure, targets["HEATMAP"]))
        better = found.get("recommended") or {}
        made = {name: path for name, path in targets.items() if path}
        return made | {"RECOMMENDED": better.get("crs", ""), "ERRORS": json.dumps(found["overall"])}

    def _target(self, name, parameters, context):
        """The path of an output, "" where none is wanted."""
        if name == "REPORT":
            return self.parameterAsFileOutput(parameters, name, context)
        return self.parameterAsOutputLayer(parameters, name, context)

    def _written(self, layer, parameters, context, folder):
        """A file with the layer as the map shows it, whatever its source: a database, or features in memory."""
        path = self.parameterAsCompatibleSourceLayerPath(parameters, "INPUT", context, ["gpkg", "geojson"], "gpkg")
        if path and os.path.isfile(path) and layer.dataProvider().subLayerCount() <= 1:
            return path
        options = QgsVectorFileWriter.SaveVectorOptions()
        options.driverName, path = "GPKG", os.path.join(folder, "layer.gpkg")
        error = QgsVectorFileWriter.writeAsVectorFormatV3(layer, path, context.transformContext(), options)
        if error[0]:
            raise QgsProcessingException(f"The layer cannot be written for the command: {error[1]}.")
        return path


def _crs_text(candidates) -> str:
    """The code of the first CRS that has a map plane, or WKT of one that has no code."""
    crs = next((one for one in candidates if one.isValid() and not one.isGeographic()), None)
    if crs is None:
        raise QgsProcessingException("Neither the layer's CRS nor the project's is of a map: state a projected one.")
    code = crs.authid()
    return crs.toWkt(QgsCoordinateReferenceSystem.WKT2_2019) if not code or code.startswith("USER:") else code


def _region_of(layer, context) -> str:
    """The box about a layer in degrees."""
    degrees = QgsCoordinateTransform(layer.crs(), QgsCoordinateReferenceSystem("EPSG:4326"), context.transformContext())
    extent = degrees.transformBoundingBox(layer.extent(), handle180Crossover=True)
    return box_of(extent.xMinimum(), extent.yMinimum(), extent.xMaximum(), extent.yMaximum())
