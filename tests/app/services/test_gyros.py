"""A type's nominal values."""

import pytest

from app.errors import Invalid
from app.services import gyros
from app.services.access import SYSTEM
from app.services.lab import Lab
from app.services.views import Nominal

KX = Nominal(2063.0, 21.0, -0.4)


def test_nominal_values_replace_those_before_and_leave_the_limits(lab: Lab) -> None:
    with lab.write(SYSTEM) as work:
        gyros.set_limits(work, "GVK-6", {"wg": (-3.0, 3.0)})
        gyros.set_nominals(work, "GVK-6", {"kx": KX, "wg": Nominal(6.0, 3.0)})
        gyros.set_nominals(work, "GVK-6", {"kx": KX, "wk": Nominal(2.0, 1.0)})
    with lab.read(SYSTEM) as work:
        (kind,) = gyros.types(work)
    assert dict(kind.nominals) == {"kx": KX, "wk": Nominal(2.0, 1.0, None)}
    assert kind.limits == {"wg": (-3.0, 3.0)}


@pytest.mark.parametrize(
    ("nominals", "column"),
    [({"kz": KX}, "kz"), ({"kx": Nominal(1.0, 0.0)}, "kx"), ({"kx": Nominal(1.0, float("nan"))}, "kx")],
)
def test_nominal_values_that_cannot_be(lab: Lab, nominals: dict[str, Nominal], column: str) -> None:
    with lab.write(SYSTEM) as work:
        with pytest.raises(Invalid) as error:
            gyros.set_nominals(work, "GVK-6", nominals)
        assert [item.column for item in error.value.problems] == [column]
        assert gyros.types(work)[0].nominals == {}
