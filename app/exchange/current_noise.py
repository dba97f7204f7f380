"""Which u(J) was stated and which was used, as JSON in laboratory units."""

from app.exchange.json_values import Json, finite, message_json
from solver.current_noise import about_moderation, current_noise, stated_noise
from solver.records import Array, Observations
from solver.units import ma_from_ampere


def current_noise_json(observations: Observations, widening: Array | None) -> Json:
    """Write u(J) where it was moderated: nothing at all where it was used as stated.

    Parameters
    ----------
    observations
    widening : (n, 2) array or None
        Of the method (`solver.estimators.estimated_weights`).

    Returns
    -------
    dict
        ``current_noise``: for `x` and `y`, position by position in the order of the residuals, `u_ma` and `dof`
        as stated, `u_used_ma` and `dof_used` as used for weights and tests, `u_counted_ma` with what weights by
        estimates add, as the budget counts it; and a `conclusion` in words. Infinite degrees of freedom are null.
    """
    stated, used = stated_noise(observations), current_noise(observations)
    if stated is None or used is None:
        return {}
    message = about_moderation(stated, used)
    if message is None:
        return {}
    counted = used.u if widening is None else used.u * widening
    columns = {
        "u_ma": ma_from_ampere(stated.u),
        "dof": stated.dof,
        "u_used_ma": ma_from_ampere(used.u),
        "dof_used": used.dof,
        "u_counted_ma": ma_from_ampere(counted),
    }
    rows: Json = {
        axis: {name: [finite(value) for value in values[:, channel]] for name, values in columns.items()}
        for channel, axis in enumerate("xy")
    }
    return {"current_noise": {**rows, "conclusion": message_json(message)}}
