"""The candidate CRSs for a region: chosen by area of use and country, and tried at a few nodes."""

import functools
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from projdist import earth, projections, regions
from projdist._typing import BoolArray, FloatArray
from projdist.decisions.map_info import WeightedPoints, properties_of
from projdist.decisions.measurement import Area, Distortion, Rejected, lattice_of
from projdist.field import FIGURES, Figure, jacobian
from projdist.support import HIDDEN, Record, check_text, close_words, did_you_mean, listed, schema, values_of

LEVEL = FIGURES["airy_kavrayskiy"]
"""The figure that orders maps for which the criterion vanishes."""

Key = tuple[float, float]
"""The order of maps: the figure, 0 if it is only rounding, then the Airy-Kavrayskiy error."""

_LEAST_COVERED = 0.99  # share of the region that a map of it must show
_UNMEASURED = Distortion(**dict.fromkeys((one.name for one in fields(Distortion)), float("nan")))


@dataclass(frozen=True, kw_only=True)
class Trial:
    """Figures of a CRS at the nodes of a region, good to a few per cent."""

    value: float  # the figure of the criterion
    level: float  # the Airy-Kavrayskiy error, infinite if undefined
    jacobian: FloatArray
    conversion: projections.Conversion  # the same for CRSs that draw the same map
    modern: bool  # on the ellipsoids of GRS 80 and WGS 84
    upright: bool  # the axes point east and north
    positive: bool  # all coordinates are


@dataclass(frozen=True, kw_only=True)
class Candidate(Record):
    """A CRS over a region, with all CRSs that draw the same map under other datums. A search adds figures in turn."""

    code: str
    name: str
    method: str
    datum: str
    value: float = float("nan")  # the figure of the criterion
    ranked: float = float("nan")  # what the map is ordered by: the figure times `weight`
    distortion: Distortion = field(default=_UNMEASURED, metadata=schema(spread=True))
    keeps: tuple[str, ...]  # what the map keeps true in the region, as measured
    # Of the region, within the areas of use of all these CRSs.
    share: float = field(default=0.0, metadata=schema("share_in_area_of_use"))
    national: bool = False  # a map of the country that the region is in
    wide: bool = False  # a map of the world or a continent
    datum_since: int | None = None  # year of the datum, None if the registry has none
    area_of_use: Area
    area_name: str = field(metadata=HIDDEN)
    same: tuple[tuple[str, str], ...] = ()
    # To the figure of the best custom projection; None without one, or if that is only rounding
    ratio_to_custom: float | None = None
    difference_to_custom: float | None = None  # from the same; None without one
    over_limit: float | None = None  # the figure over `Recommendation.limit`, None without that
    trial: Trial = field(repr=False, compare=False, metadata=HIDDEN)
    holds: bool = field(default=False, repr=False, metadata=HIDDEN)  # its area of use has nearly all of the region
    special: bool = field(default=False, repr=False, metadata=HIDDEN)  # not for general use
    weight: float = field(default=1.0, repr=False, metadata=HIDDEN)  # by which figures are multiplied
    key: Key = field(default=(np.inf, np.inf), repr=False, metadata=HIDDEN)  # by which it is ordered

    @property
    def trial_key(self) -> Key:
        """The weighted figure and level of the trial."""
        return self.weight * or_infinity(self.trial.value), self.weight * self.trial.level

    @property
    def since(self) -> int:
        """The year of the datum, 0 if unknown."""
        return self.datum_since or 0

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of all CRSs of the map, its own first."""
        return (self.code, *(code for code, _ in self.same))

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        area = {"bounds": list(self.area_of_use), "name": self.area_name}
        same = [{"code": code, "name": name} for code, name in self.same]
        return super().to_dict() | {"area_of_use": area, "same": same}

    def _row(self) -> dict[str, Any]:
        texts = {"keeps": " ".join(self.keeps), "area_of_use": self.area_name, "same": " ".join(self.codes[1:])}
        return values_of(self) | texts | {"proj": ""}


def or_infinity(value: float) -> float:
    """The value, or infinity for NaN."""
    return value if np.isfinite(value) else np.inf


def try_crs(record: projections.CrsRecord, probe: WeightedPoints, ranking: Figure) -> Candidate | Rejected:
    """The CRS as a candidate, measured at the probe's nodes."""
    try:
        crs = projections.load_crs(record.code)
        J = jacobian(crs.projection, probe.lon, probe.lat)
        xy = np.stack(crs.projection(probe.lon, probe.lat))
    except projections.ProjectionError as error:
        return Rejected(record.code, record.name, str(error))
    covered = float(probe.weight[np.isfinite(J).all(axis=(-1, -2))].sum())
    if covered < _LEAST_COVERED:
        return Rejected(record.code, record.name, f"It can be projected over only {100 * covered:.3g} % of the region.")
    ellipsoid = crs.projection.ellipsoid
    return Candidate(
        code=record.code,
        name=record.name,
        method=crs.conversion[0],
        datum=crs.datum,
        keeps=properties_of(J, probe).keeps,
        area_of_use=record.area_of_use,
        area_name=record.area_name,
        trial=Trial(
            value=ranking(J, probe.weight),
            level=or_infinity(LEVEL(J, probe.weight)),
            jacobian=J,
            conversion=crs.conversion,
            modern=abs(ellipsoid.a - earth.WGS84.a) < 0.1 and abs(ellipsoid.f - earth.WGS84.f) < 1e-8,
            upright=crs.is_upright,
            positive=bool(np.all((xy > 0) | np.isnan(xy))),
        ),
    )


