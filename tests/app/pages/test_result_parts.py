"""Parts of a result's page from the result's JSON: budget, Monte Carlo, further terms, findings."""

from types import SimpleNamespace

from app.pages.result_findings import TITLES, findings, not_excluded
from app.pages.result_limits import SOURCES, Budget
from app.pages.result_tests import TERMS, Model, MonteCarlo
from solver.estimators.terms import TERMS as SOLVER_TERMS
from solver.inputs import SOURCES as LINES
from solver.propagation.budget import CORRELATION, SCATTER
from solver.records import PARAMETERS

# The interface's codes of blunders, and the one for what none of them explains.
CODES = (
    "outlier", "positions-swapped", "position-wrong", "angle-unit", "channel-stuck", "channel-saturated",
    "warm-up", "channels-swapped", "channel-sign", "latitude-sign", "latitude-complement",
    "psi-reversed", "theta-reversed", "current-unit", "unexplained",
)  # fmt: skip


def line(code, share):
    return {"code": code, "source": code, "shares": dict.fromkeys(PARAMETERS, share),
            "standard_uncertainties": dict.fromkeys(PARAMETERS, 0.0123)}  # fmt: skip


def parameters(**changes):
    entry = {"standard_uncertainty": 0.0123, "expanded_uncertainty": 0.0241, "dof": None, "coverage_factor": 1.96,
             "dominated_by": "currents"}  # fmt: skip
    return dict.fromkeys(PARAMETERS, entry | changes)


def test_everything_that_the_solver_names_has_words():
    assert set(SOURCES) == {SCATTER, *LINES, CORRELATION}
    assert set(TERMS) == set(SOLVER_TERMS)
    assert set(CODES) <= set(TITLES)


def test_the_largest_lines_are_drawn_and_the_others_counted():
    shares = {
        "gravity": 0.001,
        "currents": 0.6,
        "angles": 0.3,
        "level": 0.05,
        "azimuth": 0.03,
        "latitude": 0.019,
    }
    budget = Budget(
        {"budget": [line(code, share) for code, share in shares.items()], "parameters": parameters()}
    )
    assert [item["code"] for item in budget.shown] == ["currents", "angles", "level", "azimuth", "latitude"]
    assert budget.hidden == 1
    bars = budget.rows[0].shares
    assert [bar.text for bar in bars] == ["60", "30", "5", "3", "2"]
    assert [bar.dominates for bar in bars] == [True, False, False, False, False]
    assert bars[0].length == "60.0%"
    assert len(budget.lines) == 6
    assert budget.sentence.startswith("Noise of the means dominates Kx, Ky")


def test_sums_show_infinite_degrees_of_freedom_and_nothing_for_the_undetermined():
    known, blank = (
        parameters(),
        parameters(standard_uncertainty=None, expanded_uncertainty=None, coverage_factor=None),
    )
    (first, *_), (last, *_) = (
        Budget({"budget": [line("currents", 1.0)], "parameters": told}).sums for told in (known, blank)
    )
    assert (first.u, first.dof, first.k, first.expanded) == ("0.012", "∞", "1.96", "0.024")
    assert {last.u, last.dof, last.k, last.expanded} == {"–"}


def test_a_share_below_half_a_percent_is_no_zero():
    budget = Budget({"budget": [line("currents", 0.999), line("gravity", 0.001)], "parameters": parameters()})
    assert [bar.text for bar in budget.rows[0].shares] == ["100", "<1"]


def test_parts_of_an_uncertainty_end_with_its_third_digit_and_rounding_is_zero():
    """u = 0.0123: parts down to 10⁻⁴; what is smaller still is told from the rounding of the computation."""
    parts = [0.0123, 0.001234, 4e-6, 3.3e-20, 0.0]
    lines = [
        line("currents", 1.0) | {"standard_uncertainties": dict.fromkeys(PARAMETERS, part)} for part in parts
    ]
    told = Budget({"budget": lines, "parameters": parameters()}).lines
    assert [cells[0] for _, cells in told] == ["0.0123", "0.0012", "< 0.0001", "0", "0"]


