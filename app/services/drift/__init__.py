"""Drift history: a gyro's and a stand's life, studied by jobs and read from the studies.

`following.changed` is told of everything that changes a study and enqueues the job that makes it anew;
`study` computes it from columns (`series`) in a child process; `alarms` keeps what it found; `reading` answers
pages and the interface from the stored study alone.
"""
