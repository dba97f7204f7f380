"""How much a quantity scatters, and by what: unbalanced nested components of variance."""
