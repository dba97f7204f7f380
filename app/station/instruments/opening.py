"""The instruments of a station's file, ready to be used; each connects when it is first used."""

from app.station.instruments.ammeter import DescribedAmmeter
from app.station.instruments.description import AmmeterDescription, StandDescription
from app.station.instruments.stand import DescribedStand


def open_stand(description: StandDescription) -> DescribedStand:
    """The stand of a description, not connected yet."""
    return DescribedStand(description)


def open_ammeter(description: AmmeterDescription) -> DescribedAmmeter:
    """The ammeter of a description, not connected yet."""
    return DescribedAmmeter(description)
