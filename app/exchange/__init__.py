"""Files and wire formats to rows in laboratory units, and those to the solver's SI records.

Canonical form: the float64 nearest to the value in the laboratory's unit (mA, arcsec, degrees).
Whatever unit a file or a form uses, its decimal text is shifted exactly and rounded once to that
float, so the same decimal means give the same bits by whatever way they came.
"""
