"""The automated stand's program: it drives stand and ammeter, keeps what they measured, and sends it on.

It runs on the stand's own computer, with no database and nothing that only POSIX has. `cycle` is what is
done in which order, `plan` what comes next; `instruments` speak, `judgement` says what a record is worth,
`keeping` puts everything on disk before it is used, `sending` brings it to the service when that can be
reached. `contracts` is what the cycle needs of a stand and an ammeter, whichever they are.
"""
