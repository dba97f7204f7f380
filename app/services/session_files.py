"""Files brought to a session that is open already."""

from app.services import ingest, sessions
from app.services.lab import Work
from app.services.uploads import Arrived, BroughtIn
from solver.errors import Message


def bring_into(work: Work, session_id: int, arrived: Arrived) -> BroughtIn:
    """Save what the files measured as revisions of this session, or ask for their reading.

    What the files say of gyro and stand is compared with the session's, and a difference told.

    Raises
    ------
    NotFound
        No such session.
    Invalid
        A position that the session's certificate does not have.
    """
    session = sessions.session(work, session_id)
    warnings = list(arrived.warnings)
    for name, said, used in (
        ("gyro", arrived.facts.gyro, session.gyro),
        ("stand", arrived.facts.stand, session.stand),
    ):
        if said is not None and said != used:
            warnings.append(
                Message(
                    "differs",
                    "session.json names the %(what)s %(said)s; %(used)s was used.",
                    {"what": name, "said": said, "used": used},
                )
            )
    if arrived.measured is None:
        job = ingest.request_import(work, session_id, arrived.digest, arrived.name)
        return BroughtIn(session, (), job, tuple(warnings))
    saved = ingest.save(work, session_id, arrived.measured)
    return BroughtIn(session, saved, None, tuple(warnings))