# ---- countries of areas of use -------------------------------------------------------------------

_MOST = 0.5  # share of the land of a region: a country with more is the region's own
_BETWEEN = re.compile(r"[;:]|\. ")  # countries of a list
_AT_SEA = re.compile(r"^(?!.*onshore).*offshore", re.IGNORECASE)
USA = "United States of America"
_STATE = "Georgia"  # no area of use has both that country and the USA
# Areas that are part of a country in the outlines.
_PARTS = dict.fromkeys(("French Guiana", "Guadeloupe", "Martinique", "Mayotte", "Reunion"), "France")
_NOBODYS = "Antarctica"  # belongs to no country, by the treaty of 1959
# Areas of use that belong to no country: continents, and those whose names begin with World.
_CONTINENT = re.compile(r"^(Africa|Asia|Europe|Oceania|(North|South) America) including ")


def named(extents: Sequence[str], *, at_sea: bool = False) -> frozenset[str]:
    """The countries named by areas of use: USA in "USA - New Mexico", China and Hong Kong in "China - Hong Kong"."""
    # `extents` are names and descriptions as in EPSG's registry. Those of the whole world, or of a continent
    # "including" a country, name none. `at_sea` also counts countries of which only the waters are named.
    if not extents or extents[0].startswith("World") or any(map(_CONTINENT.match, extents)):
        return frozenset()
    found: set[str] = set()
    for item in (item for text in extents for item in _BETWEEN.split(text) if at_sea or not is_at_sea(item)):
        # The countries before its first dash, and one that stands alone after it.
        first, _, rest = item.partition(" - ")
        alone = _vocabulary()[1].get(rest.partition(" - ")[0].strip(" ."))
        found |= (_names_in(first) or _names_in(item)) | ({alone} if alone else set())
    return frozenset(found - {_STATE} if USA in found else found)


def is_at_sea(name: str) -> bool:
    """True if by its name an area or a CRS has no land: Louisiana Offshore."""
    return _AT_SEA.search(name) is not None


def home_of(points: WeightedPoints) -> str:
    """The country that has more than half of the region's points in any country, or ""."""
    # Outlines, which do not overlap, are read in the order of the weight in their boxes, largest first, then of the
    # size of the boxes, smallest first, until a country has won, or none can.
    east = np.mod(points.lon + 180.0, 360.0) - 180.0
    about = earth.natural_earth.countries_about(east, points.lat)
    boxes = {name: about[key] for name, key in outline_keys().items() if key in about and name != _NOBODYS}
    reach = {name: float(points.weight @ box) for name, box in boxes.items()}
    shares: dict[str, float] = {}
    for name in sorted(reach, key=reach.__getitem__, reverse=True):
        if max(reach[name], *shares.values(), 0.0) <= _MOST * sum(shares.values()):
            return ""
        box = boxes[name]
        inside = outline_of(name).contains(points.lon[box], points.lat[box])
        shares[name] = float(points.weight[box] @ inside)
        if shares[name] > _MOST * points.weight.sum():
            return name
    most = max(shares, key=shares.__getitem__, default="")
    return most if most and shares[most] > _MOST * sum(shares.values()) else ""


def outline_of(name: str) -> regions.Region:
    """The fine shipped outline of a country: coarse ones would give Singapore to Malaysia."""
    geometry = earth.natural_earth.country(outline_keys()[name])
    assert geometry is not None  # at 1 : 50 million all are there
    return regions.Polygons(geometry, name)


@functools.cache
def outline_keys() -> dict[str, str]:
    """The outlines' keys of all countries, by name."""
    return {row["name"]: row["iso_n3"] or row["name"] for row in earth.data_rows("countries.csv")}


