"""What is stated of a stand and of its certificates, joined for the solver."""

from datetime import date

import pytest

from app.errors import Invalid, NotFound
from app.exchange.rows import CertificateRow
from app.services import stands
from app.services.access import SYSTEM
from app.services.lab import Lab
from app.services.views import NONE_IN_COMMON, CommonAngles

ROWS = [CertificateRow(0.0, 90.0, 6.9, -16.4, 6.6)]
DAYS = (date(2026, 1, 1), date(2027, 1, 1))


def test_a_statement_replaces_the_one_before(lab: Lab) -> None:
    with lab.write(SYSTEM) as work:
        assert stands.stand(work, "S1").uncertainty == {}
        stands.state_uncertainty(work, "S1", {"u_gain_x_ppm": 50, "dof": {}, "u_gravity_ppm": None})
    with lab.read(SYSTEM) as work:
        assert stands.stand(work, "S1").uncertainty == {"u_gain_x_ppm": 50}
    with lab.write(SYSTEM) as work:
        stands.state_uncertainty(work, "S1", {"u_gravity_ppm": 5})
        assert stands.stand(work, "S1").uncertainty == {"u_gravity_ppm": 5}
        assert stands.state_uncertainty(work, "S1", {}).uncertainty == {}


def test_a_bad_statement_changes_nothing(lab: Lab) -> None:
    with lab.write(SYSTEM) as work:
        stands.state_uncertainty(work, "S1", {"u_gain_x_ppm": 50})
        with pytest.raises(Invalid):
            stands.state_uncertainty(work, "S1", {"u_gain_x_ppm": -1})
        assert stands.stand(work, "S1").uncertainty == {"u_gain_x_ppm": 50}
        with pytest.raises(NotFound):
            stands.state_uncertainty(work, "S9", {})


def test_the_certificates_part_joins_the_stands(lab: Lab) -> None:
    """The certificate's own value goes before one that was stated for the stand."""
    with lab.write(SYSTEM) as work:
        made = stands.add_certificate(work, "S1", "C-18", *DAYS, ROWS, common=CommonAngles(0.3, None, 0.0))
        assert made.common == CommonAngles(0.3, None, 0.0)
        assert stands.certificate(work, "S1", "C-17").common == NONE_IN_COMMON
        stands.state_uncertainty(work, "S1", {"u_gain_x_ppm": 50, "u_alpha_common_arcsec": 9.0})
        row = stands.find_stand(work, "S1")
        by_number = {
            number: dict(stands.statement(stands.find_certificate(work, row, number)))
            for number in ("C-17", "C-18")
        }
    assert by_number["C-18"] == {"u_gain_x_ppm": 50, "u_alpha_common_arcsec": 0.3}
    assert by_number["C-17"] == {"u_gain_x_ppm": 50, "u_alpha_common_arcsec": 9.0}


@pytest.mark.parametrize("value", [-1e-3, float("nan"), float("inf"), 1e10])
def test_a_common_part_that_cannot_be(lab: Lab, value: float) -> None:
    with lab.write(SYSTEM) as work:
        with pytest.raises(Invalid) as error:
            stands.add_certificate(work, "S1", "C-18", *DAYS, ROWS, common=CommonAngles(0.3, value))
        assert [item.column for item in error.value.problems] == ["u_beta_common_arcsec"]
        assert len(stands.certificates(work, "S1")) == 1
