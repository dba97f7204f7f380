"""Measurements are revisions: nothing is overwritten, nothing doubled."""

import pytest

from app.errors import Invalid, NotFound
from app.exchange.rows import MeansRow
from app.services import ingest, sessions
from app.services.access import SYSTEM
from app.store import measurement

TYPED = ingest.Source("typed")


def save(lab, session_id, row, source=TYPED, note=""):
    with lab.write(SYSTEM) as work:
        return ingest.save_means(work, session_id, row, source, note)


def current(lab, session_id):
    with lab.read(SYSTEM) as work:
        return [
            (row.theta_deg, row.psi_deg, row.jx_ma, row.revision)
            for row in measurement.current(work.db, session_id)
        ]


def test_the_same_again_changes_nothing(lab, session_id, currents):
    assert save(lab, session_id, currents(0)).new
    again = save(lab, session_id, currents(0))
    assert not again.new
    assert again.measurement.revision == 1


def test_another_value_is_a_new_revision_and_the_old_one_stays(lab, session_id, currents):
    save(lab, session_id, currents(0))
    second = save(lab, session_id, currents(0, jx_ma=0.002))
    assert (second.new, second.measurement.revision) == (True, 2)
    with lab.read(SYSTEM) as work:
        kept = [(row.revision, row.jx_ma) for row in sessions.detail(work, session_id).revisions]
    assert kept == [(1, 0.001), (2, 0.002)]
    assert current(lab, session_id) == [(0.0, 0.0, 0.002, 2)]


def test_the_first_value_again_after_another_is_a_third_revision(lab, session_id, currents):
    for jx_ma in (0.001, 0.002, 0.001):
        save(lab, session_id, currents(0, jx_ma=jx_ma))
    assert current(lab, session_id) == [(0.0, 0.0, 0.001, 3)]


def test_the_last_bit_of_a_current_is_kept(lab, session_id, currents):
    value = 0.004536068469767458  # needs all 17 digits
    save(lab, session_id, currents(0, jx_ma=value))
    assert current(lab, session_id)[0][2].hex() == value.hex()


def test_a_withdrawn_position_counts_no_more_and_can_be_measured_again(lab, session_id, currents):
    save(lab, session_id, currents(0))
    with lab.write(SYSTEM) as work:
        gone = ingest.withdraw(work, session_id, 0.0, 0.0, 0, "door slammed")
    assert gone.measurement.withdrawn
    assert current(lab, session_id) == []
    assert save(lab, session_id, currents(0)).measurement.revision == 3


def test_a_full_turn_is_the_same_position(lab, session_id, currents):
    save(lab, session_id, MeansRow(360.0, -90.0, 0.001, 0.002))
    assert current(lab, session_id) == [(0.0, 270.0, 0.001, 1)]


def test_every_position_without_certified_angles_is_named(lab, session_id):
    rows = [
        MeansRow(45.0, 0.0, 0.001, 0.002),
        MeansRow(0.0, 0.0, 0.001, 0.002),
        MeansRow(30.0, 0.0, 0.001, 0.002),
    ]
    with pytest.raises(Invalid) as caught, lab.write(SYSTEM) as work:
        ingest.save(work, session_id, [ingest.Measured(row, TYPED) for row in rows])
    assert [item.message.values["theta"] for item in caught.value.problems] == [45.0, 30.0]
    assert current(lab, session_id) == [], (
        "one bad row keeps the others out: the file is mended and sent again"
    )


def test_an_unknown_session_is_named(lab, currents):
    with pytest.raises(NotFound, match="no session 99"):
        save(lab, 99, currents(0))


def test_a_record_is_referred_to_by_its_digest(lab, session_id, currents):
    stored = ingest.StoredRecord("ab" * 32, 12000, 60.0, 200.0)
    with lab.write(SYSTEM) as work:
        saved = ingest.save_record(
            work, session_id, currents(3), stored, ingest.Source("upload", "cd" * 32, "a.csv")
        )
        known = measurement.record(work.db, "ab" * 32)
        assert (known.samples, known.source_digest, known.source_name) == (12000, "cd" * 32, "a.csv")
    assert saved.measurement.record == "ab" * 32


@pytest.mark.parametrize(
    ("name", "suffix"),
    [
        ("a.csv", "csv"),
        ("dir/A.CSV.GZ", "csv.gz"),
        ("a", "bin"),
        ("a.../../x", "bin"),
        ("a.b c", "bin"),
        ("x.parquet", "parquet"),
    ],
)
def test_a_kept_upload_has_a_plain_suffix(name, suffix):
    assert ingest.source_suffix(name) == suffix
