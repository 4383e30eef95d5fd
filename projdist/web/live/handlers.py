"""Handlers of requests: pictures, figures, parameters, recommendations, corrections, designs, checks and exports."""

from __future__ import annotations

import shlex
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely

from projdist._typing import FloatArray
from projdist.field import sample
from projdist.projections import Projection, ProjectionError, ProjectionLike, crs_of, crs_wkt, tunable
from projdist.regions import Place, get_region, polygons_of, region_title
from projdist.support import check_choice, one_line
from projdist.surfaces import shown_part, surface_of
from projdist.web.frames import Arrays, frame_of
from projdist.web.page import cell_step, colour_scales

_MOST = 4000  # points of a region
_MOST_OF_FEATURE = 500


def outline(region: Place) -> tuple[dict[str, Any], Arrays]:
    """Outline of a region to be moved over a map, with its title and centre; raises ValueError."""
    if not region.area_km2 or region.bounds[2] - region.bounds[0] >= 360.0:
        raise ValueError("Only a region that is a part of the globe can be moved over a map.")
    rings = shapely.get_rings(shapely.get_parts(polygons_of(region)))
    lines = [shapely.get_coordinates(ring) for ring in rings]
    step = max(1, sum(map(len, lines)) // _MOST)
    west, south, east, north = region.bounds
    header = {"title": region_title(region), "middle": [0.5 * (west + east), 0.5 * (south + north)]}
    return header, packed_lines([line[::step] for line in lines if len(line) > 2 * step])


def feature_lines(geometries: Sequence[Any]) -> Arrays:
    """Longest line of each geometry, thinned."""
    return packed_lines([_longest(geometry) for geometry in geometries])


def _longest(geometry: Any) -> FloatArray:
    rings = shapely.get_rings(shapely.get_parts(geometry))
    parts = rings if rings.size else shapely.get_parts(geometry)
    longest = max(map(shapely.get_coordinates, parts), key=len, default=np.empty((0, 2)))
    return longest[:: max(1, len(longest) // _MOST_OF_FEATURE)]


def packed_lines(lines: Sequence[FloatArray]) -> Arrays:
    """Lines as concatenated points and the number of points of each."""
    return {
        "points": np.concatenate([np.empty((0, 2)), *lines]).astype(np.float32),
        "sizes": np.array([len(line) for line in lines], dtype=np.uint32),
    }


# ---- pictures ------------------------------------------------------------------------------------


_KEPT = 24  # maps whose values take part in the colours


@dataclass
class Pictures:
    """Makes pictures, and keeps the last Jacobians so that all maps of a page share a scale."""

    kept: OrderedDict[tuple[str, str], tuple[FloatArray, FloatArray]] = field(default_factory=OrderedDict)

    def picture(
        self, projection: Projection, region: Place, beside: Sequence[str] = ()
    ) -> tuple[dict[str, Any], Arrays]:
        """Header and arrays of a map, in a colour scale shared with the maps `beside`; raises ValueError."""
        shown = shown_part(region)
        surface = surface_of(projection, shown, cell_step(shown.bounds))
        header, arrays, J = frame_of(surface, projection.label)
        self._keep((projection.definition, region.name), (J, surface.weights))
        header |= {
            "resolved": projection.definition,
            "name": projection.name,
            "region_title": region_title(region),
        }
        return header | self.scales(region, [projection.definition, *beside]), arrays

    def scales(self, region: Place, definitions: Sequence[str]) -> dict[str, Any]:
        """Colour scales shared by the kept pictures of a region, and the definitions of these maps."""
        together = [one for one in dict.fromkeys(definitions) if (one, region.name) in self.kept]
        values = [self.kept[definition, region.name] for definition in together]
        scales = colour_scales([J for J, _ in values], [weights for _, weights in values])
        return {"scales": list(scales), "together": together}

    def _keep(self, key: tuple[str, str], values: tuple[FloatArray, FloatArray]) -> None:
        self.kept[key] = values
        self.kept.move_to_end(key)
        while len(self.kept) > _KEPT:
            self.kept.popitem(last=False)


# ---- answers to requests --------------------------------------------------------------------------


Progress = Callable[[int, int], None]

EXPORTS = ("png", "svg", "pdf", "html")
_KINDS = ("any", "conformal", "equal-area")
_TOLERANCE = 1e-4  # of Airy-Kavrayskiy errors
_LISTED = 12  # CRSs
_WORST = 20  # features
_DOTS = 150.0  # an inch


def figures_of(projection: Projection, region: Place) -> dict[str, Any]:
    """Airy-Kavrayskiy errors with their uncertainty and parts, or the reason why they are undefined."""
    try:
        found = sample(projection, region, tolerance=_TOLERANCE)
        errors, (angles, areas) = found.airy_kavrayskiy, found.angles_and_areas
    except ProjectionError as error:
        return {"reason": one_line(error)}
    return {
        "airy_kavrayskiy": _finite(errors.raw),
        "airy_kavrayskiy_scaled": _finite(errors.scaled),
        "airy_kavrayskiy_affine": _finite(errors.affine),
        "error": _finite(errors.error),
        "angles": _finite(angles),
        "areas": _finite(areas),
        "coverage": found.coverage,
    }


def _finite(value: float) -> float | None:
    return float(value) if abs(value) < float("inf") else None


def parameter_ranges(projection: ProjectionLike) -> dict[str, Any]:
    """Adjustable parameters of a map, and how it can be dragged."""
    found = tunable(projection)
    return {
        "tunable": found.definition,
        "drags": found.drags,
        "centre": found.centre,
        "parameters": [
            {name: getattr(one, name) for name in ("name", "label", "unit", "low", "high", "step", "value")}
            for one in found.parameters
        ],
    }


def recommended(region: Place, options: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """The best CRSs for a region; raises ValueError."""
    from projdist.decisions import recommend

    found = recommend(
        region,
        purpose=str(options.get("purpose", "any")),
        criterion=str(options.get("criterion", "airy_kavrayskiy")),
        limit=_LISTED,
        progress=progress,
    )
    rows = [
        {
            "definition": one.code,
            "name": one.name,
            "value": one.value,
            "error": one.distortion.error_estimate,
            "largest": _finite(one.distortion.max_scale_error_ppm),
            "omega": _finite(one.distortion.max_omega),
            "keeps": list(one.keeps),
            "share": one.share,
            "national": one.national,
            **_parts(one.code, region),
        }
        for one in found.results
    ]
    return {"rows": rows, "notes": list(found.notes), "candidates": found.candidates, "limit": found.limit}


def _parts(code: str, region: Place) -> dict[str, Any]:
    figures = figures_of(Projection.from_user_input(code), region)
    return {name: figures.get(name) for name in ("angles", "areas")}


def corrected(projection: Projection, region: Place) -> dict[str, Any]:
    """The best linear correction of a map over a region; raises ValueError."""
    from projdist.answers import correct

    found = correct(projection, region)
    definition = found.parameters or found.pipeline
    if definition is None:
        raise ProjectionError(f"'{projection.label}' corrected has no PROJ string.")
    return {
        "definition": definition,
        "words": found.words,
        "before": found.airy_kavrayskiy,
        "after": found.airy_kavrayskiy_corrected,
        "error": found.error_estimate,
    }


def designed(region: Place, options: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """The map made to measure for a region; raises ValueError."""
    from projdist.designs import design

    kind = check_choice("kind", str(options.get("kind", "any")), _KINDS)
    found = design(region, kind=kind, progress=lambda text: progress(0, 0))
    best = min((rival.value for rival in found.rivals), default=None)
    return {
        "definition": found.proj,
        "words": f"Degree {found.degree} on {found.base.label}.",
        "before": best,
        "after": found.value,
        "error": found.error,
        "notes": list(found.notes),
    }


def checked(projection: Projection, file: bytes) -> tuple[dict[str, Any], Arrays]:
    """The worst features of GeoJSON in a map, with their outlines; raises ValueError."""
    from projdist.decisions import check
    from projdist.gis import frame_of_geojson

    frame = frame_of_geojson(file)
    found = check(frame, projection, purpose=None)
    errors = np.abs(found.features["area_error"])
    lengths = np.abs(found.features["length_error"])
    worst = np.argsort(-np.nan_to_num(np.fmax(errors, lengths), nan=-1.0))[:_WORST]
    lines = feature_lines(frame.geometry.iloc[worst])
    return {"rows": found.rows(worst.tolist()), "count": len(frame), "notes": list(found.notes)}, lines


def texts(projection: Projection, region: Place) -> dict[str, Any]:
    """Command, PROJ string, WKT2 and PROJJSON of a map, to be copied."""
    found = {}
    if _have_texts(projection, region):
        found["Command"] = shlex.join(["projdist", "heatmap", projection.definition, "--region", region.name])
    if projection.definition.startswith("+"):
        found["PROJ"] = projection.definition
    wkt = _wkt(projection)
    if wkt:
        found["WKT2"] = wkt
        found["PROJJSON"] = crs_of(wkt).to_json(pretty=True)
    return {"texts": found}


def _have_texts(projection: Projection, region: Place) -> bool:
    """True if texts can name the map and the region, which objects of a notebook have not."""
    try:
        Projection.from_user_input(projection.definition)
        get_region(region.name)
    except ValueError:
        return False
    return True


def _wkt(projection: Projection) -> str | None:
    """WKT2 of a projection, None if it has none."""
    if ":" in projection.definition and not projection.definition.startswith("+"):
        return str(crs_of(projection.definition).to_wkt("WKT2_2019", pretty=True))
    return crs_wkt(projection, projection.name)[0]


def exported(projection: Projection, region: Place, options: Mapping[str, Any]) -> tuple[dict[str, Any], Arrays]:
    """A picture or a page as a file; raises ValueError."""
    suffix = check_choice("format", str(options.get("format", "png")), EXPORTS)
    measure = str(options.get("measure", "fisher"))
    if suffix == "html":
        content = _page(projection, region, measure).encode()
    else:
        content = _picture(projection, region, measure, suffix, bool(options.get("ellipses")))
    arrays: Arrays = {"file": np.frombuffer(content, dtype=np.uint8)}
    return {"name": f"projdist.{suffix}"}, arrays


def _page(projection: Projection, region: Place, measure: str) -> str:
    from projdist.web.page import Page, draw_maps, page_html

    maps = draw_maps([projection], titles=[projection.label], region=region, measure=measure)
    copies = texts(projection, region)["texts"]
    return page_html(Page(title=f"{projection.label}: {region_title(region)}", copies=copies, maps=maps))


def _picture(projection: Projection, region: Place, measure: str, suffix: str, ellipses: bool) -> bytes:
    from projdist import plots

    if ellipses:
        figure = plots.tissot_figure(projection, region=region)
    else:
        figure = plots.heatmap_figure(projection, region=region, measure=measure)
    return plots.encoded(figure, f".{suffix}", dpi=_DOTS)
