"""A calibration from request to result, its revisions and its provenance."""

import json

import pytest

from app.errors import Invalid
from app.exchange.rows import MeansRow
from app.services import calibrations, history, ingest, jobs, sessions
from app.services.access import SYSTEM
from app.services.computing import calibrate
from app.services.ledger import MAX_ATTEMPTS, JobLedger
from app.services.simulated import degrees, truth_values
from app.store.tables import StandAttitude
from simdevice.bench import mean_currents
from simdevice.certificate import sixteen_positions
from solver.units import ma_from_ampere


@pytest.fixture
def measured(lab, session_id, bench) -> int:
    """The session with sixteen simulated positions."""
    means = mean_currents(bench, sixteen_positions())
    rows = [
        MeansRow(
            degrees(means.theta[n]),
            degrees(means.psi[n]),
            *(float(ma_from_ampere(column[n])) for column in (means.jx, means.jy, means.u_jx, means.u_jy)),
            60.0,
            200.0,
        )
        for n in range(16)
    ]
    with lab.write(SYSTEM) as work:
        ingest.save(work, session_id, [ingest.Measured(row, ingest.Source("typed")) for row in rows])
    return session_id


def ask(lab, session_id, method="both"):
    with lab.write(SYSTEM) as work:
        return calibrations.request(work, session_id, method)


def run(lab, job_id):
    """What the job engine does, without its processes."""
    ledger = JobLedger(lab)
    task = ledger.begin(job_id)
    ledger.succeed(job_id, calibrate(task.payload, lambda fraction, phase: None))
    with lab.read(SYSTEM) as work:
        return jobs.job(work, job_id)


def test_the_truth_comes_back_within_four_u(lab, measured, bench):
    job = run(lab, ask(lab, measured).id)
    assert (job.state, job.progress) == ("succeeded", 1.0)
    with lab.read(SYSTEM) as work:
        view = calibrations.calibration(work, job.calibration)
    truth = truth_values(bench.gyro)
    for name, parameter in view.summary.parameters.items():
        # Eight normal deviates beyond 4 u: p = 8 · 6e-5. The certificate's 0.5″ adds about 2 ppm of K and
        # 2e-5 °/h, small against u.
        assert abs(parameter.value - truth[name]) < 4 * parameter.u, name


def test_the_provenance_is_complete(lab, measured):
    job = run(lab, ask(lab, measured).id)
    with lab.read(SYSTEM) as work:
        view = calibrations.calibration(work, job.calibration)
        detail = sessions.detail(work, measured)
    assert view.certificate.number == "C-17"
    assert [item.id for item in view.inputs] == [item.measurement.id for item in detail.positions]
    assert view.input_hash == view.result["input_hash"]
    assert view.result["least-squares"]["fit"]["dof"] == 24
    assert (view.revision, view.replaces, view.replaced_by) == (1, None, None)


def test_the_stands_attitude_is_kept_beside_the_result(lab, measured):
    job = run(lab, ask(lab, measured).id)
    with lab.read(SYSTEM) as work:
        view = calibrations.calibration(work, job.calibration)
        row = work.db.get(StandAttitude, job.calibration)
        told = view.result["least-squares"]["stand_attitude"]
        assert {name: getattr(row, name) for name in told} == told
    # The simulated base stands as certified, to the certificate's 0.5″: four standard deviations.
    for name in ("azimuth_arcsec", "level_north_arcsec"):
        assert abs(told[name]) < 4 * told[f"u_{name}"] < 200


def test_solving_the_same_again_gives_the_same_bytes_and_no_new_revision(lab, measured):
    first = run(lab, ask(lab, measured).id)
    second = run(lab, ask(lab, measured).id)
    assert second.id != first.id
    assert second.calibration == first.calibration


