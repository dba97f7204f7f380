"""Propagation of uncertainty: the GUM to first order, Monte Carlo by JCGM 101, the budget of a result."""
