"""Object queries: points and placements, size and mass, categories, and the words of the six attributes."""

from __future__ import annotations

from collections.abc import Iterable

from manitwin.dataset.index.conditions import sql_text
from manitwin.dataset.statistics.query import Column, Query, counts, histogram, labels, summary
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import Prior

ATTRIBUTES = ("category", "color", "material", "size", "shape", "function")
"""The paper's six attributes (section 3.1, semantic captioning)."""

SAMPLE, SAMPLE_SEED = 2000, 0

POINTS_PER_OBJECT = summary(
    "points_per_object",
    "Functional points, grasp points and placements of an accepted twin.",
    {"functional points": "functional_points", "grasp points": "grasp_points", "placements": "placements"},
    heading="quantity per object",
    total=True,
)

FUNCTIONAL_LABELS = Query(
    "functional_labels",
    "Labels of functional points.",
    """SELECT label, count(*) AS points, count(DISTINCT twin_id) AS objects FROM points WHERE role = 'functional'
GROUP BY label ORDER BY points DESC, label""",
    (*labels("label"), *counts("points", "objects")),
    shown=20,
)

PLACEMENTS = Query(
    "placements",
    "Placements.",
    """SELECT count(*) AS placements, count(*) FILTER (settled) AS settled,
  count(*) FILTER (settled) / nullif(count(*), 0) AS settled_share,
  count(DISTINCT twin_id) FILTER (upright) AS objects_upright,
  (SELECT median(upright_probability) FROM twins) AS upright_probability,
  median(collision_radius_m) AS collision_radius_m FROM placements""",
    (
        Column("placements", "placements"),
        Column("settled", "settled in simulation"),
        Column("settled_share", "share", "share"),
        Column("objects_upright", "objects that can stand upright"),
        Column("upright_probability", "median probability of upright", "number"),
        Column("collision_radius_m", "median collision radius, m", "number"),
    ),
)

DIMENSIONS = summary(
    "dimensions",
    "Size, mass and contact of accepted twins.",
    {
        "longest side, m": "longest_m",
        "height, m": "extent_z_m",
        "volume, litres": "volume_m3 * 1000",
        "mass, kg": "mass_kg",
        "density, kg/m³": "density_kg_m3",
        "static friction": "friction_static",
        "collision hulls": "hulls",
    },
)

MASS_SOURCES = Query(
    "mass_sources",
    "Who says what the mass is.",
    """SELECT split_part(mass_source, ':', 1) AS source, count(*) AS twins,
  count(*) / (SELECT count(*) FROM twins) AS share, median(mass_high / nullif(mass_low, 0)) AS spread
FROM (SELECT mass_source, mass_low_kg AS mass_low, mass_high_kg AS mass_high FROM twins)
GROUP BY source ORDER BY twins DESC, source""",
    (
        *(*labels("source"), *counts("twins")),
        Column("share", "share", "share"),
        Column("spread", "median of high / low", "number"),
    ),
    "Every mass has an interval; its median width says how much is known.",
)

CATEGORIES = Query(
    "categories",
    "Categories of accepted twins.",
    """SELECT category, count(*) AS twins, median(longest_m) AS longest_m, median(mass_kg) AS mass_kg,
  avg(verified) AS verified, sum(verified) / nullif(sum(simulated), 0) AS rate
FROM twins GROUP BY category ORDER BY twins DESC, category""",
    (
        *(*labels("category"), *counts("twins")),
        Column("longest_m", "median longest side, m", "number"),
        Column("mass_kg", "median mass, kg", "number"),
        Column("verified", "mean verified grasps", "number"),
        Column("rate", "verification rate", "share"),
    ),
    shown=1000,
)


def _logarithmic(name: str, quantity: str, column: str, unit: str, steps: int) -> Query:
    caption = f"{quantity}, {steps} steps a decade: step s is from 10^(s/{steps}) {unit}."
    return histogram(name, caption, f"floor(log10({column}) * {steps} + 1e-9)::INT AS step", f"{column} > 0")


SIZE_STEPS, MASS_STEPS = 20, 10
SIZE_HISTOGRAM = _logarithmic("size_histogram", "Longest side", "longest_m", "m", SIZE_STEPS)
MASS_HISTOGRAM = _logarithmic("mass_histogram", "Mass", "mass_kg", "kg", MASS_STEPS)