@functools.lru_cache(maxsize=4096)
def _names_in(text: str) -> frozenset[str]:
    """Countries named in a text."""
    return frozenset(_vocabulary()[1][word] for word in words_in(text))


def words_in(text: str) -> list[str]:
    """Names of countries and states in a text, as whole words: West Virginia does not name Virginia."""
    return _vocabulary()[0].findall(text)


@functools.cache
def _vocabulary() -> tuple[re.Pattern[str], dict[str, str]]:
    """A pattern of all names, longest first, and the country of each: the USA of New Mexico."""
    names: dict[str, str] = {}
    for row in earth.data_rows("countries.csv"):
        for name in (row["name"], *row["other_names"].split("|")):
            if name:
                names.setdefault(name, row["name"])
    for row in earth.data_rows("states.csv"):
        names.setdefault(row["name"], USA)
    names.update(_PARTS)
    longest = sorted(names, key=len, reverse=True)
    return re.compile(r"(?<!\w)(?:" + "|".join(map(re.escape, longest)) + r")(?!\w)"), names


# ---- country parts -------------------------------------------------------------------------------

_IS_IN = 0.9  # share of the region in a state, at least: outlines differ
_IS_MOST = 0.5  # least share of the state in the region; least share of the country's points in its main part


@dataclass(frozen=True, kw_only=True)
class CountryPart:
    """A part of a country: a `state`, or a part far from the main part, whose `middle` is in degrees."""

    state: str = ""
    middle: tuple[float, float] | None = None

    def is_elsewhere(self, extents: Sequence[str]) -> bool:
        """True if an area of use names other states."""
        others = {row["name"] for row in earth.data_rows("states.csv")} - {self.state}
        return bool(self.state) and any(others.intersection(words_in(name)) for name in extents[:1])

    def has(self, record: projections.CrsRecord, extents: Sequence[str]) -> bool:
        """True if a CRS is made for this part: its area names the state, or leaves out the main part's middle."""
        if self.state:
            return any(self.state in words_in(name) for name in extents[:1])
        return self.middle is None or not _is_within(record.area_of_use, *self.middle)


def part_of(home: str, region: regions.Region, points: WeightedPoints) -> CountryPart:
    """The part of the `home` country that a region is, by its points with weights whose sum is 1."""
    if not home:
        return CountryPart()
    for row in earth.data_rows("states.csv") if home == USA else ():
        outline = earth.state_outline(row["fips"])
        if points.weight @ _is_within(outline.bounds, points.lon, points.lat) < _IS_IN:
            continue
        state = regions.Polygons(outline, row["name"])
        share = float(points.weight @ state.contains(points.lon, points.lat))
        if share >= _IS_IN and share * region.area_km2 >= _IS_MOST * state.area_km2:
            return CountryPart(state=row["name"])
    country = outline_of(home)
    main = regions.main_part(country)
    if main is country:
        return CountryPart()
    share, of_main = (float(points.weight @ one.contains(points.lon, points.lat)) for one in (country, main))
    if of_main >= _IS_MOST * share:
        return CountryPart()
    west, south, east, north = main.bounds
    return CountryPart(middle=(0.5 * (west + east), 0.5 * (south + north)))


def _is_within(bounds: Area, lon: Any, lat: Any) -> Any:
    west, south, east, north = bounds
    return ((lon - west) % 360.0 <= ((east - west) % 360.0 or 360.0)) & (lat >= south) & (lat <= north)


# ---- the pool ------------------------------------------------------------------------------------

HOLDS = 0.99
"""Share of the region in the area of use that counts as all of it: both are rounded."""
HOLDS_NEARLY = 0.9
"""Share that counts as nearly all: outlines have disputed land, and islands that an area of use leaves out."""
_TOUCHES = 0.25  # least share of the region in the areas of use of a map that was made for it
_SOME = 0.1  # least share in the area of use of each CRS of the map
# A wide map's area is larger than three regions, and than a zone of six degrees to 84 N (4.2 million).
_WIDE_KM2, _WIDE_TIMES = 5e6, 3.0
# A region this large holds 75 million km2 of land at least, the largest country 17: it belongs to no country.
_NOBODYS_KM2 = 450e6


