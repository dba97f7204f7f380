"""Stands and the versions of their certificates."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from decimal import Decimal

from app.errors import Conflict, Invalid, NotFound, problem
from app.exchange.certificate import write_certificate_csv
from app.exchange.fields import full_turn
from app.exchange.positions import Positions
from app.exchange.rows import CertificateRow
from app.exchange.uncertainties import Statement, common_uncertainty, tidy
from app.services.lab import Work
from app.services.names import checked_name
from app.services.views import NONE_IN_COMMON, CertificateView, CommonAngles, StandView
from app.store import equipment
from app.store.tables import CertificatePosition, Stand, StandCertificate


def add_stand(work: Work, name: str, latitude_deg: float, note: str = "") -> StandView:
    """Register a stand in its place."""
    name = checked_name(name, "name")
    if not -90 <= latitude_deg <= 90:
        raise Invalid(problem("bad-latitude", "The latitude must lie between −90 and 90 degrees.",
                              column="latitude_deg"))  # fmt: skip
    if equipment.stand(work.db, name) is not None:
        raise Conflict(
            problem("stand-exists", "There is a stand %(name)s already.", column="name", name=name)
        )
    row = Stand(name=name, latitude_deg=latitude_deg, note=note, created_at=work.now)
    work.db.add(row)
    work.db.flush()
    return _stand_view(work, row)


def stand(work: Work, name: str) -> StandView:
    """One stand with the certificate that is valid today."""
    return _stand_view(work, find_stand(work, name))


def stands(work: Work) -> tuple[StandView, ...]:
    """Every stand, by name."""
    return tuple(_stand_view(work, row) for row in equipment.stands(work.db))


def state_uncertainty(work: Work, name: str, statement: Statement) -> StandView:
    """Enter what all positions measured on a stand have in common; it replaces what was stated before.

    Results that are there already keep the statement that they were computed with.

    Raises
    ------
    Invalid
        As `app.exchange.uncertainties.common_uncertainty`.
    """
    common_uncertainty(statement)
    row = find_stand(work, name)
    row.uncertainty = tidy(statement) or None
    work.db.flush()
    return _stand_view(work, row)


def add_certificate(
    work: Work,
    stand_name: str,
    number: str,
    valid_from: date,
    valid_until: date,
    rows: Sequence[CertificateRow],
    issued_by: str = "",
    common: CommonAngles = NONE_IN_COMMON,
) -> CertificateView:
    """Keep a new version of a stand's certificate; it never changes afterwards.

    `common` are the standard uncertainties of what the angles of all positions share.

    Raises
    ------
    Invalid
        No position, one position twice, a validity that ends before it begins, an uncertainty in
        common that is negative or beyond reason.
    Conflict
        The stand has a certificate of that number.
    """
    row = find_stand(work, stand_name)
    number = checked_name(number, "number")
    if valid_until < valid_from:
        raise Invalid(problem("bad-validity", "The certificate ends before it begins.", column="valid_until"))
    _check_common(common)
    if not rows:
        raise Invalid(
            problem("no-positions", "A certificate needs at least one position.", column="positions")
        )
    if equipment.certificate(work.db, row.id, number) is not None:
        raise Conflict(problem("certificate-exists", "Stand %(stand)s has a certificate %(number)s already; "
                               "certificates never change, so give the new one its own number.",
                               column="number", stand=stand_name, number=number))  # fmt: skip
    ordered = sorted(_in_one_turn(rows), key=lambda item: (item.theta_deg, item.psi_deg))
    version = 1 + max((item.version for item in equipment.certificates(work.db, row.id)), default=0)
    certificate = StandCertificate(
        stand=row, number=number, version=version, valid_from=valid_from, valid_until=valid_until,
        issued_by=issued_by, digest=_digest(ordered, common),
        created_at=work.now, created_by=work.person.name, **common._asdict(),
        positions=[CertificatePosition(**_columns(item)) for item in ordered],
    )  # fmt: skip
    work.db.add(certificate)
    work.db.flush()
    return certificate_view(certificate, work.now.date())


def _check_common(common: CommonAngles) -> None:
    try:
        common_uncertainty(common._asdict())
    except Invalid as error:
        raise Invalid(
            *(replace(item, column=(item.column or "").lstrip("/")) for item in error.problems)
        ) from error


def _digest(rows: Sequence[CertificateRow], common: CommonAngles) -> str:
    """SHA-256 of the positions as their file, and of what they have in common where that is stated."""
    said = "" if common == NONE_IN_COMMON else repr(tuple(common))
    return hashlib.sha256(write_certificate_csv(rows) + said.encode()).hexdigest()


def _in_one_turn(rows: Sequence[CertificateRow]) -> list[CertificateRow]:
    """The rows with θ and ψ in [0, 360)°, each position once."""
    known, turned, twice = Positions(), [], []
    for number, row in enumerate(rows, start=1):
        theta_deg, psi_deg = (full_turn(Decimal(repr(angle))) for angle in (row.theta_deg, row.psi_deg))
        before = len(known)
        if known.put(theta_deg, psi_deg) < before:
            twice.append(problem("duplicate-position", "The position θ %(theta)g°, ψ %(psi)g° is there already. "
                                 "Keep one of the two.", row=number, column="theta_deg", theta=theta_deg,
                                 psi=psi_deg))  # fmt: skip
        turned.append(replace(row, theta_deg=theta_deg, psi_deg=psi_deg))
    if twice:
        raise Invalid(*twice)
    return turned


def certificate(work: Work, stand_name: str, number: str) -> CertificateView:
    """One certificate of a stand."""
    row = find_certificate(work, find_stand(work, stand_name), number)
    return certificate_view(row, work.now.date())


def certificates(work: Work, stand_name: str | None = None) -> tuple[CertificateView, ...]:
    """Certificates of one stand or of all, the newest first."""
    stand_id = None if stand_name is None else find_stand(work, stand_name).id
    return tuple(certificate_view(row, work.now.date()) for row in equipment.certificates(work.db, stand_id))


def find_stand(work: Work, name: str) -> Stand:
    """The stand's row, or `NotFound`."""
    row = equipment.stand(work.db, name)
    if row is None:
        raise NotFound(problem("unknown-stand", "There is no stand %(name)s. Register it first.",
                               column="stand", name=name))  # fmt: skip
    return row


