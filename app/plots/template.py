"""From an Altair chart, written once, to the document of one request."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from app.plots import theme
from app.plots.theme import Spec

Row = Mapping[str, Any]


def template_of(layers: Sequence[Any], *, height: int, values: Mapping[str, Any] | None = None) -> Spec:
    """What Altair makes of charts with named data in layers; a test checks it against Vega-Lite's schema.

    Charts fill the width of their container and keep the size of their text. What belongs to the whole
    is put into Altair's document, not into its chart: each change of a chart copies all layers several times.

    Parameters
    ----------
    layers
        Charts, the lowest first.
    height
        Height in px.
    values
        The chart's parameters and the values that they have in the template.
    """
    import altair as alt

    spec: Spec = alt.layer(*layers).to_dict(validate=False)
    spec.pop("config", None)
    whole = {
        "height": height, "width": "container", "autosize": {"type": "fit-x", "contains": "padding"}, "padding": 0,
    }  # fmt: skip
    params = [{"name": name, "value": value} for name, value in (values or {}).items()]
    return {**spec, **whole, **({"params": params} if params else {})}


def filled(
    template: Spec,
    *,
    data: Mapping[str, Iterable[Row]],
    values: Mapping[str, Any],
    description: str,
    height: int | None = None,
) -> Spec:
    """The document of one request.

    Parameters
    ----------
    template
        From `template_of`; it is not changed.
    data
        Rows of each named data set.
    values
        Values of the chart's parameters.
    description
        What the chart shows, for whoever does not see it.
    height
        Height in px, where it is not the template's.
    """
    known = [item["name"] for item in template.get("params", ())]
    unknown = set(values) - set(known)
    if unknown:
        raise ValueError(f"the chart has no parameter {', '.join(sorted(unknown))}")
    params = [
        {**item, "value": values[item["name"]]} if item["name"] in values else item
        for item in template.get("params", ())
    ]
    return {
        **template,
        **({"height": height} if height else {}),
        "description": description,
        "config": theme.config(),
        "params": params,
        "datasets": {name: [dict(row) for row in rows] for name, rows in data.items()},
    }


def axis_range(values: Iterable[float], *, margin: float = 0.08) -> tuple[float, float]:
    """Lowest and highest value with a margin on both sides; of one value alone, a range around it."""
    found = sorted(values)
    if not found:
        return -1.0, 1.0
    low, high = found[0], found[-1]
    span = (high - low) or abs(high) * 0.01 or 1.0
    return low - margin * span, high + margin * span
