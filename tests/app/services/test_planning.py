"""Plans of a laboratory: what is taken for nominal, what is told, what is refused."""

from dataclasses import replace
from datetime import date

import pytest

from app.errors import Invalid, NotFound
from app.exchange.rows import CertificateRow
from app.services import gyros, plan_subjects, planning, stands
from app.services.access import SYSTEM
from app.services.lab import Lab
from app.services.plan_question import Asked, Question, check
from app.services.plan_subjects import typical
from app.services.plan_views import as_json
from solver.records import PARAMETERS

SIXTEEN = tuple(
    CertificateRow(float(theta), float(psi), 6.9, -16.4, 6.6, 0.5, 0.5, 0.5)
    for theta in range(0, 360, 90)
    for psi in range(0, 360, 90)
)


def question(asked: Asked | None = None, latitude_deg: float = 55.7558, **more) -> Question:
    return Question(SIXTEEN, latitude_deg, tuple(typical()[0].values()), asked or Asked(), **more)


def test_the_whole_certificate_is_judged_when_nothing_else_is_asked() -> None:
    plan = planning.plan(question(limits=(("w0x", -2.0, 2.0),)))
    assert (plan.count, plan.rank, plan.dof, plan.search) == (16, 8, 24, None)
    assert plan.duration_s == 90.0  # 2400 s / 16 − 60 s
    assert all(item.certified and item.times == 1 for item in plan.positions)
    found = {item.name: item for item in plan.parameters}
    # 0.005 °/h over 60 s, 90 s each, sixteen of them: 0.005·√(60/90)/√16.
    assert found["w0x"].u == pytest.approx(0.005 * (60 / 90) ** 0.5 / 4, rel=0.02)
    assert found["w0x"].verdict == "conforms"
    assert found["w0x"].of_limits == pytest.approx(found["w0x"].expanded / 2.0, rel=1e-12)
    assert found["w0y"].verdict == "no-limit"
    assert found["w0y"].of_limits is None
    assert found["kx"].dominating == "currents"
    assert found["kx"].k == pytest.approx(1.96, abs=0.001)  # u is taken as known: normal quantile of 95 %


def test_a_list_counts_its_repeats_and_marks_what_is_not_certified() -> None:
    plan = planning.plan(question(Asked(positions=((0.0, 0.0), (45.0, 10.0), (0.0, 0.0), (90.0, 90.0)))))
    told = [(item.theta_deg, item.psi_deg, item.times, item.certified) for item in plan.positions]
    assert told == [(0.0, 0.0, 2, True), (45.0, 10.0, 1, False), (90.0, 90.0, 1, True)]
    assert plan.count == 4


def test_the_best_are_proposed_and_nothing_where_nothing_can_be() -> None:
    plan = planning.plan(question(Asked(count=8, criterion="wg")))
    assert plan.search is not None
    assert plan.search.exhaustive
    assert plan.search.tried == 12_870  # 16 over 8
    found = {item.name: item for item in plan.parameters}
    assert plan.search.figure == pytest.approx(found["wg"].u, rel=1e-6)
    assert plan.search.unit == "deg/h/g"
    assert plan.determined
    pole = planning.plan(question(Asked(count=8), latitude_deg=90.0))
    assert not pole.determined
    assert "at a pole" in pole.warnings[0].text
    assert planning.counts(question(Asked(count=8), latitude_deg=90.0)) == ()


def test_numbers_of_positions_are_compared_and_the_best_is_marked() -> None:
    found = planning.counts(question(Asked(floor_deg_per_h=0.01)))
    assert [item.count for item in found] == list(range(4, 17))
    assert [item.best for item in found].count(True) == 1
    best = next(item for item in found if item.best)
    assert best.figure == min(item.figure for item in found)
    assert best.count > 8  # a floor makes more positions pay
    short = planning.counts(question(Asked(time_s=900.0)))
    assert [item.count for item in short if item.below_method] == list(range(8, 15))


def test_the_trade_marks_the_papers_eight_all_sixteen_and_the_plan() -> None:
    trade = planning.trade(question())
    marked = {point.kind: point for point in trade.marked}
    assert set(marked) == {"paper", "all", "plan"}
    assert len(marked["paper"].positions) == 8
    assert (
        marked["plan"].u_k_deg_per_h_per_ma == marked["all"].u_k_deg_per_h_per_ma
    )  # the certificate is both
    for point in trade.marked:
        assert any(
            front.u_k_deg_per_h_per_ma <= point.u_k_deg_per_h_per_ma * 1.001
            and front.u_wg_deg_per_h_per_g <= point.u_wg_deg_per_h_per_g * 1.001
            for front in trade.front
        ), point.kind  # points nearer than 1e-3 are one
    again = planning.plan(question(Asked(positions=trade.front[0].positions)))
    found = {item.name: item.u for item in again.parameters}
    assert found["wg"] == pytest.approx(trade.front[0].u_wg_deg_per_h_per_g, rel=1e-9)