def find_certificate(work: Work, row: Stand, number: str) -> StandCertificate:
    """The certificate's row, or `NotFound`."""
    certificate = equipment.certificate(work.db, row.id, number)
    if certificate is None:
        raise NotFound(problem("unknown-certificate", "Stand %(stand)s has no certificate %(number)s.",
                               column="certificate", stand=row.name, number=number))  # fmt: skip
    return certificate


def certificate_rows(row: StandCertificate) -> tuple[CertificateRow, ...]:
    """The certificate's positions in laboratory units, θ outer, ψ inner."""
    return tuple(
        CertificateRow(
            item.theta_deg, item.psi_deg, item.alpha_arcsec, item.beta_arcsec, item.gamma_arcsec,
            item.u_alpha_arcsec, item.u_beta_arcsec, item.u_gamma_arcsec,
        )
        for item in row.positions
    )  # fmt: skip


def statement(row: StandCertificate) -> Statement:
    """What all positions measured with this certificate have in common: the stand's part and its own."""
    own = {name: value for name, value in _common(row)._asdict().items() if value}
    return {**(row.stand.uncertainty or {}), **own}


def _common(row: StandCertificate) -> CommonAngles:
    return CommonAngles(row.u_alpha_common_arcsec, row.u_beta_common_arcsec, row.u_gamma_common_arcsec)


def certificate_view(row: StandCertificate, today: date) -> CertificateView:
    """A certificate as it is shown."""
    return CertificateView(
        stand=row.stand.name, number=row.number, version=row.version, valid_from=row.valid_from,
        valid_until=row.valid_until, issued_by=row.issued_by, digest=row.digest, created_at=row.created_at,
        created_by=row.created_by, valid=row.valid_from <= today <= row.valid_until,
        common=_common(row),
        positions=certificate_rows(row),
    )  # fmt: skip


def _stand_view(work: Work, row: Stand) -> StandView:
    valid = equipment.valid_certificate(work.db, row.id, work.now.date())
    return StandView(
        row.name, row.latitude_deg, row.note, row.created_at,
        certificate_view(valid, work.now.date()) if valid else None, row.uncertainty or {},
    )  # fmt: skip


def _columns(row: CertificateRow) -> dict[str, float | None]:
    return {name: getattr(row, name) for name in CertificateRow.__slots__}
