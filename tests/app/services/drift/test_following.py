"""One job behind all that comes in; a study is the old one or the new one, never in between."""

from laid import TECHNICIAN, drawn, revision, session

from app.services.computing import follow
from app.services.drift import following, reading, series, studying
from app.services.ledger import JobLedger
from app.services.lookup import find_gyro
from app.store.tables import DriftStudy, Job


def _jobs(lab, state="queued"):
    with lab.read(TECHNICIAN) as work:
        rows = work.db.query(Job).filter_by(kind=following.KIND, state=state)
        return [row.id for row in rows if "gyro" in row.request]


def _drift(lab):
    with lab.read(TECHNICIAN) as work:
        return reading.gyro_drift(work, "0417")


def _done(task):
    return follow(task.payload, lambda _fraction, _phase: None)


def test_twelve_results_wait_for_one_job_of_the_gyro(lab, history, follow_jobs):
    assert len(_jobs(lab)) == 1
    before = _drift(lab)
    assert (before.up_to_date, before.document, before.sessions) == (False, None, 0)
    assert before.job is not None
    assert before.job.state == "queued"
    follow_jobs()
    after = _drift(lab)
    assert (after.up_to_date, after.sessions) == (True, 12)
    assert [point.session for point in after.parameters[0].points] == history


def test_what_comes_in_while_the_study_is_made_leaves_it_behind_with_a_job_of_its_own(lab, history):
    ledger = JobLedger(lab)
    (first,) = _jobs(lab)
    task = ledger.begin(first)
    assert task is not None
    with lab.write(TECHNICIAN) as work:
        session(work, 12, drawn(13)[12])
    (second,) = _jobs(lab)
    ledger.succeed(first, _done(task))
    behind = _drift(lab)
    assert (behind.up_to_date, behind.sessions) == (False, 12)
    task = ledger.begin(second)
    assert task is not None
    ledger.succeed(second, _done(task))
    assert (_drift(lab).up_to_date, _drift(lab).sessions) == (True, 13)


def test_a_late_answer_does_not_replace_a_newer_study(lab, history):
    ledger = JobLedger(lab)
    (first,) = _jobs(lab)
    slow = ledger.begin(first)
    assert slow is not None
    with lab.write(TECHNICIAN) as work:
        session(work, 12, drawn(13)[12])
    (second,) = _jobs(lab)
    quick = ledger.begin(second)
    assert quick is not None
    ledger.succeed(second, _done(quick))
    ledger.succeed(first, _done(slow))
    assert (_drift(lab).up_to_date, _drift(lab).sessions) == (True, 13)


def test_a_job_begun_again_after_a_crash_takes_in_what_is_there_then(lab, history):
    ledger = JobLedger(lab)
    (job_id,) = _jobs(lab)
    assert ledger.begin(job_id) is not None  # the service is killed while the child computes
    with lab.write(TECHNICIAN) as work:
        session(work, 12, drawn(13)[12])
    task = ledger.begin(job_id)
    assert task is not None
    ledger.succeed(job_id, _done(task))
    assert (_drift(lab).up_to_date, _drift(lab).sessions) == (True, 13)


def test_a_failed_job_leaves_the_old_study_and_the_next_change_tries_again(lab, history, follow_jobs):
    follow_jobs()
    with lab.write(TECHNICIAN) as work:
        session(work, 12, drawn(13)[12])
    (job_id,) = _jobs(lab)
    ledger = JobLedger(lab)
    assert ledger.begin(job_id) is not None
    ledger.fail(job_id, [])
    assert (_drift(lab).up_to_date, _drift(lab).sessions) == (False, 12)
    with lab.write(TECHNICIAN) as work:
        session(work, 13, drawn(14)[13])
    follow_jobs()
    assert (_drift(lab).up_to_date, _drift(lab).sessions) == (True, 14)


def test_each_method_has_a_study_and_a_correction_takes_the_others_along(lab, history, follow_jobs):
    with lab.write(TECHNICIAN) as work:
        revision(work, history[0], drawn(1, 7)[0], methods=("paper",))
        gyro = find_gyro(work, "0417").id
        assert len(series.load(work, gyro, "least-squares")) == 12
        assert series.load(work, gyro, "paper")["session"].tolist() == [history[0]]
        revision(work, history[0], drawn(1, 8)[0], methods=("paper",), input_hash="corrected")
    follow_jobs()
    found = _drift(lab)
    assert found.methods == ("least-squares", "paper")
    assert [point.session for point in found.parameters[0].points] == history[1:]


def test_builders_without_an_engine_study_everything_at_once(lab, history):
    with lab.write(TECHNICIAN) as work:
        studying.follow_all_now(work)
    assert _drift(lab).up_to_date
    assert _jobs(lab) == []
    assert len(_jobs(lab, "succeeded")) == 1


def test_at_the_start_results_older_than_the_studies_get_theirs(lab, history):
    with lab.write(TECHNICIAN) as work:
        work.db.query(DriftStudy).delete()
        work.db.query(Job).delete()
        following.catch_up(work)
        following.catch_up(work)
    assert len(_jobs(lab)) == 1
    with lab.write(TECHNICIAN) as work:
        studying.follow_all_now(work)
        following.catch_up(work)
        work.db.query(DriftStudy).update({"solver_version": "0.0.1"})
    assert _jobs(lab) == []
    with lab.write(TECHNICIAN) as work:
        following.catch_up(work)
    assert len(_jobs(lab)) == 1
    assert not _drift(lab).up_to_date


def test_at_the_start_a_failed_study_is_tried_again(lab, history):
    (job_id,) = _jobs(lab)
    ledger = JobLedger(lab)
    assert ledger.begin(job_id) is not None
    ledger.fail(job_id, [])
    with lab.write(TECHNICIAN) as work:
        following.catch_up(work)
    assert len(_jobs(lab)) == 1