@pytest.mark.parametrize(
    ("asked", "columns"),
    [
        (Asked(count=3), ["count"]),
        (Asked(count=65, criterion="E"), ["count", "criterion"]),
        (Asked(grid_deg=44.0, count=8), ["grid_deg"]),
        (Asked(grid_deg=15.0, count=8), ["grid_deg"]),
        (Asked(time_s=0.0, moving_s=-1.0), ["time_s", "moving_s"]),
        (Asked(time_s=float("nan")), ["time_s"]),
        (Asked(time_s=900.0), ["time_s"]),
        (Asked(noise_deg_per_h=0.0), ["noise_deg_per_h"]),
        (Asked(noise_deg_per_h=11.0, floor_deg_per_h=-1.0), ["noise_deg_per_h", "floor_deg_per_h"]),
        (Asked(count=17), ["count"]),
        (Asked(positions=((0.0, 0.0),) * 65), ["positions"]),
    ],
)
def test_a_question_without_an_answer_names_its_fields(asked: Asked, columns: list[str]) -> None:
    with pytest.raises(Invalid) as error:
        planning.plan(question(asked))
    assert [item.column for item in error.value.problems] == columns


def test_usual_values_are_accepted() -> None:
    check(Asked())
    check(Asked(count=64, grid_deg=30.0, repeats=True))


def test_nominal_values_come_from_the_gyro_its_type_or_nobody(lab: Lab) -> None:
    with lab.write(SYSTEM) as work:
        gyros.set_limits(work, "GVK-6", {"kx": (2000.0, 2100.0)})
        found = plan_subjects.subject(work, "S1", Asked(), gyro="0417")
        assert found.nominal_source.code == "nominal-typical"
        assert found.certificate == "C-17"
        assert found.question.limits == (("kx", 2000.0, 2100.0),)
        assert found.question.certificate[0].u_alpha_arcsec == 0.5
        gyros.set_nominals(work, "GVK-6", {"kx": gyros.Nominal(2050.0, 10.0)})
        found = plan_subjects.subject(work, "S1", Asked(), type_name="GVK-6")
        assert found.nominal_source.text == "nominal values of type GVK-6"
        assert dict(zip(PARAMETERS, found.question.nominal, strict=True))["kx"] == 2050.0
        nobody = plan_subjects.subject(work, "S1", Asked())
        assert nobody.question.limits == ()
        # 10 rad/(s·A) in °/h/mA: 10·180/π·3.6.
        assert nobody.question.nominal[0] == pytest.approx(2062.648, abs=1e-3)
        assert nobody.question.nominal[4:] == (0.0,) * 4


def test_what_is_not_there_is_named(lab: Lab) -> None:
    with lab.write(SYSTEM) as work:
        stands.add_stand(work, "S2", 10.0)
        stands.add_certificate(work, "S2", "old", date(2000, 1, 1), date(2001, 1, 1), SIXTEEN)
        for arguments, column in (
            ({"certificate": "C-99"}, "certificate"), ({"gyro": "9999"}, "gyro"), ({"type_name": "no"}, "type")
        ):  # fmt: skip
            with pytest.raises(NotFound) as error:
                plan_subjects.subject(work, "S1", Asked(), **arguments)
            assert error.value.problems[0].column == column
        with pytest.raises(Invalid) as refused:
            plan_subjects.subject(work, "S2", Asked())
        assert refused.value.problems[0].column == "certificate"
        # Named, an old certificate serves: one plans before a new one is there.
        assert plan_subjects.subject(work, "S2", Asked(), certificate="old").certificate == "old"


def test_a_stated_uncertainty_of_the_stand_counts(lab: Lab) -> None:
    with lab.write(SYSTEM) as work:
        before = plan_subjects.subject(work, "S1", Asked())
        stands.state_uncertainty(work, "S1", {"u_gain_x_ppm": 5000, "u_gain_y_ppm": 5000})
        after = plan_subjects.subject(work, "S1", Asked())
    first, second = planning.plan(before.question), planning.plan(after.question)
    assert (first.parameters[0].dominating, second.parameters[0].dominating) == ("currents", "ammeter-gain")
    # 0.5 % of K beside the noise.
    assert second.parameters[0].u == pytest.approx(0.005 * 2062.65, rel=0.05)


def test_the_answer_for_programs_is_plain() -> None:
    planned = planning.planned(
        plan_subjects.Subject(replace(question()), "S1", "C-17", typical()[1]), with_counts=True
    )
    written = as_json(planned)
    assert written["plan"]["parameters"][0]["name"] == "kx"
    assert "of_limits" in written["plan"]["parameters"][0]
    assert len(written["counts"]) == 13
    assert "trade" not in written