def test_without_a_budget_there_is_nothing_to_show():
    assert not Budget({})
    assert Model.of({}) is None
    assert MonteCarlo.of({}) is None
    assert (findings({}, []), not_excluded({})) == ([], [])


def test_intervals_are_rounded_to_three_digits_of_the_expanded_uncertainty():
    entry = {"expanded_uncertainty": 0.53112, "first_order": [2062.16578, 2063.228],
             "symmetric": [2062.14425, 2063.2489],
             "shortest": [2062.1417, 2063.2461], "difference": 0.0215, "tolerance": 0.05, "agrees": True}  # fmt: skip
    found = MonteCarlo.of({"monte_carlo": {"trials": 20000, "seed": 3, "conclusion": {"code": "x", "message": "Yes."},
                                           "parameters": dict.fromkeys(PARAMETERS, entry)}})  # fmt: skip
    assert (found.trials, found.seed, found.sentence) == ("20000", 3, "Yes.")
    assert found.rows[0].gum == ("2062.166", "2063.228")
    assert found.rows[0].agrees


def test_where_no_draws_could_be_made_the_reason_stands_alone():
    found = MonteCarlo.of(
        {
            "monte_carlo": {
                "trials": 20000,
                "seed": 0,
                "parameters": {},
                "conclusion": {"code": "x", "message": "No."},
            }
        }
    )
    assert (found.sentence, found.rows) == ("No.", [])


def test_a_term_shows_its_value_or_why_it_cannot_be_tested():
    value = {"term": "wg_split", "value": 0.0123, "expanded_uncertainty": 0.0041, "unit": "deg/h/g", "f": 35.2,
             "p_holm": 1.2e-5, "reason": None}  # fmt: skip
    blank = {"term": "wn", "value": None, "expanded_uncertainty": None, "unit": "deg/h/g2", "f": None, "p_holm": None,
             "reason": {"code": "x", "message": "Not shown."}}  # fmt: skip
    model = Model.of({"model": {"conclusion": {"code": "y", "message": "One."}, "supported": ["wg_split"],
                                "terms": [value, blank]}})  # fmt: skip
    assert [row.supported for row in model.rows] == [True, False]
    assert (str(model.rows[0].shown.value), model.rows[0].f) == ("0.0123", "35.2")
    assert model.rows[1].reason == "Not shown."


def test_a_finding_leads_to_the_samples_of_its_positions():
    inputs = [SimpleNamespace(theta_deg=90.0, psi_deg=180.0, repeat=0, id=7)]
    told = {"code": "positions-swapped", "message": "Exchanged.", "positions": [[90.0, 180.0], [90.0, 270.0]],
            "advice": {"code": "a", "message": "Again."}}  # fmt: skip
    (row,) = findings({"diagnosis": [told]}, inputs)
    assert (row.title, row.text, row.advice) == ("positions exchanged", "Exchanged.", "Again.")
    assert [place.href for place in row.places] == ["/measurements/7", ""]


def test_kinds_that_cannot_be_excluded_are_named_in_words():
    item = {"code": "not-excluded", "message": "Not: latitude-sign.", "template": "Not: %(kinds)s.",
            "values": {"kinds": "latitude-sign, psi-reversed"}}  # fmt: skip
    assert not_excluded({"not_excluded": [item]}) == ["Not: sign of the latitude, ψ counted the other way."]


def test_a_moderated_uncertainty_of_the_currents_is_said():
    conclusion = {
        "code": "moderated-uncertainty",
        "message": "stated 1…3 mA",
        "template": "stated %(stated_x)s mA",
        "values": {"stated_x": "1…3"},
    }
    assert Budget({"current_noise": {"conclusion": conclusion}}).moderation == "stated 1…3 mA"
    assert Budget({}).moderation == ""