class CandidatePool:
    """The CRSs that may serve a region, by their areas of use; `home` is the country whose land it is, "" for none."""

    def __init__(self, region: regions.Region, records: Sequence[projections.CrsRecord], area: str) -> None:
        self.region, self.lattice = region, lattice_of(region)
        self.records: dict[str, projections.CrsRecord] = {}  # by code
        self.held: dict[str, BoolArray] = {}  # the lattice's points in the area of use of a CRS
        self.united: dict[str, BoolArray] = {}  # and in those of all CRSs of its map
        self.rejected: list[Rejected] = []  # those that hold too little of the region
        least = HOLDS if area == "contains" else _TOUCHES
        near = self.lattice.near([record.area_of_use for record in records])
        self.meeting = [record for record, is_near in zip(records, near, strict=True) if is_near]
        bounds = list(dict.fromkeys(record.area_of_use for record in self.meeting))
        held = dict(zip(bounds, self.lattice.within(bounds), strict=True))
        self.facts = projections.facts_of([record.code for record in self.meeting])
        self.home = home_of(self.lattice) if region.area_km2 <= _NOBODYS_KM2 else ""
        touching = [record for record in self.meeting if held[record.area_of_use].any()]
        drawn = [self._facts(record.code).draws or record.code for record in touching]  # the maps in the registry
        united: dict[Any, BoolArray] = {}
        for record, one in zip(touching, drawn, strict=True):
            united[one] = united.get(one, False) | held[record.area_of_use]
        for record, one in zip(touching, drawn, strict=True):
            own, together = held[record.area_of_use], united[one]
            if self.share(together) >= least and self.share(own) >= min(least, _SOME):
                self.records[record.code], self.held[record.code], self.united[record.code] = record, own, together
            else:
                text = f"Its area of use holds {100 * self.share(own):.2g} % of the region."
                self.rejected.append(Rejected(record.code, record.name, text))

    def _facts(self, code: str) -> projections.Facts:
        return self.facts.get(code, projections.UNKNOWN)

    def share(self, held: BoolArray) -> float:
        """The share of the region in some points of the lattice."""
        return float(held @ self.lattice.weight)

    def is_national(self, record: projections.CrsRecord) -> bool:
        """True if a CRS is of the region's country, by the names of its area of use."""
        return self.home != "" and is_own(record, named(self._facts(record.code).extents), self.home)

    @functools.cached_property
    def part(self) -> CountryPart:
        """The part of its country that the region is."""
        return part_of(self.home, self.region, self.lattice)

    def is_for_part(self, record: projections.CrsRecord) -> bool:
        """True if a national CRS was made for the region's part of the country, or the region is no such part."""
        return self.part.has(record, self._facts(record.code).extents)

    def with_usage(self, one: Candidate) -> Candidate:
        """The candidate with what it is used for."""
        record, facts = self.records[one.code], self._facts(one.code)
        return replace(
            one,
            holds=self.share(self.held[one.code]) >= HOLDS_NEARLY,
            national=self.is_national(record),
            special=facts.special or is_at_sea(record.name),
            datum_since=facts.since or None,
        )

    def as_one_map(self, members: Sequence[Candidate]) -> Candidate:
        """The first of the CRSs of one map, with the others in `same`; their areas of use count as one."""
        held = np.any([self.united[one.code] for one in members], axis=0)
        national = any(one.national for one in members)
        return replace(
            members[0],
            share=self.share(held),
            national=national,
            wide=not national and all(is_wide(self.records[one.code], self.region.area_km2) for one in members),
            same=tuple((one.code, one.name) for one in members[1:]),
        )


def is_wide(record: projections.CrsRecord, area_km2: float) -> bool:
    """True if a CRS was made for the world or a continent, much larger than the region's area."""
    return record.extent_km2 > max(_WIDE_KM2, _WIDE_TIMES * area_km2)


def is_own(record: projections.CrsRecord, countries: Collection[str], home: str) -> bool:
    """True if the CRS is national: made for the home country, alone or with neighbours, and not for a continent."""
    return home in countries and (len(countries) == 1 or not is_wide(record, 0.0))


def of_datum(candidates: Sequence[Candidate], datum: str) -> list[Candidate]:
    """Candidates whose datum's name contains the text; raises ValueError with close names if there are none."""
    wanted = _plain_name(check_text("datum", datum))
    known = {_plain_name(one.datum): one.datum for one in candidates}
    if not wanted or not any(wanted in name for name in known):
        close = [known[name] for name in close_words(wanted, known)] if wanted else []
        raise ValueError(
            f"Invalid datum '{datum}'. {did_you_mean(close)}It must be a part of the name of a geodetic CRS "
            f"with candidates for the region and purpose, as {listed(sorted(known.values(), key=len)[:3], 'or')}."
        )
    return [one for one in candidates if wanted in _plain_name(one.datum)]


def _plain_name(text: str) -> str:
    """A name without all but its letters, in lower case, and digits."""
    return "".join(c for c in text.lower() if c.isalnum())
