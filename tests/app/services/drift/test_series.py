"""Columns of the results that count, and their way through Arrow."""

from datetime import timedelta

import numpy as np
from laid import BEGIN, MONTH, TECHNICIAN, drawn, revision

from app.services.drift import reading, series
from app.services.lookup import find_gyro


def _load(lab, method="least-squares"):
    with lab.read(TECHNICIAN) as work:
        return series.load(work, find_gyro(work, "0417").id, method)


def test_a_row_for_each_session_in_the_order_of_time(lab, history):
    table = _load(lab)
    assert table["session"].tolist() == history
    assert [series.aware(at) for at in table["measured_at"]] == [BEGIN + n * MONTH for n in range(12)]
    for number, values in enumerate(drawn(12)):
        for name, value in values.items():
            assert table[f"{name}.value"][number] == value  # the same bits
    assert set(table["stand"]) == {"S1"}
    assert set(table["certificate"]) == {"C-17"}
    assert table["start"].tolist() == list(range(1, 13))


def test_a_correction_counts_once_and_what_it_replaced_is_told(lab, history):
    corrected = drawn(1, 5)[0]
    with lab.write(TECHNICIAN) as work:
        revision(work, history[3], corrected, input_hash="corrected")
    table = _load(lab)
    assert len(table) == 12
    assert table["revisions"].tolist() == [1, 1, 1, 2, *[1] * 8]
    assert table["w0x.value"][3] == corrected["w0x"]
    with lab.read(TECHNICIAN) as work:
        gone = reading.replaced(work, "0417")
    assert {(item.session, item.revision, item.replaced_by) for item in gone} == {
        (history[3], 1, int(table["calibration"][3]))
    }
    assert {item.parameter: item.value for item in gone} == drawn(12)[3]


def test_what_is_not_determined_is_not_in_the_history_of_its_parameter(lab, history):
    values = {name: value for name, value in drawn(1)[0].items() if name != "kxy"}
    with lab.write(TECHNICIAN) as work:
        revision(work, history[0], values, input_hash="corrected")
    table = _load(lab)
    assert np.isnan(table["kxy.value"][0])
    assert len(table.history("kxy")) == 11
    assert len(table.history("kyx")) == 12


def test_arrow_gives_back_every_column(lab, history):
    table = _load(lab)
    read = series.decode(series.encode(table))
    assert list(read.columns) == list(table.columns)
    for name, column in table.columns.items():
        np.testing.assert_array_equal(read[name], column)
        assert read[name].dtype == column.dtype


def test_a_period_includes_both_ends(lab, history):
    table = _load(lab)
    inside = table.between(BEGIN + 2 * MONTH, BEGIN + 5 * MONTH)
    assert inside["session"].tolist() == history[2:6]
    assert len(table.between(BEGIN + 2 * MONTH + timedelta(seconds=1), None)) == 9


def test_the_solvers_history_has_the_noise_and_the_seconds(lab, history):
    found = _load(lab).history("w0x")
    assert found.time[0] == BEGIN.timestamp()
    np.testing.assert_array_equal(found.u, np.full(12, 0.003))
