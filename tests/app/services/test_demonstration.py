"""The demonstration laboratory shows what it says: one gyro drifts, one jumps, the others are steady."""

import numpy as np

from app.services import demonstration, gyros, history, overview, sessions
from app.services.access import SYSTEM
from app.services.opening import open_lab
from app.settings import Settings


def test_the_year_shows_the_drifting_and_the_jumping_gyro(tmp_path):
    with open_lab(Settings(data=tmp_path / "demo")) as lab:
        demonstration.build(lab)
        with lab.read(SYSTEM) as work:
            verdicts = {item.serial: item.last_result.verdict for item in gyros.gyros(work).items}
            w0x = {name: values(work, name, "w0x") for name in ("0412", "0417")}
            wk = values(work, "0423", "wk")
            open_session = overview.overview(work).current.session
            last = sessions.detail(work, demonstration.SESSIONS * len(verdicts))
    assert len(verdicts) == 6
    assert verdicts["0423"] == "fails"
    # 0417 drifts by 0.6 °/h over the year; starts scatter by 0.03 °/h, so two means differ by 0.02 °/h.
    assert w0x["0417"][-3:].mean() - w0x["0417"][:3].mean() > 0.3
    assert abs(w0x["0412"][-3:].mean() - w0x["0412"][:3].mean()) < 0.1
    # 0423's quadrature drift jumps by 0.5 °/h/g once; starts scatter by 0.02.
    assert np.sum(np.abs(np.diff(wk)) > 0.3) == 1
    assert (open_session.positions_measured, open_session.positions_total) == (12, 16)
    assert all(item.measurement.record for item in last.positions), "the latest session has its full records"


def values(work, serial, parameter):
    (series,) = history.history(work, serial, parameter=parameter)
    return np.array([point.value for point in series.points])
