"""Getting ready before somebody asks: Altair takes a second or two to import and to think."""

import threading
from typing import Final

from app.plots import dates
from app.plots.allan import template as allan_template
from app.plots.autocorrelation import template as autocorrelation_template
from app.plots.bode import template as bode_template
from app.plots.common_mode import template as common_mode_template
from app.plots.convergence import template as convergence_template
from app.plots.distribution import template as distribution_template
from app.plots.drift import template as drift_template
from app.plots.live import template as live_template
from app.plots.pareto import template as pareto_template
from app.plots.poles import template as poles_template
from app.plots.record import template as record_template
from app.plots.residuals import template as residuals_template
from app.plots.step_response import template as step_response_template

_DELAY_S: Final = 10.0


def warm_up() -> threading.Timer:
    """Make every chart's template in the background, a little after the service has started.

    Returns
    -------
    threading.Timer
        To be cancelled when the service stops before that.
    """
    timer = threading.Timer(_DELAY_S, make_templates)
    timer.daemon = True
    timer.start()
    return timer


def make_templates() -> None:
    """Make what every later chart is filled from; done once in a process."""
    residuals_template()
    convergence_template()
    allan_template()
    autocorrelation_template()
    pareto_template("", "")
    bode_template()
    poles_template()
    step_response_template()
    distribution_template()
    drift_template(False, 1)
    for step in dates.STEPS:
        drift_template(True, step)
        common_mode_template(True, step)
    for channel in ("x", "y"):
        record_template(channel)
        live_template(channel)
