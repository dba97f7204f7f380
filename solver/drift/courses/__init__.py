"""What a quantity did, does and will do: steps and bends dated, a trend chosen by test, a forecast."""
