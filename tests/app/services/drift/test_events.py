"""Events entered and withdrawn, and what the sessions themselves tell."""

from contextlib import nullcontext
from datetime import date, timedelta

import pytest
from laid import BEGIN, METROLOGIST, MONTH, TECHNICIAN, drawn, revision

from app.errors import Conflict, Forbidden, Invalid, NotFound
from app.exchange.rows import CertificateRow
from app.services import stands
from app.services.drift import events, reading
from app.services.sessions import NewSession, open_session


def test_a_gyros_events_and_those_of_its_stands_are_on_its_axis(lab, history):
    with lab.write(TECHNICIAN) as work:
        stands.add_stand(work, "S2", 55.0)
        first = events.add(work, "repair", BEGIN + MONTH, " torquer ", gyro="0417")
        second = events.add(work, "moved", BEGIN + 2 * MONTH, stand="S1")
        events.add(work, "moved", BEGIN + 2 * MONTH, stand="S2")
        assert events.of_gyro(work, "0417") == (first, second)
        assert events.of_stand(work, "S1") == (second,)
    assert (first.note, first.created_by, first.derived) == ("torquer", "petrova", False)


def test_an_event_withdrawn_is_hidden_but_kept(lab, history):
    with lab.write(TECHNICIAN) as work:
        made = events.add(work, "repair", BEGIN, gyro="0417")
        gone = events.withdraw(work, made.id)
        assert gone.withdrawn_by == "petrova"
        assert events.of_gyro(work, "0417") == ()
        assert events.of_gyro(work, "0417", withdrawn=True) == (gone,)
        with pytest.raises(Conflict):
            events.withdraw(work, made.id)
        with pytest.raises(NotFound):
            events.withdraw(work, 99)


@pytest.mark.parametrize(
    ("enters", "withdraws", "allowed"),
    [(METROLOGIST, TECHNICIAN, False), (TECHNICIAN, METROLOGIST, True), (TECHNICIAN, TECHNICIAN, True)],
    ids=["anothers", "judge", "ones-own"],
)
def test_who_withdraws_an_event(lab, history, enters, withdraws, allowed):
    with lab.write(enters) as work:
        made = events.add(work, "repair", BEGIN, gyro="0417")
    with lab.write(withdraws) as work, nullcontext() if allowed else pytest.raises(Forbidden):
        events.withdraw(work, made.id)


def test_the_sessions_tell_of_another_stand_certificate_and_solver(lab, history, follow_jobs):
    with lab.write(TECHNICIAN) as work:
        rows = [CertificateRow(0.0, 0.0, 1.0, 1.0, 1.0)]
        stands.add_certificate(work, "S1", "C-18", date(2000, 1, 1), date(2100, 1, 1), rows)
        stands.add_stand(work, "S2", 55.0)
        stands.add_certificate(work, "S2", "D-1", date(2000, 1, 1), date(2100, 1, 1), rows)
        for number, (stand, certificate) in enumerate((("S1", "C-18"), ("S2", "D-1")), start=12):
            new = NewSession("0417", stand, certificate, started_at=BEGIN + number * MONTH)
            revision(work, open_session(work, new).id, drawn(1)[0])
    follow_jobs()
    with lab.read(TECHNICIAN) as work:
        told = reading.all_events(work, "0417")
    assert [(item.kind, item.note, item.session) for item in told] == [
        ("certificate", "C-18", 13), ("stand", "S2", 14),
    ]  # fmt: skip
    assert told[0].at == BEGIN + 12 * MONTH
    assert told[0].derived


@pytest.mark.parametrize(
    ("kind", "later", "subject", "column"),
    [
        ("explosion", timedelta(0), {"gyro": "0417"}, "kind"),
        ("repair", timedelta(days=20_000), {"gyro": "0417"}, "happened_at"),
        ("repair", timedelta(0), {}, "gyro"),
        ("repair", timedelta(0), {"gyro": "0417", "stand": "S1"}, "gyro"),
    ],
    ids=["kind", "to-come", "nobodys", "both"],
)
def test_what_is_no_event(lab, kind, later, subject, column):
    with lab.write(TECHNICIAN) as work, pytest.raises(Invalid) as refused:
        events.add(work, kind, BEGIN + later, **subject)
    assert refused.value.problems[0].column == column


def test_an_event_of_nobody_known(lab):
    with lab.write(TECHNICIAN) as work, pytest.raises(NotFound):
        events.add(work, "repair", BEGIN, gyro="0999")
