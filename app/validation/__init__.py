"""The validation pack: published problems and our own, solved by the installed build.

It shows on the machine at hand that the numbers come out right: every case names its source, the
function of the product that computes it, what is expected and what was obtained. `pack.run` gives a
`report.Report`; a suite is a module with ``group(report) -> Group``. Data stand in ``data/`` as
numbers with their source; that they belong together was proved in exact arithmetic, and
``tests/app/validation`` proves it again.

It uses `solver` and `simdevice` alone and stands beside ``exchange``: services, pages and the
command show what it found.
"""
