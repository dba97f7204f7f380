"""The index against what `sessions.views` says of each session, which is made another way."""

from collections import Counter
from datetime import UTC, date, datetime

import pytest

from app.exchange.rows import CertificateRow, MeansRow
from app.services import access, calibrations, gyros, ingest, jobs, session_index, sessions, stands
from app.services.opening import open_lab
from app.settings import Settings

PLACES = [(0.0, 0.0), (0.0, 90.0), (90.0, 0.0)]


class Quiet:
    """A queue that takes everything and does nothing."""

    def enqueue(self, session, job_id, *, priority=100):
        pass

    def cancel(self, job_id):
        pass


@pytest.fixture
def work(settings: Settings):
    with open_lab(settings, Quiet()) as lab, lab.write(access.SYSTEM) as found:
        for serial in ("A", "B"):
            gyros.add_gyro(found, serial, "T")
        for name in ("S1", "S2"):
            stands.add_stand(found, name, 56.0)
            rows = [CertificateRow(theta, psi, 1.0, 2.0, 3.0) for theta, psi in PLACES]
            stands.add_certificate(found, name, "C", date(2000, 1, 1), date(2100, 1, 1), rows)
        yield found


def opened(work, gyro="A", stand="S1", measured=0):
    number = sessions.open_session(work, sessions.NewSession(gyro, stand)).id
    for theta, psi in PLACES[:measured]:
        ingest.save_means(work, number, MeansRow(theta, psi, 0.001, 0.002), ingest.Source("typed"))
    return number


def filled(work):
    """One session in each state, some of them twice."""
    numbers = {
        "measuring": opened(work, measured=2),
        "ready": opened(work, "B", measured=3),
        "solving": opened(work, "B", "S2", measured=3),
        "failed": opened(work, measured=3),
    }
    again = opened(work, "B", measured=3)
    ingest.withdraw(work, again, *PLACES[0], 0, "slipped")
    numbers["withdrawn"] = again
    calibrations.request(work, numbers["solving"])
    job = calibrations.request(work, numbers["failed"])
    jobs._find(work, job.id).state = "failed"
    work.db.flush()
    return numbers


def test_states_are_those_of_the_sessions(work):
    filled(work)
    everything = session_index.find(work)
    for state, count in everything.counts["state"].items():
        found = session_index.find(work, state=state).page.items
        assert {item.state for item in found} == {state}
        assert len(found) == count
    assert sum(everything.counts["state"].values()) == everything.total == 5


def test_a_withdrawn_position_is_to_be_measured_again(work):
    numbers = filled(work)
    measuring = {item.id for item in session_index.find(work, state="measuring").page.items}
    assert measuring == {numbers["measuring"], numbers["withdrawn"]}


def test_counts_say_what_a_choice_would_leave(work):
    filled(work)
    narrowed = session_index.find(work, stand="S1")
    for key in ("gyro", "state"):
        for value, count in narrowed.counts[key].items():
            assert session_index.find(work, stand="S1", **{key: value}).total == count
    assert narrowed.counts["stand"] == {"S1": 4, "S2": 1}  # as if no stand were chosen


def test_the_newest_come_first_and_pages_join(work):
    numbers = [opened(work) for _ in range(5)]
    first = session_index.find(work, limit=2).page
    second = session_index.find(work, limit=2, before=int(first.next or 0)).page
    third = session_index.find(work, limit=2, before=int(second.next or 0)).page
    assert [item.id for page in (first, second, third) for item in page.items] == numbers[::-1]
    assert third.next is None


def test_the_last_one_measured_comes_first_whenever_it_was_entered(work):
    numbers = [opened(work) for _ in range(5)]
    days = dict(zip(numbers, (3, 9, 1, 9, 5), strict=True))
    for number, day in days.items():
        sessions.find_session(work, number).started_at = datetime(2026, 3, day, tzinfo=UTC)
    work.db.flush()
    found, following = [], None
    while True:
        page = session_index.find(work, limit=2, before=following).page
        found += [item.id for item in page.items]
        if page.next is None:
            break
        following = int(page.next)
    assert found == sorted(numbers, key=lambda number: (days[number], number), reverse=True)


def test_nothing_there(work):
    empty = session_index.find(work, gyro="none")
    assert (empty.total, empty.page.items, empty.page.next) == (0, (), None)
    assert Counter(empty.counts["gyro"]) == Counter()