def test_a_corrected_position_gives_a_revision_that_says_what_it_replaces(lab, measured, currents):
    first = run(lab, ask(lab, measured).id).calibration
    with lab.write(SYSTEM) as work:
        row = sessions.detail(work, measured).positions[0].measurement
        corrected = MeansRow(0.0, 0.0, row.jx_ma + 1e-7, row.jy_ma, row.u_jx_ma, row.u_jy_ma, 60.0, 200.0)
        ingest.save_means(work, measured, corrected, ingest.Source("typed"))
    second = run(lab, ask(lab, measured).id).calibration
    with lab.read(SYSTEM) as work:
        old, new = calibrations.calibration(work, first), calibrations.calibration(work, second)
        points = history.history(work, "0417", parameter="wg")[0].points
    assert (new.revision, new.replaces, old.replaced_by) == (2, first, second)
    assert old.result["input_hash"] != new.result["input_hash"]
    assert [point.calibration for point in points] == [second], "a session counts once in the history"


def test_solving_once_more_by_the_papers_method_hides_nothing_from_the_history(lab, measured, currents):
    first = run(lab, ask(lab, measured, "least-squares").id).calibration
    second = run(lab, ask(lab, measured, "paper").id).calibration
    assert _in_history(lab) == ([first], [second])
    with lab.write(SYSTEM) as work:
        ingest.save_means(work, measured, currents(0), ingest.Source("typed"))
    third = run(lab, ask(lab, measured, "paper").id).calibration
    assert _in_history(lab) == ([], [third]), "a value of measurements since corrected has no place there"


def _in_history(lab):
    with lab.read(SYSTEM) as work:
        return tuple(
            [
                point.calibration
                for point in history.history(work, "0417", parameter="wg", method=method)[0].points
            ]
            for method in ("least-squares", "paper")
        )


def test_a_request_while_the_same_one_waits_gives_the_same_job(lab, measured, queue):
    assert ask(lab, measured).id == ask(lab, measured).id
    assert len(queue.queued) == 1
    assert ask(lab, measured, "paper").id != queue.queued[0]


def test_the_inputs_are_those_of_the_request_although_a_position_changed_since(lab, measured, currents):
    job = ask(lab, measured)
    with lab.write(SYSTEM) as work:
        ingest.save_means(work, measured, currents(0), ingest.Source("typed"))
    done = run(lab, job.id)
    with lab.read(SYSTEM) as work:
        view = calibrations.calibration(work, done.calibration)
    assert view.inputs[0].revision == 1


def test_a_job_cancelled_while_it_computes_keeps_its_end(lab, measured, queue):
    job = ask(lab, measured)
    ledger = JobLedger(lab)
    task = ledger.begin(job.id)
    with lab.write(SYSTEM) as work:
        assert jobs.cancel(work, job.id).state == "cancelled"
    assert queue.cancelled == [job.id]
    ledger.succeed(job.id, calibrate(task.payload, lambda fraction, phase: None))
    with lab.read(SYSTEM) as work:
        assert jobs.job(work, job.id).state == "cancelled"
        assert sessions.session(work, measured).result is None
    assert ledger.begin(job.id) is None


def test_a_job_is_not_begun_for_ever(lab, measured):
    job, ledger = ask(lab, measured), JobLedger(lab)
    for _ in range(MAX_ATTEMPTS):
        assert ledger.begin(job.id) is not None
    assert ledger.begin(job.id) is None
    with lab.read(SYSTEM) as work:
        failed = jobs.job(work, job.id)
    assert (failed.state, len(failed.problems)) == ("failed", 1)


def test_nothing_measured_cannot_be_solved(lab, session_id):
    with pytest.raises(Invalid, match="No position"):
        ask(lab, session_id)


def test_too_few_positions_are_solved_as_far_as_they_go(lab, session_id, currents):
    with lab.write(SYSTEM) as work:
        ingest.save(
            work, session_id, [ingest.Measured(currents(n), ingest.Source("typed")) for n in range(2)]
        )
    job = run(lab, ask(lab, session_id).id)
    with lab.read(SYSTEM) as work:
        view = calibrations.calibration(work, job.calibration)
    assert view.summary.verdict == "undetermined"
    assert "error" in view.result["paper"]
    codes = [warning["code"] for warning in view.result["least-squares"]["warnings"]]
    assert "unobservable" in codes


def test_a_result_is_stored_byte_for_byte(lab, measured):
    job = run(lab, ask(lab, measured).id)
    with lab.read(SYSTEM) as work:
        text = calibrations.result_text(work, job.calibration)
    assert json.loads(text)["method"] == "both"
    assert "NaN" not in text