COUNT_HISTOGRAMS = tuple(
    Query(
        f"{column}_histogram",
        f"Objects by number of {column.replace('_', ' ')}.",
        f"SELECT {column} AS number, count(*) AS objects FROM twins WHERE {column} IS NOT NULL "
        "GROUP BY number ORDER BY number",
    )
    for column in ("functional_points", "grasp_points", "placements")
)

WORDS = tuple(
    Query(
        f"words_{attribute}",
        f"Terms of the attribute {attribute}: what stands between commas, without brackets"
        + (" and measurements." if attribute == "size" else "."),
        rf"""SELECT term, count(*) AS twins FROM (
  SELECT DISTINCT twin_id, lower(trim(unnest(string_split(regexp_replace({attribute}, '\([^)]*\)', '', 'g'), ',')))) AS term
  FROM twins)
WHERE term <> ''{" AND NOT regexp_matches(term, '[0-9]')" if attribute == "size" else ""}
GROUP BY term ORDER BY twins DESC, term LIMIT 200""",
    )
    for attribute in ATTRIBUTES
)

MASS_AND_SIZE = Query(
    "mass_and_size",
    "Longest side and mass.",
    f"""SELECT twin_id, category, longest_m, mass_kg, mass_low_kg, mass_high_kg,
  split_part(mass_source, ':', 1) AS source
FROM twins WHERE longest_m > 0 AND mass_kg > 0 ORDER BY md5(twin_id || ':{SAMPLE_SEED}') LIMIT {SAMPLE}""",
    note=f"Of more than {SAMPLE:,} twins a sample, by the MD5 of the twin's id and the seed {SAMPLE_SEED}.",
)


def priors_of(categories: Iterable[str]) -> dict[str, Prior]:
    """Return the priors of those categories that have one."""
    found = {category: find_prior(category) for category in categories}
    return {category: prior for category, prior in found.items() if prior is not None}


def _double(value: float) -> str:
    """Return a number as a DuckDB double literal; without the exponent it would be a decimal."""
    return f"{value!r}e0"


def mass_in_prior(priors: dict[str, Prior]) -> Query:
    """Return the query that compares twins' masses and sizes with the package's priors, which are embedded as literals."""
    rows = ",\n  ".join(
        f"({sql_text(category)}, {_double(prior.mass_kg.low)}, {_double(prior.mass_kg.typical)}, "
        f"{_double(prior.mass_kg.high)}, {_double(prior.longest_axis_m.low)}, {_double(prior.longest_axis_m.high)})"
        for category, prior in sorted(priors.items())
    )
    values = f"VALUES\n  {rows}" if rows else "SELECT '', 0e0, 0e0, 0e0, 0e0, 0e0 WHERE false"
    return Query(
        "mass_in_prior",
        "Masses and sizes of accepted twins beside the priors of their categories.",
        f"""WITH priors(category, mass_low_kg, mass_typical_kg, mass_high_kg, size_low_m, size_high_m) AS ({values})
SELECT category, count(*) AS twins, p.mass_low_kg, p.mass_typical_kg, p.mass_high_kg, p.size_low_m, p.size_high_m,
  min(mass_kg) AS least_kg, quantile_cont(mass_kg, 0.1) AS p10_kg, median(mass_kg) AS median_kg,
  quantile_cont(mass_kg, 0.9) AS p90_kg, max(mass_kg) AS most_kg,
  count(*) FILTER (mass_kg BETWEEN p.mass_low_kg AND p.mass_high_kg) / count(*) AS mass_inside,
  count(*) FILTER (longest_m BETWEEN p.size_low_m AND p.size_high_m) / count(*) AS size_inside
FROM twins JOIN priors p USING (category)
GROUP BY ALL ORDER BY twins DESC, category""",
        (
            *(*labels("category"), *counts("twins")),
            Column("mass_low_kg", "prior low, kg", "given"),
            Column("mass_typical_kg", "typical", "given"),
            Column("mass_high_kg", "high", "given"),
            Column("median_kg", "median twin, kg", "number"),
            Column("mass_inside", "mass inside", "share"),
            Column("size_inside", "size inside", "share"),
        ),
        "A prior's interval is meant to hold about 19 of 20 such things. It is of the longest extent as a thing stands, "
        "held here against the longest side of the oriented box. The built-in annotator takes masses from these same "
        "priors: for it, a share inside is no evidence. Categories without a prior are left out.",
    )
