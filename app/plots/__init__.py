"""Chart specifications: plain values in, a Vega-Lite document out, drawn in the page or printed.

A chart is written once in Altair with named, empty data; what Altair makes of it is kept, and a
request only fills in rows, domains and words (`template.filled`). So Altair is imported when the
first chart is asked for (`warm_up` does it beforehand), and a chart costs well under a millisecond.

Colours are the stylesheet's variables: the page that shows a chart decides between light and dark,
and a change of theme needs no redrawing. `theme.printed` puts the light or dark values in for paper.
"""

from app.plots.allan import AllanPoint, MeanPoint, allan
from app.plots.autocorrelation import autocorrelation
from app.plots.bode import MarginMark, bode
from app.plots.common_mode import CommonPoint, common_mode
from app.plots.convergence import Change, convergence
from app.plots.correlation_map import CorrelationMark, correlation_map
from app.plots.distribution import DistributionPoint, distribution
from app.plots.drift import drift
from app.plots.drift_marks import ControlStretch, DriftChange, DriftEvent, DriftLimit, DriftPoint, Forecast
from app.plots.live import LivePoint, live
from app.plots.live import news as live_news
from app.plots.pareto import TradeMark, pareto
from app.plots.poles import Pole, poles
from app.plots.record import Stretch, record
from app.plots.residuals import LIMIT_SD, Place, Residual, decade, residuals
from app.plots.step_response import step_response
from app.plots.theme import printed
from app.plots.warming import warm_up

__all__ = [
    "LIMIT_SD",
    "AllanPoint",
    "Change",
    "CommonPoint",
    "ControlStretch",
    "CorrelationMark",
    "DistributionPoint",
    "DriftChange",
    "DriftEvent",
    "DriftLimit",
    "DriftPoint",
    "Forecast",
    "LivePoint",
    "MarginMark",
    "MeanPoint",
    "Place",
    "Pole",
    "Residual",
    "Stretch",
    "TradeMark",
    "allan",
    "autocorrelation",
    "bode",
    "common_mode",
    "convergence",
    "correlation_map",
    "decade",
    "distribution",
    "drift",
    "live",
    "live_news",
    "pareto",
    "poles",
    "printed",
    "record",
    "residuals",
    "step_response",
    "warm_up",
]
