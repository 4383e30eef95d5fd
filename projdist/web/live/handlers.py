"""Handlers of requests: pictures, figures, parameters, recommendations, corrections, designs, checks and exports."""

import contextlib
import shlex
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely

from projdist import answers, decisions, designs, gis, plots, projections, regions, support, surfaces
from projdist._typing import FloatArray
from projdist.field import sample
from projdist.projections import Projection
from projdist.web import frames, page

_MOST = 4000  # points of an outline
_MOST_OF_FEATURE = 500  # points of the outline of a feature


def outline(region: regions.Place) -> frames.Frame:
    """Outline of a region to be moved over a map, with its title and centre; raises ValueError."""
    if not region.area_km2 or region.bounds[2] - region.bounds[0] >= 360.0:
        raise ValueError("Only a region that is a part of the globe can be moved over a map.")
    rings = shapely.get_rings(shapely.get_parts(regions.polygons_of(region)))
    lines = [shapely.get_coordinates(ring) for ring in rings]
    step = max(1, sum(map(len, lines)) // _MOST)
    west, south, east, north = region.bounds
    header = {"title": regions.region_title(region), "middle": [0.5 * (west + east), 0.5 * (south + north)]}
    return header, _packed_lines([line[::step] for line in lines if len(line) > 2 * step])


def _packed_lines(lines: Sequence[FloatArray]) -> frames.Arrays:
    """Lines as concatenated points and the number of points of each."""
    return {
        "points": np.concatenate([np.empty((0, 2)), *lines]).astype(np.float32),
        "sizes": np.array([len(line) for line in lines], dtype=np.uint32),
    }


_KEPT = 24  # maps that may share a colour scale


@dataclass
class Pictures:
    """Makes pictures, and keeps the latest Jacobians so that all maps of a page share a colour scale."""

    kept: OrderedDict[tuple[str, str], tuple[FloatArray, FloatArray]] = field(default_factory=OrderedDict)

    def picture(self, projection: Projection, region: regions.Place, beside: Sequence[str] = ()) -> frames.Frame:
        """Header and arrays of a map, in a colour scale shared with the maps `beside`; raises ValueError."""
        shown = surfaces.shown_part(region)
        surface = surfaces.surface_of(projection, shown, page.cell_step(shown.bounds))
        header, arrays, J = frames.frame_of(surface, projection.label)
        self._keep((projection.definition, region.name), (J, surface.weights))
        header |= {"resolved": projection.definition, "name": projection.name}
        header["region_title"] = regions.region_title(region)
        return header | self.scales(region, [projection.definition, *beside]), arrays

    def scales(self, region: regions.Place, definitions: Sequence[str]) -> dict[str, Any]:
        """Colour scales shared by the kept pictures of a region, and the definitions of these maps."""
        together = [one for one in dict.fromkeys(definitions) if (one, region.name) in self.kept]
        values = [self.kept[definition, region.name] for definition in together]
        scales = page.colour_scales([J for J, _ in values], [weights for _, weights in values])
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


def figures_of(projection: Projection, region: regions.Place) -> dict[str, Any]:
    """Airy-Kavrayskiy errors with their uncertainty and parts, or the reason why they are undefined."""
    try:
        found = sample(projection, region, tolerance=_TOLERANCE)
        errors, (angles, areas) = found.airy_kavrayskiy, found.angles_and_areas
    except projections.ProjectionError as error:
        return {"reason": support.one_line(error)}
    values = {
        "airy_kavrayskiy": errors.raw,
        "airy_kavrayskiy_scaled": errors.scaled,
        "airy_kavrayskiy_affine": errors.affine,
        "error": errors.error,
        "angles": angles,
        "areas": areas,
        "coverage": found.coverage,
        "note": answers.note_on_area_of_use(projection, region),
    }
    return dict(support.plain(values))


def parameter_ranges(projection: projections.ProjectionLike) -> dict[str, Any]:
    """Adjustable parameters of a map, and how it can be dragged."""
    found = projections.tunable(projection)
    return {
        "tunable": found.definition,
        "drags": found.drags,
        "centre": found.centre,
        "parameters": [
            {name: getattr(one, name) for name in ("name", "label", "unit", "low", "high", "step", "value")}
            for one in found.parameters
        ],
    }


def recommended(region: regions.Place, options: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """The best CRSs for a region; raises ValueError."""
    found = decisions.recommend(
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
            "largest": support.plain(one.distortion.max_scale_error_ppm),
            "omega": support.plain(one.distortion.max_omega),
            "keeps": list(one.keeps),
            "share": one.share,
            "national": one.national,
            **{name: parts.get(name) for name in ("angles", "areas")},
        }
        for one in found.results
        for parts in [figures_of(Projection.from_user_input(one.code), region)]
    ]
    return {"rows": rows, "notes": list(found.notes), "candidates": found.candidates, "limit": found.limit}


def corrected(projection: Projection, region: regions.Place) -> dict[str, Any]:
    """The best linear correction of a map over a region; raises ValueError."""
    found = answers.correct(projection, region)
    definition = found.parameters or found.pipeline
    if definition is None:
        raise projections.ProjectionError(f"'{projection.label}' corrected has no PROJ string.")
    return {
        "definition": definition,
        "words": found.words,
        "before": found.airy_kavrayskiy,
        "after": found.airy_kavrayskiy_corrected,
        "error": found.error_estimate,
    }


def designed(region: regions.Place, options: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """The map made to measure for a region; raises ValueError."""
    kind = support.check_choice("kind", str(options.get("kind", "any")), _KINDS)
    found = designs.design(region, kind=kind, progress=lambda text: progress(0, 0))
    best = min((rival.value for rival in found.rivals), default=None)
    return {
        "definition": found.proj,
        "words": f"Degree {found.degree} on {found.base.label}.",
        "before": best,
        "after": found.value,
        "error": found.error,
        "notes": list(found.notes),
    }


def checked(projection: Projection, file: bytes) -> frames.Frame:
    """The worst features of GeoJSON in a map, with their outlines; raises ValueError."""
    frame = gis.frame_of_geojson(file)
    found = decisions.check(frame, projection, purpose=None)
    errors = np.fmax(*(np.abs(found.features[name]) for name in ("area_error", "length_error")))
    worst = np.argsort(-np.nan_to_num(errors, nan=-1.0))[:_WORST]
    lines = _packed_lines([_longest_line(geometry) for geometry in frame.geometry.iloc[worst]])
    return {"rows": found.rows(worst.tolist()), "count": len(frame), "notes": list(found.notes)}, lines


def _longest_line(geometry: Any) -> FloatArray:
    """Longest ring or line of a geometry, thinned."""
    rings = shapely.get_rings(shapely.get_parts(geometry))
    parts = rings if rings.size else shapely.get_parts(geometry)
    longest = max(map(shapely.get_coordinates, parts), key=len, default=np.empty((0, 2)))
    return longest[:: max(1, len(longest) // _MOST_OF_FEATURE)]


def texts(projection: Projection, region: regions.Place) -> dict[str, Any]:
    """Command, PROJ string, WKT2 and PROJJSON of a map, to be copied."""
    found, definition = {}, projection.definition
    wkt: str | None
    with contextlib.suppress(ValueError):  # objects of a notebook have no texts
        Projection.from_user_input(definition)
        regions.get_region(region.name)
        found["Command"] = shlex.join(["projdist", "heatmap", definition, "--region", region.name])
    if definition.startswith("+"):
        found["PROJ"] = definition
    if ":" in definition and not definition.startswith("+"):
        wkt = projections.crs_of(definition).to_wkt("WKT2_2019", pretty=True)
    else:
        wkt = projections.crs_wkt(projection, projection.name)[0]
    if wkt:
        found["WKT2"] = wkt
        found["PROJJSON"] = projections.crs_of(wkt).to_json(pretty=True)
    return {"texts": found}


def exported(projection: Projection, region: regions.Place, options: Mapping[str, Any]) -> frames.Frame:
    """A picture or a page as a file; raises ValueError."""
    suffix = support.check_choice("format", str(options.get("format", "png")), EXPORTS)
    measure = str(options.get("measure", "fisher"))
    if suffix == "html":
        maps = page.draw_maps([projection], titles=[projection.label], region=region, measure=measure)
        title = f"{projection.label}: {regions.region_title(region)}"
        copies = texts(projection, region)["texts"]
        content = page.page_html(page.Page(title=title, copies=copies, maps=maps)).encode()
    else:
        is_tissot = bool(options.get("ellipses"))
        chosen = {} if is_tissot else {"measure": measure}
        figure = plots.figure(projection, "tissot" if is_tissot else "heatmap", region=region, **chosen)
        content = plots.encoded(figure, f".{suffix}", dpi=_DOTS)
    return {"name": f"projdist.{suffix}"}, {"file": np.frombuffer(content, dtype=np.uint8)}
