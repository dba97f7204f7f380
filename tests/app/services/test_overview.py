"""The first screen: open sessions before everything else."""

from app.services import calibrations, ingest, overview
from app.services.access import SYSTEM
from app.services.computing import calibrate
from app.services.ledger import JobLedger
from app.services.sessions import NewSession, open_session


def solve(lab, session_id, currents):
    with lab.write(SYSTEM) as work:
        ingest.save_means(work, session_id, currents(0), ingest.Source("typed"))
        job = calibrations.request(work, session_id, "least-squares").id
    ledger = JobLedger(lab)
    ledger.succeed(job, calibrate(ledger.begin(job).payload, lambda fraction, phase: None))


def test_the_open_session_is_found_behind_a_later_one_that_is_solved(lab, session_id, currents):
    with lab.write(SYSTEM) as work:
        ingest.save_means(work, session_id, currents(0), ingest.Source("typed"))
        later = open_session(work, NewSession("0417", "S1")).id
    solve(lab, later, currents)
    with lab.read(SYSTEM) as work:
        seen = overview.overview(work)
        (stand,) = overview.stands_now(work, ("S1",))
    assert [item.id for item in seen.recent] == [session_id, later]
    assert seen.current.session.id == stand.session.id == session_id


def test_a_solved_session_leaves_the_stand_free(lab, session_id, currents):
    solve(lab, session_id, currents)
    with lab.read(SYSTEM) as work:
        (stand,) = overview.stands_now(work, ("S1",))
        seen = overview.overview(work)
    assert stand.session is None
    assert seen.current is None
    assert [item.state for item in seen.recent] == ["solved"]


def test_an_empty_laboratory_has_nothing_to_go_on_with(lab):
    with lab.read(SYSTEM) as work:
        seen = overview.overview(work)
        (stand,) = overview.stands_now(work, ("S1",))
    assert (seen.current, seen.recent, stand.session) == (None, (), None)
