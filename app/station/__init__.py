"""The automated stand's program: it drives stand and ammeter, keeps what they measured, and sends it on.

It runs on the stand's own computer, with no database and nothing that only POSIX has. `description`
says which instruments there are, `visa` alone speaks to them, `cycle` is what is done in which order,
`checks` judge a record on the spot, `spool` keeps everything on disk before it is used, and `forwarding`
brings it to the service whenever that can be reached.
"""
